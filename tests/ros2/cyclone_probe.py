#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A participant of Cyclone DDS (its Python binding) with the types of ROS 2, made from the definitions that rosbags has.

    cyclone_probe.py listen DOMAIN OUT TOPIC TYPE QUALITY [TOPIC TYPE QUALITY ...]
        until its standard input ends; OUT: pickled (arrival on the monotonic clock in ns, topic, message as dict)
    cyclone_probe.py send DOMAIN TOPIC TYPE RATE_HZ < pickled messages as dicts
        prints "matched" once a reader is there
    cyclone_probe.py endpoints DOMAIN
        {topic: [type in DDS, user data]} of the writers and readers that are there after 2 s, as JSON"""

import json
import pickle
import select
import sys
import time

from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsPublication, BuiltinTopicDcpsSubscription
from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import make_idl_struct, types
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration
from rosbags.typesys import Stores, get_typestore

STORE = get_typestore(Stores.ROS2_HUMBLE)
_BASE = {"string": str, "bool": bool, "octet": types.uint8, "byte": types.uint8,
         **{f"{sign}int{bits}": getattr(types, f"{sign}int{bits}") for sign in ("", "u") for bits in (8, 16, 32, 64)},
         "float32": types.float32, "float64": types.float64}
_made = {}


def _field(description):
    node, what = description
    if node.name == "BASE":
        return _BASE[what[0]]
    if node.name == "NAME":
        return struct(what)
    inner, length = what
    return types.array[_field(inner), length] if node.name == "ARRAY" else types.sequence[_field(inner)]


def struct(name):
    """Cyclone's class of a ROS type, with the name that ROS 2 gives it in DDS."""
    if name not in _made:
        package, _, short = name.split("/")
        fields = {field: _field(description) for field, description in STORE.get_msgdef(name).fields}
        _made[name] = make_idl_struct(short + "_", f"{package}.msg.dds_.{short}_", fields)
    return _made[name]


def plain(value):
    """A message as dicts, lists and numbers, of either library."""
    if hasattr(value, "__dict__"):
        return {name: plain(inner) for name, inner in vars(value).items() if name != "sample_info"}
    if isinstance(value, (list, tuple)) or type(value).__module__ == "numpy" and value.ndim:
        return [plain(item) for item in value]
    return value.item() if type(value).__module__ == "numpy" else value


def zeros(name):
    """A message of zeros as dicts."""
    def of(description):
        node, what = description
        if node.name == "BASE":
            return "" if what[0] == "string" else 0
        if node.name == "NAME":
            return zeros(what)
        return [of(what[0]) for _ in range(what[1] if node.name == "ARRAY" else 0)]
    return {field: of(description) for field, description in STORE.get_msgdef(name).fields}


def filled(name, values):
    """A message of Cyclone's class from dicts."""
    def of(description, value):
        node, what = description
        if node.name == "NAME":
            return filled(what, value)
        return [of(what[0], item) for item in value] if node.name in ("ARRAY", "SEQUENCE") else value
    fields = dict(STORE.get_msgdef(name).fields)
    return struct(name)(**{field: of(fields[field], value) for field, value in values.items()})


def quality_of(text):
    """The same as an RViz display (reliable), nav2's reader of a localizer's pose (latched), a sensor's reader. The history is
    the reader's own matter, and long: Python may stand still for seconds on a loaded computer."""
    return Qos(Policy.Reliability.BestEffort if text == "sensor" else Policy.Reliability.Reliable(duration(milliseconds=100)),
               Policy.Durability.TransientLocal if text == "latched" else Policy.Durability.Volatile,
               Policy.History.KeepLast(5000))


def listen(participant, out, names):
    readers = [(topic, DataReader(participant, Topic(participant, "rt" + topic, struct(kind)), quality_of(quality)))
               for topic, kind, quality in zip(*[iter(names)] * 3)]
    print("ready", flush=True)
    with open(out, "wb") as file:
        while not select.select([sys.stdin], [], [], 0.002)[0]:
            for topic, reader in readers:
                for message in reader.take(100):
                    if not message.sample_info.valid_data:  # its writer ended
                        continue
                    pickle.dump((time.clock_gettime_ns(time.CLOCK_MONOTONIC), topic, plain(message)), file)


def send(participant, topic, kind, rate_hz):
    writer = DataWriter(participant, Topic(participant, "rt" + topic, struct(kind)), quality_of("stream"))
    until = time.monotonic() + 30
    while not writer.get_matched_subscriptions():
        if time.monotonic() > until:
            sys.exit("no reader came")
        time.sleep(0.02)
    print("matched", flush=True)
    while True:
        try:
            writer.write(filled(kind, pickle.load(sys.stdin.buffer)))
        except EOFError:
            break
        time.sleep(1 / rate_hz)
    time.sleep(0.3)


def endpoints(participant):
    readers = [BuiltinDataReader(participant, kind) for kind in (BuiltinTopicDcpsPublication, BuiltinTopicDcpsSubscription)]
    time.sleep(2)
    found = [endpoint for reader in readers for endpoint in reader.take(1000) if endpoint.sample_info.valid_data]
    print(json.dumps({endpoint.topic_name: [endpoint.type_name, bytes(endpoint.qos[Policy.Userdata].data or b"").decode()]
                      for endpoint in found if Policy.Userdata in endpoint.qos}))


if __name__ == "__main__":
    how, domain, *rest = sys.argv[1:]
    if how == "listen":
        listen(DomainParticipant(int(domain)), rest[0], rest[1:])
    elif how == "endpoints":
        endpoints(DomainParticipant(int(domain)))
    else:
        send(DomainParticipant(int(domain)), rest[0], rest[1], float(rest[2]))
