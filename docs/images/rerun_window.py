#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Makes docs/images/rerun.png: an exported run in the window of Rerun's viewer, with map, robot, way, particles and picture.

    rerun_window.py RUN.mcap SECONDS OUT.png    the run until then; a display has to be there (Xvfb is one), and ImageMagick

The Python is one with tests/judges/viewer.txt (`pip install --require-hashes -r`). The run of the picture is corridor-a's:
    waymark replay RECORDING --config config/datasets/corridor-particles.yaml --out run
    waymark export run --recording RECORDING --pictures --mcap run.mcap"""
import pathlib
import subprocess
import sys
import tempfile

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from mcap.reader import make_reader
from mcap.writer import Writer
from mcap_ros2.decoder import DecoderFactory

SIZE = "1400x800"  # points of the window; the picture has twice as many pixels on some displays
COLOURS = 1 << 6  # of the PNG: enough for grey pictures and few colours, and a small file


def cut(file, seconds, out):
    """The first seconds of a file: the viewer stands at the end of what it gets."""
    with open(file, "rb") as stream, open(out, "wb") as copy:
        writer, channels, first_ns = Writer(copy), {}, None
        writer.start(profile="ros2")
        for schema, channel, message in make_reader(stream).iter_messages():
            first_ns = first_ns or message.log_time
            if message.log_time > first_ns + seconds * 1e9:
                break
            if channel.id not in channels:
                channels[channel.id] = writer.register_channel(
                    channel.topic, channel.message_encoding, writer.register_schema(schema.name, schema.encoding, schema.data))
            writer.add_message(channels[channel.id], message.log_time, message.data, message.publish_time)
        writer.finish()


def read(file, topic):
    """The last message of a topic."""
    with open(file, "rb") as stream:
        for _, _, _, message in make_reader(stream, decoder_factories=[DecoderFactory()]).iter_decoded_messages(topics=[topic], reverse=True):
            return message
    raise SystemExit(f"{file}: no {topic} in it")


def layout(file):
    """The map with robot and way at the left; particles from near and the picture at the right."""
    at, grid = read(file, "/waymark/pose").pose.pose.position, read(file, "/map").info
    robot = np.array([at.x, at.y, 0.0])
    size = np.array([grid.width, grid.height]) * grid.resolution
    middle = np.array([grid.origin.position.x, grid.origin.position.y, 0.0]) + (*size / 2, 0.0)

    def points(colour, radius):
        return rr.Points3D.from_fields(colors=colour, radii=radius)

    def view(name, target, away, contents, overrides):
        return rrb.Spatial3DView(name=name, origin="/", contents=contents, overrides=overrides, line_grid=False,
                                 spatial_information=rrb.SpatialInformation("map"),
                                 eye_controls=rrb.EyeControls3D(position=tuple(target + away), look_target=tuple(target), eye_up=(0, 0, 1)))

    way = {"/waymark/path/points": points([60, 140, 255], 0.1), "/waymark/particles/points": points([255, 140, 0], 0.3)}
    whole = view("Map, way and robot", middle, np.array([0.0, -0.45, 0.75]) * size.max(), ["/map", "/waymark/path/**", "/waymark/particles/**"], way)
    near = view("Particles and robot", robot, np.array([-0.25, -0.25, 0.3]), ["/map", "/tf", "/waymark/particles/**"],
                {"/waymark/particles/points": points([255, 140, 0], 0.003), "/tf": rr.TransformAxes3D(0.1)})
    picture = rrb.Spatial2DView(name="Camera", origin="/camera/front/image/compressed", contents="/camera/front/image/compressed")
    return rrb.Blueprint(rrb.Horizontal(whole, rrb.Vertical(near, picture), column_shares=[3, 2]),
                         rrb.TimePanel(state="collapsed", timeline="message_log_time", play_state="following"),
                         rrb.SelectionPanel(state="collapsed"), rrb.BlueprintPanel(state="collapsed"), auto_views=False)


def main():
    given, seconds, out = sys.argv[1:]
    viewer = pathlib.Path(sys.executable).with_name("rerun")
    with tempfile.TemporaryDirectory(prefix="waymark-rerun-") as folder:
        file, made, run, blueprint, shot = (pathlib.Path(folder) / name for name in (
            "run.mcap", "made.rrd", "run.rrd", "layout.rbl", "shot.png"))
        cut(given, float(seconds), file)
        subprocess.run([viewer, "mcap", "convert", file, "-o", made, "--application-id", "waymark"], check=True)
        subprocess.run([viewer, "rrd", "optimize", made, "-o", run], check=True)  # else it is not loaded when the picture is taken
        layout(file).save("waymark", blueprint)
        subprocess.run([viewer, "--bind", "127.0.0.1", "--port", "0", "--window-size", SIZE, "--screenshot-to", shot, run, blueprint], check=True,
                       timeout=300)
        subprocess.run(["convert", shot, "-resize", SIZE, "-colors", str(COLOURS), f"PNG8:{out}"], check=True)


if __name__ == "__main__":
    main()
