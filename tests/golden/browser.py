# SPDX-License-Identifier: Apache-2.0
"""Chromium without a window, over its pipe (the DevTools protocol), for tests of pages: no driver and no further package."""
import base64
import fcntl
import json
import os
import select
import shutil
import subprocess
import tempfile
import time


def program():
    """The browser's program, or None."""
    return next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)


class Browser:
    def __init__(self):
        self.folder = tempfile.mkdtemp(prefix="waymark-browser-")
        to_browser, mine_out = os.pipe()
        mine_in, from_browser = os.pipe()
        # The protocol is on descriptors 3 and 4; these are out of their way.
        low = (to_browser, from_browser)
        to_browser, from_browser = (fcntl.fcntl(fd, fcntl.F_DUPFD, 20) for fd in low)
        for fd in low:
            os.close(fd)
        self.process = subprocess.Popen(
            ["bash", "-c", f'exec 3<&{to_browser} 4>&{from_browser} {to_browser}<&- {from_browser}>&-; exec "$@"', "bash", program(), "--headless=new",
             "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--no-first-run", "--disable-dev-shm-usage", "--disable-background-networking",
             "--disable-component-update", "--disable-extensions", f"--user-data-dir={self.folder}", "--remote-debugging-pipe", "about:blank"],
            pass_fds=(to_browser, from_browser), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        os.close(to_browser)
        os.close(from_browser)
        self.to, self.of, self.rest, self.number = mine_out, mine_in, b"", 0
        self.complaints, self.requests, self.session = [], [], None
        self.new_page()

    def new_page(self):
        self.session = None
        self.target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self.session = self.call("Target.attachToTarget", targetId=self.target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(domain + ".enable")

    def close_page(self):
        """At once, whatever it is doing."""
        self.session = None
        self.call("Target.closeTarget", targetId=self.target)

    def hear(self, until):
        """The next message; None where none comes until then."""
        while b"\0" not in self.rest:
            if not select.select([self.of], [], [], max(0, until - time.monotonic()))[0]:
                return None
            piece = os.read(self.of, 1 << 20)
            assert piece, "the browser has ended"
            self.rest += piece
        message, self.rest = self.rest.split(b"\0", 1)
        message = json.loads(message)
        what, said = message.get("method"), message.get("params", {})
        if what == "Runtime.exceptionThrown":
            self.complaints.append(json.dumps(said["exceptionDetails"])[:600])
        if what == "Log.entryAdded" and said["entry"]["level"] in ("error", "warning"):
            self.complaints.append(json.dumps(said["entry"])[:600])
        if what == "Runtime.consoleAPICalled" and said["type"] in ("error", "warning", "assert"):
            self.complaints.append(json.dumps(said["args"])[:600])
        if what == "Network.requestWillBeSent":
            self.requests.append(said["request"]["url"])
        return message

    def call(self, method, **params):
        self.number += 1
        asked = {"id": self.number, "method": method, "params": params}
        if self.session:
            asked["sessionId"] = self.session
        os.write(self.to, json.dumps(asked).encode() + b"\0")
        until = time.monotonic() + 60
        while message := self.hear(until):
            if message.get("id") == self.number:
                assert "error" not in message, f"{method}: {message['error']}"
                return message["result"]
        raise AssertionError(f"the browser does not answer {method}")

    def window(self, width, height, is_dark=False, is_phone=False):
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=2 if is_phone else 1, mobile=is_phone)
        self.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": "dark" if is_dark else "light"}])

    def open(self, url):
        self.call("Page.navigate", url=url)

    def value(self, expression):
        """Of a piece of JavaScript, by JSON."""
        said = self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in said, said["exceptionDetails"]
        return said["result"].get("value")

    def wait_for(self, expression, seconds):
        until = time.monotonic() + seconds
        while not (value := self.value(expression)):
            assert time.monotonic() < until, f"after {seconds} s there is no {expression}: {self.value('JSON.stringify(window.waymark && window.waymark.drawn)')}; {self.complaints}"
            self.hear(time.monotonic() + 0.2)
        return value

    def mouse(self, *places, drags=False):
        """Clicks at each place (px of the window), or drags from the first over the others."""
        for i, (x, y) in enumerate(places):
            self.call("Input.dispatchMouseEvent", type="mouseMoved", x=x, y=y, buttons=1 if drags and i else 0)
            if not drags or i == 0:
                self.call("Input.dispatchMouseEvent", type="mousePressed", x=x, y=y, button="left", buttons=1, clickCount=1)
            if not drags or i == len(places) - 1:
                self.call("Input.dispatchMouseEvent", type="mouseReleased", x=x, y=y, button="left", clickCount=1)

    def press(self, key, ctrl=False, shift=False):
        code = {"Delete": 46, "Enter": 13, "Escape": 27, "ArrowLeft": 37, "ArrowRight": 39}.get(key, ord(key[0].upper()))
        same = {"key": key, "modifiers": 2 * ctrl + 8 * shift, "windowsVirtualKeyCode": code}
        self.call("Input.dispatchKeyEvent", type="keyDown", **same, **({"text": key} if len(key) == 1 and not ctrl else {}))
        self.call("Input.dispatchKeyEvent", type="keyUp", **same)

    def picture(self, path, whole_page=False):
        shot = self.call("Page.captureScreenshot", format="png", captureBeyondViewport=whole_page)
        path.write_bytes(base64.b64decode(shot["data"]))

    def close(self):
        self.process.terminate()
        self.process.wait(timeout=20)
        shutil.rmtree(self.folder, ignore_errors=True)
