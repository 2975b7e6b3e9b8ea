#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The editor in a real browser, by mouse and keys: landmarks moved, added, renamed, deleted, undone and done again; a distance, a
scale, an origin, an ignored area; all saved as a version that is read from the disk. Another editor's version comes meanwhile, and
a page is closed while it saves. No complaint in the console, nothing asked from elsewhere, nothing wider than a phone. Skipped (77)
without Chromium.

    editor_page.py [FOLDER]      with a folder: pictures of the page are left there (desk and phone, light and dark)"""
import pathlib
import sys
import tempfile
import time

import browser
from buildings import current, make_site
from judged import check, failures, run
from lcm_tools import in_a_network
from web_editor import WEB, Server, rows

WAIT_S = 20


class Page:
    """What a person does on it."""

    def __init__(self, window, address):
        self.window, self.value = window, window.value
        window.window(1360, 850)
        window.open(address)
        window.wait_for("window.waymark && window.waymark.model.site && window.waymark.drawn.layers === 2 && true", WAIT_S)
        self.settle()

    def settle(self):
        self.value("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(() => done(true))))")

    def px(self, x_m, y_m):
        """Of the window."""
        return self.value(f"(() => {{ const [u, v] = window.waymark.at({x_m}, {y_m}), r = document.getElementById('map').getBoundingClientRect(); return [u + r.x, v + r.y]; }})()")

    def choose(self, key):
        self.value("document.getElementById('map').focus()")
        self.window.press("Escape")
        self.window.press(key)

    def click(self, *places):
        for place in places:
            self.window.mouse(self.px(*place))
            self.settle()

    def write(self, selector, text):
        self.value(f"(() => {{ const i = document.querySelector({selector!r}); i.focus(); i.value = {text!r}; i.dispatchEvent(new Event('change', {{bubbles: true}})); }})()")

    def press_button(self, words):
        self.value(f"[...document.querySelectorAll('button')].find(b => b.textContent === {words!r}).click()")

    def landmark(self, id):
        return self.value(f"window.waymark.applied().find(f => f.name === window.waymark.model.floor).landmarks.get({id}) || null")

    def steps(self):
        return self.value("window.waymark.model.steps.length")

    def said(self):
        return self.value("document.getElementById('said').textContent")

    def save(self):
        self.write("#author", "Jane")
        self.value("document.getElementById('save').click()")

    def saved(self):
        self.window.wait_for("document.getElementById('said').textContent.includes('is saved')", WAIT_S)


def landmarks(page):
    page.window.mouse(page.px(0.3, 2), page.px(1.5, 3), page.px(2, 3.5), drags=True)
    moved = page.landmark(1)
    check(abs(moved["x_m"] - 2) < 0.02 and abs(moved["y_m"] - 3.5) < 0.02 and page.steps() == 1, f"dragged to 2, 3.5: {moved['x_m']}, {moved['y_m']}")
    check(moved["sigma_m"] > 0.009, "a place by hand is no better known than a pixel")
    page.window.press("z", ctrl=True)
    check(page.landmark(1)["x_m"] == 0.3 and page.steps() == 0, "undone")
    page.window.press("z", ctrl=True, shift=True)
    check(page.landmark(1)["x_m"] == moved["x_m"], "done again")
    page.value("document.getElementById('map').focus()")
    page.window.press("ArrowRight")
    page.window.press("ArrowRight", shift=True)
    check(abs(page.landmark(1)["x_m"] - moved["x_m"] - 0.11) < 1e-6 and page.steps() == 2, "arrow keys move it by 1 cm and 10 cm, as one step")
    page.choose("a")
    page.click((8, 6))
    check(page.landmark(13) is not None and page.value("document.querySelector('#selected h2').textContent") == "Landmark 13", "added with the next number, and selected")
    page.write("#selected [name=yaw_rad]", "-90")
    page.write("#selected [name=id]", "20")
    tag = page.landmark(20)
    check(abs(tag["yaw_rad"] + 1.5708) < 1e-3 and page.value("document.querySelector('#selected h2').textContent") == "Tag 20", "a tag by its heading, renamed")
    page.write("#selected [name=id]", "2")
    check("is there already" in page.said() and page.landmark(20) is not None, "a number that is taken is refused")
    page.choose("v")
    page.click((11, 4))
    page.value("document.getElementById('map').focus()")
    page.window.press("Delete")
    check(page.landmark(2) is None, "deleted by a key")


def plan(page):
    before = page.steps()
    page.choose("m")
    page.click((1, 1), (4, 5))
    check("5.0" in page.value("document.querySelector('#asked p').textContent") and page.steps() == before, "3 m and 4 m are 5 m")
    page.choose("i")
    page.click((8, 1), (10, 1), (10, 3), (8, 3))
    page.value("document.getElementById('map').focus()")
    page.window.press("Enter")
    page.settle()
    check(page.value("window.waymark.drawn.areas") == 1, "an area is ignored")
    page.choose("s")
    page.click((2, 2), (6, 2))
    page.write("#asked input", "4.04")
    page.press_button("Set the scale")
    page.settle()
    check(abs(page.value("window.waymark.applied()[0].plan.factor") - 1.01) < 2e-3, "4 m are 4.04 m: the plan grows by a hundredth")
    page.choose("o")
    page.click((3, 3))
    for number, text in enumerate(("48.1", "11.5", "520")):
        page.write(f"#asked label:nth-of-type({number + 1}) input", text)
    page.press_button("Set the origin")
    check(page.steps() == before + 3, "scale, area and origin are steps")


def main():
    if not browser.program():
        in_a_network.skip("there is no Chromium (apt install chromium)")
    if not WEB.exists():
        in_a_network.skip("waymark-web is not built here")
    pictures = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else None
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        site = folder / "office"
        make_site(site)
        run("waymark-map", "version", site, "--author", "Joe", "--note", "as drawn")
        drive = folder / "monday"
        drive.mkdir()
        (drive / "published.csv").write_text("t_ns,x_m,y_m,floor\n" + "".join(f"{i},{1 + i / 20},{3 + (i % 40) / 40},ground\n" for i in range(180)))
        window = browser.Browser()
        with Server(site, "--drive", drive) as server:
            page = Page(window, server.address)
            check(page.value("window.waymark.drawn.landmarks") == 2 and page.value("window.waymark.drawn.drives") == 1, "landmarks and the drive are drawn")
            check("token" not in page.value("location.href"), "the token is not left in the address")
            landmarks(page)
            plan(page)
            look(window, pictures)
            window.window(1360, 850)
            page.save()
            page.saved()
            on_disk(site)
            both(page, server, site)
            closed(window, server, site)
            elsewhere = [url for url in window.requests if not url.startswith((server.address.split("#")[0], "data:"))]
            check(not elsewhere, f"nothing is asked from elsewhere {elsewhere[:3]}")
        refused = [text for text in window.complaints if "409" not in text]  # the browser logs the refused save
        check(not refused, f"no complaint in the console {refused[:2]}")
        window.close()
    return 1 if failures else 0


def look(window, pictures):
    for name, size in (("desk-light", (1360, 850, False, False)), ("desk-dark", (1360, 850, True, False)), ("phone", (390, 844, False, True))):
        window.window(*size)
        window.wait_for("new Promise(done => setTimeout(() => done(true), 400))", 5)
        check(window.value("document.documentElement.scrollWidth <= window.innerWidth"), f"{name}: not wider than the window")
        if pictures:
            window.picture(pictures / f"editor-{name}.png")
            if name == "phone":
                window.picture(pictures / "editor-phone-whole.png", whole_page=True)
    check(window.value("getComputedStyle(document.getElementById('editing')).display") == "none", "a phone looks, and does not edit")


def on_disk(site):
    after = rows(site / "ground/landmarks.csv")
    yaml, whole = (site / "ground/map.yaml").read_text(), (site / "site.yaml").read_text()
    check(set(after) == {"id", "1", "20"} and after["20"].endswith("-1.570796327"), "the version has what was drawn")
    check("ignore: [[[" in yaml and "resolution: 0.0126" in yaml and "origin: [48.09" in whole, "area, scale and origin are in the files")
    said = run("waymark-map", "check", site)
    check("good" in said and "Jane" in said and "differ" not in said, "map check: good")


def both(page, server, site):
    """Another editor saves while this one has changes."""
    page.choose("v")
    page.window.mouse(page.px(*place(page, 20)), page.px(7, 5), page.px(7, 5.5), drags=True)
    check(page.steps() == 1, "a change is not saved yet")
    status, other = server.save({"do": "set", "floor": "ground", "id": 1, "z_m": 1.75}, author="Other")
    check(status == 200, "another editor saves")
    page.save()
    page.window.wait_for("/no longer as it was|came meanwhile/.test(document.getElementById('said').textContent)", WAIT_S)
    check(page.steps() == 1 and current(site) == other["version"] and page.landmark(1)["z_m"] == 1.75, "the page has the other's version, and keeps its own change on top")
    page.window.wait_for("!document.getElementById('save').disabled", WAIT_S)
    page.save()
    page.saved()
    after = rows(site / "ground/landmarks.csv")
    moved = [float(v) for v in after["20"].split(",")[:2]]
    check(",1.75," in after["1"] and max(abs(moved[0] - 7), abs(moved[1] - 5.5)) < 0.02, f"saved again, both changes are there {after}")


def place(page, id):
    found = page.landmark(id)
    return found["x_m"], found["y_m"]


def closed(window, server, site):
    """The page is closed at many moments of a save."""
    outcomes = []
    for wait_s in (0, 0.01, 0.05, 0.2, 0.6):
        window.close_page()
        window.new_page()
        page = Page(window, server.address)
        before = current(site)
        page.value("document.getElementById('map').focus()")
        page.value("document.querySelector('#list tr:nth-child(2)').click()")
        page.window.press("ArrowLeft")
        page.save()
        time.sleep(wait_s)
        window.close_page()
        server.ask("GET", "/newest.json")
        said = run("waymark-map", "check", site)
        check("good" in said and "differ" not in said, f"closed {wait_s} s after a save began: {'new' if current(site) != before else 'old'}, whole")
        outcomes.append(current(site) != before)
        window.new_page()
    check(outcomes[-1], "and once it is done it is there")


if __name__ == "__main__":
    sys.exit(main())
