#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""`waymark-web --edit SITE` without a browser: what it answers and to whom; each kind of edit, as the files have it afterwards and as
a robot takes it; what is refused, with the field's name; two editors at once; requests that break off; kill -9 at random moments of
saving, after which the site is the old version or the new one, whole.

    web_editor.py KILLS"""
import http.client
import json
import pathlib
import random
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time

from lcm_tools import in_a_network
from buildings import CONFIG, current, make_site
from judged import BIN, check, failures, run

RANDOM = random.Random(11)
WEB = BIN / "waymark-web"


class Server:
    """Of a site; ends with the with."""

    def __init__(self, site, *words):
        self.process = subprocess.Popen([WEB, "--edit", site, "--listen", "0", *words], stdout=subprocess.PIPE, text=True)
        self.address = self.process.stdout.readline().strip()
        self.port, self.token = re.fullmatch(r"http://localhost:(\d+)/#token=([0-9a-f]{32})", self.address).groups()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.wait()

    def ask(self, method, path, body=None, **heads):
        connection = http.client.HTTPConnection("127.0.0.1", int(self.port), timeout=60)
        heads = {"Host": f"localhost:{self.port}", "X-Waymark-Token": self.token} | {name.replace("_", "-"): value for name, value in heads.items()}
        connection.request(method, path, body, {name: value for name, value in heads.items() if value is not None})
        answer = connection.getresponse()
        data = answer.read()
        connection.close()
        return answer.status, json.loads(data) if answer.getheader("Content-Type") == "application/json" else data

    def site(self):
        status, site = self.ask("GET", "/site.json")
        assert status == 200, site
        return site

    def save(self, *edits, base=None, author="Jane", note=""):
        return self.ask("POST", "/version", json.dumps({"base": base or self.site()["base"], "author": author, "note": note, "edits": list(edits)}))


def rows(file):
    return dict(line.split(",", 1) for line in file.read_text().splitlines())


def who_is_answered(server):
    check(server.ask("GET", "/site.json", X_Waymark_Token=None)[0] == 403 and server.ask("GET", "/site.json", X_Waymark_Token="0" * 32)[0] == 403, "nothing without the token")
    check(server.ask("POST", "/version", "{}", X_Waymark_Token=None)[0] == 403, "nor is anything saved")
    check(server.ask("GET", "/site.json", Host="evil.example")[0] == 403, "nothing for the page of another site")
    check([server.ask(method, "/version")[0] for method in ("PUT", "DELETE", "OPTIONS")] == [405] * 3, "only GET and POST are answered")
    check([server.ask("GET", path)[0] for path in ("/", "/edit.js", "/edit-model.js", "/mapview.js", "/page.css")] == [200] * 5, "the page itself has no secrets")
    check([server.ask("GET", path)[0] for path in ("/edit.html", "//etc/passwd", "/versions/current", "/plan.png?floor=9&layer=edges", "/state.json")] == [404] * 5, "there is nothing else")
    png = server.ask("GET", "/plan.png?floor=0&layer=edges")[1]
    check(png.startswith(b"\x89PNG"), "the plan is a picture")
    long = socket.create_connection(("127.0.0.1", int(server.port)))
    long.sendall(b"POST /version HTTP/1.1\r\nHost: localhost\r\nX-Waymark-Token: " + server.token.encode() + b"\r\nContent-Length: 99000000\r\n\r\n")
    sent = 0
    try:
        while sent < 90_000_000:
            sent += long.send(b" " * 100_000)
    except OSError:
        pass
    check(sent < 20_000_000, f"a body that is too long is cut off ({sent / 1e6:.1f} MB)")


def edits(server, site):
    """Each kind, in the files, in the version, and back in the answer."""
    before = server.site()
    check(before["current"] == "" and len(before["floors"]) == 2 and len(before["floors"][0]["landmarks"]) == 2 and not before["wrong"], "the site as it is")
    (site / "ground/landmarks-covariance.npy").write_bytes(b"of the landmarks as they were")
    status, said = server.save({"do": "set", "floor": "ground", "id": 1, "x_m": 0.35, "y_m": 2.5, "sigma_m": 0.02}, {"do": "add", "floor": "ground", "id": 21, "x_m": 5, "y_m": 7.5, "z_m": 1.5, "sigma_m": 0.05, "yaw_rad": -1.5},
                               {"do": "rename", "floor": "first", "id": 12, "to": 30}, {"do": "delete", "floor": "first", "id": 11}, note="moved, added, renamed, deleted")
    check(status == 200, f"a version is made {said if status != 200 else ''}")
    check(rows(site / "ground/landmarks.csv") == {"id": "x_m,y_m,z_m,sigma_m,yaw_rad", "1": "0.35,2.5,1,0.02,0", "2": "11,4,1,0.01,1.5", "21": "5,7.5,1.5,0.05,-1.5"}, "moved and added; the other row as it was")
    check(rows(site / "first/landmarks.csv") == {"id": "x_m,y_m,z_m,sigma_m,yaw_rad", "30": "11,4,1,0.01,1.5"}, "renamed and deleted")
    version = site / "versions" / said["version"]
    check(current(site) == said["version"] and (version / "ground/landmarks.csv").read_bytes() == (site / "ground/landmarks.csv").read_bytes(), "robots take it")
    check(not (site / "ground/landmarks-covariance.npy").exists() and not (version / "ground/landmarks-covariance.npy").exists(), "a joint covariance of other landmarks is left out")
    checked = run("waymark-map", "check", site)
    check("good" in checked and "differ" not in checked and "moved, added" in checked, "map check: good, and the files are those of the version")
    after = server.site()
    check(after["base"] == after["current"] == said["version"] and [v["author"] for v in after["versions"]] == ["Jane"], "the page sees it")

    status, said = server.save({"do": "set", "floor": "first", "id": 30, "x_m": 500})
    check(status == 422 and f"{site}/site.yaml:6: floor 'first': 1 of 1 landmarks lie outside" in said["errors"][0]["text"], f"what map check finds wrong is refused in its words {said}")
    check(current(site) == after["current"] and server.site()["base"] == after["base"], "and nothing has changed")
    yaml = (site / "ground/map.yaml").read_text()
    status, said = server.save(*({"do": "scale", "floor": floor, "factor": 1.02, "x_m": 2, "y_m": 2} for floor in ("ground", "first")),
                               {"do": "origin", "floor": "ground", "x_m": 100, "y_m": 200, "latitude_deg": 52.5, "longitude_deg": 13.4, "altitude_m": 34})
    check(status == 200, f"scale and origin {said if status != 200 else ''}")
    scaled = dict(line.split(": ", 1) for line in (site / "ground/map.yaml").read_text().splitlines() if ": " in line)
    old = dict(line.split(": ", 1) for line in yaml.splitlines() if ": " in line)
    ox, oy, yaw = json.loads(scaled["origin"])
    was_x, was_y, _ = json.loads(old["origin"])
    check(abs(float(scaled["resolution"]) / float(old["resolution"]) - 1.02) < 1e-9 and abs(ox - (2 + 1.02 * (was_x - 2))) < 1e-9 and abs(oy - (2 + 1.02 * (was_y - 2))) < 1e-9,
          "the plan is 1.02 times as large, about the clicked place")
    check(all(scaled[key] == value for key, value in old.items() if key not in ("resolution", "origin")), "and else as it was")
    lat, lon, altitude = json.loads(re.search(r"origin: (\[.*\])", (site / "site.yaml").read_text())[1])
    # A degree of latitude at 52.5 degrees has 111.27 km, one of longitude 67.90 km (WGS84).
    check(abs((52.5 - lat) * 111270 - 200) < 0.3 and abs((13.4 - lon) * 67898 - 100) < 0.3 and abs(altitude - 34) < 0.1, f"the origin lies 100 m west and 200 m south of the place: {lat}, {lon}")
    one = site.parent / "one"
    shutil.copytree(site / "ground", one)
    with Server(one) as alone:
        floor = alone.site()["floors"][0]["name"]
        check(alone.save({"do": "delete", "floor": floor, "id": 2})[0] == 200 and current(one), "a folder with one map is edited, too")
        (one / "landmarks.csv").write_text("id,x_m,y_m,cov_xx,cov_xy,cov_yy,yaw_rad,cov_tt\n1,1,2,0.04,0.01,0.04,1,0.02\n2,3,4,0.040,,0.04,1,0.02\n")
        check(alone.save({"do": "set", "floor": floor, "id": 1, "y_m": 2.5, "sigma_m": 0.3})[0] == 200 and rows(one / "landmarks.csv") == {
            "id": "x_m,y_m,cov_xx,cov_xy,cov_yy,yaw_rad,cov_tt,sigma_m", "1": "1,2.5,,,,1,0.02,0.3", "2": "3,4,0.040,,0.04,1,0.02,"}, "a place by hand has no measured covariance; its heading has")
        status, said = alone.save({"do": "origin", "floor": floor, "x_m": 0, "y_m": 0, "latitude_deg": 1, "longitude_deg": 2, "altitude_m": 3})
        check(status == 400 and "site.yaml" in said["errors"][0]["text"], "but has no place for an origin")


REFUSED = [  # what is sent for edits (or the whole body), the field that is named
    ({"do": "set", "floor": "ground", "id": 1, "x_m": "2"}, "edits[0].x_m"),
    ({"do": "set", "floor": "ground", "id": 1, "x_m": None}, "edits[0].x_m"),
    ({"do": "set", "floor": "ground", "id": 1, "x_m": 1e9}, "edits[0].x_m"),
    ({"do": "set", "floor": "ground", "id": 1.5, "x_m": 1}, "edits[0].id"),
    ({"do": "set", "floor": "ground", "id": 99, "x_m": 1}, "edits[0].id"),
    ({"do": "set", "floor": "attic", "id": 1, "x_m": 1}, "edits[0].floor"),
    ({"do": "set", "id": 1, "x_m": 1}, "edits[0].floor"),
    ({"do": "set", "floor": "ground", "id": 1, "x": 1}, "edits[0].x"),
    ({"do": "set", "floor": "ground", "id": 1, "yaw_rad": 9}, "edits[0].yaw_rad"),
    ({"do": "add", "floor": "ground", "id": 2, "x_m": 1, "y_m": 1}, "edits[0].id"),
    ({"do": "add", "floor": "ground", "id": 50, "x_m": 1}, "edits[0].y_m"),
    ({"do": "rename", "floor": "ground", "id": 1, "to": 2}, "edits[0].to"),
    ({"do": "rename", "floor": "ground", "id": 1, "to": -2}, "edits[0].to"),
    ({"do": "scale", "floor": "ground", "factor": 0, "x_m": 0, "y_m": 0}, "edits[0].factor"),
    ({"do": "origin", "floor": "ground", "x_m": 0, "y_m": 0, "latitude_deg": 91, "longitude_deg": 0, "altitude_m": 0}, "edits[0].latitude_deg"),
    ({"do": "ignore", "floor": "ground"}, "edits[0].areas"),
    ({"do": "ignore", "floor": "ground", "areas": [[[1, 1], [2, 2]]]}, "edits[0].areas[0]"),
    ({"do": "ignore", "floor": "ground", "areas": [[[1, 1], [2, 2], [3]]]}, "edits[0].areas[0][2]"),
    ({"do": "paint", "floor": "ground"}, "edits[0].do"),
    ("x", "edits[0]"),
    ('{"base": "BASE", "author": "J", "edits": []}', "edits"),
    ('{"base": "BASE", "author": "", "edits": [1]}', "author"),
    ('{"base": "BASE", "author": "J", "author": "K", "edits": []}', "author"),
    ('{"base": "BASE", "author": "J", "edits": [], "more": 1}', "more"),
    ('{"base": "BASE", "edits": []}', "author"),
    ('{"base": "BASE", "author": "' + "J" * 64 + '", "edits": []}', "author"),
    ('{"author": "J", "edits": []}', "base"),
    ('{"base": "BASE", "author": "J", "edits": [' + "[" * 5000 + "]" * 5000 + "]}", ""),
    ('{"base": "BASE", "author": "J", "edits": [1e999]}', ""),
    ("{", ""), ("", ""), ("\xff\xfe", ""), ("[]", ""), ("nonsense", ""),
]


def refusals(server, site):
    before = server.site()
    for edit, field in REFUSED:
        if isinstance(edit, str) and edit != "x":
            status, said = server.ask("POST", "/version", edit.replace("BASE", before["base"]).encode("latin-1"))
        else:
            status, said = server.save(edit)
        named = said["errors"][0]["field"] if status == 400 else None
        check(named == field, f"{str(edit)[:70]}: {field!r} is named" + ("" if named == field else f": {status} {said}"))
    check(server.site() == before and not [p for p in (site / "versions").iterdir() if p.name.startswith(".")], "and nothing is left of them")


def mutated(server, count):
    """Bodies with bytes changed, left out and doubled: each is answered, and none is taken for a version of another base."""
    whole = json.dumps({"base": "0" * 16, "author": "J", "note": "n", "edits": [{"do": "set", "floor": "ground", "id": 1, "x_m": 2.5, "yaw_rad": None}, {"do": "ignore", "floor": "ground", "areas": [[[1, 2], [3, 4], [5, 0]]]}]}).encode()
    seen = set()
    for _ in range(count):
        body = bytearray(whole)
        for _ in range(RANDOM.randint(1, 4)):
            at = RANDOM.randrange(len(body))
            body[at:at + RANDOM.randint(0, 2)] = RANDOM.choice((b"", bytes([RANDOM.randrange(256)]), b"[", b"{", b'"', b"1e99", b"null", bytes(body[at:at + 9])))
        seen.add(server.ask("POST", "/version", bytes(body))[0])
    check(seen <= {400, 409} and server.process.poll() is None, f"{count} mutated bodies are refused: {seen}")


def two_at_once(site):
    with Server(site) as one, Server(site) as other:
        base = one.site()["base"]
        status, first = one.save({"do": "set", "floor": "ground", "id": 1, "z_m": 1.1}, base=base, author="One")
        check(status == 200, "the first editor saves")
        status, said = other.save({"do": "set", "floor": "ground", "id": 2, "z_m": 1.2}, base=base, author="Other")
        check(status == 409 and said["errors"][0]["field"] == "base" and current(site) == first["version"], "the second one's base is no longer the newest: refused")
        status, second = other.save({"do": "set", "floor": "ground", "id": 2, "z_m": 1.2}, author="Other")
        landmarks = rows(site / "ground/landmarks.csv")
        check(status == 200 and ",1.1," in landmarks["1"] and ",1.2," in landmarks["2"], "saved again on the newest one both changes are there")
        check({first["version"], second["version"]} <= {p.name for p in (site / "versions").iterdir()}, "and both versions")
        landmarks = site / "ground/landmarks.csv"
        landmarks.write_text(landmarks.read_text().replace(",1.2,", ",1.3,"))
        check(one.save({"do": "delete", "floor": "ground", "id": 2}, base=second["version"])[0] == 409, "a file that was edited by hand is no base either")
        # Many at once on one base: one is taken, none is lost unnoticed.
        base, answers = one.site()["base"], []
        crowd = [threading.Thread(target=lambda k=k: answers.append(RANDOM.choice((one, other)).save({"do": "set", "floor": "ground", "id": 1, "z_m": 2 + k / 10}, base=base)[0])) for k in range(8)]
        for thread in crowd:
            thread.start()
        for thread in crowd:
            thread.join()
        check(answers.count(200) == 1 and all(status in (200, 409, 422) for status in answers), f"eight at once: {sorted(answers)}")


def broken_off(server, site):
    """A page that is closed while it saves: the version is there or not."""
    before = current(site)
    body = json.dumps({"base": server.site()["base"], "author": "J", "edits": [{"do": "set", "floor": "ground", "id": 1, "z_m": 0.5}]}).encode()
    head = f"POST /version HTTP/1.1\r\nHost: localhost\r\nX-Waymark-Token: {server.token}\r\nContent-Length: {len(body)}\r\n\r\n".encode()
    for sent in (10, len(head), len(head) + len(body) // 2, len(head) + len(body) - 1):
        with socket.create_connection(("127.0.0.1", int(server.port))) as connection:
            connection.sendall((head + body)[:sent])
        check(server.ask("GET", "/newest.json")[0] == 200 and current(site) == before, f"closed after {sent} of {len(head) + len(body)} bytes: not saved")
    with socket.create_connection(("127.0.0.1", int(server.port))) as connection:
        connection.sendall(head + body)
    until = time.monotonic() + 20
    while current(site) == before and time.monotonic() < until:
        time.sleep(0.05)
    check(current(site) != before and server.site()["base"] == current(site), "closed once all was sent: saved")


def robot(folder, site):
    drive = folder / "drive"
    run("waymark-simulate", pathlib.Path(__file__).resolve().parents[2] / "config/worlds/crossing-easy.yaml", "--seed", 1, "--no-video", "--out", drive)
    hall = folder / "hall"
    hall.mkdir()
    shutil.copy(drive / "landmarks.csv", hall / "landmarks.csv")
    (folder / "robot.yaml").write_text(CONFIG + "\nsite: hall\n")
    poses = lambda out: (run("waymark", "replay", drive, "--config", folder / "robot.yaml", "--out", folder / out), (folder / out / "trajectory.csv").read_bytes())[1]
    before = poses("before")
    run_folder = folder / "before"
    with Server(hall, "--drive", run_folder) as server:
        shown = server.site()
        check(len(shown["drives"]) == 1 and len(shown["drives"][0]["points"]) > 50, f"a drive is drawn: {len(shown['drives'][0]['points'])} points")
        landmark = shown["floors"][0]["landmarks"][0]
        status, said = server.save({"do": "set", "floor": shown["floors"][0]["name"], "id": landmark["id"], "x_m": landmark["x_m"] + 0.02})
        check(status == 200, f"a landmark is moved {said}")
    after = poses("after")
    check(after != before and f"version {said['version']}" in run("waymark", "check", folder / "robot.yaml", drive, expect=(0, 1)), "the robot takes the version at its next start")


def kills(site, count):
    """Megabytes are written for each version; the first kill comes at once, the last one when it is saved."""
    for floor in ("ground", "first"):
        (site / floor / "points").write_bytes(b"WMMAP 1\n" + bytes(3_000_000))
    yaml = (site / "site.yaml").read_text()
    (site / "site.yaml").write_text(yaml.replace("map: ground/map.yaml", "map: ground/map.yaml, points: ground/points").replace("map: first/map.yaml", "map: first/map.yaml, points: first/points"))
    landmarks = [site / floor / "landmarks.csv" for floor in ("ground", "first")]
    edit = lambda server, z_m: server.save(*({"do": "set", "floor": floor, "id": id, "z_m": z_m} for floor, id in (("ground", 1), ("first", 30))))
    with Server(site) as server:
        begin = time.monotonic()
        assert edit(server, 0.25)[0] == 200
        needs_s = time.monotonic() - begin
    outcomes, broken = {"before": 0, "new": 0}, []
    for number in range(1, count + 1):
        (site / "first/points").write_bytes(b"WMMAP 1\n" + bytes(3_000_000) + str(number).encode())
        run("waymark-map", "version", site)
        old, files = current(site), [file.read_bytes() for file in landmarks]
        with Server(site) as server:
            base = server.site()["base"]
            asked = threading.Thread(target=lambda: _quiet(lambda: server.save(*({"do": "set", "floor": floor, "id": id, "z_m": number / 7} for floor, id in (("ground", 1), ("first", 30))), base=base)))
            asked.start()
            time.sleep({1: 0, count: 3 * needs_s}.get(number, RANDOM.uniform(0, 1.2 * needs_s)))
            server.process.send_signal(signal.SIGKILL)
            server.process.wait()
            asked.join()
        said = subprocess.run([BIN / "waymark-map", "check", str(site)], capture_output=True, text=True)
        is_old = current(site) == old
        now = [file.read_bytes() for file in landmarks]
        if said.returncode != 0 or "differ from the current" in said.stdout or (now == files) != is_old or any((a == b) != is_old for a, b in zip(now, files)):
            broken.append(said.stdout + said.stderr)
        outcomes["before" if is_old else "new"] += 1
    check(not broken, f"killed {count} times while it saves, which takes {needs_s:.2f} s: map check is good, files and version are both old or both new, {outcomes}" + "".join(broken[:1]))
    check(min(outcomes.values()) > 0, "kills before and after the version is current")
    # Between the version and the site's own files: as a program killed there leaves them.
    old = [file.read_bytes() for file in landmarks]
    with Server(site) as server:
        assert edit(server, 0.75)[0] == 200
    new, name = [file.read_bytes() for file in landmarks], current(site)
    hashes = [fnv(data) for data in old]
    for hand in (False, True):
        (site / "versions/.carried").write_text(name + "\n" + "".join(f"{h:016x} {file.relative_to(site)}\n" for h, file in sorted(zip(hashes, landmarks), key=lambda p: str(p[1]))))
        landmarks[0].write_bytes(old[0] + b"77,1,1,1,1,\n" if hand else old[0])
        landmarks[1].write_bytes(old[1])
        said = run("waymark-map", "check", site)
        check(landmarks[1].read_bytes() == new[1] and not (site / "versions/.carried").exists(), "what a killed program had still to carry is carried by the next one")
        check(landmarks[0].read_bytes() == (old[0] + b"77,1,1,1,1,\n" if hand else new[0]), "a file that a person edited meanwhile stays" if hand else "in all files")


def _quiet(call):
    try:
        call()
    except (OSError, http.client.HTTPException, AssertionError):
        pass  # its server was killed


def fnv(data):
    out = 0xCBF29CE484222325
    for byte in data:
        out = (out ^ byte) * 0x100000001B3 % 2**64
    return out


def main(count):
    if not WEB.exists():
        in_a_network.skip("waymark-web is not built here (libmicrohttpd-dev)")
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        site = folder / "office"
        make_site(site)
        with Server(site) as server:
            who_is_answered(server)
            edits(server, site)
            refusals(server, site)
            mutated(server, 500)
            broken_off(server, site)
            check(server.process.poll() is None, "the server still runs")
        two_at_once(site)
        kills(site, count)
        robot(folder, site)
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1])))
