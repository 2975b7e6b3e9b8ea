# SPDX-License-Identifier: Apache-2.0
"""Between a run (LCM) and a fleet manager (MQTT)."""

import json
import select
import time
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from ..live import Live
from .actions import Action, Actions
from .broker import Broker, Heard
from .maps import Building
from .protocol import Error, Heads, Refused, refusal_of_order, tell, wishes_of
from .run import Place, Run

TAKEN = ("order", "instantActions")
"""Topics of the fleet manager."""
_LOOK_S = 1.0  # at the building's versions, which people change, too
_FEWER_S = 0.2  # so long after a state the next one waits for more changes
_NOT_MEASURED = {"batteryState": {"batteryCharge": 0, "charging": False}, "safetyState": {"eStop": "NONE", "fieldViolation": False},
                 "information": [{"infoType": "notMeasured", "infoLevel": "INFO", "infoDescription":
                                  "Waymark states where the robot is; batteryState and safetyState are compulsory, and not measured"}]}
_WITHOUT_ORDER = {"orderId": "", "orderUpdateId": 0, "lastNodeSequenceId": 0, "nodeStates": [], "edgeStates": [], "operatingMode": "MANUAL"}


class Pace(NamedTuple):
    """How often, s; `visualization_s` 0: never."""

    state_s: float
    visualization_s: float


class Adapter:
    """One thread; actions have threads of their own."""

    def __init__(self, live: Live, run: Run, building: Building, heads: Heads, pace: Pace, factsheet: Mapping[str, Any]):
        self._live, self._run, self._building, self._heads, self._pace, self._factsheet = live, run, building, heads, pace, factsheet
        self._broker: Any = None
        self._prefix, self._node, self._is_sheet_due = "", "", False
        self._mistakes: dict[str, Error] = {}  # by topic or actionType: the newest
        self._maps, self._floors, self._looked_s = building.maps(), building.enabled_floors(), time.monotonic()
        self._sent: tuple[str, float, float] = "", 0.0, 0.0  # what the last state had; when state and visualization were sent
        self._actions = Actions({
            "downloadMap": lambda p: building.download(p["mapId"], p["mapVersion"], p["mapDownloadLink"], p.get("mapHash")),
            "enableMap": lambda p: building.enable(p["mapId"], p["mapVersion"], run.reload),
            "deleteMap": lambda p: building.delete(p["mapId"], p["mapVersion"]),
            "initPosition": self._set_position, "stateRequest": lambda _: "", "factsheetRequest": self._ask_factsheet,
        }, dict.fromkeys(("downloadMap", "enableMap", "deleteMap"), "maps"))

    def connection(self, state: str) -> bytes:
        """A message of the topic `connection`."""
        return self._heads.message("connection", {"connectionState": state})

    def run(self, broker: Broker, prefix: str, is_over: Callable[[], bool]) -> None:
        """Until `is_over`. `prefix` of topics: "uagv/v2/ACME/7/"."""
        self._broker, self._prefix = broker, prefix
        while not is_over():
            if select.select([self._live.fileno()], [], [], 0.05)[0]:  # a signal does not disturb it, as it would LCM's own wait
                while message := self._live.next(0):
                    self._run.take(message)
            while heard := broker.heard():
                self._take(heard)
            for action in self._actions.step():
                self._ended(action)
            if broker.is_connected:
                self._publish()

    # ── what comes ───────────────────────────────────────────────────────────────────────────────────────────────────

    def _take(self, heard: Heard) -> None:
        topic = heard.topic.rsplit("/", 1)[-1]
        if not topic:
            self._send("connection", self.connection("ONLINE"), 1, True)
            self._is_sheet_due, self._sent = True, ("", 0.0, 0.0)
            return
        self._mistakes.pop(topic, None)
        try:
            message = self._heads.read(topic, heard.payload)
            if topic == "order":
                self._mistakes[topic] = refusal_of_order(message)
            else:
                self._wish(message)
        except Refused as error:
            self._mistakes[topic] = Error("validationError", "WARNING", str(error), references=(("topic", topic),))
            tell(f"refused: {error}")

    def _wish(self, message: Mapping[str, Any]) -> None:
        for wish in wishes_of(message):
            if not self._actions.take(wish):
                tell(f"{wish.kind} '{wish.action_id}' came twice and is done once")
        self._publish_state()  # WAITING

    def _ended(self, action: Action) -> None:
        kind = action.wish.kind
        self._mistakes.pop(kind, None)
        if action.status == "FAILED":
            self._mistakes[kind] = action.error()
        tell(f"{kind} '{action.wish.action_id}': {action.status}: {action.result}")
        self._look()
        self._publish_state()

    # ── actions, on threads of their own ─────────────────────────────────────────────────────────────────────────────

    def _set_position(self, given: dict[str, Any]) -> str:
        said = self._run.set_place(Place(given["x"], given["y"], given["theta"], given["mapId"]), self._building.enabled_floors())
        self._node = given.get("lastNodeId") or ""
        return said

    def _ask_factsheet(self, _given: dict[str, Any]) -> str:
        self._is_sheet_due = True
        return ""

    # ── what goes ────────────────────────────────────────────────────────────────────────────────────────────────────

    def _send(self, topic: str, payload: bytes, qos: int = 0, retain: bool = False) -> None:
        if self._broker.is_connected:
            self._broker.publish(self._prefix + topic, payload, qos, retain)

    def _look(self) -> None:
        self._maps, self._floors, self._looked_s = self._building.maps(), self._building.enabled_floors(), time.monotonic()

    def _publish(self) -> None:
        now_s = time.monotonic()
        if self._is_sheet_due:
            self._is_sheet_due = False
            self._send("factsheet", self._heads.message("factsheet", self._factsheet), retain=True)
        if now_s - self._looked_s > _LOOK_S:
            self._look()
        known, state_s, seen_s = self._sent
        if now_s - state_s > self._pace.state_s or (now_s - state_s > _FEWER_S and self._known() != known):
            self._publish_state()
        if self._pace.visualization_s and now_s - seen_s > self._pace.visualization_s:
            self._sent = (*self._sent[:2], now_s)
            self._send("visualization", self._heads.message("visualization", self._run.position(self._floors)))

    def _errors(self) -> list[dict[str, Any]]:
        return [error.entry() for error in (*self._run.errors(), *self._mistakes.values())]

    def _known(self) -> str:
        """All whose change is an event."""
        place = self._run.position(self._floors)["agvPosition"]
        return json.dumps([self._maps, self._actions.entries(), self._errors(), self._run.is_driving, place["mapId"], place["positionInitialized"]])

    def _publish_state(self) -> None:
        maps = [{"mapId": m.map_id, "mapVersion": m.version, "mapStatus": "ENABLED" if m.is_enabled else "DISABLED"} for m in self._maps]
        self._sent = self._known(), time.monotonic(), self._sent[2]
        self._send("state", self._heads.message("state", {
            **_WITHOUT_ORDER, "lastNodeId": self._node, "maps": maps, **self._run.position(self._floors), "driving": self._run.is_driving,
            "actionStates": self._actions.entries(), "errors": self._errors(), **_NOT_MEASURED}))
