# SPDX-License-Identifier: Apache-2.0
"""Instant actions: each once, in their order, with its state."""

import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from .protocol import Error, Refused, Wish, check_parameters

_KEPT = 100  # states of actions that are done; an actionId is known so long


@dataclass
class Action:
    """A wish and what became of it."""

    wish: Wish
    status: str = "WAITING"
    is_done: bool = False
    result: str = "this program failed; its log has the reason"
    thread: threading.Thread | None = None

    def entry(self) -> dict[str, str]:
        """As `actionStates` has it."""
        out = {"actionId": self.wish.action_id, "actionType": self.wish.kind, "actionStatus": self.status}
        return out | ({"resultDescription": self.error().entry()["errorDescription"]} if self.status in ("FINISHED", "FAILED") else {})

    def error(self) -> Error:
        """As `errors` has a failed one."""
        kind = "noOrderToCancel" if self.wish.kind == "cancelOrder" else f"{self.wish.kind}Failed"
        return Error(kind, "WARNING", self.result, references=(("topic", "instantActions"), ("actionId", self.wish.action_id)))


class Actions:
    """Does actions by `does`, one of a lane at a time: maps are changed one after the other, and a pose is set meanwhile.

    A HARD one is done alone. One thread calls; each action has a thread of its own, which returns what was done, or raises Refused.
    """

    def __init__(self, does: dict[str, Callable[[dict[str, Any]], str]], lanes: dict[str, str]):
        self._does, self._lanes = does, lanes
        self._actions: dict[str, Action] = {}

    def take(self, wish: Wish) -> bool:
        """A new action; False where its actionId is known: it came twice. Refused where too many wait."""
        if wish.action_id in self._actions:
            return False
        if len(self._of("WAITING")) >= _KEPT:
            raise Refused(f"instantActions: {wish.kind} '{wish.action_id}' is not taken: {_KEPT} actions wait")
        self._actions[wish.action_id] = Action(wish)
        return True

    def entries(self) -> list[dict[str, str]]:
        """For the state."""
        return [action.entry() for action in self._actions.values()]

    def step(self) -> list[Action]:
        """Starts what may start; the actions that have come to their end."""
        ended = [action for action in self._of("RUNNING") if action.thread and not action.thread.is_alive()]
        for action in ended:
            action.status = "FINISHED" if action.is_done else "FAILED"
        for action in self._of("WAITING"):
            running = self._of("RUNNING")
            if any(other.wish.is_hard for other in running) or (action.wish.is_hard and running):
                break
            if self._lane(action) not in map(self._lane, running):
                action.status, action.thread = "RUNNING", threading.Thread(target=self._do, args=(action,), daemon=True)
                action.thread.start()
        done = [key for key, action in self._actions.items() if action.status in ("FINISHED", "FAILED")]
        for key in done[:-_KEPT]:
            del self._actions[key]
        return ended

    def _of(self, status: str) -> list[Action]:
        return [action for action in self._actions.values() if action.status == status]

    def _lane(self, action: Action) -> str:
        return self._lanes.get(action.wish.kind, action.wish.kind)

    def _do(self, action: Action) -> None:
        try:
            check_parameters(action.wish)
            action.result = self._does[action.wish.kind](action.wish.parameters)
            action.is_done = True
        except Refused as error:
            action.result = str(error)
