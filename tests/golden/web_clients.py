#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Browsers of every kind at once on the page of a run: 20 that read, 20 that drip bytes, 10 that never read what they asked for, one
that sends rubbish. The run does not notice (no pose is lost, nothing is counted), those that read are answered, and what is answered is
valid JSON, with names from messages as text. Needs the right to a network namespace; skipped (77) without."""
import json
import signal
import socket
import subprocess
import sys
import threading
import time
import urllib.error
import urllib.request

from lcm_tools import WAYMARK, config, ended, finish, in_a_network, published, run, write_recording

SECONDS = 8
WEB = WAYMARK.with_name("waymark-web")
NAME = "<script>alert(1)</script>"  # of the sensor: it is in the sources' names


def get(port, path, host=None, timeout=15):
    asked = urllib.request.Request(f"http://127.0.0.1:{port}{path}", headers={"Host": host or f"localhost:{port}"})
    return urllib.request.urlopen(asked, timeout=timeout)


def drip(port, until, ended):
    """A request that never ends, a byte at a time."""
    request = b"GET /state.json HTTP/1.1\r\nHost: localhost\r\nX: " + b"a" * 10000
    with socket.create_connection(("127.0.0.1", port)) as connection:
        for byte in request:
            if time.monotonic() > until:
                return
            try:
                connection.send(bytes([byte]))
            except OSError:
                ended.append(time.monotonic())
                return
            time.sleep(0.05)


def never_read(port, until):
    with socket.socket() as connection:
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 2048)
        connection.connect(("127.0.0.1", port))
        connection.setblocking(False)
        while time.monotonic() < until:
            try:
                connection.send(b"GET /page.js HTTP/1.1\r\nHost: localhost\r\n\r\n" * 20)
            except OSError:
                pass
            time.sleep(0.1)


def read_on(port, until, answers, failures):
    while time.monotonic() < until:
        try:
            with get(port, "/state.json") as answer:
                assert answer.headers["Content-Type"] == "application/json" and answer.headers["X-Content-Type-Options"] == "nosniff"
                answers.append((time.monotonic(), json.load(answer)))
        except Exception as problem:  # noqa: BLE001: whatever it is, it is one
            failures.append(repr(problem))
        time.sleep(0.2)


def send_rubbish(port, until, failures):
    pieces = [b"\0" * 1000, b"GET / HTTP/9.9\r\n\r\n", b"POST /state.json HTTP/1.1\r\nHost: localhost\r\nContent-Length: 1000000000\r\n\r\n" + b"a" * 10000,
              b"GET /" + b"a" * 100000 + b" HTTP/1.1\r\n\r\n", b"GET /%00%2e%2e/etc/passwd HTTP/1.1\r\nHost: localhost\r\n\r\n", b"\r\n" * 5000]
    while time.monotonic() < until:
        for piece in pieces:
            with socket.create_connection(("127.0.0.1", port)) as connection:
                connection.settimeout(0.3)
                try:
                    connection.sendall(piece)
                    if connection.recv(100).startswith(b"HTTP/1.1 200"):
                        failures.append(f"{piece[:60]} is answered")
                except OSError:
                    pass


def status_of(port, path, host=None):
    try:
        with get(port, path, host) as answer:
            return answer.status
    except urllib.error.HTTPError as refusal:
        return refusal.code


def alone(work, name):
    """The run with nobody at the page, for comparison."""
    out = work / name
    finish(run(work / "recording", work / "config.yaml", out))
    return out


def main():
    if not WEB.exists():
        in_a_network.skip("waymark-web is not built here (libmicrohttpd-dev)")
    in_a_network.begin(programs=())
    with in_a_network.work_folder("web") as work, ended() as started:
        write_recording(work / "recording", SECONDS)
        for file in ("calibration.yaml", "sightings.csv"):
            path = work / "recording" / file
            path.write_text(path.read_text().replace("{eye:", '{"' + NAME + '":').replace(",eye,", f",{NAME},"))
        config(work / "config.yaml", "landmark_ekf")
        quiet = alone(work, "quiet")
        web = subprocess.Popen([WEB, work / "config.yaml", "--recording", work / "recording", "--listen", "0"], stdout=subprocess.PIPE, text=True)
        started.append(web)
        port = int(web.stdout.readline().rpartition(":")[2])
        until, answers, failures, sent_away = time.monotonic() + SECONDS + 6, [], [], []
        crowd = [threading.Thread(target=drip, args=(port, until, sent_away)) for _ in range(20)]
        crowd += [threading.Thread(target=never_read, args=(port, until)) for _ in range(10)]
        crowd += [threading.Thread(target=read_on, args=(port, until, answers, failures)) for _ in range(20)]
        crowd.append(threading.Thread(target=send_rubbish, args=(port, until, failures)))
        for one in crowd:
            one.start()
        time.sleep(1)
        finish(run(work / "recording", work / "config.yaml", work / "crowded"))
        statuses = {path: status_of(port, path) for path in ("/", "/page.js", "/page.css", "/map.json", "/picture.json", "/floor.png", "/page.html",
                                                             "//etc/passwd", "/page/../page.js")}
        assert statuses == {"/": 200, "/page.js": 200, "/page.css": 200, "/map.json": 200, "/picture.json": 200, "/floor.png": 404, "/page.html": 404,
                            "//etc/passwd": 404, "/page/../page.js": 404}, statuses
        assert status_of(port, "/state.json", "evil.example") == 403
        with get(port, "/") as page:
            assert "default-src 'none'" in page.headers["Content-Security-Policy"]
        for one in crowd:
            one.join()
        assert web.poll() is None, "waymark-web has ended"

        # Those that read were answered all the time, and saw the whole drive.
        assert not failures, f"{len(failures)} of {len(answers)} requests failed: {failures[:3]}"
        assert len(answers) > 20 * 10, len(answers)
        states = [state for _, state in answers]
        named = {source["name"] for state in states if "health" in state for source in state["health"]["sources"]}
        assert f"sightings:{NAME}" in named, named
        assert max(len(state["trail"]["points"]) for state in states) > 50
        assert any(len(state["rays"]) == 4 for state in states)

        # The run did not notice: every pose of its rate, none lost, the same fused.
        health = {name: json.loads((work / name / "health.json").read_text()) for name in ("quiet", "crowded")}
        poses = {name: len(published(work / name)) for name in health}
        print(f"{len(answers)} answers to 20 browsers; poses alone {poses['quiet']}, in the crowd {poses['crowded']}; {len(sent_away)} that drip were sent away")
        assert poses["crowded"] > 0.9 * poses["quiet"], poses
        fused = {name: {source: value["fused"] for source, value in health[name]["sources"].items()} for name in health}
        assert fused["crowded"] == fused["quiet"], fused
        assert health["crowded"]["outputs_lost"] == 0
        web.send_signal(signal.SIGTERM)
        assert web.wait(timeout=20) == 0


if __name__ == "__main__":
    sys.exit(main())
