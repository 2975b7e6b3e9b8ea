# SPDX-License-Identifier: Apache-2.0
"""Runs a test program in a network of its own, or skips it."""

import importlib.util
import os
import shutil
import subprocess
import sys

INSIDE = "WAYMARK_TEST_INSIDE"


def missing(modules):
    """The reason why it can't run here; None."""
    for name in modules:
        if importlib.util.find_spec(name) is None:
            return f"no {name} in .cache/venv (tests/judges/setup.sh)"
    if not shutil.which("lcm-gen"):
        return "no lcm-gen"
    if not shutil.which("ip") or subprocess.run(["unshare", "-n", "true"], capture_output=True, check=False).returncode:
        return "no right to a network namespace"
    return None


def begin(*modules):
    """Returns in the network alone; outside of it the program begins anew in one, and ends with its exit code."""
    if INSIDE in os.environ:
        return
    why = missing(modules)
    if why:
        print(f"skipped: {why}")
        sys.exit(77)
    sys.exit(subprocess.run(["unshare", "-n", sys.executable, *sys.argv], env={**os.environ, INSIDE: "1"}, check=False).returncode)
