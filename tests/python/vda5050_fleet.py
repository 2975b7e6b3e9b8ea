# SPDX-License-Identifier: Apache-2.0
"""A fleet manager's side of VDA 5050, for tests: the standard's own JSON schemas, a broker (mosquitto), and a client that holds each message
that it gets to its schema."""

import hashlib
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import time
import uuid
import zipfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
CACHE = ROOT / ".cache/vda5050"
# The schemas of github.com/VDA5050/VDA5050 at its tag 2.1.0 (commit 511d01d7), out of a wheel of PyPI that carries them byte by byte.
WHEEL = "vda5050-sdk==0.2.0 --hash=sha256:f84b63758ba68e85808666fef4a230b651e0a76d4a7547f0006da5e9aed2fe10"
SUMS = {"connection": "aa991bc8c5a15115a3cb46cbbc2a87bef208cef436268a06feed663a949c30f1",
        "factsheet": "386e3f20be0fa29132e8b3bc1e90991e7e5cf496aae7f3fb744cb072174a8bfc",
        "instantActions": "79b9d71ce31f5bce167d470e0e12a83c28f28f20580148b4dae28cedeb78a355",
        "state": "26e41279414d7acfeac6ea9b6438b484b0930ee0e9059cf953168d141da8473b",
        "visualization": "9930b0fca1743ab2e4b9e2a66dad0f366bd4d8b18550f896adce34db3357ebff"}
MAKER, SERIAL = "ACME", "truck-7"
PREFIX = f"uagv/v2/{MAKER}/{SERIAL}/"


def fetch():
    """The schemas, into the cache; why they can't be had, or None."""
    if all((CACHE / f"{name}.json").is_file() for name in SUMS):
        return None
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        (folder / "wheel.txt").write_text(WHEEL + "\n")
        done = subprocess.run([sys.executable, "-m", "pip", "-q", "--disable-pip-version-check", "download", "--no-deps", "--require-hashes",
                               "-r", folder / "wheel.txt", "-d", folder], capture_output=True, text=True, check=False, timeout=300)
        if done.returncode:
            return f"the schemas of VDA 5050 can't be fetched: {done.stderr.strip().splitlines()[-1]}"
        with zipfile.ZipFile(next(folder.glob("*.whl"))) as wheel:
            for kind, digest in SUMS.items():
                data = wheel.read(f"vda5050/validation/schemas/{kind}.json")
                assert hashlib.sha256(data).hexdigest() == digest, f"{kind}: not the standard's schema"
                (folder / f"{kind}.json").write_bytes(data)
        CACHE.mkdir(parents=True, exist_ok=True)
        for kind in SUMS:
            shutil.copy(folder / f"{kind}.json", CACHE)
    return None


def validators():
    """By topic."""
    import jsonschema

    return {kind: jsonschema.Draft202012Validator(json.loads((CACHE / f"{kind}.json").read_text(encoding="utf-8"))) for kind in SUMS}


