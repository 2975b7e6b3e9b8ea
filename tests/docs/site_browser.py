#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The site of documents in a real browser: site_browser.py HTML [FOLDER]. The search finds ten terms of the glossary: the glossary
and the page that uses the term are among the first results; no page is wider than a phone or a desktop, none
complains or loads from elsewhere. FOLDER gets pictures of PAGES. Skipped (77) without Chromium or the site (./dev docs)."""
import functools
import http.server
import pathlib
import sys
import threading
import urllib.parse

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "golden"))
import browser  # noqa: E402

FIRST = 8  # results that a reader looks at
# Term of the glossary, and a page that a reader of it needs beside the glossary.
TERMS = {
    "dead reckoning": "docs/estimators/odometry.html",
    "kidnapped robot": "docs/consistency.html",
    "time offset": "docs/estimators.html",
    "innovation": "docs/check.html",
    "perceptual aliasing": "docs/edges.html",
    "likelihood field": "docs/references.html",
    "inverse depth": "docs/references.html",
    "coded marker": "docs/markers.html",
    "relocalization": "docs/estimators/landmark_ekf.html",
    "covariance": "docs/estimators/landmark_ekf.html",
}
PAGES = ["docs/index", "README", "docs/choose", "docs/troubleshooting", "docs/glossary", "docs/edges", "docs/markers", "docs/live", "docs/faults",
         "docs/boards", "docs/consistency", "docs/reference-c", "docs/reference-python", "docs/tutorials/landmarks", "docs/config"]
WINDOWS = {"desktop": (1360, 850, False, False), "phone": (390, 844, False, True), "dark": (1360, 850, True, False)}


class Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *_):
        pass


def serve(folder):
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=str(folder)))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    return f"http://127.0.0.1:{server.server_address[1]}"


def load(window, url):
    window.open(url)
    window.wait_for(f"location.href === {url!r} && document.readyState === 'complete'", 30)


def search(window, address, term):
    """Pages of the first results, in their order."""
    load(window, f"{address}/search.html?q={urllib.parse.quote_plus(term)}")
    window.wait_for("document.querySelector('#search-results p.search-summary, #search-results > p')?.textContent.match(/found|match/) && true", 30)
    window.wait_for(f"document.querySelectorAll('#search-results ul.search li a').length >= {FIRST} || "
                    "!document.querySelector('#search-results .search-progress')", 30)
    links = window.value("[...document.querySelectorAll('#search-results ul.search li > a')].map(a => a.getAttribute('href').split('#')[0])")
    return list(dict.fromkeys(link.split("?")[0] for link in links))


def check(html, pictures):
    faults, address = [], serve(html)
    window = browser.Browser()
    try:
        glossary = (html / "docs/glossary.html").read_text().lower()
        window.window(*WINDOWS["desktop"])
        for term, page in TERMS.items():
            assert term in glossary, f"'{term}' is not in the glossary"
            found = search(window, address, term)
            places = {name: found.index(name) + 1 if name in found else None for name in ("docs/glossary.html", page)}
            print(f"{term}: {len(found)} pages; {', '.join(f'{name} is number {place}' for name, place in places.items())}")
            faults += [f"search for '{term}': {name} is not among the first {FIRST}: {found[:FIRST]}"
                       for name, place in places.items() if not place or place > FIRST]
        pages = sorted(str(path.relative_to(html))[:-5] for path in html.rglob("*.html"))
        for name, size in WINDOWS.items():
            window.window(*size)
            for page in pages if name != "dark" else PAGES:
                load(window, f"{address}/{page}.html")
                wide = window.value("document.documentElement.scrollWidth - window.innerWidth")
                if wide > 0:
                    faults.append(f"{page}, {name}: {wide} px wider than the window")
                if pictures and page in PAGES:
                    window.picture(pictures / f"{page.replace('/', '-')}-{name}.png")
        faults += window.complaints
        faults += [f"asked from elsewhere: {url}" for url in window.requests if not url.startswith((address, "data:"))][:5]
        print(f"{len(pages)} pages at {len(WINDOWS)} sizes, {len(faults)} faults")
    finally:
        window.close()
    return faults


def main():
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    html = pathlib.Path(sys.argv[1]).resolve()
    if not browser.program():
        print("skipped: there is no Chromium (apt install chromium)")
        sys.exit(77)
    if not (html / "docs/index.html").exists():
        print("skipped: there is no site (./dev docs fetches what makes it)")
        sys.exit(77)
    pictures = pathlib.Path(sys.argv[2]) if len(sys.argv) > 2 else None
    if pictures:
        pictures.mkdir(parents=True, exist_ok=True)
    faults = check(html, pictures)
    print("\n".join(faults), file=sys.stderr)
    sys.exit(1 if faults else 0)


if __name__ == "__main__":
    main()
