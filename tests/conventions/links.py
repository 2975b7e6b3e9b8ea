# SPDX-License-Identifier: Apache-2.0
"""What connects programs: LCM on UDP, DDS, MAVLink."""

import json
import math
import os
import re
import socket
import struct
import subprocess
import sys
import time
from dataclasses import dataclass

from experiment import said

LCM, DDS, MAVLINK = "lcm 1.5.3", "cyclonedds 11.0.1", "pymavlink 2.4.50"
ORDER = "stamps order events, not their arrival"
BRIDGE = "the qualities of service are stated ([stack.md](stack.md))"
UNREAD = "MAVLink is not read; its streams come by a program of the robot's"


def rows():
    """LCM and DDS have a network of their own, so that nothing leaves it."""
    done = subprocess.run(["unshare", "--user", "--map-root-user", "--net", sys.executable, __file__], capture_output=True, text=True, check=False)
    if done.returncode:
        raise SystemExit(f"links.py: no network of its own:\n{done.stderr[-2000:]}")
    yield from (tuple(row) for row in json.loads(done.stdout.splitlines()[-1]))
    yield from _mavlink()


# ── LCM: packets as its definition has them ─────────────────────────────────────────────────────────────────────────

GROUP = ("239.255.76.67", 7667)


def _short(channel, data, number):
    return struct.pack("!II", 0x4C433032, number) + channel.encode() + b"\0" + data


def _fragments(channel, data, number, size=1000):
    first = size - len(channel) - 1
    parts = [data[:first]] + [data[at:at + size] for at in range(first, len(data), size)]
    packets, at = [], 0
    for k, part in enumerate(parts):
        name = b"" if k else channel.encode() + b"\0"
        packets.append(struct.pack("!IIIIHH", 0x4C433033, number, len(data), at, k, len(parts)) + name + part)
        at += len(part)
    return packets


def _sender():
    sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
    return lambda packet: sender.sendto(packet, GROUP)


def _lcm():
    import lcm

    def heard(channel, send):
        """What a subscriber gets of what is sent before it looks."""
        link, got = lcm.LCM("udpm://239.255.76.67:7667?ttl=0"), []
        link.subscribe(channel, lambda _, data: got.append(bytes(data)))
        time.sleep(0.05)
        send()
        time.sleep(1)  # all of it waits in the subscriber's queue
        while link.handle_timeout(200):
            pass
        return got

    publish, one, two = lcm.LCM("udpm://239.255.76.67:7667?ttl=0").publish, _sender(), _sender()
    burst = heard("BURST", lambda: [publish("BURST", bytes([k])) for k in range(100)])
    yield "LCM: 100 messages before a subscriber looks", f"{len(burst)} arrive: {burst[0][0]} to {burst[-1][0]}", LCM, "queues that are long enough for a second, emptied by a thread of their own"
    whole = bytes(range(256)) * 20
    fragments = _fragments("PARTS", whole, 1)
    yield "LCM: a message that lacks one of its six fragments", f"{len(heard('PARTS', lambda: [one(packet) for k, packet in enumerate(fragments) if k != 2]))} arrive", LCM, "-"
    yield "LCM: fragments in reverse order", f"{heard('PARTS', lambda: [one(packet) for packet in reversed(fragments)]).count(whole)} arrives", LCM, "-"
    first, second = _fragments("PARTS", b"1" * 5000, 2), _fragments("PARTS", b"2" * 5000, 3)
    mixed = heard("PARTS", lambda: [one(packet) for packet in first[:2] + second + first[2:]])
    yield "LCM: fragments of two messages of one sender, one inside the other", ", ".join(data[:1].decode() for data in mixed) + ": both, the second first", LCM, ORDER
    both = heard("PARTS", lambda: [(one(a), two(b), time.sleep(0.0005)) for a, b in zip(first, second)])
    yield "LCM: fragments of two senders in turn", f"{len(both)} arrive", LCM, "-"
    yield "LCM: a message that arrives twice, by two routes", f"is handed out {len(heard('TWICE', lambda: [one(_short('TWICE', b'x', 7)) for _ in (0, 1)]))} times", LCM, "-"
    order = heard("ORDER", lambda: [one(_short("ORDER", str(k).encode(), k)) for k in (2, 1)])
    yield "LCM: messages 2 and 1 of one sender in this order", ", ".join(data.decode() for data in order), LCM, ORDER
    yield "LCM: a channel's name of 63 letters, of 64", f"{len(heard('c' * 63, lambda: publish('c' * 63, b'x')))} arrives, {said(lambda: publish('c' * 64, b'x'))}", LCM, "-"
    listener = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    listener.bind(("", 7668))
    listener.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, socket.inet_aton("239.255.76.68") + socket.inet_aton("127.0.0.1"))
    listener.setsockopt(socket.IPPROTO_IP, 12, 1)  # IP_RECVTTL
    listener.settimeout(2)
    lcm.LCM("udpm://239.255.76.68:7668").publish("TTL", b"x")
    yield "LCM: time to live without ttl in the URL", f"{struct.unpack('i', listener.recvmsg(100, 100)[1][0][2])[0]}: packets stay on the computer", LCM, "the same; `waymark doctor` names a ttl above 0"


