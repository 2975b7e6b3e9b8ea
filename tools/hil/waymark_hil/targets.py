# SPDX-License-Identifier: Apache-2.0
"""Where a test runs: this computer, a guest, or a board over ssh. Each gets the test's folder, runs target/drive.sh in it, and gives out/ back."""
import os
import pathlib
import re
import shlex
import shutil
import signal
import subprocess
import tarfile

from . import HilError, guest

SCRIPTS = pathlib.Path(__file__).resolve().parent.parent / "target"
# CLOCK_MONOTONIC seconds from the run's start to the recording's first datum: pictures' devices are opened twice a second.
LEAD_S = 4


class Target:
    """A place with interfaces. `name` is for people; `plan` has what plan.sh needs beside the recording's facts."""

    name, where, single_core = "", "local", False
    computer = []  # facts that the target does not have of itself
    played = None  # program with a recording in the place of the kernel's drivers

    def player_of(self, interface):
        """The interface on which the player sends what the run receives on `interface`."""
        return interface

    def prepare(self, progress):
        """Before the first test."""

    def run(self, folder, facts, progress):
        """Runs the test in `folder`; False where the target's part failed."""
        raise NotImplementedError


def _follow(process, log, progress):
    """The lines of a process, into a file and to the progress."""
    with open(log, "w", encoding="utf-8") as out:
        for line in process.stdout:
            out.write(line)
            out.flush()
            progress.line(line.strip())
    return process.wait()


def _end(process):
    """Ends a process that we began, with what it began."""
    if process.poll() is None:
        process.send_signal(signal.SIGTERM)
        try:
            process.wait(timeout=10)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def _run(command, log, progress):
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace")
    try:
        return _follow(process, log, progress)
    finally:
        _end(process)


class Local(Target):
    """This computer, in namespaces of its own for network, mounts and processes: what is begun there ends with them."""

    name, where = "local", "local"

    def __init__(self, program, played=None):
        self.program, self.played = program, played
        if played:
            self.name = "local, played devices"

    def prepare(self, progress):
        if os.geteuid() != 0:
            raise HilError("--local makes interfaces and a network of its own: run it as root (sudo), or use --guest amd64")
        if subprocess.run(["unshare", "-n", "-m", "-p", "--fork", "true"], capture_output=True, check=False).returncode:
            raise HilError("--local: namespaces can't be made on this computer (unshare -n -m -p fails)")
        if self.played:
            return
        if not shutil.which("modprobe", path=os.environ.get("PATH", "") + ":/usr/sbin:/sbin"):
            raise HilError("--local needs modprobe, which is not installed: sudo apt-get install kmod")
        for module in ("vcan", "v4l2loopback"):
            if not pathlib.Path(f"/sys/module/{module}").exists() and subprocess.run(["modprobe", "-n", module], capture_output=True, check=False).returncode:
                raise HilError(f"--local: this kernel has no module {module}; --guest amd64 has one of its own")

    def run(self, folder, facts, progress):
        inside = f"ip link set lo up; ip route add 224.0.0.0/4 dev lo; exec bash {shlex.quote(str(folder / 'target/drive.sh'))}"
        command = ["unshare", "-n", "-m", "-p", "--fork", "--kill-child", "--mount-proc", "bash", "-c", inside]
        return _run(command, folder / "target.log", progress) == 0


class Guest(Target):
    """A guest of its own for each test, with one processor whose clock counts instructions."""

    where, single_core = "guest", True

    def __init__(self, arch, program, package, mips=guest.MIPS):
        self.arch, self.program, self.package, self.mips = arch, program, package, mips
        self.name = f"guest {arch}" + ("" if mips == guest.MIPS else f", {mips} MIPS")
        self.computer = [f"one processor that does {mips} million instructions a second"]
        self.folder = guest.folder_of(arch)
        if arch != "amd64" and not package:
            raise HilError(f"--guest {arch} needs --package FILE.deb, Waymark's package for {arch} (./dev board arm64 package)")

    def player_of(self, interface):
        return f"p-{interface}"

    def prepare(self, progress):
        self.folder.mkdir(parents=True, exist_ok=True)
        if not (self.folder / "image/made_of").is_file():
            progress.say(f"making the image of the guest in {self.folder}: some minutes, once")
        with open(self.folder / "prepare.log", "w", encoding="utf-8") as log:
            self.image = guest.prepare(self.arch, self.folder, log)

    def run(self, folder, facts, progress):
        share = folder / "share"
        shutil.rmtree(share, ignore_errors=True)
        share.mkdir()
        (share / "out").mkdir()
        shutil.copytree(guest.SCRIPTS, share / "guest")
        shutil.copy(SCRIPTS / "guest.sh", share / "guest/hil.sh")
        if self.package:
            shutil.copy(self.package, share / "waymark.deb")
        else:
            shutil.copy(self.program, share / "waymark")
            shutil.copy(self.program.parent / "waymark-play", share / "waymark-play")
        with tarfile.open(share / "test.tar", "w", dereference=True) as tar:
            for path in sorted(folder.iterdir()):
                if path.name not in ("share", "out", "state"):
                    tar.add(path, path.name)
        megabytes = (share / "test.tar").stat().st_size >> 20
        machine, words = guest.at_rate(self.arch, self.mips)
        command = guest.command_of(self.image, machine, share, "hil.sh", guest.buses(len(facts["buses"])), guest.BOARD, words, memory_mb=1024 + 4 * megabytes)
        limit_s = 300 + 20 * facts["seconds"]
        is_good = guest.boot(command, folder / "target.log", limit_s, progress.line)
        for path in (share / "out").iterdir():
            (shutil.copytree if path.is_dir() else shutil.copy)(path, folder / "out" / path.name)
        shutil.rmtree(share, ignore_errors=True)
        return is_good


