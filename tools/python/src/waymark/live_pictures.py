# SPDX-License-Identifier: Apache-2.0
"""A live run's pictures with what its detectors found: taken from `waymark web`, which projects by the cameras' models."""

import base64
import io
import json
import queue
import subprocess
import threading
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from PIL import Image

from .mcapio.estimates import topic_name
from .mcapio.writer import Item
from .ros import Messages

EVERY_S = 0.5  # the run encodes at most two pictures a second for viewers
_FOUND, _EXPECTED = (0.1, 0.9, 0.3), (0.2, 0.6, 0.9)
_POINTS, _LINE = 1, 3  # foxglove_msgs/PointsAnnotation


def picture_items(messages: Messages, answer: dict[str, Any], offset_ns: int) -> Iterator[Item]:
    """Items of a picture.json: the picture, and annotations of what was found (green) and what the map predicts (blue)."""
    jpeg, t_ns = base64.b64decode(answer["jpeg"]), int(answer["t_ns"]) + offset_ns
    topic = f"/camera/{topic_name(answer['camera'] or answer['name'])}"
    header = messages.header(t_ns, topic.rpartition("/")[2] + "_optical")
    yield Item(t_ns, f"{topic}/image/compressed", "sensor_msgs/msg/CompressedImage", messages.make(
        "CompressedImage", header=header, format="jpeg", data=np.frombuffer(jpeg, dtype=np.uint8)))
    with Image.open(io.BytesIO(jpeg)) as image:
        scale = image.width / max(int(answer["width"]), 1)  # the answer is in pixels of the camera
    stamp, points, texts = messages.time(t_ns), [], []

    def point(uv: Any) -> Any:
        return messages.make("foxglove_msgs/Point2", x=float(uv[0]) * scale, y=float(uv[1]) * scale)

    def add(pixels: list[Any], kind: int, colour: Any) -> None:
        if pixels:
            points.append(messages.make("PointsAnnotation", timestamp=stamp, type=kind, points=[point(uv) for uv in pixels],
                                        outline_color=colour, thickness=2.0))

    for names, rgb in ((("dots", "marks"), _FOUND), (("map_dots", "map_marks"), _EXPECTED)):
        colour = messages.make("foxglove_msgs/Color", r=rgb[0], g=rgb[1], b=rgb[2], a=1.0)
        for name in names:
            add(answer[name], _POINTS, colour)
        for u, v, number in answer[names[1]]:
            texts.append(messages.make("TextAnnotation", timestamp=stamp, position=point((u, v)), text=str(number), font_size=14.0,
                                       text_color=colour))
    for line in answer["lines"]:
        add(line, _LINE, messages.make("foxglove_msgs/Color", r=_FOUND[0], g=_FOUND[1], b=_FOUND[2], a=1.0))
    yield Item(t_ns, f"{topic}/annotations", "foxglove_msgs/msg/ImageAnnotations",
               messages.make("ImageAnnotations", points=points, texts=texts))


class WebPictures:
    """Asks a `waymark web` of its own for pictures while `is_watched()`. A thread; answers wait in `answers`."""

    def __init__(self, program: list[str], is_watched: Callable[[], bool]):
        """Starts `program` (waymark-web with its arguments); ValueError with its reason where it ends at once."""
        self.answers: queue.Queue[dict[str, Any]] = queue.Queue(maxsize=4)
        self._is_watched, self._stop = is_watched, threading.Event()
        self._web = subprocess.Popen([*program, "--listen", "127.0.0.1:0"], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                     text=True)
        assert self._web.stdout
        self._url = self._web.stdout.readline().strip()
        if not self._url.startswith("http"):
            raise ValueError(self._web.communicate()[1].strip() or "waymark-web ended without a reason")
        self._thread = threading.Thread(target=self._work, name="pictures")
        self._thread.start()

    def _ask(self, source: int, number: int) -> dict[str, Any] | None:
        with urllib.request.urlopen(f"{self._url}/picture.json?source={source}&number={number}", timeout=2) as answer:
            return json.loads(answer.read()) if answer.status == 200 else None

    def _work(self) -> None:
        source, number = 0, -1
        while not self._stop.wait(EVERY_S):
            if not self._is_watched():
                continue
            try:
                picture = self._ask(source, number)
            except (OSError, ValueError, urllib.error.URLError):
                continue  # it ended, or is about to
            if picture and "jpeg" in picture and not self.answers.full():
                self.answers.put(picture)
                number = int(picture["number"])
                source = (source + 1) % max(int(picture["sources"]), 1)

    def stop(self) -> None:
        """Ends the thread and the program."""
        self._stop.set()
        self._thread.join()
        self._web.terminate()
        self._web.communicate()
