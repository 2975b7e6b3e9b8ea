# SPDX-License-Identifier: Apache-2.0
"""Runs a test program in a network of its own, with a loopback and nothing else, or skips it (exit code 77)."""

import contextlib
import importlib.util
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

SKIPPED = 77
INSIDE = "WAYMARK_TEST_INSIDE"
JUDGES = pathlib.Path(__file__).resolve().parents[2] / ".cache/venv/bin/python"
ROUTE = ["ip", "route", "add", "224.0.0.0/4", "dev", "lo"]


def skip(why):
    print(f"skipped: {why}")
    sys.exit(SKIPPED)


def _python(modules):
    """One that has the modules: this one, or the judges'."""
    if all(importlib.util.find_spec(name) for name in modules):
        return sys.executable
    if not JUDGES.exists() or subprocess.run([JUDGES, "-c", f"import {', '.join(modules)}"], capture_output=True, check=False).returncode:
        skip(f"no {' or no '.join(modules)} in .cache/venv (tests/judges/setup.sh)")
    return JUDGES


def again(*modules, programs=("lcm-gen",), mounts=False):
    """Exit code of this program, begun anew in a network of its own, and with mounts of its own."""
    for name in (*programs, "ip", "unshare"):
        if not shutil.which(name):
            skip(f"there is no {name}")
    unshare = ["unshare", "-n", *(["-m"] if mounts else [])]
    if subprocess.run([*unshare, "true"], capture_output=True, check=False).returncode:
        skip("no right to a network namespace" + (" and a mount namespace" if mounts else ""))
    environment = {**os.environ, INSIDE: "1", "PYTHONDONTWRITEBYTECODE": "1"}
    return subprocess.run([*unshare, _python(modules), *sys.argv], env=environment, check=False).returncode


def begin(*modules, multicast=True, **needed):
    """Returns in the network alone, over whose loopback multicast goes; outside of it the program ends with the exit code of again()."""
    if INSIDE not in os.environ:
        sys.exit(again(*modules, **needed))
    subprocess.run(["ip", "link", "set", "lo", "up", "multicast", "on"], check=True)
    if multicast:
        subprocess.run(ROUTE, check=True)


@contextlib.contextmanager
def small_disk(folder, size):
    """A disk of this size for the time of a with; needs mounts of its own."""
    folder.mkdir(exist_ok=True)
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", folder], check=True)
    try:
        yield folder
    finally:
        subprocess.run(["umount", folder], check=True)


@contextlib.contextmanager
def work_folder(name):
    """A folder for the time of a with."""
    with tempfile.TemporaryDirectory(prefix=f"waymark-{name}-", ignore_cleanup_errors=True) as folder:
        yield pathlib.Path(folder)
