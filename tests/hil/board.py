# SPDX-License-Identifier: Apache-2.0
"""`waymark hil --host` against a board, which is a guest of its own: over ssh, with the kernel's virtual CAN. As a user with sudo once to its end
and once interrupted in the middle; as root; as a user without sudo, who is told. Each time the board is as it was."""
import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time

import drives

SECONDS = 12


def free_port():
    """A free port of this computer."""
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


def prepare(work, root, here, simulate):
    """A drive, a key, and a network that forwards a port of this computer to the board's."""
    recording, folder = drives.make(work, "board", simulate, root / "config/worlds/crossing.yaml", "--no-video", "--duration", str(SECONDS))
    key = work / "board-key"
    for path in (key, key.with_suffix(".pub")):
        path.unlink(missing_ok=True)
    subprocess.run(["ssh-keygen", "-q", "-t", "ed25519", "-N", "", "-f", key], check=True)
    shutil.copy(key.with_suffix(".pub"), folder / "key.pub")
    # Not part of the image: no other test needs it. Of another architecture the lists are those of its kernel.
    own = work / "image/arm64.apt/apt.conf"
    found = subprocess.run(["apt-get", "download", "-q", "sudo"], cwd=folder, check=False, env={**os.environ, **({"APT_CONFIG": str(own)} if own.is_file() else {})})
    if found.returncode:
        print("board: Debian's package sudo could not be fetched")
    (work / "share/out/board-done").unlink(missing_ok=True)
    for name in ("whole", "root", "guest", "broken"):
        (work / f"board-{name}.txt").unlink(missing_ok=True)
    port = free_port()
    (work / "board-port").write_text(str(port))
    return ["-nic", f"user,model=virtio-net-pci,hostfwd=tcp:127.0.0.1:{port}-:22"]


def command(work, waymark, out, user, *words):
    """The one command."""
    root = drives.pathlib.Path(__file__).resolve().parents[2]
    ssh = f"-p {(work / 'board-port').read_text()} -i {work}/board-key -o StrictHostKeyChecking=no -o UserKnownHostsFile=/dev/null -o LogLevel=ERROR -o ConnectTimeout=120"
    return [sys.executable, waymark.parent / "waymark-hil", work / "board-recording", "--config", root / "config/datasets/crossing-points.yaml",
            "--host", f"{user}@127.0.0.1", "--ssh", ssh, "--out", work / out, *words]


def at_the_desk(work, waymark):
    """All tests; their output is kept for the judge."""
    try:
        for name, user, words in (("whole", "pi", ()), ("root", "root", ("--until", "4")), ("guest", "guest", ())):
            done = subprocess.run(command(work, waymark, f"board-{name}", user, *words), capture_output=True, text=True, timeout=900)
            (work / f"board-{name}.txt").write_text(f"{done.returncode}\n{done.stdout}{done.stderr}")
        broken = subprocess.Popen(command(work, waymark, "board-broken", "pi"), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        end_s = time.monotonic() + 400
        for line in broken.stdout:
            if line.startswith("driving,") or time.monotonic() > end_s:
                break
        broken.send_signal(signal.SIGTERM)
        broken.communicate(timeout=120)
        (work / "board-broken.txt").write_text(f"{broken.returncode}\n")
    finally:
        (work / "share/out/board-done").touch()


def watch(work, waymark):
    """What begins the tests when the board is ready."""
    def line(text):
        print(text, flush=True)
        if text == "BOARD-READY":
            threading.Thread(target=at_the_desk, args=(work, waymark), daemon=True).start()
    return line


def judge(work, waymark, root):
    failures = []
    for name in ("whole", "root"):
        text = (work / f"board-{name}.txt").read_text() if (work / f"board-{name}.txt").exists() else "none\nno test was begun"
        print(text)
        path = work / f"board-{name}/result.json"
        result = json.loads(path.read_text()) if path.exists() else {"figures": {}, "checks": []}
        if not text.startswith("0\n") or not result["figures"].get("same_bits"):
            failures.append(f"board: the test over ssh ({name}) is not good")
    refused = (work / "board-guest.txt").read_text() if (work / "board-guest.txt").exists() else "none"
    print(refused)
    if not refused.startswith("2\n") or "may not use sudo" not in refused:
        failures.append("board: a user without sudo is not told so")
    broken = (work / "board-broken.txt").read_text() if (work / "board-broken.txt").exists() else "none"
    if broken.startswith(("0", "none")):
        failures.append(f"board: the test that was interrupted ended with {broken.strip()}")
    return failures