class Broker:
    """mosquitto on a port; kill() and start() again as a broker that goes away and comes back."""

    def __init__(self, folder, port, *lines):
        self.port, self._conf = port, folder / f"mosquitto-{port}.conf"
        self._conf.write_text("\n".join([f"listener {port} 127.0.0.1", "allow_anonymous true", *lines]) + "\n")
        self.start()

    def start(self):
        self._process = subprocess.Popen(["mosquitto", "-c", self._conf], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

    def kill(self):
        self._process.kill()
        self._process.wait()


class Fleet:
    """A fleet manager: what it was sent by topic, and what was wrong with that."""

    def __init__(self, port, **login):
        from paho.mqtt import client as mqtt

        self.messages, self.wrong, self.retained = {}, [], set()
        self._schemas, self._made, self._heads = validators(), 0, {}
        self.client = mqtt.Client(mqtt.CallbackAPIVersion.VERSION2, client_id=f"fleet-{uuid.uuid4()}")
        if login:
            self.client.username_pw_set(**login)
        self.client.reconnect_delay_set(1, 1)
        self.client.on_connect = lambda client, *_: client.subscribe(PREFIX + "#")
        self.client.on_message = self._take
        self.client.connect_async("127.0.0.1", port, 5)
        self.client.loop_start()
        self.wait(self.client.is_connected)

    def _take(self, _client, _data, message):
        topic = message.topic.removeprefix(PREFIX)
        if topic in ("order", "instantActions"):
            return
        body = json.loads(message.payload, parse_constant=lambda word: self.wrong.append(f"{topic}: {word}"))
        self.wrong += [f"{topic}: {error.json_path}: {error.message}" for error in self._schemas[topic].iter_errors(body)]
        if not re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d\dZ", body["timestamp"]):
            self.wrong.append(f"{topic}: timestamp {body['timestamp']}")
        if (body["version"], body["manufacturer"], body["serialNumber"]) != ("2.1.0", MAKER, SERIAL):
            self.wrong.append(f"{topic}: head {body}")
        last = self._heads.get(topic, -1)
        if topic == "state" and 0 < body["headerId"] <= last:  # some are lost where a broker is killed; a new program begins with 0
            self.wrong.append(f"{topic}: headerId {body['headerId']} after {last}")
        self._heads[topic] = body["headerId"]
        if message.retain:
            self.retained.add(topic)
        self.messages.setdefault(topic, []).append(body)

    def newest(self, topic):
        return self.messages.get(topic, [{}])[-1]

    def send(self, topic, fields, **head):
        self._made += 1
        body = {"headerId": self._made, "timestamp": "2026-12-01T10:00:00.00Z", "version": "2.1.0", "manufacturer": MAKER, "serialNumber": SERIAL,
                **fields, **head}
        self.send_raw(topic, json.dumps(body))

    def send_raw(self, topic, text):
        self.client.publish(PREFIX + topic, text)

    def act(self, kind, identity=None, blocking="NONE", **parameters):
        """Sends an instant action; its actionId."""
        identity = identity or str(uuid.uuid4())
        message = {"actions": [{"actionId": identity, "actionType": kind, "blockingType": blocking,
                                "actionParameters": [{"key": key, "value": value} for key, value in parameters.items()]}]}
        assert not list(self._schemas["instantActions"].iter_errors({**message, "headerId": 1, "timestamp": "", "version": "", "manufacturer": "", "serialNumber": ""}))
        self.send("instantActions", message)
        return identity

    def states_of(self, identity):
        """The states that the action had in the messages, in their order, each once."""
        out = []
        for state in self.messages.get("state", []):
            out += [entry["actionStatus"] for entry in state["actionStates"] if entry["actionId"] == identity and entry["actionStatus"] not in out]
        return out

    def ends(self, kind, seconds=60, **given):
        """Status and result of an action that was sent, at its end."""
        identity = self.act(kind, **given)
        return self.end_of(identity, seconds)

    def end_of(self, identity, seconds=60):
        def found():
            return next((entry for entry in self.newest("state").get("actionStates", []) if entry["actionId"] == identity
                         and entry["actionStatus"] in ("FINISHED", "FAILED")), None)
        entry = self.wait(found, seconds)
        return entry["actionStatus"], entry["resultDescription"]

    def wait(self, condition, seconds=60):
        end = time.monotonic() + seconds
        while not (value := condition()):
            assert time.monotonic() < end, f"nothing within {seconds} s; the newest state: {json.dumps(self.newest('state'))}"
            time.sleep(0.02)
        return value

    def errors(self):
        return {error["errorType"]: error for error in self.newest("state").get("errors", [])}

    def maps(self):
        return {(m["mapId"], m["mapVersion"]): m["mapStatus"] for m in self.newest("state").get("maps", [])}

    def close(self):
        self.client.loop_stop()
        self.client.disconnect()
