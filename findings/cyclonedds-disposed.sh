#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# What a writer of Cyclone DDS has disposed of is still read, as valid data.
# cyclonedds 11.0.1 (PyPI). Expected: after dispose() a reader gets a sample without data, or valid_data False. Seen: the last value, valid_data
# True; the instance state alone says that it is gone. A robot that reads obstacles keeps those that its sensor has withdrawn.
. "$(dirname "$0")/common.sh"
pip_packages cyclonedds==11.0.1
seen='Obstacle, x 5, valid_data True, disposed True'
cat >"$work/gone.py" <<'EOT'
import os, sys, time
os.environ["CYCLONEDDS_URI"] = "<CycloneDDS><Domain><General><Interfaces><NetworkInterface name='lo' multicast='true'/></Interfaces></General></Domain></CycloneDDS>"
from dataclasses import dataclass
from cyclonedds.core import InstanceState, Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.annotations import key
from cyclonedds.idl.types import int32
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

@dataclass
class Obstacle(IdlStruct, typename="Obstacle"):
    id: int32
    key("id")
    x: int32

participant, qos = DomainParticipant(7), Qos(Policy.Reliability.Reliable(duration(seconds=1)))
topic = Topic(participant, "obstacles", Obstacle)
reader, writer = DataReader(participant, topic, qos=qos), DataWriter(participant, topic, qos=qos)
writer.write(Obstacle(1, 5))
writer.dispose(Obstacle(1, 5))
time.sleep(1)
for sample in reader.read(10):
    info = sample.sample_info
    print(f"{type(sample).__name__}, x {sample.x}, valid_data {info.valid_data}, disposed {bool(info.instance_state & InstanceState.NotAliveDisposed)}")
sys.stdout.flush()
os._exit(0)
EOT
alone "$python" "$work/gone.py" | as_seen
