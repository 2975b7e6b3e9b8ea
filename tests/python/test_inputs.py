#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What goes into the package: columns of any kind of array, pictures of maps, candump logs. Taken right, or refused in words.

    test_inputs.py BIN_DIR"""

import datetime
import io
import json
import shutil
import subprocess
import unittest
import zlib

import numpy as np
from common import BIN, CONFIG, Folder
from PIL import Image

import waymark
from waymark.maps import FREE, OCCUPIED, UNKNOWN
from waymark.recording import COLUMNS, STREAMS

STAMPS = [1_700_000_000_000_000_000, 1_700_000_000_020_000_000]
T_S = 1_700_000_000


class Columns(Folder):
    def written(self, stamps, **others):
        """motion.csv of these stamps, read back."""
        count = len(stamps)
        with waymark.RecordingWriter(self.folder / "rec") as writer:
            writer.table("motion.csv", {"t_ns": stamps, "v_mps": np.ones(count), "w_radps": np.zeros(count), **others})
        table = waymark.Recording(self.folder / "rec").table("motion.csv")
        shutil.rmtree(self.folder / "rec")
        return table

    def test_stamps_of_any_unit_are_nanoseconds(self):
        micros = np.array([1_700_000_000_000_000, 1_700_000_000_020_000])
        for stamps in (np.array(STAMPS), STAMPS, np.array(STAMPS, dtype="datetime64[ns]"), micros.astype("datetime64[us]"),
                       (micros // 1000).astype("datetime64[ms]"), np.array(STAMPS).astype("timedelta64[ns]"),
                       micros.astype("timedelta64[us]"), np.array(STAMPS, dtype=np.uint64), np.array(STAMPS, dtype=np.float64)):
            table = self.written(stamps)
            self.assertEqual(table["t_ns"].dtype, np.int64)
            self.assertEqual(table["t_ns"].tolist(), STAMPS, np.asarray(stamps).dtype)
        self.assertEqual(self.written(np.array([T_S, T_S + 1], dtype="datetime64[s]"))["t_ns"].tolist(), [T_S * 10**9, (T_S + 1) * 10**9])
        self.assertEqual(self.written(np.array(["2023-11-14T22:13"], dtype="datetime64[m]"))["t_ns"].tolist(), [(T_S - 20) * 10**9])
        self.assertEqual(self.written(np.array(["2023-11-14"], dtype="datetime64[D]"))["t_ns"].tolist(), [1_699_920_000 * 10**9])

    def test_what_is_no_stamp_is_refused(self):
        date = datetime.datetime(2023, 11, 14, tzinfo=datetime.timezone.utc)
        for stamps, words in ((np.array([date, date]), "t_ns holds datetime; whole nanoseconds"),
                              (np.array(["2023-11", "2023-12"], dtype="datetime64[M]"), "has no length in nanoseconds"),
                              (np.array(["2023-11-14", "NaT"], dtype="datetime64[s]"), "NaT. in row 1"),
                              (np.array(["2623-11-14", "2623-11-15"], dtype="datetime64[s]"), "doesn't fit into 64-bit"),
                              (np.array([1.7e9, 1.7e9 + 0.02]), "holds whole numbers, but row 1 has 1700000000.02; are these seconds"),
                              (np.array([1e18, np.nan]), "row 1 has nan"),
                              (np.array([1e18, 1e30]), "row 1 has 1e.30"),
                              (np.zeros((2, 2)), "has the shape .2, 2."),
                              (["2023-11-14T00:00:00", "2023-11-14T00:00:01"], "t_ns holds text .'2023-11-14T00:00:00'.; whole nanoseconds"),
                              (np.array([2**63, 2**63 + 1], dtype=np.uint64), "has 9223372036854775808 in row 0; whole numbers up to"),
                              (np.ma.array([1, 2], mask=[0, 1]), "has no value .masked. in row 1"),
                              (np.array([True, False]), "holds bool; whole nanoseconds"),
                              (np.array([1j, 2j]), "holds complex128")):
            with self.assertRaisesRegex(ValueError, words):
                self.written(stamps)

    def test_other_columns_and_lengths_are_refused(self):
        for others, words in (({"vx_mps": np.zeros(2)}, "column vx_mps is not one of this table; did you mean v_mps"),
                              ({"temperature": np.zeros(2)}, "temperature is not one of this table; it has t_ns, arrival_ns, v_mps"),
                              ({"vy_mps": np.zeros(3)}, "different lengths: vy_mps 3 where others have 2"),
                              ({"vy_mps": np.array(STAMPS, dtype="datetime64[ns]")}, "only stamps .columns that end in _ns. are times"),
                              ({"vy_mps": ["1", "x"]}, "vy_mps holds text .'1'.; numbers are needed"),
                              ({"vy_mps": np.array([None, 1.0])}, "vy_mps holds NoneType; numbers are needed")):
            with self.assertRaisesRegex(ValueError, words):
                self.written(STAMPS, **others)
        with self.assertRaisesRegex(ValueError, "did you mean motion.csv"), waymark.RecordingWriter(self.folder / "c") as writer:
            writer.table("motoin.csv", {"t_ns": np.array(STAMPS)})
        with self.assertRaisesRegex(TypeError, "a table is columns by name, and not list"), waymark.RecordingWriter(self.folder / "d") as writer:
            writer.table("motion.csv", [STAMPS])
        with waymark.RecordingWriter(self.folder / "e") as writer:
            writer.table("motion.csv", {"t_ns": np.array(STAMPS), "v_mps": np.ones(2), "w_radps": np.ones(2)})
        with self.assertRaisesRegex(FileNotFoundError, "it has no table imu.csv; it has motion.csv"):
            waymark.Recording(self.folder / "e").table("imu.csv")
        with self.assertRaisesRegex(ValueError, "w_radps is missing"), waymark.RecordingWriter(self.folder / "b") as writer:
            writer.table("motion.csv", {"t_ns": np.array(STAMPS), "v_mps": np.ones(2)})
        with self.assertRaisesRegex(ValueError, "names have no comma"):
            waymark.write_table(self.folder / "a.csv", {"t_ns": np.array([1]), "sensor": np.array(["a,b"])})
        waymark.write_table(self.folder / "a.csv", {"id": np.array([7.0, -1.0]), "sensor": np.array([b"a", b"b"])})
        self.assertEqual(waymark.read_table(self.folder / "a.csv")["id"].tolist(), [7, -1])

    def test_names_that_no_program_reads_are_refused(self):
        for name, table, words in (("motion", {"t_ns": STAMPS}, "a table's file is called NAME.csv"), ("../a.csv", {"t_ns": STAMPS}, "outside of the recording"),
                                   ("motion.csv", {"t_ns": STAMPS, 3: STAMPS}, "the column 3 has no name")):
            with self.assertRaisesRegex(ValueError, words), waymark.RecordingWriter(self.folder / "n") as writer:
                writer.table(name, table)

    def test_files_that_are_no_tables_are_named(self):
        head = "t_ns,v_mps,w_radps\n"
        for text, words in (("1,2,3\n", "a.csv:1: there is no header line"), ("", "a.csv:1: there is no header line"),
                            ("t_ns,v_mps,v_mps\n1,2,3\n", "a.csv:1: the column v_mps appears twice"), (head + "1.5,2,3\n", "a.csv:2: '1.5' is not a whole number"),
                            (head + f"{10**19},2,3\n", "a.csv:2: '1000.*' does not fit into 64 bits"), ((head + "1,2,3\n").encode("utf-16"), "no text in UTF-8")):
            (self.folder / "a.csv").write_bytes(text if isinstance(text, bytes) else text.encode())
            with self.subTest(text), self.assertRaisesRegex(ValueError, words):
                waymark.read_table(self.folder / "a.csv")
        (self.folder / "a.csv").write_text("t_ns, v_mps\n1, 2\n")
        self.assertEqual(list(waymark.read_table(self.folder / "a.csv")), ["t_ns", "v_mps"])

    def test_yaml_that_is_none_is_named_with_its_line(self):
        for text, words in ((b"name: a\nstreams: [\n", "recording.yaml:3: this is no valid YAML$"), (b"\xff\xfea\0", "no text in UTF-8"), (b"- 1\n", "not a mapping of keys"),
                            (b"name: a\nname: b\n", "recording.yaml:2: the key name appears twice")):
            (self.folder / "recording.yaml").write_bytes(text)
            with self.subTest(text), self.assertRaisesRegex(ValueError, words):
                waymark.Recording(self.folder)

    def test_the_runtime_names_utf16(self):
        (self.folder / "robot.yaml").write_text(CONFIG)
        (self.folder / "recording.yaml").write_text("format: waymark-recording/1\nname: a\nstreams: [motion.csv]\n")
        (self.folder / "motion.csv").write_bytes("t_ns,v_mps,w_radps\n1,2,3\n".encode("utf-16"))
        done = subprocess.run([BIN / "waymark", "check", self.folder / "robot.yaml", self.folder, "--quick"], capture_output=True, text=True, check=False)
        self.assertIn("the file is in UTF-16: save it in UTF-8", done.stdout + done.stderr)

    def test_the_runtime_knows_every_column(self):
        self.assertEqual(set(STREAMS) - set(COLUMNS), set())
        (self.folder / "robot.yaml").write_text(CONFIG)
        for name, (needed, others) in COLUMNS.items():
            if name not in STREAMS:
                continue
            columns = ("t_ns", "arrival_ns", *needed, *others)
            with waymark.RecordingWriter(self.folder / name) as writer:
                writer.table(name, {column: np.array(["front"] if column == "sensor" else ["0" * 64] if column == "appearance" else [1])
                                    for column in columns})
            done = subprocess.run([BIN / "waymark", "check", self.folder / "robot.yaml", self.folder / name, "--quick"], capture_output=True,
                                  text=True, check=False)
            self.assertNotIn("unknown column", done.stdout + done.stderr, name)
            self.assertNotRegex(done.stdout + done.stderr, "column '.*' is missing", name)

    def test_spellings_of_numbers_that_only_python_knows_are_refused(self):
        for field in ("1_0", "\u0661"):
            for name in ("t_ns", "x_m"):
                (self.folder / "a.csv").write_text(f"{name}\n1\n{field}\n", encoding="utf-8")
                with self.subTest(field, name=name), self.assertRaisesRegex(ValueError, f"a.csv:3: '{field}' is not a (whole )?number"):
                    waymark.read_table(self.folder / "a.csv")

    def test_a_byte_order_mark_is_no_part_of_a_name(self):
        (self.folder / "a.csv").write_bytes(b"\xef\xbb\xbft_ns,x_m\r\n1,2\r\n")
        self.assertEqual(list(waymark.read_table(self.folder / "a.csv")), ["t_ns", "x_m"])
        (self.folder / "recording.yaml").write_bytes(b"\xef\xbb\xbfformat: waymark-recording/1\nname: a\nstreams: []\n")
        self.assertEqual(waymark.Recording(self.folder).meta["name"], "a")


def png(levels, bits=8, kind=0, gamma=None):
    """A PNG by its bytes: levels (rows, columns[, channels]) of 8 bits, widened to 16."""
    def chunk(name, data):
        return len(data).to_bytes(4, "big") + name + data + zlib.crc32(name + data).to_bytes(4, "big")
    values = levels.astype(np.uint16) * 257 if bits == 16 else levels
    rows = b"".join(b"\0" + np.ascontiguousarray(row.astype(">u2" if bits == 16 else "u1")).tobytes() for row in values)
    head = levels.shape[1].to_bytes(4, "big") + levels.shape[0].to_bytes(4, "big") + bytes([bits, kind, 0, 0, 0])
    extra = chunk(b"gAMA", round(gamma * 100000).to_bytes(4, "big")) if gamma else b""
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + extra + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


def saved(picture, ending, **options):
    """A picture's bytes by Pillow."""
    out = io.BytesIO()
    picture.save(out, ending, **options)
    return out.getvalue()


