#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The blocks of docs/lcm.md as they stand there: types are made, programs compiled, and while a run sends, the Python and the
C program print its poses and set_pose.py moves it. Needs what lcm_tools.py needs (else 77); Java's part needs a JDK and LCM's jar."""
import os
import pathlib
import re
import shutil
import subprocess
import sys
import time

import lcm_tools
from lcm_tools import in_a_network

LCM_JAR = pathlib.Path("/usr/share/java/lcm.jar")


def blocks():
    """(kind, name) -> text: files to write ("file hear.py") and commands that make something ("make c")."""
    page = (lcm_tools.ROOT / "docs/lcm.md").read_text()
    found = re.findall(r"<!-- (file|make) (\S+) -->\n```\w+\n(.*?)```", page, re.S)
    return {(kind, name): text for kind, name, text in found}


def last_x(text):
    found = re.findall(r"^x (-?[\d.]+) m, y ", text, re.M)
    return float(found[-1]) if found else None


def main():
    lcm_tools.own_network()
    with in_a_network.work_folder("lcm-examples") as work, lcm_tools.ended() as started:
        (work / "msgs").symlink_to(lcm_tools.ROOT / "msgs")
        for folder in ("types", "types-c", "types-java"):
            (work / folder).mkdir()
        all_blocks = blocks()
        for (kind, name), text in all_blocks.items():
            if kind == "file":
                (work / name).write_text(text)
        for (kind, name), text in all_blocks.items():
            if kind == "make" and (name != "java" or (shutil.which("javac") and LCM_JAR.exists())):
                subprocess.run(["sh", "-e", "-c", text], cwd=work, check=True, stdout=subprocess.DEVNULL)
                print(f"made by the commands of {name}")
        lcm_tools.write_recording(work / "recording", 4)
        lcm_tools.config(work / "config.yaml", "odometry", "commands: {lcm: true}\n")
        environment = {**os.environ, "PYTHONPATH": str(work / "types")}
        start = lambda *command: started.append(subprocess.Popen([*command, lcm_tools.URL], cwd=work, env=environment,
                                                                 stdout=subprocess.PIPE, text=True))
        start(sys.executable, "hear.py")
        start("./hear")
        run = lcm_tools.run(work / "recording", work / "config.yaml", work / "out")
        time.sleep(1.5)
        subprocess.run([sys.executable, "set_pose.py", lcm_tools.URL], cwd=work, env=environment, check=True)
        lcm_tools.finish(run)
        time.sleep(0.3)
        for process in started:
            process.terminate()
        heard = [process.communicate(timeout=10)[0] for process in started]
        for name, text in zip(("hear.py", "hear.c"), heard):
            print(f"{name}: {len(text.splitlines())} poses; the last: {text.splitlines()[-1] if text else 'none'}")
            assert last_x(text) is not None and abs(last_x(text) - 100) < 5, f"{name} did not hear the run that set_pose.py moved"
        assert [last_x(text) for text in heard].count(last_x(heard[0])) == 2, "Python and C heard different poses"


if __name__ == "__main__":
    sys.exit(main())
