# SPDX-License-Identifier: Apache-2.0
"""Messages of VDA 5050 version 2.1.0 (github.com/VDA5050/VDA5050): heads, what is taken and what is refused, the factsheet."""

import datetime
import json
import sys
from collections import Counter
from collections.abc import Mapping
from typing import Any, NamedTuple

VERSION = "2.1.0"
MAJOR = VERSION.split(".", maxsplit=1)[0]
_BYTES_MAX = 1 << 20  # of a message that is taken; an order of a thousand nodes has half of it
_TEXT_MAX = 500  # characters of a reason, which may repeat what came
_IDENTITY_MAX = 200  # of an actionId; a UUID has 36
_NUMBER_MAX = 1e8  # m: the coordinates that a site may have (site.yaml)
_DOES_NOT_DRIVE = "Waymark states where the robot is; it does not drive. Orders belong to the program that drives the robot"


class Refused(Exception):
    """Why something is not done, in plain words."""


def tell(line: str) -> None:
    """A line of the log, without control characters of what came."""
    print("waymark vda5050: " + "".join(c if c.isprintable() else "?" for c in line[:_TEXT_MAX]), file=sys.stderr, flush=True)


class Parameter(NamedTuple):
    """Of an action."""

    key: str
    kind: str  # STRING or FLOAT, the words of the factsheet
    is_optional: bool = False


ACTIONS: dict[str, tuple[str, tuple[Parameter, ...]]] = {
    "downloadMap": ("fetches a version of the building, checks it and stores it", (
        Parameter("mapId", "STRING"), Parameter("mapVersion", "STRING"), Parameter("mapDownloadLink", "STRING"),
        Parameter("mapHash", "STRING", True))),
    "enableMap": ("the run goes on with this version", (Parameter("mapId", "STRING"), Parameter("mapVersion", "STRING"))),
    "deleteMap": ("removes a version that is not enabled", (Parameter("mapId", "STRING"), Parameter("mapVersion", "STRING"))),
    "initPosition": ("sets the pose and the floor", (
        Parameter("x", "FLOAT"), Parameter("y", "FLOAT"), Parameter("theta", "FLOAT"), Parameter("mapId", "STRING"),
        Parameter("lastNodeId", "STRING", True))),
    "stateRequest": ("sends the state", ()),
    "factsheetRequest": ("sends the factsheet", ()),
}
"""What the adapter does, by actionType."""


class Error(NamedTuple):
    """An entry of `errors`."""

    kind: str
    level: str  # WARNING or FATAL
    text: str
    hint: str = ""
    references: tuple[tuple[str, str], ...] = ()

    def entry(self) -> dict[str, Any]:
        """As the state has it."""
        out: dict[str, Any] = {"errorType": self.kind, "errorLevel": self.level, "errorDescription": self.text[:_TEXT_MAX]}
        if self.hint:
            out["errorHint"] = self.hint
        if self.references:
            out["errorReferences"] = [{"referenceKey": key, "referenceValue": value[:_IDENTITY_MAX]} for key, value in self.references]
        return out


class Heads:
    """Makes messages of one robot; each topic counts its own."""

    def __init__(self, manufacturer: str, serial_number: str):
        self.manufacturer, self.serial_number = manufacturer, serial_number
        self._made: Counter[str] = Counter()

    def message(self, topic: str, fields: Mapping[str, Any]) -> bytes:
        """A message as JSON, with its head. ValueError where a number is not finite."""
        now = datetime.datetime.now(datetime.UTC)
        head = {"headerId": self._made[topic] % 2**32, "timestamp": now.strftime("%Y-%m-%dT%H:%M:%S.%f")[:-4] + "Z", "version": VERSION,
                "manufacturer": self.manufacturer, "serialNumber": self.serial_number}
        self._made[topic] += 1
        return json.dumps({**head, **fields}, allow_nan=False, ensure_ascii=False).encode()

    def read(self, topic: str, payload: bytes) -> dict[str, Any]:
        """A message of the fleet manager to this robot. Refused: what is wrong with it, and where."""
        if len(payload) > _BYTES_MAX:
            raise Refused(f"{topic}: has {len(payload)} bytes, {_BYTES_MAX} are taken")
        try:
            message = json.loads(payload, parse_constant=_no_number)
        except (ValueError, RecursionError) as error:
            raise Refused(f"{topic}: is no JSON: {error}") from None
        if not isinstance(message, dict):
            raise Refused(f"{topic}: is no JSON object")
        for key, kind in (("headerId", int), ("timestamp", str), ("version", str), ("manufacturer", str), ("serialNumber", str)):
            need(message, key, kind, topic)
        if message["headerId"] < 0:
            raise Refused(f"{topic}: headerId: {message['headerId']} is below 0")
        if message["version"].split(".")[0] != MAJOR:
            raise Refused(f"{topic}: version: '{message['version']}' is not understood; this is version {VERSION}, and takes {MAJOR}.x")
        for key, own in (("manufacturer", self.manufacturer), ("serialNumber", self.serial_number)):
            if message[key] != own:
                raise Refused(f"{topic}: {key}: '{message[key]}' is another robot; this is '{own}'")
        return message


