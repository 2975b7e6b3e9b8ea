#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The live page in a real browser, of a run that drives through a rendered corridor: no complaint in the console, nothing asked from
elsewhere, trail and map are drawn, and in the live picture the map's edges beside those that the detector found. Skipped (77) without Chromium or the right to a network namespace.

    web_page.py [FOLDER]      with a folder: pictures of the page are left there (desk and phone, light and dark)"""
import pathlib
import signal
import subprocess
import sys

import browser
from lcm_tools import ROOT, URL, WAYMARK, ended, in_a_network

DRIVE_S, WAIT_S = 24, 40


def prepare(work):
    world = (ROOT / "config/worlds/corridor-easy.yaml").read_text().replace(
        "\npictures:", "\ncameras: [{name: front, size: [640, 360], rate_hz: 5, colour: false}]\n\npictures:")
    (work / "world.yaml").write_text(world)
    subprocess.run([WAYMARK.with_name("waymark-simulate"), work / "world.yaml", "--out", work / "recording", "--duration", str(DRIVE_S)], check=True,
                   stdout=subprocess.DEVNULL)
    (work / "robot.yaml").write_text((ROOT / "config/datasets/corridor.yaml").read_text().replace("realtime: {", "realtime: {lock_memory: false, ")
                                     + f"\npublish: {{lcm_url: '{URL}', picture_socket: pictures}}\n")


def main():
    if not browser.program():
        in_a_network.skip("there is no Chromium (apt install chromium)")
    if not all(WAYMARK.with_name(name).exists() for name in ("waymark-web", "waymark-simulate")):
        in_a_network.skip("waymark-web or waymark-simulate is not built here")
    in_a_network.begin(programs=())
    pictures = sys.argv[1] if len(sys.argv) > 1 else ""
    with in_a_network.work_folder("page") as work, ended() as started:
        prepare(work)
        web = subprocess.Popen([WAYMARK.with_name("waymark-web"), work / "robot.yaml", "--recording", work / "recording", "--listen", "0"],
                               stdout=subprocess.PIPE, text=True)
        started.append(web)
        address = web.stdout.readline().strip()
        window = browser.Browser()
        window.window(1360, 800)
        run = subprocess.Popen([WAYMARK, "run", "--config", work / "robot.yaml", "--recording", work / "recording"], stdout=subprocess.DEVNULL,
                               stderr=subprocess.PIPE, text=True)
        started.append(run)
        window.open(address)
        window.wait_for("window.waymark && window.waymark.state() && window.waymark.state().pose && true", 40)
        # In the picture: what was found, and the map where pose and mounting put it; on the map: its floor and edges, the way.
        window.wait_for("window.waymark.drawn.picture_dots > 50 && window.waymark.drawn.map_dots > 50", WAIT_S)
        window.wait_for("window.waymark.drawn.trail > 200 && window.waymark.drawn.map === 2", WAIT_S)
        assert window.value("window.waymark.state().state") in ("tracking", "degraded")
        drawn = window.value("JSON.stringify(window.waymark.drawn)")
        # Both kinds of dots are really on the canvas.
        found = window.value("""(() => { const c = document.getElementById('picture'), d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;
            let yellow = 0, blue = 0; for (let i = 0; i < d.length; i += 4) { yellow += d[i] > 200 && d[i + 2] < 120; blue += d[i + 2] > 200 && d[i] < 90; }
            return [yellow, blue]; })()""")
        assert min(found) > 100, f"pixels of what was found and of the map in the picture: {found}"
        for name, size in (("desk-light", (1360, 800, False, False)), ("desk-dark", (1360, 800, True, False)), ("phone", (390, 844, False, True))):
            window.window(*size)
            window.wait_for("new Promise(done => setTimeout(() => done(true), 600))", 5)
            assert window.value("document.documentElement.scrollWidth <= window.innerWidth"), f"{name}: wider than the window"
            if pictures:
                window.picture(pathlib.Path(pictures) / f"{name}.png")
        assert not window.complaints, window.complaints
        elsewhere = [url for url in window.requests if not url.startswith((address + "/", "http://127.0.0.1", "data:"))]
        assert not elsewhere, elsewhere[:3]
        window.close()
        run.send_signal(signal.SIGTERM)
        said = run.communicate(timeout=60)[1]
        assert run.returncode == 0, said
        web.send_signal(signal.SIGTERM)
        print(drawn, web.communicate(timeout=20)[0].strip())


if __name__ == "__main__":
    sys.exit(main())
