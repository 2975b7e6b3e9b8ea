# SPDX-License-Identifier: Apache-2.0
"""Messages, logs, videos, clouds, drawings."""

import datetime
import io
import os
import struct
import subprocess
import sys
import tempfile
import time
from fractions import Fraction
from pathlib import Path

import av
import cv2
import dpkt
import ezdxf
import foxglove
import gpxpy.gpx
import imageio.v2
import laspy
import lcm
import mcap.reader
import mcap_ros2.writer
import numpy as np
import svgpathtools
from ezdxf.path import make_path
from foxglove.messages import Quaternion, Timestamp
from google.protobuf import duration_pb2, timestamp_pb2
from mcap_ros2.decoder import DecoderFactory

MCAP, ROS2, FOX, PROTO, LCM, AV, CV = "mcap 1.6.0", "mcap-ros2-support 0.6.0", "foxglove-sdk 0.30.3", "protobuf 7.36.2", "lcm 1.5.3", f"PyAV {av.__version__}", f"OpenCV {cv2.__version__}"
POSE = ("geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n" + "=" * 80 + "\nMSG: geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z\n"
        + "=" * 80 + "\nMSG: geometry_msgs/Quaternion\nfloat64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n")


def video(path, stamps_ms, codec="libx264"):
    with av.open(str(path), "w") as file:
        stream = file.add_stream(codec, rate=1000)
        stream.width, stream.height, stream.pix_fmt, stream.codec_context.time_base = 64, 48, "yuv420p", Fraction(1, 1000)
        for k, ms in enumerate(stamps_ms):
            frame = av.VideoFrame.from_ndarray(np.full((48, 64, 3), 20 + 30 * k, np.uint8), format="rgb24")
            frame.pts, frame.time_base = ms, Fraction(1, 1000)
            file.mux(stream.encode(frame))
        file.mux(stream.encode())


def position(path, seek_ms=None):
    capture = cv2.VideoCapture(str(path))
    if seek_ms is not None:
        capture.set(cv2.CAP_PROP_POS_MSEC, seek_ms)
    capture.read()
    return round(capture.get(cv2.CAP_PROP_POS_MSEC))


def of_mcap():
    file = io.BytesIO()
    writer = mcap_ros2.writer.Writer(file)
    schema = writer.register_msgdef("geometry_msgs/msg/Pose", POSE)
    for t in (10, 20):
        writer.write_message("/pose", schema, {"position": {"x": 1.0}}, log_time=t, publish_time=t)
    writer.finish()
    file.seek(0)
    times = [message.log_time for _, _, message in mcap.reader.make_reader(file).iter_messages(start_time=10, end_time=20)]
    file.seek(0)
    first = next(iter(mcap.reader.make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages())).decoded_message
    yield "mcap iter_messages from 10 to 20: messages of 10 and 20", ", ".join(map(str, times)) + " alone", MCAP, "-"
    yield "mcap-ros2-support: a quaternion that nobody sets", f"w {first.orientation.w:.0f}: the definition's default", ROS2, "all four numbers are written"


def of_times():
    here = os.environ.get("TZ", "UTC")
    os.environ["TZ"] = "America/New_York"
    time.tzset()
    stamp = timestamp_pb2.Timestamp()
    stamp.FromDatetime(datetime.datetime(2026, 1, 1))
    hours = (Timestamp.from_datetime(datetime.datetime(2026, 1, 1)).sec - stamp.seconds) / 3600
    os.environ["TZ"] = here
    time.tzset()
    yield "Foxglove's from_datetime without a zone against protobuf's, in New York", f"{hours:.0f} h later", f"{FOX}, {PROTO}", "stamps are integers of nanoseconds, in UTC where a message states it"
    yield "foxglove-sdk Quaternion()", str(Quaternion()).removeprefix("Quaternion(").removesuffix(")"), FOX, "all four numbers are written"
    span = duration_pb2.Duration()
    span.FromTimedelta(datetime.timedelta(seconds=-0.5))
    yield "protobuf Duration of -0.5 s", f"{span.seconds} s, {span.nanos} ns (ROS 2: -1 s, 500000000 ns)", PROTO, "differences are integers of nanoseconds"


