# SPDX-License-Identifier: Apache-2.0
"""Drives and buses with a protocol of their own: CANopen's CiA 402, moteus, VESC, ODrive, J1939, NMEA 2000, OBD-II."""

import contextlib
import importlib.util
import io
import logging
import math
import struct
import sys
import time
import types
from pathlib import Path

import can
import canopen
import j1939
import moteus.moteus
import moteus.multiplex
import numpy as np
import obd.commands
from canopen.objectdictionary import ObjectDictionary, ODVariable, datatypes
from canopen.profiles.p402 import State402
from nmea2000.decoder import NMEA2000Decoder
from odrive_can.utils import get_dbc
from PyRoboteq import RoboteqHandler

from experiment import said

CANOPEN, MOTEUS, VESC, ODRIVE, ROBOTEQ = "canopen 2.4.1", "moteus 1.1.1", "pyvesc-fix 1.0.3", "odrive-can 2.1.0", "PyRoboteq 0.1.2"
J1939, NMEA, OBD = "can-j1939 2.0.12", "nmea2000 2026.10.3", "obd 0.7.3"
BY_DBC = "a DBC states factor, unit and sign ([can.md](can.md))"
COUNTED = "lost frames are counted, and a silent bus is a finding"


def rows():
    logging.disable(logging.CRITICAL)
    yield from _canopen()
    yield from _moteus()
    yield from _vesc()
    yield from _odrive()
    yield from _roboteq()
    yield from _j1939()
    yield from _nmea2000()
    yield from _obd()


def _variable(index, kind, factor=1):
    variable = ODVariable(f"object {index:x}", index)
    variable.data_type, variable.factor, variable.access_type = kind, factor, "rw"
    return variable


def _canopen():
    objects = ObjectDictionary()
    for index, kind, factor in ((0x2000, datatypes.UNSIGNED16, 1), (0x606C, datatypes.INTEGER32, 0.1)):
        objects.add_object(_variable(index, kind, factor))
    network, sent = canopen.Network(), []
    network.send_message = lambda identifier, data, remote=False: sent.append(bytes(data))
    node = canopen.LocalNode(5, objects)
    network.add_node(node)

    def negative():
        node.sdo[0x2000].raw = -1
        return node.sdo[0x2000].raw
    yield "canopen: -1 in an unsigned object", said(negative), CANOPEN, "sends nothing on CAN"
    speed, written = node.sdo[0x606C], []
    for value in (0.26, 0.25, 0.35):
        speed.phys = value
        written.append(str(speed.raw))
    yield "canopen: 0.26, 0.25, 0.35 at a factor of 0.1", ", ".join(written), CANOPEN, "sends nothing on CAN"

    def state(word):
        return next((name for name, (mask, value) in State402.SW_MASK.items() if word & mask == value), "none")
    yield "canopen: CiA 402 states of the status words 0637, 0250, 001F", ", ".join(state(word) for word in (0x0637, 0x0250, 0x001F)), CANOPEN, "reads speeds and counts, no drive's states"
    remote = canopen.RemoteNode(6, objects)
    network.add_node(remote)
    network.notify(0x706, bytearray([5]), time.time())
    time.sleep(1.2)
    yield "canopen: a node's state 1.2 s after its last heartbeat", remote.nmt.state, CANOPEN, COUNTED
    pdo = canopen.pdo.base.PdoMap(remote.tpdo, None, None)
    pdo.add_variable(0x606C)
    yield "canopen: a speed of a PDO before the first one came", f"{pdo[0].raw}; is_received {pdo.is_received}", CANOPEN, "no value without a frame"
    sent.clear()
    canopen.timestamp.TimeProducer(network).transmit(1700000000.25)
    milliseconds, days = struct.unpack("<LH", sent[0])
    yield "canopen TIME: 1700000000.25 s since 1970", f"day {days} since 1984, {milliseconds} ms, in UTC", CANOPEN, "not read"


