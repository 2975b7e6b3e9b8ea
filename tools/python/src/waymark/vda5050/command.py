# SPDX-License-Identifier: Apache-2.0
"""The command line of `waymark vda5050`."""

import argparse
import json
import re
import shutil
import signal
import sys
import threading
import time
from pathlib import Path
from typing import Any
from urllib.parse import SplitResult, urlsplit

from ..live import Live
from ..numbers import between
from .adapter import TAKEN, Adapter, Pace
from .broker import Broker
from .maps import Building
from .protocol import MAJOR, VERSION, Heads, factsheet
from .run import KINDS, Run

_STATE_MOST_S = 30  # the standard's
_EXAMPLES = """examples:
  waymark vda5050 --broker mqtt://192.168.1.5 --manufacturer ACME --serial truck-7 --site /var/lib/waymark/office
  waymark vda5050 --broker mqtts://truck-7@fleet.example:8883 --password-file key.txt --ca ca.pem --manufacturer ACME --serial truck-7 \\
      --site /var/lib/waymark/office/ground --commands /run/waymark/commands

It runs on the robot, beside `waymark run`. docs/vda5050.md has the fields of the messages and where they come from.
Exit code: 0 done, 1 the work failed, 2 usage."""


def _name(text: str) -> str:
    if not re.fullmatch("[A-Za-z0-9_.:-]+", text):
        raise argparse.ArgumentTypeError(f"'{text}' has other characters than A-Z a-z 0-9 _ . : -")
    return text


def _url(text: str) -> SplitResult:
    try:
        url = urlsplit(text)
        good = url.scheme in ("mqtt", "mqtts") and url.hostname and not url.path.strip("/") and url.port != 0 and url.password is None
    except ValueError:
        good = False
    if not good:
        raise argparse.ArgumentTypeError(f"'{text}' is no broker; mqtt://HOST:PORT and mqtts://USER@HOST:PORT are (a password: --password-file)")
    return url


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="waymark vda5050", epilog=_EXAMPLES, formatter_class=argparse.RawDescriptionHelpFormatter,
                                     description=f"Gives a run's position to a fleet manager by VDA 5050 version {VERSION} over MQTT, and takes maps from it:\n"
                                                 "downloadMap, enableMap, deleteMap, initPosition. Orders are refused: Waymark does not drive.")
    parser.add_argument("--broker", metavar="URL", type=_url, required=True, help="mqtt://HOST:PORT, or mqtts://USER@HOST:PORT by TLS (ports 1883 and 8883)")
    parser.add_argument("--manufacturer", metavar="NAME", type=_name, required=True, help="of the robot, as the fleet manager has it")
    parser.add_argument("--serial", metavar="NUMBER", type=_name, required=True, help="of the robot, as the fleet manager has it")
    parser.add_argument("--site", metavar="FOLDER", type=Path, required=True,
                        help="the building, as `site:` of the configuration names it (FOLDER or FOLDER/FLOOR); an empty folder where maps are still to come")
    parser.add_argument("--commands", metavar="SOCKET", default="", help="`commands: {socket: FILE}` of the configuration, for initPosition (default: LCM)")
    parser.add_argument("--rate", metavar="HZ", type=between(0, 50, float), default=1.0, help="of the topic visualization; 0: none (default 1)")
    parser.add_argument("--state-every", metavar="S", type=between(0.2, _STATE_MOST_S, float), default=5.0,
                        help="a state at the latest after so many seconds, 0.2 to 30; changes are sent at once (default 5)")
    parser.add_argument("--interface", metavar="NAME", type=_name, default="uagv", help="first level of the topics (default uagv)")
    parser.add_argument("--password-file", metavar="FILE", type=Path, help="its first line is the password of the broker's user")
    parser.add_argument("--ca", metavar="FILE", type=Path, help="the authority of the broker's certificate, PEM (default: the system's)")
    parser.add_argument("--factsheet", metavar="FILE", type=Path, help="JSON whose parts take the place of the factsheet's: sizes, speeds, kinematics")
    parser.add_argument("--max-mb", metavar="MB", type=between(1, 100000, int), default=1000, help="of a downloaded map, packed and unpacked (default 1000)")
    parser.add_argument("--url", default="", help="LCM's (default: LCM_DEFAULT_URL, else this computer's)")
    parser.add_argument("--prefix", default="WAYMARK_", help="of LCM's channels (default WAYMARK_)")
    parser.add_argument("--duration", metavar="S", type=between(0, 1e9, float), default=0.0, help="seconds, then stop")
    return parser


def _given_sheet(path: Path | None) -> dict[str, Any]:
    try:
        given = json.loads(path.read_text(encoding="utf-8")) if path else {}
        return factsheet(given)
    except (ValueError, TypeError, AttributeError) as error:
        raise ValueError(f"{path}: is no factsheet, a JSON object of objects: {error}") from error


def _work(given: argparse.Namespace) -> None:
    if not shutil.which("waymark-map"):
        raise FileNotFoundError("there is no waymark-map in PATH, which keeps the versions of maps; the package waymark-tools has it")
    password = given.password_file.read_text(encoding="utf-8").partition("\n")[0] if given.password_file else ""
    if given.ca:
        given.ca.read_bytes()  # TLS does not name a file that is missing
    building, heads, sheet = Building(given.site, given.max_mb << 20), Heads(given.manufacturer, given.serial), _given_sheet(given.factsheet)
    live = Live(given.url, given.prefix, KINDS)
    pace = Pace(given.state_every, 1 / given.rate if given.rate else 0.0)
    adapter = Adapter(live, Run(live, building.floor, given.commands), building, heads, pace, sheet)
    prefix = f"{given.interface}/v{MAJOR}/{given.manufacturer}/{given.serial}/"
    broker = Broker(given.broker, password, given.ca, f"waymark-{given.manufacturer}-{given.serial}", tuple(prefix + topic for topic in TAKEN),
                    (prefix + "connection", lambda: adapter.connection("CONNECTIONBROKEN")))
    print(f"{given.prefix}POSE and maps of {building.folder} -> {prefix}... on {given.broker.geturl()}", flush=True)
    stop, begin_s = threading.Event(), time.monotonic()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stop.set())
    try:
        adapter.run(broker, prefix, lambda: stop.is_set() or 0 < given.duration < time.monotonic() - begin_s)
    finally:
        broker.close(prefix + "connection", adapter.connection("OFFLINE"))


def main(argv: list[str] | None = None) -> int:
    """The command line."""
    given = _parser().parse_args(argv)
    try:
        _work(given)
    except ImportError as error:
        print(f"waymark vda5050: {error} (pip install 'waymark[vda5050]')", file=sys.stderr)
        return 1
    except (OSError, ValueError) as error:
        print(f"waymark vda5050: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
