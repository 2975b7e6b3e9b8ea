# SPDX-License-Identifier: Apache-2.0
"""A connection to an MQTT broker that comes back by itself."""

import contextlib
import importlib
import queue
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import SplitResult

from .protocol import tell

KEEPALIVE_S = 15  # the standard's heartbeat
_AGAIN_S = (1, 15)  # a lost broker is tried again after so long at first, and at most
_WAITING = 1000  # messages that wait for the program
_SENT_S = 3.0


class Heard(NamedTuple):
    """A message of a topic; topic "": the connection is made anew."""

    topic: str
    payload: bytes


class Broker:
    """An MQTT 3.1.1 client with a last will, which its own thread connects again and again.

    ImportError where paho-mqtt lacks. `will` makes the last will's message for each connection.
    """

    def __init__(self, url: SplitResult, password: str, authority: Path | None, client_id: str, topics: tuple[str, ...],
                 will: tuple[str, Callable[[], bytes]]):
        mqtt: Any = importlib.import_module("paho.mqtt.client")
        port = url.port or (8883 if url.scheme == "mqtts" else 1883)
        self._name, self._topics, self._will = f"{url.hostname}:{port}", topics, will
        self._heard: queue.Queue[Heard] = queue.Queue(_WAITING)
        self._told = ""
        self._client: Any = mqtt.Client(mqtt.CallbackAPIVersion.VERSION2, client_id=client_id, protocol=mqtt.MQTTv311)
        if url.username:
            self._client.username_pw_set(url.username, password)
        distrust = ", or its certificate is not trusted (--ca)" if url.scheme == "mqtts" else ""
        if url.scheme == "mqtts":
            self._client.tls_set(ca_certs=str(authority) if authority else None)
        self._client.reconnect_delay_set(*_AGAIN_S)
        self._client.on_connect, self._client.on_disconnect = self._connected, self._gone
        self._client.on_connect_fail = lambda *_: self._tell(f"{self._name} can't be reached{distrust}; it is tried again")
        self._client.on_message = lambda _client, _data, message: self._put(Heard(message.topic, message.payload))
        self._set_will()
        self._client.connect_async(url.hostname, port, KEEPALIVE_S)
        self._client.loop_start()

    def _set_will(self) -> None:
        topic, make = self._will
        self._client.will_set(topic, make(), qos=1, retain=True)

    def _tell(self, line: str) -> None:
        """Each state of the connection once."""
        if line != self._told:
            self._told = line
            tell(line)

    def _put(self, heard: Heard) -> None:
        try:
            self._heard.put_nowait(heard)
        except queue.Full:
            self._tell(f"messages come faster than they can be taken: some of {heard.topic} are dropped")

    def _connected(self, client: Any, _data: Any, _flags: Any, reason: Any, _properties: Any) -> None:
        if reason.is_failure:
            self._tell(f"{self._name} refuses the connection: {reason}")
            return
        self._tell(f"connected to {self._name}")
        client.subscribe([(topic, 0) for topic in self._topics])
        self._put(Heard("", b""))

    def _gone(self, _client: Any, _data: Any, _flags: Any, reason: Any, _properties: Any) -> None:
        if reason.is_failure:
            self._tell(f"{self._name} is gone ({reason}); it is tried again")
        self._set_will()

    @property
    def is_connected(self) -> bool:
        """Whether messages can be sent."""
        return bool(self._client.is_connected())

    def heard(self) -> Heard | None:
        """The next message that has come; None: there is none."""
        try:
            return self._heard.get_nowait()
        except queue.Empty:
            return None

    def publish(self, topic: str, payload: bytes, qos: int = 0, retain: bool = False) -> Any:
        """Sends a message; its receipt."""
        return self._client.publish(topic, payload, qos, retain)

    def close(self, topic: str, payload: bytes) -> None:
        """The last message, retained, and an orderly end."""
        with contextlib.suppress(RuntimeError, ValueError):  # the broker went just now
            self.publish(topic, payload, 1, True).wait_for_publish(_SENT_S if self.is_connected else 0)
        self._client.disconnect()
        self._client.loop_stop()