class Maps(Folder):
    """The cells of a picture by the package, and how much of it is drivable by the runtime, which has its own reader."""

    def setUp(self):
        super().setUp()
        self.grey = np.full((100, 100), 205, dtype=np.uint8)
        self.grey[20:80, 20:80] = 254
        self.grey[20:80, [20, 79]] = self.grey[[20, 79], 20:80] = 0
        self.meant = np.select([self.grey == 254, self.grey == 0], [FREE, OCCUPIED], UNKNOWN)[::-1]

    def pictures(self):
        grey, clear = self.grey, np.where(self.grey == 205, 0, 255)
        hidden = np.where(self.grey == 205, 254, self.grey)
        palette = Image.frombytes("P", grey.shape[::-1], np.select([grey == 254, grey == 0], [0, 1], 2).astype(np.uint8).tobytes())
        palette.putpalette([254] * 3 + [0] * 3 + [205] * 3)
        return {"grey": png(grey), "grey16": png(grey, 16), "gamma": png(grey, gamma=1.0), "grey16-gamma": png(grey, 16, gamma=1.0),
                "rgb": png(np.repeat(grey[:, :, None], 3, 2), kind=2),
                "rgb-tint": png(np.stack([grey, grey, np.minimum(grey, 250)], 2), kind=2),
                "rgb16": png(np.repeat(grey[:, :, None], 3, 2), 16, 2),
                "rgba": png(np.stack([hidden, hidden, hidden, clear], 2), kind=6), "grey-alpha": png(np.stack([hidden, clear], 2), kind=4),
                "rgba-opaque": png(np.stack([grey, grey, grey, np.full_like(grey, 255)], 2), kind=6),
                "palette": saved(palette, "PNG"), "palette-clear": saved(palette, "PNG", transparency=2),
                "pgm": b"P5\n# by a robot\n100 100\n255\n" + grey.tobytes(),
                "pgm16": b"P5 100 100 65535\n" + (grey.astype(">u2") * 257).astype(">u2").tobytes()}

    def both(self, name, picture, keys=""):
        """Cells by the package, and the area in m2 that `waymark map check` states."""
        file = self.folder / f"{name}.{'pgm' if picture[:1] == b'P' else 'png'}"
        file.write_bytes(picture)
        about = self.folder / f"{name}.yaml"
        about.write_bytes(b"\xef\xbb\xbf" + f"image: {file.name}\nresolution: 0.05\norigin: [0, 0, 0.5]\n{keys}".encode())
        done = subprocess.run([BIN / "waymark-map", "check", about], capture_output=True, text=True, check=False)
        area = next(line for line in done.stdout.splitlines() if line.startswith("drivable:"))
        return waymark.read_floor_plan(about).cells, float(area.split()[1])

    def test_one_map_as_every_kind_of_picture(self):
        for name, picture in self.pictures().items():
            cells, area = self.both(name, picture)
            np.testing.assert_array_equal(cells, self.meant, name)
            self.assertAlmostEqual(area, float((self.meant == FREE).sum()) * 0.0025, delta=0.051, msg=name)

    def test_modes(self):
        raw = np.select([self.grey == 254, self.grey == 0], [0, 100], 255).astype(np.uint8)
        for name, picture, keys in (("trinary", png(self.grey), "mode: trinary\n"), ("scale", png(self.grey), "mode: scale\n"),
                                    ("negated", png(255 - self.grey), "negate: 1\n"), ("truth", png(255 - self.grey), "negate: true\n"),
                                    ("raw", png(raw), "mode: raw\n")):
            cells, area = self.both(name, picture, keys)
            np.testing.assert_array_equal(cells, self.meant, name)
            self.assertAlmostEqual(area, float((self.meant == FREE).sum()) * 0.0025, delta=0.051, msg=name)

    def test_what_is_refused(self):
        (self.folder / "a.png").write_bytes(png(self.grey)[:60])
        (self.folder / "b.png").write_bytes(png(self.grey))
        (self.folder / "c.pgm").write_bytes(b"P5\n%d %d\n255\n" % self.grey.shape[::-1] + self.grey.astype(np.uint8).tobytes()[:-9])
        for keys, words in (("image: a.png\n", "a.png: this is no picture that can be read, or it is cut off"),
                            ("image: c.pgm\n", "c.pgm: this is no picture that can be read, or it is cut off"),
                            ("image: b.png\nmode: graded\n", "mode: 'graded' is none of trinary"),
                            ("image: b.png\nmode: raw\nnegate: 1\n", "negate: the map servers")):
            (self.folder / "map.yaml").write_text(f"resolution: 0.05\norigin: [0, 0, 0]\n{keys}")
            with self.assertRaisesRegex(ValueError, words):
                waymark.read_floor_plan(self.folder / "map.yaml")
        for keys, words in (("resolution: 0,05\norigin: [0, 0]\n", "map.yaml: resolution: '0,05' is not a number"), ("origin: [0, 0]\n", "resolution is missing"),
                            ("resolution: 1\norigin: {x: 0}\n", "origin is .x, y, yaw."), ("resolution: 1\norigin: [0, 0, 0, 0]\n", "origin is .x, y, yaw."),
                            ("resolution: 1\norigin: [0, a]\n", "origin: 'a' is not a number"), ("- 1\n", "not a mapping"), ("a: [\n", "map.yaml:2: this is no valid YAML"),
                            ("resolution: 1\nresolution: 2\norigin: [0, 0]\n", "map.yaml:2: the key resolution appears twice"),
                            ("resolution: 1\norigin: [0, 0]\nnegate: yes\n", "negate: 'yes' is not a number"),
                            ("resolution: 1\norigin: [0, 0]\noccupied_thresh: 0.1\n", "free_thresh is 0.196, above occupied_thresh")):
            (self.folder / "map.yaml").write_text(keys + "image: b.png\n" * (keys[0] != "-" and keys[-2] != "["))
            with self.subTest(keys), self.assertRaisesRegex(ValueError, words):
                waymark.read_floor_plan(self.folder / "map.yaml")