# ── DDS ─────────────────────────────────────────────────────────────────────────────────────────────────────────────

def _dds():
    os.environ["CYCLONEDDS_URI"] = "<CycloneDDS><Domain><General><Interfaces><NetworkInterface name='lo' multicast='true'/></Interfaces></General></Domain></CycloneDDS>"
    from cyclonedds.core import Policy, Qos
    from cyclonedds.domain import DomainParticipant
    from cyclonedds.idl import IdlStruct
    from cyclonedds.idl.annotations import key
    from cyclonedds.idl.types import float64, int32, sequence
    from cyclonedds.pub import DataWriter
    from cyclonedds.sub import DataReader
    from cyclonedds.topic import Topic
    from cyclonedds.util import duration

    @dataclass
    class Count(IdlStruct, typename="Count"):
        n: int32

    @dataclass
    class Few(IdlStruct, typename="Few"):
        n: sequence[int32, 3]

    @dataclass
    class Keyed(IdlStruct, typename="Keyed"):
        k: float64
        key("k")
        n: int32

    participant, reliable = DomainParticipant(7), Policy.Reliability.Reliable(duration(seconds=1))

    def pair(kind, name, qos=None):
        topic = Topic(participant, name, kind)
        return topic, DataWriter(participant, topic, qos=qos), DataReader(participant, topic, qos=qos)

    def taken(reader):
        time.sleep(0.2)
        return reader.take(20)
    _, writer, reader = pair(Count, "default")
    for k in (1, 2, 3):
        writer.write(Count(k))
    yield "Cyclone DDS by default: of three writes a reader that looks then gets", ", ".join(str(sample.n) for sample in taken(reader)), DDS, BRIDGE
    names = [type(side.get_qos()[Policy.Reliability]).__name__ for side in (writer, reader)]
    yield "Cyclone DDS by default: reliability of writer and reader", ", ".join(names), DDS, BRIDGE
    yield "Cyclone DDS: an int32 of 2147483648, a sequence of four in a bound of three", f"{said(lambda: writer.write(Count(2**31)))}, {said(lambda: pair(Few, 'few')[1].write(Few([1, 2, 3, 4])))}", DDS, "-"
    _, writer, reader = pair(Count, "times", Qos(reliable, Policy.History.KeepAll))
    now = time.time_ns()
    writer.write(Count(2), now)
    writer.write(Count(1), now - 10**9)
    yield "Cyclone DDS: a sample whose stamp is before the last one's", "is read " + ("last" if taken(reader)[-1].n == 1 else "first"), DDS, ORDER
    late = Qos(reliable, Policy.Durability.TransientLocal)
    for name, qos in (("volatile", Qos(reliable)), ("transient local", late)):
        topic = Topic(participant, name.replace(" ", "_"), Count)
        writer = DataWriter(participant, topic, qos=qos)
        writer.write(Count(1))
        writer.write(Count(2))
        got = [str(sample.n) for sample in taken(DataReader(participant, topic, qos=qos))]
        yield f"Cyclone DDS, {name}: a reader that comes late gets", ", ".join(got) or "nothing", DDS, BRIDGE
    _, writer, reader = pair(Keyed, "keyed", Qos(reliable))
    for k in (1.0, 2.0, 1.0, 2.0, math.nan, math.nan):
        writer.write(Keyed(k, 5))
    yield "Cyclone DDS: samples left of keys 1, 2, 1, 2, NaN, NaN at a depth of 1", str(len(taken(reader))), DDS, BRIDGE
    _, writer, reader = pair(Keyed, "gone", Qos(reliable))
    writer.write(Keyed(1.0, 5))
    writer.dispose(Keyed(1.0, 5))
    time.sleep(0.2)
    sample = reader.read(1)[0]
    yield "Cyclone DDS: what is read after an instance was disposed", f"its last value {sample.n}, valid_data {sample.sample_info.valid_data}", DDS, "the bridge disposes nothing"


