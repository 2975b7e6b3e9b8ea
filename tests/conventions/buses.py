# SPDX-License-Identifier: Apache-2.0
"""CAN: definitions, absent values, logs."""

import os
import struct
import tempfile
import time
from pathlib import Path

import can
import canmatrix
import canmatrix.formats
import cantools
from dronecan import uavcan

from experiment import said

TOOLS, PYTHON, MATRIX, DRONE = "cantools 45.1.0", "python-can 4.6.1", "canmatrix 1.2", "dronecan 1.0.27"
DBC = '''VERSION ""
NS_ :
BS_:
BU_: A
BO_ 2566844926 CCVS: 8 A
 SG_ WheelSpeed : 8|16@1+ (0.00390625,0) [0|250.996] "km/h" A
 SG_ Brake : 28|2@1+ (1,0) [0|3] "" A
BO_ 256 Motion: 8 A
 SG_ v : 0|16@1- (0.01,0) [-100|100] "m/s" A
 SG_ w : 16|8@1+ (1,-128) [0|0] "rad/s" A
VAL_ 2566844926 Brake 0 "off" 1 "on" 2 "error" 3 "not available" ;
VAL_ 256 v 32767 "SNA" ;
'''


def zone(name):
    os.environ["TZ"] = name
    time.tzset()


def rows():
    db = cantools.database.load_string(DBC, "dbc")
    absent = "absent where all bits are set and the range leaves that out, and where `VAL_` names it so; counted ([can.md](can.md))"
    yield "cantools: a J1939 speed of FFFF", f"{db.decode_message(0x18FEF1FE, bytes([255] * 8))['WheelSpeed']:.1f} km/h", TOOLS, absent
    matrix = canmatrix.formats.loads_flat(DBC.encode(), "dbc", dbcImportEncoding="utf8")
    speed = matrix.decode(canmatrix.ArbitrationId(0x18FEF1FE, extended=True), b"\xff" * 8)["WheelSpeed"].phys_value
    yield "canmatrix: the same", f"{float(speed):.1f} km/h", MATRIX, absent
    yield "cantools: the raw value that VAL_ names SNA", f"{type(db.decode_message(256, struct.pack('<hB5x', 32767, 128))['v']).__name__} instead of a number", TOOLS, absent
    yield "cantools: the same message of another source address", said(lambda: db.decode_message(0x18FEF100, bytes(8))), TOOLS, "priority and source address are those of the DBC ([can.md](can.md))"
    yield "cantools: encoding a value beyond its range", said(lambda: db.encode_message(256, {"v": 123.0, "w": 0})), TOOLS, "sends nothing on CAN"
    yield "cantools: encoding 0.6 with a factor of 1", f"{db.decode_message(256, db.encode_message(256, {'v': 0, 'w': 0.6}))['w']}", TOOLS, "sends nothing on CAN"
    yield "cantools: one byte of a message of eight", said(lambda: db.decode_message(256, b"\x01")), TOOLS, "short frames are malformed, and counted"
    yield "cantools: a signal of which no bit lies in a frame that is cut, allow_truncated", ", ".join(db.decode_message(256, b"\x01\x02", allow_truncated=True)) + " alone", TOOLS, "short frames are malformed, and counted"
    folder = Path(tempfile.mkdtemp())
    sent = [can.Message(timestamp=1700000000 + 0.0101111 * k, arbitration_id=0x100, data=[k], is_extended_id=False, channel=k) for k in (0, 1)]
    here = os.environ.get("TZ", "UTC")
    for ending in ("log", "blf", "csv", "db", "trc", "asc"):
        zone("UTC")
        with can.Logger(str(folder / f"drive.{ending}")) as log:
            for message in sent:
                log(message)
        zone("America/New_York")
        read = list(can.LogReader(str(folder / f"drive.{ending}")))
        off = read[0].timestamp - sent[0].timestamp
        yield f"python-can: buses 0 and 1 in a .{ending}", f"{read[0].channel} and {read[1].channel}, stamps {off:.0f} s off, {abs(read[1].timestamp - sent[1].timestamp - off) * 1e6:.0f} us apart from that", PYTHON, "`candump -l` files, with the interface's name"
    off = list(can.ASCReader(str(folder / "drive.asc"), relative_timestamp=False))[0].timestamp - sent[0].timestamp
    yield "python-can: .asc of UTC with relative_timestamp=False in New York", f"{off:.0f} s off", PYTHON, "stamps are seconds since 1970 in UTC"
    zone(here)
    status = uavcan.equipment.esc.Status()
    for rpm in (-3000, 200000):
        status.rpm = rpm
        again = uavcan.equipment.esc.Status()
        again._unpack(status._pack())
        yield f"dronecan: an ESC's {rpm} turns a minute", str(again.rpm), DRONE, "not read"
    status.temperature = 298.15
    again._unpack(status._pack())
    yield "dronecan: a temperature of 25 C", f"{again.temperature} K, as float16", DRONE, "-"
    yield "dronecan: 24.123 V as float16", f"{_voltage(status):.3f} V", DRONE, "-"


def _voltage(status):
    status.voltage = 24.123
    again = uavcan.equipment.esc.Status()
    again._unpack(status._pack())
    return again.voltage
