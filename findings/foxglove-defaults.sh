#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The Foxglove SDK's quaternion without arguments is no rotation, and its times without a zone are local where protobuf's are UTC.
# foxglove-sdk 0.30.3, protobuf 7.36.2, TZ=America/New_York. Expected: Quaternion() is the identity, and a naive datetime means the same to both. Seen:
# all four are 0; from_datetime is 5 h later than FromDatetime. Messages of one program lie hours apart, and their arrows have no direction.
. "$(dirname "$0")/common.sh"
pip_packages foxglove-sdk==0.30.3 protobuf==7.36.2
export TZ=America/New_York
seen='Quaternion(x=0.0, y=0.0, z=0.0, w=0.0)
foxglove 1767243600
protobuf 1767225600'
"$python" - 2>/dev/null <<'EOF' | as_seen
import datetime
from foxglove.messages import Quaternion, Timestamp
from google.protobuf import timestamp_pb2
naive, there = datetime.datetime(2026, 1, 1), timestamp_pb2.Timestamp()
there.FromDatetime(naive)
print(Quaternion())
print("foxglove", Timestamp.from_datetime(naive).sec)
print("protobuf", there.seconds)
EOF