# ── MAVLink ─────────────────────────────────────────────────────────────────────────────────────────────────────────

def _mavlink():
    from pymavlink.dialects.v20 import ardupilotmega, common

    def link(dialect=common):
        one = dialect.MAVLink(None, srcSystem=1, srcComponent=1)
        one.robust_parsing = True
        return one

    def there(message):
        return link().parse_buffer(message.pack(link()))[0]
    position = there(common.MAVLink_global_position_int_message(0, 0, 0, 0, 0, 0, 0, 0, 65535))
    yield "MAVLink GLOBAL_POSITION_INT: a heading that is not known", str(position.hdg), MAVLINK, UNREAD
    sizes = [len(message.pack(link())) for message in (common.MAVLink_global_position_int_message(*[0] * 9), common.MAVLink_global_position_int_message(*[1] * 9))]
    yield "MAVLink 2: bytes of a message of zeros, and of ones", f"{sizes[0]} and {sizes[1]}: zeros at the end are not sent", MAVLINK, UNREAD
    arguments = (1, 1, 8, 1, 2, 3, [1, 0, 0, 0], 0, 0, 0, 0, 0, 0, [math.nan] * 21, [math.nan] * 21)
    odometry = there(common.MAVLink_odometry_message(*arguments))
    yield "MAVLink ODOMETRY without its extensions: quality", f"{odometry.quality}: unknown; -1 is failed", MAVLINK, UNREAD
    same = common.MAVLink_odometry_message(*arguments).pack(link()) == ardupilotmega.MAVLink_odometry_message(*arguments).pack(link(ardupilotmega))
    yield "MAVLink ODOMETRY of `common` and of `ardupilotmega`", "equal bytes" if same else "other bytes", MAVLINK, UNREAD
    for message, field in (("raw_imu", "xacc"), ("scaled_imu", "xacc"), ("raw_imu", "zgyro"), ("optical_flow", "flow_x"), ("distance_sensor", "current_distance"), ("attitude", "yawspeed")):
        units = getattr(common, f"MAVLink_{message}_message").fieldunits_by_name
        yield f"pymavlink: unit of {message.upper()}.{field}", units.get(field, "none"), MAVLINK, UNREAD
    yield "pymavlink: an int16 of 40000", said(lambda: common.MAVLink_raw_imu_message(0, 40000, *[0] * 8).pack(link())), MAVLINK, UNREAD
    wheels = there(common.MAVLink_wheel_distance_message(1, 2, [1.5, 2.5] + [0] * 14))
    yield "MAVLink WHEEL_DISTANCE of two wheels", f"{len(wheels.distance)} places, count {wheels.count}; the others {wheels.distance[2]}", MAVLINK, UNREAD
    text = there(common.MAVLink_vision_position_estimate_message(1, 1, 2, 3, 0, 0, 0, [math.nan] * 21)).to_json()
    yield "pymavlink to_json: a covariance that is not known", re.search(r'"covariance": \[(\w+)', text)[1] + ", which is no JSON", MAVLINK, "no value is an empty field, null in JSON"


def _set_up_network():
    for words in (["link", "set", "lo", "up"], ["link", "set", "lo", "multicast", "on"], ["route", "add", "224.0.0.0/4", "dev", "lo"]):
        subprocess.run(["ip", *words], check=True)


if __name__ == "__main__":
    _set_up_network()
    measured = [*_lcm(), *_dds()]
    print(json.dumps(measured))
    sys.stdout.flush()
    os._exit(0)  # threads of DDS