class CanLogs(Folder):
    def frames(self, *lines):
        (self.folder / "recording.yaml").write_text("format: waymark-recording/1\nname: a\nstreams: [can.log]\n")
        (self.folder / "can.log").write_text("".join(line + "\n" for line in lines))
        return list(waymark.Recording(self.folder).can())

    def test_forms_of_a_line(self):
        got = self.frames("(2020-12-19 12:04:45.485261) received_messages 123#0102", "", "# a comment", "(1608379486) can0 00000123#R8 T",
                          "(1608379486.5) can0 123#0011223344556677_9", "(1608379487.000001) can0 123##1AABB")
        self.assertEqual([frame.t_ns for frame in got],
                         [1608379485485261000, 1608379486000000000, 1608379486500000000, 1608379487000001000])
        self.assertEqual([frame.interface for frame in got][:2], ["received_messages", "can0"])
        self.assertEqual([(frame.remote, frame.extended, frame.flags, len(frame.data)) for frame in got],
                         [(False, False, None, 2), (True, True, None, 0), (False, False, None, 8), (False, False, 1, 2)])

    def test_differences_are_summed_up(self):
        got = self.frames("(000.000000) can0 100#00", *("(000.010000) can0 100#00" for _ in range(20)))
        self.assertEqual([frame.t_ns for frame in got], [10_000_000 * i for i in range(21)])
        got = self.frames(*(f"(000.{10000 * i:06d}) can0 100#00" for i in range(20)))  # candump -tz
        self.assertEqual([frame.t_ns for frame in got], [10_000_000 * i for i in range(20)])


