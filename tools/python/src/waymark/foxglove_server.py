# SPDX-License-Identifier: Apache-2.0
"""`waymark watch --foxglove PORT`: a run as it goes for Foxglove, with the topics of an exported run."""

import argparse
import queue
import shutil
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import foxglove
import yaml
from foxglove.websocket import ServerListener

from .documents import read_yaml
from .lcm_types import load
from .live import Live
from .live_pictures import WebPictures, picture_items
from .mcapio import place, streams
from .mcapio.estimates import topic_name
from .mcapio.streaming import SIGHTINGS, TOPICS, LiveItems
from .mcapio.writer import Item, is_latched
from .numbers import finite
from .ros import Messages
from .tables import read_table

_OFFER_AGAIN_S = 1.0  # a viewer subscribes within milliseconds
LAYOUT = Path(__file__).with_name("foxglove-layout.json")
_EXAMPLES = """examples:
  waymark watch --foxglove 8765 --config /etc/waymark/robot.yaml
  waymark watch --foxglove 0.0.0.0:8765 --config config/datasets/corridor.yaml --recording recordings/drive

In Foxglove: Open connection, ws://localhost:8765; then import the layout that is printed at the start. A connection has no
password: without an address, this computer alone can connect. Exit code: 0 done, 1 the work failed, 2 usage."""


class FoxgloveServer(ServerListener):
    """Sends items to all viewers. What changes seldom is sent again to each one that subscribes later."""

    def __init__(self, messages: Messages, host: str, port: int, topics: dict[str, str] | None = None):
        """`topics` are offered from the start, with their types."""
        self._messages, self._context = messages, foxglove.Context()
        self._channels: dict[str, foxglove.Channel] = {}
        self._latched: dict[str, Item] = {}
        self._subscribed: queue.SimpleQueue[str] = queue.SimpleQueue()
        self._offered: dict[str, tuple[float, Item]] = {}
        self._has_started = False
        # Before the server: foxglove-sdk 0.30 tells viewers of a channel before it knows the channel itself, and refuses one that
        # subscribes in that instant (1 of 300 on one computer).
        for topic, kind in (TOPICS | (topics or {})).items():
            self._channel(topic, kind)
        try:
            self._server = foxglove.start_server(name="waymark", host=host, port=port, context=self._context, server_listener=self)
        except RuntimeError as error:
            reason = str(error).rpartition("bind port: ")[2]
            raise OSError(f"{host}:{port} can't be listened on: {reason}; --foxglove takes another port or address of this computer") from error
        self._has_started = True

    @property
    def port(self) -> int:
        """The port that it listens on."""
        return int(self._server.port)

    def on_subscribe(self, client: Any, channel: Any) -> None:
        """Of the server's thread."""
        self._subscribed.put(channel.topic)

    def _channel(self, topic: str, kind: str, metadata: dict[str, str] | None = None) -> foxglove.Channel:
        if topic not in self._channels:
            schema = foxglove.Schema(name=kind, encoding="ros2msg", data=self._messages.definition(kind))
            self._channels[topic] = foxglove.Channel(topic, schema=schema, message_encoding="cdr", context=self._context,
                                                     metadata=metadata)
        return self._channels[topic]

    def write(self, item: Item) -> None:
        """Sends an item to those who subscribed to its topic; without a subscriber nothing is encoded."""
        if self._has_started and item.topic not in self._channels:
            self._offered[item.topic] = time.monotonic() + _OFFER_AGAIN_S, item
        channel = self._channel(item.topic, item.type, item.metadata)
        if is_latched(item.topic):
            self._latched[item.topic] = item
        if channel.has_sinks():
            channel.log(self._messages.encode(item.message, item.type), log_time=max(int(item.log_ns), 0))

    def is_watched(self, part: str) -> bool:
        """Whether a topic with `part` in its name has a subscriber, or none of them is there yet."""
        channels = [channel for topic, channel in list(self._channels.items()) if part in topic]
        return not channels or any(channel.has_sinks() for channel in channels)

    def serve_late(self) -> None:
        """Sends what changes seldom to those who subscribed since the last call.

        A channel that appeared later than the server and found no subscriber is offered once more: one may have been refused.
        """
        for topic, (due_s, item) in list(self._offered.items()):
            if time.monotonic() < due_s:
                continue
            del self._offered[topic]
            if not self._channels[topic].has_sinks():
                self._channels.pop(topic).close()
                self._channel(topic, item.type, item.metadata)
        topics = set()
        while not self._subscribed.empty():
            topics.add(self._subscribed.get())
        for topic in topics & self._latched.keys():
            self.write(self._latched[topic])

    def stop(self) -> None:
        """Ends all connections."""
        self._server.stop()


