# SPDX-License-Identifier: Apache-2.0
"""Every message of a bag that has a taker, one after the other: a bad one costs itself, a topic that can't be read costs that topic."""

from collections.abc import Callable
from typing import Any

from ..tables import NS_MOST
from . import sight
from .cameras import PICTURE_KINDS
from .collection import Collection, stamp_ns
from .containers import Bag
from .decoding import BadMessage, Topic
from .motion_takers import TRANSFORMS
from .pictures import NotTaken
from .takers import TAKERS, elsewhere

Progress = Callable[[float], None]
_EVERY = 200  # messages between two reports of progress
_LOOK_MAX_BYTES = 64 << 20  # of messages that are looked at to see which topics are pictures


def is_ours(topic: Topic) -> bool:
    """Whether a topic is a table of `waymark export`."""
    return topic.name.startswith("/recording/") and topic.kind.startswith("waymark_msgs/msg/")


def _look(bag: Bag) -> dict[str, str]:
    """Topics of pictures whose first message is of a kind that isn't taken, with the reason. They are looked at where a camera has several."""
    waiting = {topic.name for topic in bag.topics if topic.kind in PICTURE_KINDS and topic.count != 0}
    problems: dict[str, str] = {}
    if len(waiting) < 2:
        return problems
    seen = 0
    for topic, _, raw in bag.messages(lambda topic: topic.name in waiting):
        seen += len(raw)
        if topic.name in waiting:
            waiting.discard(topic.name)
            if problem := sight.problem_of(topic, raw):
                problems[topic.name] = problem
        if not waiting or seen > _LOOK_MAX_BYTES:
            break
    bag.forget_notes()
    return problems


def read(bag: Bag, into: Collection, progress: Progress | None) -> dict[str, list[Any]]:
    """Takes every message that has a taker; rows of our own tables by their topic."""
    own: dict[str, list[Any]] = {}
    wanted = {id(topic) for topic in bag.topics if not topic.why and (topic.kind in TAKERS or is_ours(topic))}
    into.sight.cameras.plan((topic for topic in bag.topics if id(topic) in wanted), _look(bag))
    for name, why in into.sight.cameras.left_out.items():
        into.refuse(name, why)
    for topic in bag.topics:
        if id(topic) not in wanted:
            into.refuse(topic.name, topic.why or elsewhere(topic))
    counts: dict[str, int] = {}
    for count, (topic, log_ns, raw) in enumerate(bag.messages(lambda topic: id(topic) in wanted)):
        if progress and count % _EVERY == 0:
            progress(bag.done)
        if topic.name in into.refused or (topic.kind in TRANSFORMS and into.frames.is_known(topic.name, raw)):
            continue
        counts[topic.name] = counts.get(topic.name, 0) + 1
        if is_ours(topic):
            _own(into, own, topic, log_ns, raw)
        else:
            _take(into, topic, log_ns, raw)
    for name, camera in into.sight.cameras.by_topic.items():
        sight.begin(into, name, camera)
    for name, bad in into.bad.items():
        into.say_bad(name, bad, counts.get(name, 0))
    return own


def _own(into: Collection, own: dict[str, list[Any]], topic: Topic, log_ns: int, raw: Any) -> None:
    try:
        own.setdefault(topic.name, []).append(topic.decode(raw))
    except BadMessage as problem:
        into.spoilt(topic.name, log_ns, str(problem))


def _take(into: Collection, topic: Topic, log_ns: int, raw: Any) -> None:
    t_ns = log_ns
    try:
        if not 0 <= log_ns <= NS_MOST:
            raise BadMessage("the bag's log has no time for it")
        message = topic.decode(raw)
        if hasattr(message, "header"):
            t_ns = stamp_ns(message, log_ns) or log_ns
        TAKERS[topic.kind](into, topic.name, message, log_ns)
    except BadMessage as problem:
        into.spoilt(topic.name, t_ns, str(problem))
    except NotTaken as problem:
        into.refuse(topic.name, str(problem))
        into.sight.cameras.give_up(topic.name)
    except OSError:  # the disk's: no message is to blame
        raise
    except AttributeError:
        into.spoilt(topic.name, t_ns, f"its definition in the bag lacks a field that {topic.kind} has")
    except Exception:  # whatever numbers lead to in a library is one message's matter, and its text is no help
        into.spoilt(topic.name, t_ns, f"its values can't be used as {topic.kind}")