def need(message: Any, key: str, kind: type, where: str) -> Any:
    """The value of this kind; Refused names the place where it is not."""
    value = message.get(key) if isinstance(message, dict) else None
    if not isinstance(value, kind) or (kind is int and isinstance(value, bool)):
        raise Refused(f"{where}: {key}: {'is missing' if value is None else 'is of another type'}; {_KINDS[kind]} is needed")
    return value


_KINDS = {int: "a whole number", str: "a text", list: "a list"}


def _no_number(word: str) -> float:
    raise ValueError(f"{word} is no number")


class Wish(NamedTuple):
    """An instant action that was asked for."""

    action_id: str
    kind: str
    is_hard: bool
    parameters: dict[str, Any]


def wishes_of(message: Mapping[str, Any]) -> list[Wish]:
    """The actions of an instantActions message. Refused: all of it, where one has no identity or is malformed."""
    out = []
    for i, action in enumerate(need(message, "actions", list, "instantActions")):
        where = f"instantActions: actions[{i}]"
        names = [need(action, key, str, where) for key in ("actionId", "actionType", "blockingType")]
        if not 0 < len(names[0]) <= _IDENTITY_MAX:
            raise Refused(f"{where}: actionId: has {len(names[0])} characters; 1 to {_IDENTITY_MAX} are needed")
        if names[2] not in ("NONE", "SOFT", "HARD"):
            raise Refused(f"{where}: blockingType: '{names[2]}'; NONE, SOFT or HARD is needed")
        parameters = need({"actionParameters": [], **action}, "actionParameters", list, where)
        keys = [need(parameter, "key", str, f"{where}: actionParameters") for parameter in parameters]
        out.append(Wish(names[0], names[1], names[2] == "HARD", dict(zip(keys, (p.get("value") for p in parameters), strict=True))))
    return out


def check_parameters(wish: Wish) -> None:
    """Refused where a parameter of the action is missing, unknown or of another type."""
    if wish.kind not in ACTIONS:
        raise Refused(f"'{wish.kind}' is none of this robot's actions; {', '.join(ACTIONS)} are")
    known = {parameter.key: parameter for parameter in ACTIONS[wish.kind][1]}
    for key, parameter in known.items():
        value = wish.parameters.get(key)
        if value is None and parameter.is_optional:
            continue
        if not (_is_number(value) if parameter.kind == "FLOAT" else isinstance(value, str) and value):
            raise Refused(f"{key}: {'is missing' if value is None else repr(value) + ' is not right'}; "
                          f"{'a number' if parameter.kind == 'FLOAT' else 'a text'} is needed")
    if unknown := sorted(wish.parameters.keys() - known.keys()):
        raise Refused(f"{unknown[0]}: is no parameter of {wish.kind}; {', '.join(known) or 'none'} are")


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) < _NUMBER_MAX


def refusal_of_order(message: Mapping[str, Any]) -> Error:
    """The error that answers an order."""
    references = tuple((key, str(message[key])) for key in ("orderId", "orderUpdateId", "headerId") if key in message)
    return Error("orderError", "WARNING", f"the order is refused: {_DOES_NOT_DRIVE}", references=(("topic", "order"), *references))


def factsheet(given: Mapping[str, Any]) -> dict[str, Any]:
    """What the standard asks for, without what the adapter does not know; `given` takes the place of its parts, key by key."""
    actions = [{"actionType": kind, "actionDescription": about, "actionScopes": ["INSTANT"],
                "actionParameters": [{"key": p.key, "valueDataType": p.kind, "isOptional": p.is_optional} for p in parameters]}
               for kind, (about, parameters) in ACTIONS.items()]
    plain: dict[str, Any] = {
        "typeSpecification": {"seriesName": "Waymark", "seriesDescription": _DOES_NOT_DRIVE, "agvKinematic": "DIFF", "agvClass": "CARRIER",
                              "maxLoadMass": 0, "localizationTypes": ["NATURAL"], "navigationTypes": []},
        "physicalParameters": dict.fromkeys(("speedMin", "speedMax", "accelerationMax", "decelerationMax", "heightMax", "width", "length"), 0),
        "protocolLimits": {"maxStringLens": {}, "maxArrayLens": {}, "timing": {"minOrderInterval": 0, "minStateInterval": 0}},
        "protocolFeatures": {"optionalParameters": [], "agvActions": actions}, "agvGeometry": {}, "loadSpecification": {}}
    merged = {key: {**value, **given.get(key, {})} for key, value in plain.items()}
    return {**given, **merged}
