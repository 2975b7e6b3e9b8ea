# SPDX-License-Identifier: Apache-2.0
"""A robot with two driven wheels and an RTK receiver, without CAN: its twist comes over LCM, NMEA sentences come on a serial line that gpsd
reads, each block when it arrived in the recording; landmark_ekf. gpsd's first report of a fix has no standard deviations, as the recording has,
so that poses are compared with the replay of what the guest recorded."""
import datetime
import functools
import math
import operator

import drives
import messages
import motion
from published import WORKS, Published

WORLD = "yard-rtk"
CONFIG = """format: waymark-config/1
estimator: landmark_ekf
motion: {twist: measured}
sources: [{name: gnss, lateness_max_ms: 300}]
positions: {states: {time_offset_sigma_s: 0}}   # the device is told the delay
"""
ORIGIN = (52.5, 13.4, 30.0)  # degrees, metres above the ellipsoid
GEOID_M = 40.0               # its height there, about
BEGIN = datetime.datetime(2026, 1, 1, tzinfo=datetime.timezone.utc)
A_M, E2 = 6378137.0, 6.69437999014e-3  # WGS84
RECEIVED_LEAST = 0.95
# Run and recorder are two clients of gpsd: either may get a fix more at the start, until the twist's scale, 13 % off, is known from the drive.
SETTLED_S = 10
BEFORE = 14  # fixes of the standing robot before the drive: a receiver is on before the run


def earth_centred(place):
    """Source: NIMA TR8350.2, equation 4-14."""
    latitude, longitude = math.radians(place[0]), math.radians(place[1])
    across = A_M / math.sqrt(1 - E2 * math.sin(latitude) ** 2)
    return ((across + place[2]) * math.cos(latitude) * math.cos(longitude), (across + place[2]) * math.cos(latitude) * math.sin(longitude),
            (across * (1 - E2) + place[2]) * math.sin(latitude))


def east_north_up(place):
    """Of the origin."""
    x, y, z = map(operator.sub, earth_centred(place), earth_centred(ORIGIN))
    latitude, longitude = math.radians(ORIGIN[0]), math.radians(ORIGIN[1])
    outward = math.cos(longitude) * x + math.sin(longitude) * y
    return (math.cos(longitude) * y - math.sin(longitude) * x, math.cos(latitude) * z - math.sin(latitude) * outward,
            math.cos(latitude) * outward + math.sin(latitude) * z)


def place_of(east_m, north_m, up_m):
    """Latitude, longitude, height of a place in the map: Newton's method with the slope at the origin."""
    place = list(ORIGIN)
    slopes = (math.radians(1) * A_M, math.radians(1) * A_M * math.cos(math.radians(ORIGIN[0])))
    for _ in range(20):
        east, north, up = east_north_up(place)
        place[0] += (north_m - north) / slopes[0]
        place[1] += (east_m - east) / slopes[1]
        place[2] += up_m - up
    return place


def minutes(degrees, digits, signs):
    """Of NMEA: degrees, minutes, hemisphere."""
    whole, part = divmod(abs(degrees), 1)
    return f"{int(whole):0{digits}d}{60 * part:011.8f},{signs[degrees < 0]}"


def sentence(text):
    return f"${text}*{functools.reduce(operator.xor, text.encode()):02X}\r\n"


def block(t_ns, x_m, y_m, z_m, sigma_m, sigma_up_m):
    """RMC, GGA, GSA and GST of one fix."""
    latitude, longitude, height_m = place_of(x_m, y_m, z_m)
    now = BEGIN + datetime.timedelta(microseconds=t_ns // 1000)
    time, where = f"{now:%H%M%S}.{now.microsecond // 1000:03d}", f"{minutes(latitude, 2, 'NS')},{minutes(longitude, 3, 'EW')}"
    return "".join(map(sentence, (
        f"GPRMC,{time},A,{where},,,{now:%d%m%y},,,A",
        f"GPGGA,{time},{where},4,09,0.9,{height_m - GEOID_M:.4f},M,{GEOID_M:.4f},M,,",
        "GPGSA,A,3,01,02,03,04,05,06,07,08,09,,,,1.5,0.9,1.2",
        f"GPGST,{time},{sigma_m:.3f},{sigma_m:.3f},{sigma_m:.3f},0.0,{sigma_m:.3f},{sigma_m:.3f},{sigma_up_m:.3f}"))).encode()


def fixes(recording):
    """(arrival_ns, t_ns, numbers) of gnss.csv."""
    for row in drives.rows(recording / "gnss.csv"):
        yield int(row["arrival_ns"]), int(row["t_ns"]), [float(row[name]) for name in ("x_m", "y_m", "z_m", "sigma_xy_m", "sigma_z_m")]


def before(rows):
    """The first fixes again, each as long before the first as it is after it."""
    first_ns = rows[0][1]
    for arrival_ns, t_ns, numbers in rows[BEFORE:0:-1]:
        yield arrival_ns - 2 * (t_ns - first_ns), 2 * first_ns - t_ns, numbers


def prepare(work, root, here, simulate):
    recording, scenario = drives.make(work, "gnss", simulate, root / f"config/worlds/{WORLD}.yaml")
    items, blob, delay_ns = [], bytearray(), 0
    for t_ns, message in motion.twists(work, recording):
        items.append((t_ns, f"l {t_ns} {len(blob)} {len(message)} WAYMARK_MOTION"))
        blob += message
    seconds = (items[-1][0] - items[0][0]) * 1e-9
    rows = list(fixes(recording))
    for arrival_ns, t_ns, numbers in [*before(rows), *rows]:
        text = block(t_ns, *numbers)
        items.append((arrival_ns, f"n {len(blob)} {len(text)}"))
        delay_ns = arrival_ns - t_ns
        blob += text
    drives.write(scenario, here, items, blob, seconds)
    (scenario / "calibration.yaml").write_text(f"gnss: {{origin: {list(ORIGIN)}, mounting: {{xyz_m: [0, 0, 0]}}}}\n")
    (work / "gnss.yaml").write_text(CONFIG)
    (scenario / "robot.yaml").write_text(
        f"{CONFIG}initial_pose: {drives.start_of(recording)}\ncalibration: calibration.yaml\n"
        f"publish: {{lcm_url: '{drives.URL}'}}\nrealtime: {{priority: 40}}\n"
        f"devices: {{lcm: [{{stream: motion}}], gpsd: [{{latency_ms: {delay_ns * 1e-6:g}}}]}}\n")


def judge(work, waymark, root):
    seconds = float((work / "share/gnss/duration").read_text())
    failures = drives.judge("gnss", work, waymark, work / "gnss-recording", work / "gnss.yaml", seconds, is_recorded=True, settled_s=SETTLED_S)
    heard = Published("gnss", work / "share/out/gnss", 0, str)
    sent = sum(1 for _ in fixes(work / "gnss-recording"))
    end_s = heard.healths[-1][0]
    source = messages.source(heard.health_at(end_s), "gnss")
    heard.check(source.received - source.frozen >= RECEIVED_LEAST * sent, f"{source.received} positions by gpsd, {source.frozen} of them twice; {sent} were sent")
    heard.device("the drive", "gnss", WORKS, end_s - seconds, end_s - 15)
    return failures + heard.failures
