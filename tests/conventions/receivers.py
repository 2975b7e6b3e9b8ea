# SPDX-License-Identifier: Apache-2.0
"""Receivers of satellites and their sentences. What gpsd 3.22 does is in findings/gpsd-heading-with-deviations.sh."""

import datetime
import struct
from functools import reduce

import adafruit_gps
import pyais
import pynmea2
import pynmeagps
from pyubx2 import GET, UBXMessage

NMEA2, NMEAGPS, UBX, AIS, ADAFRUIT = "pynmea2 1.19.0", "pynmeagps 1.1.8", "pyubx2 1.4.0", "pyais 3.3.1", "adafruit-circuitpython-gps 4.0.0"


def sentence(text):
    return f"${text}*{reduce(lambda a, b: a ^ b, text.encode()):02X}\r\n"


class Serial:
    in_waiting = 100

    def __init__(self, *texts):
        self.lines = [sentence(text).encode() for text in texts]

    def readline(self):
        return self.lines.pop(0)


def rows():
    gone = sentence("GPGGA,120000.00,,,,,0,00,99.99,,M,,M,,")
    here = sentence("GPGGA,120000.25,4807.038,S,01131.000,W,1,08,0.9,545.4,M,46.9,M,,")
    ours = "by gpsd: no `mode` of 2 or 3, or latitude and longitude 0, is no position; counted"
    m = pynmea2.parse(gone)
    yield "pynmea2: latitude of a GGA without a fix", str(m.latitude), NMEA2, ours
    yield "pynmeagps: the same", repr(pynmeagps.NMEAReader.parse(gone).lat).replace("''", "an empty text"), NMEAGPS, ours
    m = pynmea2.parse(here)
    yield "pynmea2: sign of south and west", f"{m.latitude:.2f}, {m.longitude:.2f}", NMEA2, "negative"
    yield "pynmea2: type of the antenna's altitude and of the geoid's height", f"{type(m.altitude).__name__} and {type(m.geo_sep).__name__}", NMEA2, "-"
    yield "pynmea2: fraction of 120000.25", f"{m.timestamp.microsecond / 1e6:.2f} s", NMEA2, "nanoseconds"
    yield "pynmeagps: latitude 9.99999999 as a sentence", pynmeagps.NMEAMessage("GP", "GLL", GET, lat=9.99999999, NS="N", lon=1.0, EW="E", time=datetime.time(12), status="A", posMode="A").serialize().decode().split(",")[1] + ": 60 minutes", NMEAGPS, "writes no NMEA"
    gps = adafruit_gps.GPS(Serial("GPRMC,120001.75,A,4808.0380,N,01131.0000,E,20.0,10.0,230324,,,A", "GPRMC,120002.75,A,4809.0380,N,01131.0000,E,20.0,10.0,230324,3.1,W", "GPGGA,120003.00,,,,,0,00,99.99,,M,,M,,"))
    gps.update()
    yield "adafruit_gps: second of 120001.75", str(gps.timestamp_utc.tm_sec), ADAFRUIT, "nanoseconds"
    first = gps.latitude
    gps.update()
    yield "adafruit_gps: an RMC of NMEA 2.0, without a mode", "changes nothing" if gps.latitude == first else "moves the place", ADAFRUIT, "left to gpsd"
    gps.update()
    yield "adafruit_gps: latitude when the fix is gone", "the last one" if gps.latitude == first else str(gps.latitude), ADAFRUIT, "no position"
    payload = struct.pack("<IHBBBBBBIiBBBBiiiiIIiiiiiIIHHIIhH", 123456789, 2024, 3, 23, 12, 0, 0, 0x37, 50, -300000000, 3, 1, 0, 12, 115166667, 481173000, 592300, 545400, 20, 30,
                          1000, -2000, 30, 2236, -6346000, 40, 100000, 123, 0, 0, 0, 0, 0)
    m = UBXMessage(0x01, 0x07, GET, payload=payload)
    yield "pyubx2 NAV-PVT: units of lat, height, gSpeed, headMot", f"{m.lat} degrees, {m.height} mm, {m.gSpeed} mm/s, {m.headMot} degrees", UBX, "SI, with the unit in each name"
    yield "pyubx2 NAV-PVT 0.3 s before 12:00:00", f"second {m.second}, nano {m.nano}: the reader has to add them", UBX, "-"
    yield "pyubx2: hMSL and height of one fix", f"{(m.height - m.hMSL) / 1000:.1f} m apart: sea level and ellipsoid", UBX, "the ellipsoid where gpsd has it"
    ship = pyais.decode("!AIVDO,1,1,,A,11mg=5OP?w<tSF0l4Q@>4?v1P000,0*47")
    yield "pyais: latitude, longitude, heading of \"not available\"", f"{ship.lat}, {ship.lon}, {ship.heading}", AIS, "not read; absent values are empty fields"