class Host(Target):
    """A board over ssh: Waymark's package and what the doctor asks for, nothing else."""

    where = "host"

    def __init__(self, address, options, pairs):
        self.address, self.options, self.pairs, self.as_root = address, options, pairs, ""
        self.name = f"host {address}"

    def player_of(self, interface):
        return self.pairs.get(interface, interface)

    def _ssh(self, command):
        return ["ssh", "-o", "BatchMode=yes", *self.options, self.address, command]

    def _ask(self, command):
        done = subprocess.run(self._ssh(command), capture_output=True, text=True, check=False, stdin=subprocess.DEVNULL, timeout=120)
        if done.returncode == 255:  # of ssh itself
            raise HilError(f"{self.address}: no connection: {(done.stderr.strip() or 'ssh has no reason').splitlines()[-1]}; try `ssh {self.address} true`")
        if done.returncode:
            raise HilError(f"{self.address}: `{command}`: {(done.stderr.strip() or done.stdout.strip() or 'no output').splitlines()[-1]}")
        return done.stdout.strip()

    def prepare(self, progress):
        if not shutil.which("ssh"):
            raise HilError("--host needs ssh, which is not installed: sudo apt-get install openssh-client")
        # Interfaces, modules and real-time priorities take root, as the service of the run has it.
        found = self._ask("command -v bash >/dev/null && waymark --version && nproc && id -u && { sudo -n true >/dev/null 2>&1 && echo sudo || echo alone; }")
        version, *_, processors, user, may = found.splitlines()
        self.single_core = processors == "1"
        if user != "0" and may != "sudo":
            raise HilError(f"{self.address}: this user is not root, and may not use sudo without a password (`sudo -n true` fails): "
                           "add it to /etc/sudoers.d with NOPASSWD: ALL, or name root@...")
        self.as_root = "" if user == "0" else "sudo -n "
        progress.say(f"{self.address}: {version}{', by sudo' if self.as_root else ''}")

    def run(self, folder, facts, progress):
        place = self._ask("mktemp -d /tmp/waymark-hil-XXXXXX")
        if not re.fullmatch(r"/tmp/waymark-hil-\w+", place):
            raise HilError(f"{self.address}: mktemp printed {place!r}")
        try:
            sent = subprocess.Popen(self._ssh(f"tar -C {place} -xf -"), stdin=subprocess.PIPE)
            with tarfile.open(fileobj=sent.stdin, mode="w|", dereference=True) as tar:
                for path in sorted(folder.iterdir()):
                    if path.name not in ("out", "state"):
                        tar.add(path, path.name)
            sent.stdin.close()
            if sent.wait():
                raise HilError(f"{self.address}: the test could not be copied to {place}")
            code = _run(self._ssh(f"exec {self.as_root}bash {place}/target/drive.sh"), folder / "target.log", progress)
            fetched = subprocess.Popen(self._ssh(f"{self.as_root}tar -C {place} -cf - out"), stdout=subprocess.PIPE, stdin=subprocess.DEVNULL)
            with tarfile.open(fileobj=fetched.stdout, mode="r|") as tar:
                tar.extractall(folder, **({"filter": "data"} if hasattr(tarfile, "data_filter") else {}))
            if fetched.wait():
                raise HilError(f"{self.address}: out/ could not be copied back")
            return code == 0
        finally:
            subprocess.run(self._ssh(f"{self.as_root}rm -rf {place}"), check=False, stdin=subprocess.DEVNULL, capture_output=True, timeout=60)
