# SPDX-License-Identifier: Apache-2.0
"""`waymark hil --host` against a board, which is a guest of its own: over ssh, with the kernel's virtual CAN. Once to its end, once interrupted in
the middle; both times the board is as it was."""
import json
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
    (work / "share/out/board-done").unlink(missing_ok=True)
    port = free_port()
    (work / "board-port").write_text(str(port))
    return ["-nic", f"user,model=virtio-net-pci,hostfwd=tcp:127.0.0.1:{port}-:22"]


def command(work, waymark, out):
    """The one command."""
    root = drives.pathlib.Path(__file__).resolve().parents[2]
    ssh = f"-p {(work / 'board-port').read_text()} -i {work}/board-key -o StrictHostKeyChecking=no -o UserKnownHostsFile=/dev/null -o LogLevel=ERROR -o ConnectTimeout=120"
    return [sys.executable, waymark.parent / "waymark-hil", work / "board-recording", "--config", root / "config/datasets/crossing-points.yaml",
            "--host", "root@127.0.0.1", "--ssh", ssh, "--out", work / out]


def at_the_desk(work, waymark):
    """Both tests; their output is kept for the judge."""
    try:
        done = subprocess.run(command(work, waymark, "board-whole"), capture_output=True, text=True, timeout=900)
        (work / "board-whole.txt").write_text(f"{done.returncode}\n{done.stdout}{done.stderr}")
        broken = subprocess.Popen(command(work, waymark, "board-broken"), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
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
    whole = (work / "board-whole.txt").read_text() if (work / "board-whole.txt").exists() else "none\nno test was begun"
    print(whole)
    result = json.loads((work / "board-whole/result.json").read_text()) if (work / "board-whole/result.json").exists() else {"figures": {}, "checks": []}
    if not whole.startswith("0\n") or not result["figures"].get("same_bits"):
        failures.append("board: the test over ssh is not good")
    broken = (work / "board-broken.txt").read_text() if (work / "board-broken.txt").exists() else "none"
    if broken.startswith(("0", "none")):
        failures.append(f"board: the test that was interrupted ended with {broken.strip()}")
    return failures