def _moteus():
    def read(data):
        return moteus.moteus.parse_registers(bytes(data))[1]
    def written(value, resolution=moteus.multiplex.INT16, form="<h"):
        out = io.BytesIO()
        moteus.moteus.Writer(out).write_position(value, resolution)
        return struct.unpack(form, out.getvalue())[0]
    yield "moteus: positions of 80 as int8 and 8000 as int16", f"{read([0x21, 1, 0x80])[1]}, {read([0x25, 1, 0, 0x80])[1]}", MOTEUS, "a NaN is refused, and counted"
    yield "moteus: int8 positions of 1 and 127", f"{read([0x21, 1, 1])[1]}, {read([0x21, 1, 127])[1]} turns", MOTEUS, BY_DBC
    yield "moteus: an int16 velocity of -400", f"{read([0x25, 2] + list(struct.pack('<h', -400)))[2]} turns/s", MOTEUS, BY_DBC

    answer = moteus.moteus.parse_registers(bytes([0x29, 1]) + struct.pack("<i", 12345) + bytes([0x30, 2, 7]))
    yield "moteus: an int32 position of 12345 beside a velocity that is refused", f"{answer.response[1]:.5f} turns; {answer.errors[0]} among the errors", MOTEUS, "no value without a frame"
    yield "moteus: the largest int32 position, and 1000000 turns", f"{read([0x29, 1, *struct.pack('<i', 2**31 - 1)])[1]:.2f} turns, written as {written(1e6, moteus.multiplex.INT32, '<i')}: its end", MOTEUS, BY_DBC
    yield "moteus: 5 and -5 turns, and no number, as int16", f"{written(5)}, {written(-5)}, {written(math.nan)}: the ends of its range", MOTEUS, "sends nothing on CAN"


def _vesc():
    # The package's modules name themselves by the name that it was forked from.
    package = types.ModuleType("pyvesc")
    package.__path__ = [str(Path(importlib.util.find_spec("can").origin).parents[1] / "pyvesc_fix")]
    sys.modules["pyvesc"] = package
    from pyvesc.protocol.base import VESCMessage
    from pyvesc.protocol.interface import decode, encode
    from pyvesc.VESC.messages import GetValues, SetDutyCycle, SetRPM

    yield "pyvesc: a duty cycle of 0.5", str(struct.unpack(">i", VESCMessage.pack(SetDutyCycle(0.5))[1:])[0]), VESC, "sends nothing on CAN"
    yield "pyvesc: 1000.7 turns a minute", said(lambda: VESCMessage.pack(SetRPM(1000.7))), VESC, "sends nothing on CAN"
    factors = {name: factor for name, _, factor in GetValues.fields}
    yield "pyvesc: factors of rpm and tachometer", f"{factors['rpm']} and {factors['tachometer']}: electrical, of the motor's pole pairs", VESC, BY_DBC
    kinds = {name: kind for name, kind, _ in GetValues.fields}
    yield "pyvesc: kinds of rpm and tachometer", f"{kinds['rpm']} and {kinds['tachometer']}: signed, 32 bits", VESC, BY_DBC
    broken = bytearray(encode(SetRPM(1000)))
    broken[4] ^= 1
    with contextlib.redirect_stdout(io.StringIO()):
        got = decode(bytes(broken) + encode(SetRPM(2000)))[0]
    yield "pyvesc: a packet with a wrong sum, then one of 2000", f"{got.rpm}: the broken one is skipped", VESC, COUNTED


def _odrive():
    message = get_dbc().get_message_by_name("Axis0_Get_Encoder_Estimates")
    signals = [f"{signal.name} {signal.unit}" for signal in message.signals]
    yield "ODrive's DBC: units of the encoder's estimates", ", ".join(signals), ODRIVE, BY_DBC

    def counts(name):
        found = [signal for each in get_dbc(name).messages for signal in each.signals if signal.name == "Shadow_Count"][:1]
        return "".join(f"{signal.length} bits, {'signed' if signal.is_signed else 'unsigned'}" for signal in found) or "none"
    step = np.spacing(np.float32(1e5))
    yield ("ODrive's DBC: counts of the encoder, 0.5.6 and 0.6.10", f"{counts('odrive-cansimple-0.5.6')}; {counts('odrive-cansimple-0.6.10')}: "
           f"turns as 32-bit floating point, {step:.4f} apart at 100000 turns", ODRIVE, BY_DBC)
    heartbeat = get_dbc().get_message_by_name("Axis0_Heartbeat")
    yield "ODrive's DBC: periods of the encoder's estimates and of the heartbeat", f"{message.cycle_time} ms, {heartbeat.cycle_time} ms", ODRIVE, "rates are measured; a silent bus is a finding"
    decoded = message.decode(struct.pack("<ff", math.nan, 1.5))
    yield "ODrive's DBC by cantools: an estimate of NaN", str(decoded["Pos_Estimate"]), ODRIVE, "a NaN is refused, and counted"