class CanDrives(Folder):
    """One drive on the CAN bus as the logs of several programs: 0.5 m/s for 20 s, of these 10 s at 0.2 rad/s."""

    DBC = """BO_ 257 SPEED: 4 X
 SG_ V : 0|16@1- (0.001,0) [0|0] "m/s" X
 SG_ COUNT : 16|16@1+ (1,0) [0|0] "" X
BO_ 258 TURN: 2 X
 SG_ W : 0|16@1- (0.001,0) [0|0] "rad/s" X
BO_ 259 OTHER: 1 X
 SG_ A : 0|8@1- (1,0) [0|0] "" X
"""
    SIGNALS = "- {quantity: vehicle_speed, message: SPEED, signal: V}\n- {quantity: yaw_rate, message: TURN, signal: W}\n"

    def frames(self):
        for i in range(2001):
            yield i * 10_000, 0x101, f"F401{i.to_bytes(2, 'little').hex().upper()}"
            yield i * 10_000 + 2_000, 0x102, "C800" if i >= 1000 else "0000"
            yield i * 10_000 + 4_000, 0x103, "00"

    def replay(self, lines, dbc=None, config="estimator: odometry\n", start=True):
        """x, y, heading at the end, and what was said."""
        for name, text in (("can.log", "".join(f"{line}\n" for line in lines)), ("vehicle.dbc", dbc or self.DBC), ("can-signals.yaml", self.SIGNALS),
                           ("recording.yaml", "format: waymark-recording/1\nname: a\n" + "vehicle: {initial_pose: {x_m: 0, y_m: 0, heading_rad: 0}}\n" * start),
                           ("robot.yaml", "format: waymark-config/1\n" + config)):
            (self.folder / name).write_text(text)
        shutil.rmtree(self.folder / "run", ignore_errors=True)
        done = subprocess.run([BIN / "waymark", "replay", self.folder, "--config", self.folder / "robot.yaml", "--out", self.folder / "run"],
                              capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        rows = (self.folder / "run/trajectory.tum").read_text().splitlines()
        end = [float(value) for value in rows[-1].split()] if rows else [np.nan] * 8
        return (end[1], end[2], 2 * np.arctan2(end[6], end[7])), done.stdout + done.stderr

    def assert_drive(self, lines, *words, **more):
        end, said = self.replay(lines, **more)
        for got, right in zip(end, (5 + 2.5 * np.sin(2), 2.5 * (1 - np.cos(2)), 2)):
            self.assertAlmostEqual(got, right, delta=0.01, msg=said)
        for word in words:
            self.assertIn(word, said)
        return said

    def lines(self, form="({s}.{us:06d}) can0 {id:03X}#{data}"):
        """The log's lines with their ids."""
        for us, name, data in self.frames():
            at = np.datetime64(T_S * 1_000_000 + us, "us")
            yield form.format(s=T_S + us // 1_000_000, us=us % 1_000_000, id=name, data=data, date=str(at).replace("T", " "),
                              bytes=bytes.fromhex(data).hex(" ").upper(), length=len(data) // 2)

    def test_what_candump_shows_with_a_time(self):
        for form in ("({s}.{us:06d}) can0 {id:03X}#{data}", " ({s}.{us:06d})  can0  {id:03X}   [{length}]  {bytes}", " ({date})  can0  {id:03X}   [{length}]  {bytes}",
                     " ({s}.{us:06d})  can0  RX - -  {id:03X}   [{length}]  {bytes}", " ({s}.{us:06d})  can0  {id:03X}   [{length}]  {bytes}   '..'"):
            with self.subTest(form):
                said = self.assert_drive(self.lines(form))
                self.assertNotIn("note", said)
                frames = list(waymark.Recording(self.folder).can())
                self.assertEqual((len(frames), frames[3].t_ns, frames[3].data), (6003, T_S * 10**9 + 10_000_000, bytes.fromhex("F4010100")))

    def test_lines_sorted_by_id_are_read_by_their_times(self):
        for key in (lambda line: line.split("#")[0].split()[-1], lambda line: line.split(maxsplit=2)[2]):  # sort -k3 compares the data, too
            self.assert_drive(sorted(self.lines(), key=key), "its lines are sorted by id: they are read in the order of their times")
            stamps = [frame.t_ns for frame in waymark.Recording(self.folder).can()]
            self.assertEqual(stamps, sorted(stamps))

    def test_a_clock_that_was_set_back_is_not_sorted(self):
        lines = list(self.lines())
        late = [line.replace(f"({T_S + 15}", f"({T_S + 7}") for line in lines]
        _, said = self.replay(late)
        self.assertNotIn("sorted", said)

    def test_of_two_messages_of_one_id_the_first_is_taken_with_a_note(self):
        self.assert_drive(self.lines(), "vehicle.dbc:8: BO_ SPEED has the id 0x101 of SPEED in line 1, which is taken",
                          dbc=self.DBC + 'BO_ 257 SPEED: 4 X\n SG_ V : 16|16@1- (0.001,0) [0|0] "m/s" X\n')
        self.assertNotIn("note", self.assert_drive(self.lines(), dbc=self.DBC + self.DBC))

    def test_dead_reckoning_without_a_start_is_named(self):
        end, said = self.replay(self.lines(), start=False)
        self.assertTrue(np.isnan(end[0]))
        self.assertIn("note: no start is known, and this estimator finds none", said)
        done = subprocess.run([BIN / "waymark", "check", self.folder / "robot.yaml", self.folder, "--quick"], capture_output=True, text=True, check=False)
        self.assertIn("start        unknown: no start is known, and this estimator finds none", done.stdout)
        self.assert_drive(self.lines(), start=False, config="estimator: odometry\ninitial_pose: {x_m: 0, y_m: 0, heading_rad: 0}\n")
        self.assertNotIn("no start", self.replay(self.lines(), config="estimator: landmark_ekf\n", start=False)[1])

    def test_rows_of_truth_without_a_position_are_counted(self):
        self.replay(self.lines())
        rows = "".join(f"{T_S * 10**9 + i * 10**8},{'nan' if 50 <= i < 60 else 0.05 * i},{'' if i == 70 else 0}\n" for i in range(100))
        (self.folder / "truth.csv").write_text("t_ns,x_m,y_m\n" + rows)
        for options, words in (((), "left out: 11 rows of truth.csv without a position"), (("--json",), '"truth_left_out": 11')):
            done = subprocess.run([BIN / "waymark-eval", self.folder / "run", self.folder, *options], capture_output=True, text=True, check=False)
            self.assertIn(words, done.stdout, done.stderr)


class Checked(Folder):
    """What `check` makes of two motion sensors on a drive of a minute at 1 m/s, of which it turns at 0.3 rad/s from 20 to 25 s."""

    T = np.arange(6001) / 100
    TURN = np.where((T >= 20) & (T < 25), 0.3, 0.0)

    def findings(self, files, more="", wheels="{radius_m: 0.1, ticks_per_turn: 4096, track_m: 0.5}"):
        (self.folder / "robot.yaml").write_text(f"format: waymark-config/1\nestimator: odometry\ninitial_pose: {{x_m: 0, y_m: 0, heading_rad: 0}}\n{more}")
        (self.folder / "calibration.yaml").write_text(f"wheels: {wheels}\n")
        (self.folder / "recording.yaml").write_text("format: waymark-recording/1\nname: a\n")
        for name in ("motion.csv", "imu.csv", "ticks.csv"):
            (self.folder / name).unlink(missing_ok=True)
        for name, table in files.items():
            waymark.write_table(self.folder / name, table)
        done = subprocess.run([BIN / "waymark", "check", self.folder / "robot.yaml", self.folder, "--quick", "--json"], capture_output=True, text=True, check=False)
        return [(one["severity"], one["about"], one["text"], one["fix"]) for one in json.loads(done.stdout)["findings"] if one["severity"] != "note"]

    def stamps(self, rate=1.0):
        return T_S * 10**9 + np.round(self.T * rate * 1e9).astype(np.int64)

    def imu(self, turn, noise=0.002, rate=1.0):
        chance = np.random.default_rng(7)
        wx, wy, wz = chance.normal(size=(3, len(self.T))) * noise
        return {"t_ns": self.stamps(rate), "wx_radps": wx, "wy_radps": wy, "wz_radps": turn + wz}

    def motion(self, turn):
        return {"t_ns": self.stamps(), "v_mps": np.ones_like(self.T), "w_radps": turn}

    def ticks(self, turn, signs=(1, 1), speed=1.0):
        counts = [np.round(sign * np.cumsum(np.concatenate([[0], (speed + side * turn * 0.25)[:-1]])) * 0.01 * 4096 / (2 * np.pi * 0.1)).astype(np.int64)
                  for sign, side in zip(signs, (-1, 1))]
        return {"t_ns": self.stamps(), "left": counts[0], "right": counts[1]}

    def test_a_gyro_that_is_far_noisier_than_configured(self):
        """0.3 rad/s at 100 Hz is a density of 0.03 rad/s per sqrt(s); 0.004 is the default of a gyro."""
        for turn in (self.TURN, 0 * self.TURN, 0.3 * np.sin(self.T / 3)):
            drive = {"motion.csv": self.motion(turn), "imu.csv": self.imu(turn, 0.3)}
            (found,) = self.findings(drive)
            self.assertRegex(found[2], r"wz_radps of imu has a white noise of 0.0(2[4-9]|3\d*) rad/s per sqrt\(s\), [6-9]\.\d times as much as is configured \(0.004\)")
            self.assertRegex(found[3], r"motion: \{noise: \{yaw_rate_radps: 0.0[23]")
            self.assertEqual(self.findings(drive, "motion: {noise: {yaw_rate_radps: 0.03}}\n"), [])
            self.assertEqual(self.findings({**drive, "imu.csv": self.imu(turn, 0.05)}), [])
            shaken = self.imu(turn)
            shaken["wz_radps"] = shaken["wz_radps"] + 0.5 * np.sin(2 * np.pi * 13.7 * self.T)  # an engine: the heading stays
            self.assertEqual(self.findings({**drive, "imu.csv": shaken}), [])

    def test_a_clock_that_runs_with_one_turn(self):
        for rate in (1.02, 0.98):
            (found,) = self.findings({"motion.csv": self.motion(self.TURN), "imu.csv": self.imu(self.TURN, rate=rate)})
            self.assertRegex(found[2], f"its clock runs 2 % {'fast' if rate > 1 else 'slow'} .* against that of motion")
        longer = self.imu(self.TURN)
        longer["t_ns"] = longer["t_ns"] + np.where(self.T > 50, (self.T - 50) * 2e8, 0).astype(np.int64)  # two seconds more of it, without a delay
        self.assertEqual(self.findings({"motion.csv": self.motion(self.TURN), "imu.csv": longer}), [])

    def test_a_wheel_that_counts_backwards(self):
        for signs, wheel in (((-1, 1), "left"), ((1, -1), "right")):
            for turn in (self.TURN, 0 * self.TURN):
                (found,) = self.findings({"ticks.csv": self.ticks(turn, signs)})
                self.assertIn("its wheels turn against each other on 100 % of their way", found[2])
                self.assertEqual(found[3], f"ticks.csv: {wheel} times -1, or the other one")
        self.assertEqual(self.findings({"ticks.csv": self.ticks(self.TURN)}), [])
        self.assertEqual(self.findings({"ticks.csv": self.ticks(self.TURN, (-1, -1))}), [])
        spin = np.full_like(self.T, 2.0)  # on the spot, as the gyro shows
        self.assertEqual(self.findings({"ticks.csv": self.ticks(spin, speed=0.0), "imu.csv": self.imu(spin)}), [])


class FirstDrives(Folder):
    """`waymark init` of a boat's log: what it writes drives that log, or it states what is missing."""

    def log(self, rate=False, positions=False):
        """20 s of heading and speed through the water by NMEA 2000, with a rate of turn and positions."""
        word = lambda value, size=2: int(round(value)).to_bytes(size, "little", signed=size == 4).hex().upper()  # noqa: E731
        lines = []
        for k in range(200):
            at = f"({T_S + k / 10:.6f}) can0 "
            lines += [f"{at}09F11223#00{word(10000 + 20 * k)}FF7FFF7FFD", f"{at}09F50323#00{word(200 + 50 * np.sin(k / 20))}FFFF00FFFF"]
            lines += [f"{at}09F11323#00{word(-0.1 * np.sin(k / 30) / 3.125e-8, 4)}FFFFFF"] if rate else []
            lines += [f"{at}09F80101#{word(525000000 + 20 * k, 4)}{word(133000000 + 5 * k, 4)}"] if positions else []
        path = self.folder / "boat.log"
        path.write_text("\n".join(lines) + "\n")
        return path

    def init(self, *options, **of_log):
        done = subprocess.run([BIN / "waymark-init", self.folder / "boat", "--can-log", self.log(**of_log), "--yes", "--force", *options],
                              capture_output=True, text=True, check=False)
        return done.returncode, done.stdout + done.stderr

    def drives(self):
        return subprocess.run([BIN / "waymark", "replay", self.folder / "boat/first-drive", "--config", self.folder / "boat/robot.yaml", "--out", self.folder / "run"],
                              capture_output=True, text=True, check=False)

    def test_a_drive_that_lacks_something_is_named_at_once(self):
        for options in ((), ("--imu",)):  # an IMU that sends live is not in the log
            code, said = self.init(*options)
            self.assertEqual(code, 1, said)
            self.assertRegex(said, "the drive can't be driven with them: .*yaw_rate.*--stream")
        gyro = self.folder / "imu.csv"
        gyro.write_text("t_ns,wx_radps,wy_radps,wz_radps\n" + "".join(f"{T_S * 10**9 + k * 10**8},0,0,0.01\n" for k in range(200)))
        code, said = self.init("--imu", "--stream", gyro)
        self.assertEqual((code, self.drives().returncode), (0, 0), said)

    def test_positions_drive_where_nothing_turns(self):
        for rate in (False, True):
            code, said = self.init(rate=rate, positions=True)
            self.assertEqual(code, 0, said)
            self.assertEqual("motion.model constant_velocity" in said, not rate)
            done = self.drives()
            self.assertEqual(done.returncode, 0, done.stderr)
            shutil.rmtree(self.folder / "run")


if __name__ == "__main__":
    unittest.main()