def of_lcm():
    folder = Path(tempfile.mkdtemp())
    found = []
    for count, size in ((10, 1), (10, 8), (20, 1), (20, 8)):
        log = lcm.EventLog(str(folder / "log"), "w", overwrite=True)
        for k in range(count):
            log.write_event(1000000 * k, "A", b"x" * size)
        log.close()
        log = lcm.EventLog(str(folder / "log"), "r")
        log.seek_to_timestamp(4500000)
        found.append(log.read_next_event().timestamp // 1000000)
    yield "LCM seek_to_timestamp(4.5 s) in a log of whole seconds: the next event", f"{found[0]} s with messages of 1 byte, {found[1]} s with those of 8; of 20 events {found[2]} s and {found[3]} s", LCM, "reads its logs from the begin"
    folder.joinpath("scan.lcm").write_text("package measured;\nstruct scan_t { int32_t count; float ranges[count]; }\n")
    subprocess.run([Path(sys.executable).parent / "lcm-gen", "-p", "--ppath", folder, folder / "scan.lcm"], check=True)
    sys.path.insert(0, str(folder))
    import measured

    scan = measured.scan_t()
    scan.ranges, scan.count = [1.0, 2.0, 3.0], 2
    yield "LCM in Python: three ranges with the count 2", f"{len(measured.scan_t.decode(scan.encode()).ranges)} arrive", LCM, "-"
    scan.ranges = [1.0]
    try:
        scan.encode()
        said = "is sent"
    except Exception as error:  # noqa: BLE001  (that it raises is what is measured)
        said = f"raises {type(error).__name__}"
    yield "LCM in Python: one range with the count 2", said, LCM, "-"


def of_videos():
    folder = Path(tempfile.mkdtemp())
    video(folder / "even.mp4", (0, 100, 200, 1000, 1100, 1200))
    ours = "a stamp for each picture beside the video; `waymark import` takes the container's"
    yield "OpenCV POS_MSEC after read(): of a video with pictures at 0, 100 ms", f"{position(folder / 'even.mp4')} ms: of the picture that was read", CV, ours
    yield "OpenCV: the picture at 1000 ms of 0, 100, 200, 1000, 1100, 1200 ms", f"that of {position(folder / 'even.mp4', 1000)} ms", CV, ours
    count = sum(1 for _ in imageio.v2.get_reader(str(folder / "even.mp4"), "ffmpeg"))
    yield "imageio: pictures of that video of six", f"{count}, at even times", "imageio 2.38.1, imageio-ffmpeg 0.8.1", ours
    for ending, name, codec in (("mp4", "H.264", "libx264"), ("mkv", "H.264", "libx264"), ("mkv", "MPEG-4", "mpeg4")):
        video(folder / f"late.{ending}", (1400, 1500), codec)
        with av.open(str(folder / f"late.{ending}")) as file:
            frame = next(file.decode(video=0))
            first = round(1000 * float(frame.pts * frame.time_base))
        yield f"first stamp of a .{ending} of {name} whose first picture is of 1400 ms", f"OpenCV {position(folder / f'late.{ending}')} ms, PyAV {first} ms", f"{CV}, {AV}", "stamps count from the first picture"
    yield from _of_pictures(folder)


def _of_pictures(folder):
    """Of a video whose container has its viewers turn it by 90 degrees clockwise, and of one that is black."""
    turned = folder / "turned.mp4"
    video(turned, (0, 100))
    data = bytearray(turned.read_bytes())
    head = data.find(b"tkhd") + 4
    matrix = head + (40 if data[head] == 0 else 52)  # ISO/IEC 14496-12, 8.3.2: behind the version's times
    data[matrix:matrix + 36] = struct.pack(">9i", 0, 1 << 16, 0, -(1 << 16), 0, 0, 48 << 16, 0, 1 << 30)
    turned.write_bytes(data)
    rows, columns = cv2.VideoCapture(str(turned)).read()[1].shape[:2]
    stored = next(av.open(str(turned)).decode(video=0))
    yield "size of a video of 64 x 48 that its container turns by 90 degrees", f"OpenCV {columns} x {rows}, PyAV {stored.width} x {stored.height}", f"{CV}, {AV}", "pictures as stored; `waymark import` states that viewers turn them"
    black = av.VideoFrame.from_ndarray(np.repeat(np.uint8([16, 128]), [48 * 64, 24 * 64]).reshape(72, 64), format="yuv420p")
    yield "PyAV: grey of the black of a video of limited range, which is 16", str(black.to_ndarray(format="gray").max()), AV, "black is 0 and white is 255, whatever the range"


def of_packets():
    def block(kind, body):
        return struct.pack("<II", kind, len(body) + 12) + body + struct.pack("<I", len(body) + 12)

    def interface(resolution):
        return block(1, struct.pack("<HHI", 1, 0, 65535) + struct.pack("<HHB3xHH", 9, 1, resolution, 0, 0))

    ns = 1700000000123456789
    packets = b"".join(block(6, struct.pack("<IIIII", k, t >> 32, t & 0xFFFFFFFF, 4, 4) + b"abcd") for k, t in enumerate((ns // 1000, ns)))
    head = block(0x0A0D0D0A, struct.pack("<IHHq", 0x1A2B3C4D, 1, 0, -1))
    read = [int(t) for t, _ in dpkt.pcapng.Reader(io.BytesIO(head + interface(6) + interface(9) + packets))]
    yield "dpkt: packets of one moment on interfaces of us and of ns", f"{read[0]} s and {read[1]} s", "dpkt 1.9.8", "not read"


def of_places():
    track = gpxpy.gpx.GPXTrackSegment([gpxpy.gpx.GPXTrackPoint(48.0, 11.0, time=datetime.datetime(2026, 1, 1))])
    g = gpxpy.gpx.GPX()
    g.tracks.append(gpxpy.gpx.GPXTrack())
    g.tracks[0].segments.append(track)
    yield "gpxpy: a time without a zone", "is written without one" if "00:00</time>" in g.to_xml() else "is written as UTC", "gpxpy 1.6.2", "not read"
    cloud = laspy.LasData(laspy.LasHeader(point_format=3, version="1.2"))
    cloud.x = np.array([0.123456])
    yield "laspy: x of 0.123456 m in a new file", f"{cloud.x[0]:.2f} m", "laspy 2.7.0", "not read"
    space, mirrored = ezdxf.new().modelspace(), {"extrusion": (0, 0, -1)}
    arc, line = space.add_arc((5, 2), 1, 0, 90, dxfattribs=mirrored), space.add_line((5, 2), (6, 2), dxfattribs=mirrored)
    yield "ezdxf: x of an arc's centre and of a line's start, both 5, with the extrusion 0, 0, -1", f"in the world {arc.ocs().to_wcs(arc.dxf.center)[0]:.0f} and {make_path(line).start[0]:.0f}", "ezdxf 1.4.5", "plans are pictures"
    folder = Path(tempfile.mkdtemp())
    folder.joinpath("plan.svg").write_text('<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100"><g transform="translate(50,0)"><path d="M 0 0 L 10 0"/></g></svg>')
    plain, whole = svgpathtools.svg2paths(str(folder / "plan.svg"))[0][0], svgpathtools.Document(str(folder / "plan.svg")).paths()[0]
    yield "svgpathtools svg2paths: x of a path at 0 in a group that is moved by 50", f"{plain.start.real:.0f}; Document has {whole.start.real:.0f}", "svgpathtools 1.8.0", "plans are pictures"


def rows():
    for ground in (of_mcap, of_times, of_lcm, of_videos, of_packets, of_places):
        yield from ground()