def _roboteq():
    class Port:
        def __init__(self, answer):
            self.write, self.read_all = lambda data: None, lambda: answer

    def read(answer):
        drive = RoboteqHandler()
        drive.ser = Port(answer)
        return repr(drive.read_value("?CB", 1))
    yield "PyRoboteq: a counter of 12345", f"{read(b'?CB 1' + bytes([13]) + b'CB=12345' + bytes([13]))}: text", ROBOTEQ, "counts of CAN signals"
    yield "PyRoboteq: of that answer the first half", f"{read(b'?CB 1' + bytes([13]) + b'CB=12')}: as if it were whole", ROBOTEQ, "short frames are malformed, and counted"


def _j1939():
    identifier = j1939.message_id.MessageId(can_id=0x18EF1234)
    group = j1939.ParameterGroupNumber()
    group.from_message_id(identifier)
    yield "j1939: group of 18EF1234, which is for the address 12", f"{group.value:X}: with the address", J1939, "identifiers as the DBC has them"


def _fast(payload, sequence):
    """Frames of a fast packet."""
    frames, rest = [bytes([sequence << 5, len(payload)]) + payload[:6]], payload[6:]
    while rest:
        frames.append((bytes([sequence << 5 | len(frames)]) + rest[:7]).ljust(8, b"\xff"))
        rest = rest[7:]
    return frames


def _nmea2000():
    decoder = NMEA2000Decoder()

    def fields(group, data, source=1):
        message = decoder.decode(can.Message(arbitration_id=2 << 26 | group << 8 | source, data=data, is_extended_id=True, timestamp=1700000000))
        return message and {field.id: field for field in message.fields}

    def heading(raw):
        return fields(127250, struct.pack("<BHhhB", 1, raw, 0x7FFF, 0x7FFF, 0xFD))["heading"]
    absent = "absent where all bits are set and the range leaves that out; counted ([can.md](can.md))"
    yield "nmea2000: headings of 15708 and FFFF", f"{heading(15708).value} {heading(15708).unit_of_measurement}, clockwise from north; {heading(0xFFFF).value}", NMEA, absent
    turn = fields(127251, struct.pack("<BiBBB", 1, 32000000, 255, 255, 255))["rate"]
    yield "nmea2000: a rate of turn of 32000000", f"{turn.value} {turn.unit_of_measurement}, positive to starboard", NMEA, "positive to the left: `scale: -1` ([can.md](can.md))"
    speeds = [fields(128259, struct.pack("<BHHBBB", 1, raw, 0xFFFF, 0, 255, 255))["speedWaterReferenced"].value for raw in (100, 0xFFFD, 0xFFFE)]
    yield "nmea2000: speeds of 100, FFFD, FFFE", f"{speeds[0]} m/s, {speeds[1]}, {speeds[2]}: also what is reserved for errors", NMEA, absent
    place = fields(129025, struct.pack("<ii", 480000000, 0x7FFFFFFF))
    yield "nmea2000: latitude 480000000, longitude 7FFFFFFF", f"{place['latitude'].value} {place['latitude'].unit_of_measurement}, {place['longitude'].value}", NMEA, "`gnss_latitude`, `gnss_longitude` ([can.md](can.md))"
    payload = struct.pack("<BHIqqq", 7, 19675, 432000000, 480000000000000000, 110000000000000000, 500000000).ljust(43, b"\xff")
    lost = [fields(129029, frame) for k, frame in enumerate(_fast(payload, 0)) if k != 2]
    two = [found for frame in _fast(payload, 1) for source in (1, 2) if (found := fields(129029, frame, source))]
    yield "nmea2000: a fast packet without its third frame; two of two sources at once", f"{sum(map(bool, lost))} messages; {len(two)} messages", NMEA, "groups of several frames are not read, and named ([can.md](can.md))"


def _obd():
    def decoded(command, *data):
        return command.decode([types.SimpleNamespace(data=bytearray(data))])
    speed, turns = decoded(obd.commands.SPEED, 0x41, 0x0D, 255), decoded(obd.commands.RPM, 0x41, 0x0C, 255, 255)
    yield "obd: speed of FF, turns of FFFF", f"{speed.magnitude:.0f} km/h, {turns.magnitude} turns a minute: no value is absent", OBD, "a range in the DBC that leaves it out makes it absent"
    steps = {decoded(obd.commands.SPEED, 0x41, 0x0D, raw).magnitude for raw in range(4)}
    yield "obd: steps of its speed", f"{min(steps - {0}):.0f} km/h", OBD, "-"
