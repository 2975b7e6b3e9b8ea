#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""`waymark import`: bags as they lie about. The same drive comes out of each container; what is cut or damaged is read as far as it goes.

    test_bag_containers.py BIN_DIR"""

import bz2
import gzip
import lzma
import re
import shutil
import sqlite3
import struct
import subprocess
import tarfile
import unittest

import lz4.frame
import numpy as np
import yaml
import zstandard
from bag_files import BIN, M, START_NS, BagTest, Events, as_ros1, imported, write_mcap
from mcap.writer import CompressionType, IndexType
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import StoragePlugin
from rosbags.typesys import Stores, get_typestore

import waymark
from waymark.bag import command

COUNT = 40


def zstd(data):
    return zstandard.ZstdCompressor().compress(data)


class Whole(BagTest):
    """Containers that have all of the drive."""

    def setUp(self):
        super().setUp()
        self.events = Events().drive(COUNT)

    def check(self, path, rows=COUNT, out="out"):
        text, folder = self.take(path, out=out)
        motion = waymark.Recording(folder).table("motion.csv")
        self.assertEqual(len(motion["t_ns"]), rows, text)
        self.assertEqual(motion["t_ns"].tolist(), [START_NS + i * 50_000_000 for i in range(rows)])
        np.testing.assert_array_equal(motion["v_mps"], 0.5)
        return text

    def test_each_way_of_writing_it(self):
        f = self.folder
        whole = self.events.mcap(f / "a.mcap").read_bytes()
        database = next(self.events.folder(f / "sqlite", StoragePlugin.SQLITE3).glob("*.db3"))
        split = f / "split"
        split.mkdir()
        for part in (0, 1, 2, 10):  # in the order of numbers, not of letters
            half = Events()
            half.items = self.events.items[10 * min(part, 3) : 10 * min(part, 3) + 10]
            half.mcap(split / f"drive_{part}.mcap")
        ways = {
            "uncompressed": self.events.mcap(f / "b.mcap", CompressionType.NONE),
            "lz4": self.events.mcap(f / "c.mcap", CompressionType.LZ4),
            "no chunks": self.events.mcap(f / "d.mcap", chunking=False),
            "no index, no summary": self.events.mcap(f / "e.mcap", use_statistics=False, use_summary_offsets=False, repeat_channels=False,
                                                     repeat_schemas=False, index_types=IndexType.NONE),
            "messages compressed": self.events.mcap(f / "f.mcap", encode=zstd),
            "renamed": shutil.copy(f / "a.mcap", f / "drive.bin"),
            "renamed to another kind": shutil.copy(f / "a.mcap", f / "drive.db3"),
            "ROS 1": self.events.ros1(f / "g.bag"),
            "ROS 1, bz2": self.events.ros1(f / "h.bag", Ros1Writer.CompressionFormat.BZ2),
            "ROS 1, lz4": self.events.ros1(f / "i.bag", Ros1Writer.CompressionFormat.LZ4),
            "split": split,
        }
        for ending, pack in ((".zstd", zstd), (".zst", zstd), (".gz", gzip.compress), (".bz2", bz2.compress), (".xz", lzma.compress),
                             (".lz4", lz4.frame.compress)):
            ways[ending] = f / f"packed.mcap{ending}"
            ways[ending].write_bytes(pack(whole))
        ways["pzstd"] = f / "parallel.mcap.zst"  # begins with a frame that holds nothing
        ways["pzstd"].write_bytes(b"\x50\x2a\x4d\x18\x04\0\0\0" + bytes(4) + zstd(whole[:5000]) + zstd(whole[5000:]))
        ways["database packed"] = f / "drive.db3.zstd"
        ways["database packed"].write_bytes(zstd(database.read_bytes()))
        for name, path in ways.items():
            with self.subTest(name):
                self.check(path, out=f"out-{name}")

    def test_folders(self):
        for name in ("no metadata", "no identifier", "renamed", "metadata is none", "packed", "packed and unpacked", "a folder around it"):
            for plugin in (StoragePlugin.MCAP, StoragePlugin.SQLITE3):
                with self.subTest(name, plugin=plugin.name):
                    folder = self.events.folder(self.folder / f"{name} {plugin.name}", plugin)
                    meta, (file,) = folder / "metadata.yaml", [p for p in folder.iterdir() if p.name != "metadata.yaml"]
                    if name in ("no metadata", "a folder around it"):
                        meta.unlink()
                    elif name == "no identifier":
                        meta.write_text(meta.read_text().replace("storage_identifier: mcap", 'storage_identifier: ""').replace("sqlite3", '""'))
                        self.assertIn('""', meta.read_text())
                    elif name == "renamed":
                        file.rename(file.with_name("another" + file.suffix))
                    elif name == "metadata is none":
                        meta.write_text("rosbag2_bagfile_information: [\n")
                    elif name.startswith("packed"):
                        file.with_name(file.name + ".zstd").write_bytes(zstd(file.read_bytes()))
                        if name == "packed":
                            file.unlink()
                        else:
                            meta.unlink()
                    if name == "a folder around it":
                        (self.folder / f"around {plugin.name}").mkdir()
                        folder = folder.rename(self.folder / f"around {plugin.name}" / "inner").parent
                    text = self.check(folder, out=f"out-{name}-{plugin.name}")
                    if name in ("no metadata", "metadata is none", "renamed"):
                        self.assertIn("metadata.yaml", text)

    def test_ros_1_in_mcap(self):
        store = get_typestore(Stores.ROS1_NOETIC)
        kind = "nav_msgs/msg/Odometry"
        definition = store.generate_msgdef(kind, ros_version=1)[0].encode()
        self.check(write_mcap(self.folder / "ros1.mcap", (
            (log_ns, "/odom", "ros1", "nav_msgs/Odometry", "ros1msg", definition, bytes(store.serialize_ros1(as_ros1(message, kind, store), kind)))
            for log_ns, _, _, message in self.events.items), "ros1"))

    def test_what_lies_in_the_write_ahead_file_is_read(self):
        (path,) = self.events.folder(self.folder / "bag", StoragePlugin.SQLITE3).glob("*.db3")
        database = sqlite3.connect(path)
        database.execute("PRAGMA journal_mode=WAL")
        (kept,) = database.execute("SELECT COUNT(*) FROM messages").fetchone()
        rows = database.execute("SELECT * FROM messages ORDER BY timestamp DESC LIMIT 15").fetchall()
        database.execute("DELETE FROM messages WHERE timestamp >= ?", (min(row[2] for row in rows),))
        database.commit()
        database.execute("PRAGMA wal_checkpoint(TRUNCATE)")
        database.executemany(f"INSERT INTO messages VALUES ({','.join('?' * len(rows[0]))})", rows)
        database.commit()
        alone = self.folder / "killed"  # as a recorder leaves it that was killed: both files, and nothing merged
        alone.mkdir()
        for ending in ("", "-wal"):
            shutil.copy(f"{path}{ending}", alone / f"drive.db3{ending}")
        database.close()
        self.assertGreater((alone / "drive.db3-wal").stat().st_size, 0)
        before = {file.name: file.read_bytes() for file in alone.iterdir()}
        self.check(alone, rows=kept)
        self.assertEqual({file.name: file.read_bytes() for file in alone.iterdir()}, before)
        (alone / "drive.db3-wal").unlink()
        self.check(alone, rows=kept - 15, out="without")


class Cut(BagTest):
    """Containers of which a part is missing."""

    def setUp(self):
        super().setUp()
        self.events = Events().drive(400)

    def rows(self, path, out):
        text, folder = self.take(path, out=out)
        t = waymark.Recording(folder).table("motion.csv")["t_ns"]
        if ".db3" in out:  # pages of a database are not in the order of its rows
            self.assertLessEqual(set(t.tolist()), {START_NS + i * 50_000_000 for i in range(400)})
        else:
            self.assertEqual(t.tolist(), [START_NS + i * 50_000_000 for i in range(len(t))])
        return text, len(t)

    def test_a_file_that_is_cut_is_read_up_to_the_cut(self):
        whole = {"one chunk.mcap": self.events.mcap(self.folder / "g", CompressionType.NONE, 1 << 24), "zstd.mcap": self.events.mcap(self.folder / "a", CompressionType.ZSTD, 1 << 15), "lz4.mcap": self.events.mcap(
            self.folder / "b", CompressionType.LZ4, 1 << 15), "plain.mcap": self.events.mcap(self.folder / "c", CompressionType.NONE),
            "loose.mcap": self.events.mcap(self.folder / "d", chunking=False), "ros1.bag": self.events.ros1(self.folder / "e"),
            "bz2.bag": self.events.ros1(self.folder / "f", Ros1Writer.CompressionFormat.BZ2),
            "x.db3": next(self.events.folder(self.folder / "h", StoragePlugin.SQLITE3).glob("*.db3"))}
        for name, path in whole.items():
            data = path.read_bytes()
            least = {"bz2.bag": 0}.get(name, 1)  # one chunk of bz2 is one block: nothing of it can be had
            for share in (0.5, 0.7, 0.98):
                with self.subTest(name, share=share):
                    cut = self.folder / f"{share}-{name}"
                    cut.write_bytes(data[: int(share * len(data))])
                    if not least and share < 0.9:
                        code, text = imported(cut, "--out", self.folder / f"out-{share}-{name}")
                        self.assertIn(code, (0, 1))
                        continue
                    text, count = self.rows(cut, f"out-{share}-{name}")
                    self.assertGreater(count, 0.8 * 400 * (share - 0.25), text)
                    if count < 400:  # else the index alone is missing
                        self.assertRegex(text, "read up to there|without its end|is cut|damaged or cut")

    def test_a_packed_file_that_is_cut(self):
        packed = self.folder / "a.mcap.zstd"
        packed.write_bytes(zstd(self.events.mcap(self.folder / "a.mcap", CompressionType.NONE).read_bytes()))
        packed.write_bytes(packed.read_bytes()[:-2000])
        text, count = self.rows(packed, "out")
        self.assertGreater(count, 50, text)
        self.assertRegex(text, "is damaged or cut|without its end")

    def test_a_damaged_part_costs_that_part(self):
        path = self.events.mcap(self.folder / "a.mcap", CompressionType.ZSTD, 1 << 14)
        data = bytearray(path.read_bytes())
        data[len(data) // 3 : len(data) // 3 + 400] = bytes(400)
        path.write_bytes(bytes(data))
        text, folder = self.take(path)
        t = waymark.Recording(folder).table("motion.csv")["t_ns"]
        self.assertGreater(len(t), 200, text)
        self.assertLess(len(t), 400)
        self.assertEqual(t[-1], START_NS + 399 * 50_000_000)  # what follows the damage is there
        self.assertRegex(text, "damaged|left out")

    def test_wrong_checksums_are_named(self):
        path = self.events.mcap(self.folder / "a.mcap", CompressionType.NONE, 1 << 14)
        data = bytearray(path.read_bytes())
        at = data.index(np.float64(0.5).tobytes(), len(data) // 4)
        data[at + 2] ^= 1
        path.write_bytes(bytes(data))
        text, _ = self.take(path)
        self.assertIn("1 of its chunks differ from their checksums", text)


class Parts(BagTest):
    """A split bag: parts of 5 s each, of which some are missing, lie elsewhere or are listed in another order."""

    def split(self, name, has_times=True, order=(0, 1, 2, 3), where="", anew=0.0):
        """Four parts and their metadata.yaml, as rosbag2 writes it now, or without the parts' times as before; None: without. `anew`: how far back the
        odometry of the last part begins."""
        folder, whole, files = self.folder / name, Events().drive(400), []
        folder.mkdir()
        for k in range(4):
            part = Events()
            part.items = whole.items[100 * k:100 * k + 100]
            for _, _, _, message in part.items if k == 3 else []:
                message.pose.pose.position.x -= anew
            part.mcap(folder / f"drive_{k}.mcap")
            files.append({"path": f"drive_{k}.mcap", "starting_time": {"nanoseconds_since_epoch": part.items[0][0]},
                          "duration": {"nanoseconds": part.items[-1][0] - part.items[0][0]}, "message_count": 100})
        about = {"relative_file_paths": [f"{where}drive_{k}.mcap" for k in order]} | ({"files": [files[k] for k in order]} if has_times else {})
        if has_times is not None:
            (folder / "metadata.yaml").write_text(yaml.safe_dump({"rosbag2_bagfile_information": about}))
        return folder

    def rows(self, folder):
        text, out = self.take(folder, out=f"out-{folder.name}")
        return text, waymark.Recording(out).table("motion.csv")["t_ns"].tolist()

    def test_a_missing_part_is_named_with_its_span(self):
        listed, open_ = "drive_{} is not there; the 4.95 s {} are missing (100 messages)", "drive_2 is not there; the 5.05 s from 9.95 s on are missing"
        for name, gone, has_times, says in (("listed", (2,), True, listed.format(2, "from 10.00 s on")), ("last", (3,), True, listed.format(3, "from 15.00 s on")),
                                            ("first", (0,), True, listed.format(0, "that begin 5.00 s before the first message")),
                                            ("without times", (2,), False, open_), ("by the numbers", (2,), None, open_),
                                            ("first by the numbers", (0,), None, "drive_0 is not there; what was recorded before the first part"),
                                            ("two in a row", (1, 2), True, "drive_1, drive_2, 2 parts, are not there; the 9.95 s from 5.00 s on are missing (200 messages)")):
            with self.subTest(name):
                folder = self.split(name, has_times, anew=2.5)  # poses that go on as if no time had passed are no clock that was set
                for k in gone:
                    (folder / f"drive_{k}.mcap").unlink()
                text, t = self.rows(folder)
                self.assertEqual(len(t), 400 - 100 * len(gone))
                self.assertIn(says, text.replace(".mcap", ""))
                self.assertNotRegex(text, "clock was set|all bags of the folder")

    def test_a_part_that_is_none_is_named_with_its_span(self):
        for name, content in (("empty", b""), ("junk", b"no bytes of a bag\n" * 100)):
            folder = self.split(name)
            (folder / "drive_2.mcap").write_bytes(content)
            text, t = self.rows(folder)
            self.assertEqual(len(t), 300)
            self.assertRegex(text, r"drive_2\.mcap is .*; the 4\.95 s from 10\.00 s on are missing")

    def test_another_order_and_another_folder(self):
        below, files = self.split("below", where="there/"), self.split("files", where="../files/")
        (below / "there").mkdir()
        for k in range(4):
            (below / f"drive_{k}.mcap").rename(below / "there" / f"drive_{k}.mcap")
        (self.folder / "beside").mkdir()
        (files / "metadata.yaml").rename(self.folder / "beside" / "metadata.yaml")
        for folder in (self.split("order", True, (2, 0, 3, 1)), self.split("order before", False, (2, 0, 3, 1)), self.split("moved", where="there/"), below,
                       self.folder / "beside"):
            text, t = self.rows(folder)
            self.assertEqual(t, [START_NS + i * 50_000_000 for i in range(400)], text)
            self.assertNotIn("metadata.yaml", text)


class Shown(BagTest):
    def test_a_long_import_shows_its_share_in_a_pipe(self):
        path = Events().drive(2000).mcap(self.folder / "a.mcap")
        every, command._LINE_EVERY_S = command._LINE_EVERY_S, 0.0
        self.addCleanup(setattr, command, "_LINE_EVERY_S", every)
        text, _ = self.take(path)
        shares = [int(share) for share in re.findall(r"^waymark import: (\d+) %, \d+ s left$", text, re.M)]
        self.assertGreater(len(shares), 4)
        self.assertEqual(shares, sorted(shares))
        self.assertGreater(shares[-1], 70)


class Refused(BagTest):
    """What is no bag: one sentence, and what to do."""

    def test_it_is_said_in_our_words(self):
        f = self.folder
        (f / "empty.mcap").write_bytes(b"")
        (f / "text.bag").write_text("these are no bytes of a bag\n")
        (f / "zeros.db3").write_bytes(bytes(5000))
        (f / "magic.mcap").write_bytes(b"\x89MCAP0\r\n")
        (f / "short.db3").write_bytes(b"SQLite format 3\0" + bytes(80))
        (f / "ros1.bag").write_bytes(b"#ROSBAG V2.0\n")
        (f / "old.bag").write_bytes(b"#ROSBAG V1.2\n" + bytes(100))
        (f / "junk.zst").write_bytes(zstd(b"not a bag, but packed"))
        (f / "cut.zst").write_bytes(zstd(b"packed and cut" * 1000)[:15])
        (f / "pointer.bag").write_bytes(b"version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 1\n")
        (f / "page.mcap").write_bytes(b"<!DOCTYPE html><html></html>")
        (f / "bag.zip").write_bytes(b"PK\3\4" + bytes(60))
        (f / "drive.lcmlog").write_bytes(b"\xed\xa1\xda\x01" + bytes(60))
        with tarfile.open(f / "bag.tar.gz", "w:gz") as archive:
            archive.add(f / "text.bag", "drive.bag")
        (f / "nothing").mkdir()
        two = f / "two"
        for name in "ab":
            (two / name).mkdir(parents=True)
            Events().drive(3).mcap(two / name / "x.mcap")
        database = sqlite3.connect(f / "other.db3")
        database.execute("CREATE TABLE invoices (id INTEGER)")
        database.commit()
        database.close()
        for name, word in (("empty.mcap", "is empty"), ("text.bag", "is no bag"), ("zeros.db3", "is no bag"), ("magic.mcap", "without its end"),
                           ("short.db3", "rosbag2"), ("ros1.bag", "nothing"), ("old.bag", "format 2.0"), ("junk.zst", "is no bag"), ("cut.zst", "nothing of what it holds"),
                           ("pointer.bag", "git lfs pull"), ("page.mcap", "a web page"), ("bag.zip", "a zip archive"), ("drive.lcmlog", "a log of lcm-logger"), ("bag.tar.gz", "a tar archive"),
                           ("nothing", "no file in this folder"), ("two", "2 bags"), ("missing.mcap", "no such file"), ("other.db3", "rosbag2")):
            with self.subTest(name):
                text, out = self.take(f / name, code=1, out=f"out-{name}")
                self.assertIn(word, text)
                self.assertIn("waymark import: ", text)
                self.assertFalse(out.exists())
                self.assertNotRegex(text, r"Error|Exception|errno|sqlite3\.|rosbags|object at|<_io")

    def test_the_command_knows_a_bag_by_its_content(self):
        Events().drive(3).mcap(self.folder / "drive.bin")
        (self.folder / "holds one").mkdir()
        shutil.copy(self.folder / "drive.bin", self.folder / "holds one" / "a.mcap")
        (self.folder / "p.zstd").write_bytes(zstd((self.folder / "drive.bin").read_bytes()))
        (self.folder / "alone").mkdir()
        shutil.copy(BIN / "waymark-import", self.folder / "alone")
        for name in ("drive.bin", "holds one", "p.zstd"):
            # The Python package's program is beside it; where it is not, and not on the path, the command says that it would read the bag.
            for program, code, words in ((BIN, 0, ""), (self.folder / "alone", 1, "bags are read by the Python package")):
                done = subprocess.run([program / "waymark-import", self.folder / name, "--out", self.folder / f"{name} of {code}"], capture_output=True, text=True,
                                      check=False, env={"PATH": "/nowhere"})
                self.assertEqual(done.returncode, code, done.stderr)
                self.assertIn(words, done.stderr, name)
            self.assertTrue((self.folder / f"{name} of 0/motion.csv").is_file(), name)


class Messages(BagTest):
    """One bad message costs one message, one bad topic a topic."""

    def test_a_message_whose_bytes_are_none_costs_itself(self):
        events = Events().drive(20)
        count = 0

        def encode(data):
            nonlocal count
            count += 1
            return {5: data[:40], 9: b"", 12: data + bytes(50)}.get(count, data)

        for compression in (CompressionType.NONE, CompressionType.ZSTD):
            count = 0
            text, folder = self.take(events.mcap(self.folder / "a.mcap", compression, encode=encode), out=f"out-{compression.name}")
            self.assertEqual(len(waymark.Recording(folder).table("motion.csv")["t_ns"]), 17)
            self.assertIn("note: /odom: 3 of 20 messages are left out; the first at 1700000000.203 s: its 40 bytes are no nav_msgs/msg/Odometry", text)

    def test_a_message_whose_log_is_beyond_all_stamps_costs_itself(self):
        events = Events().drive(20)
        for i, log_ns in ((5, 4_100_000_000_000_000_000), (9, 2**63 - 1), (12, 2**63)):
            events.items[i] = (log_ns, *events.items[i][1:])
        text, folder = self.take(events.mcap(self.folder / "a.mcap"))
        self.assertEqual(len(waymark.Recording(folder).table("motion.csv")["t_ns"]), 17, text)
        self.assertIn("3 of 20 messages are left out", text)
        self.assertIn("the bag's log has no time for it", text)

    def test_messages_in_the_second_version_of_cdr(self):
        """Packed by hand: numbers of 8 bytes begin at multiples of 4, in the delimited form a length stands before each structure."""
        plain = "iiI5s3xI10s2x3d4d36d3d3d36d"
        delimited = "4x4x4xiiI5s3xI10s2x4x4x4x3d4x4d36d4x4x4x3d4x3d36d"
        for begin, codes in ((b"\0\x06", ">" + plain), (b"\0\x07", "<" + plain), (b"\0\x08", ">" + delimited), (b"\0\x09", "<" + delimited)):
            def encode(data, begin=begin, codes=codes):
                whole = M.store.deserialize_cdr(data, "nav_msgs/msg/Odometry")
                stamp = whole.header.stamp
                return begin + b"\0\0" + struct.pack(codes, stamp.sec, stamp.nanosec, 5, b"odom", 10, b"base_link", whole.pose.pose.position.x, *[0] * 5, 1,
                                                     *[0] * 36, whole.twist.twist.linear.x, *[0] * 41)

            with self.subTest(begin=begin):
                text, folder = self.take(Events().drive(20).mcap(self.folder / "a.mcap", encode=encode), out=f"out-{begin.hex()}")
                self.assertNotIn("left out", text)
                table = waymark.Recording(folder).table("motion.csv")
                self.assertEqual((len(table["t_ns"]), set(table["v_mps"])), (20, {0.5}))

    def test_lists_in_the_second_version_of_cdr(self):
        """Of structures, with a length before them: tags with their corners, packed by hand."""
        corners = [10.0, 30.0, 30.0, 30.0, 30.0, 10.0, 10.0, 10.0]

        def encode(data):
            stamp = M.store.deserialize_cdr(data, "apriltag_msgs/msg/AprilTagDetectionArray").header.stamp
            return b"\0\x07\0\0" + struct.pack("<iiI6s2x4xII9s3xiiff2d4x8d9d", stamp.sec, stamp.nanosec, 6, b"front", 1, 9, b"tag36h11", 7, 0, 0, 0, 20, 20,
                                                *corners, *[0] * 9)

        tags = Events()
        for i in range(5):
            tags.tags("/detections", START_NS + i * 50_000_000, "front", np.reshape(corners, (4, 2)))
        first, second = (self.take(tags.mcap(self.folder / "a.mcap", encode=way), out=name)[1] for name, way in (("1", bytes), ("2", encode)))
        self.assertEqual(*(next(folder.glob("marker-corners*.csv")).read_text() for folder in (first, second)))

    def test_a_parameter_list_and_the_cut_second_version_are_named(self):
        for begin, end, words in ((b"\0\x0b", None, "all 20 messages are bad; at 1700000000.003 s: it is a list of parameters (PL_CDR)"),
                                  (b"\0\x07", -40, "bytes are no nav_msgs/msg/Odometry")):
            text, _ = self.take(Events().drive(20).mcap(self.folder / "a.mcap", encode=lambda data, begin=begin, end=end: begin + data[2:end]), code=1)
            self.assertIn(words, text)

    def test_topics_that_cant_be_read_cost_themselves(self):
        kind = "nav_msgs/msg/Odometry"
        ways = {"/good": ("cdr", kind, "ros2msg", M.definition(kind)), "/protobuf": ("protobuf", kind, "protobuf", b"\0\1"),
                "/json": ("json", kind, "jsonschema", b"{}"), "/unknown": ("cdr", "my_msgs/msg/Pose7", "ros2msg", b"float63 x[[[\n"),
                "/no_schema": ("cdr", "", "", b"")}
        text, folder = self.take(write_mcap(self.folder / "a.mcap", (
            (log_ns, topic, *way, M.encode(message, kind)) for topic, way in ways.items() for log_ns, _, _, message in Events().drive(5).items)))
        self.assertEqual(len(waymark.Recording(folder).table("motion.csv")["t_ns"]), 5)
        for topic in ("/protobuf", "/json", "/unknown", "/no_schema"):
            self.assertIn(f"not taken: {topic}: ", text)
        self.assertIn("encoded as 'protobuf'", text)


if __name__ == "__main__":
    unittest.main()