class Site:
    """What is known of a robot and its place besides messages: the files of its configuration and its recording."""

    def __init__(self, config: str | None, recording: str | None, map_file: str | None):
        about = read_yaml(Path(config).read_text(encoding="utf-8")) if config else {}
        about = about if isinstance(about, dict) else {}
        publish = about.get("publish") or {}
        self.url, self.prefix = str(publish.get("lcm_url", "")), str(publish.get("channel_prefix", "WAYMARK_"))
        self.has_pictures = bool(publish.get("picture_socket"))
        base = Path(config).parent if config else Path()
        files = {"calibration": "calibration.yaml", "map": "map/map.yaml", "landmarks": "landmarks.csv"}
        self.files: dict[str, Path] = {}
        for key, name in files.items():
            if about.get(key):
                self.files[key] = base / about[key]
            elif recording and (Path(recording) / name).is_file():
                self.files[key] = Path(recording) / name
        if map_file:
            self.files["map"] = Path(map_file)

    def topics(self, messages: Messages) -> dict[str, str]:
        """Topics, with their types, that follow from the files: pictures of the cameras, and what their sensors see."""
        out = {"/recording/sightings": streams.register(messages, "sightings.csv", SIGHTINGS)}
        calibration = read_yaml(self.files["calibration"].read_text(encoding="utf-8")) if "calibration" in self.files else None
        cameras = calibration.get("cameras") if isinstance(calibration, dict) and self.has_pictures else None
        for name in cameras or {}:
            topic = f"/camera/{topic_name(str(name))}"
            out[f"{topic}/image/compressed"] = "sensor_msgs/msg/CompressedImage"
            out[f"{topic}/annotations"] = "foxglove_msgs/msg/ImageAnnotations"
        return out

    def items(self, messages: Messages, t_ns: int) -> Iterator[Item]:
        """Mountings, map and landmarks."""
        if "calibration" in self.files:
            calibration = read_yaml(self.files["calibration"].read_text(encoding="utf-8")) or {}
            yield from place.mountings(messages, calibration, t_ns)
        if "map" in self.files:
            yield from place.grid(messages, self.files["map"], t_ns)
        if "landmarks" in self.files:
            green = messages.colour(0.2, 0.7, 0.3)
            yield from place.landmarks(messages, "/landmarks", read_table(self.files["landmarks"]), t_ns, green)


def serve(server: FoxgloveServer, live: Live, site: Site, messages: Messages, pictures: WebPictures | None,
          duration_s: float) -> None:
    """Passes messages on until Ctrl-C or the end of `duration_s` (0: none)."""
    items, begin, is_placed = LiveItems(messages, load()), time.monotonic(), False
    while not duration_s or time.monotonic() - begin < duration_s:
        server.serve_late()
        while pictures and not pictures.answers.empty():
            for item in picture_items(messages, pictures.answers.get(), items.offset_ns):
                server.write(item)
        message = live.next(0.1)
        if not message:
            continue
        for item in items.take(message.kind, message.data):
            server.write(item)
        if not is_placed and items.newest_ns:
            is_placed = True
            for item in site.items(messages, items.newest_ns):
                server.write(item)


def _pictures(given: argparse.Namespace, server: FoxgloveServer) -> WebPictures:
    program = shutil.which("waymark-web")
    if not program:
        raise ValueError("pictures of publish.picture_socket need waymark-web of the package waymark in PATH")
    words = [program, given.config]
    for option in ("recording", "map", "url", "prefix"):
        if getattr(given, option):
            words += [f"--{option}", getattr(given, option)]
    return WebPictures(words, lambda: server.is_watched("/camera/"))


def _listen(text: str) -> tuple[str, int]:
    address, _, port = text.rpartition(":")
    if not port.isdigit() or int(port) > 65535:
        raise argparse.ArgumentTypeError(f"'{text}' is neither PORT nor ADDRESS:PORT")
    return address or "127.0.0.1", int(port)


def main(argv: list[str] | None = None) -> int:
    """The command line."""
    parser = argparse.ArgumentParser(prog="waymark watch --foxglove", epilog=_EXAMPLES,
                                     formatter_class=argparse.RawDescriptionHelpFormatter,
                                     description="Sends a run as it goes to Foxglove: the topics of `waymark export`.")
    parser.add_argument("--foxglove", metavar="[ADDRESS:]PORT", type=_listen, default=("127.0.0.1", 8765),
                        help="where to listen (default 127.0.0.1:8765; 0.0.0.0 is everybody, without a password)")
    parser.add_argument("--config", metavar="FILE", help="the run's configuration: channels, map, landmarks, mountings")
    parser.add_argument("--recording", metavar="FOLDER", help="the recording that the run plays, which has map and calibration")
    parser.add_argument("--map", metavar="FILE", help="the map.yaml to show, instead of theirs")
    parser.add_argument("--url", help="LCM's, instead of the configuration's")
    parser.add_argument("--prefix", help="of the channels, instead of the configuration's (WAYMARK_)")
    parser.add_argument("--duration", metavar="S", type=finite, default=0, help="seconds, then stop")
    given = parser.parse_args(argv)
    foxglove.set_log_level("ERROR")
    pictures = None
    try:
        site, messages = Site(given.config, given.recording, given.map), Messages()
        live = Live(given.url or site.url, given.prefix or site.prefix)
        host, port = given.foxglove
        server = FoxgloveServer(messages, host, port, site.topics(messages))
        if site.has_pictures:
            pictures = _pictures(given, server)
    except (OSError, ValueError, RuntimeError, yaml.YAMLError) as error:
        print(f"waymark watch: {error}", file=sys.stderr)
        return 1
    host = "localhost" if given.foxglove[0] == "127.0.0.1" else given.foxglove[0]
    print(f"ws://{host}:{server.port}; layout: {LAYOUT}", flush=True)
    try:
        serve(server, live, site, messages, pictures, given.duration)
    except KeyboardInterrupt:
        pass
    except (OSError, ValueError, KeyError, yaml.YAMLError) as error:
        print(f"waymark watch: {error}", file=sys.stderr)
        return 1
    finally:
        server.stop()
        if pictures:
            pictures.stop()
    if live.malformed:
        print(f"waymark watch: messages that could not be decoded: {dict(live.malformed)}", file=sys.stderr)
    return 0


if __name__ == "__main__":
    sys.exit(main())
