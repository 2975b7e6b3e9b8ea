#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# can-j1939 names groups of messages that are for one receiver by another number for each receiver.
# can-j1939 2.0.12. Expected: 18EF1234 is of the group EF00 and for the address 12, as SAE J1939-21 has it. Seen: the group EF12. A table of
# groups finds a drive's answers as long as the computer has the address that it had when the table was written, and none of them after that.
. "$(dirname "$0")/common.sh"
pip_packages can-j1939==2.0.12
seen='18EF1234: EF12
18EF5634: EF56
18FEF134: FEF1'
"$python" - <<'EOT' | as_seen
import j1939
from j1939.message_id import MessageId
for identifier in (0x18EF1234, 0x18EF5634, 0x18FEF134):
    group = j1939.ParameterGroupNumber()
    group.from_message_id(MessageId(can_id=identifier))
    print(f"{identifier:X}: {group.value:X}")
EOT
