# SPDX-License-Identifier: Apache-2.0
"""Guests: Debian's PREEMPT_RT kernel under qemu's instruction clock, from images that are made once and kept. What a guest runs and what it
gives back is a folder that both share."""
import lzma
import os
import pathlib
import random
import shutil
import subprocess
import time

from . import HilError

SCRIPTS = pathlib.Path(__file__).resolve().parent.parent / "guest"
# Two controllers a bus: one receives, one plays. SJA1000 on PCI is what Debian's kernel and qemu both have.
_BUS = ["-object", "can-bus,id=cb{0}", "-device", "kvaser_pci,canbus=cb{0}", "-device", "kvaser_pci,canbus=cb{0}"]
# Instruction clocks: 250 million a second, idle time is the host's; 500 million, idle time is skipped, so that who sleeps
# wakes in time whatever else the host does; 1000 million, which is qemu's largest and less than any board's, idle time is the host's, as
# a disk is waited for; as that, but idle time is skipped.
SLOW, FAST, SYSTEM, BOARD = "shift=2,sleep=on", "shift=1,sleep=off", "shift=0,sleep=on", "shift=0,sleep=off"
# Million instructions a second of a guest's processor for `waymark hil`: of those that one core of a board does, 1400 to 4000 (docs/cross.md).
MIPS, MIPS_LEAST, MIPS_MOST = 2000, 1000, 4000
GUEST_S = 3600  # of a processor's time: a busy desk gives a guest a tenth of one
BUSY_DESK = 10
# An emulated processor has nothing to mitigate, and each barrier costs. A five-level page table is a longer way for each page.
_KERNEL = "mitigations=off no5lvl"
_ARM = {"qemu": ["qemu-system-aarch64", "-machine", "virt", "-cpu", "cortex-a57"], "console": "ttyAMA0"}
# What a guest is made of, by Debian's name of its architecture; `cc` makes helpers for it.
MACHINES = {
    # Without fast string instructions: qemu counts each byte of one as an instruction, a processor moves 32 bytes a cycle. Zeroing
    # a run's memory took a quarter of its start.
    "amd64": {"qemu": ["qemu-system-x86_64", "-machine", "q35", "-cpu", "max,-erms,-fsrm"], "console": "ttyS0", "cc": "cc"},
    "arm64": {**_ARM, "cc": "aarch64-linux-gnu-gcc"},
    "armhf": {**_ARM, "cc": "arm-linux-gnueabihf-gcc"},
}
# Debian's packages of the programs that making and booting a guest needs.
_NEEDS = {"qemu-system-x86_64": "qemu-system-x86", "qemu-system-aarch64": "qemu-system-arm", "mmdebstrap": "mmdebstrap", "cpio": "cpio",
          "mke2fs": "e2fsprogs", "gcc-12": "gcc-12", "make": "make", "aarch64-linux-gnu-gcc": "gcc-aarch64-linux-gnu",
          "qemu-arm-static": "qemu-user-static", "qemu-aarch64-static": "qemu-user-static"}


def at_rate(arch, mips):
    """(the machine, words for its kernel) for so many million instructions a second by the guest's own clock. qemu's instruction clock does 1000 at
    most, with a counter of time at 1 GHz. A guest that takes this counter for a faster one has a longer second, with more instructions."""
    machine = dict(MACHINES[arch])
    if mips == MIPS_LEAST:
        return machine, ""
    if arch == "amd64":  # the counter's rate is not measured again, and the kernel does not compare it with slower clocks
        return machine, f"tsc_early_khz={1000 * mips} tsc=reliable"
    machine["qemu"] = [*machine["qemu"][:-1], f"{machine['qemu'][-1]},cntfrq={1000000 * mips}"]
    return machine, ""


def buses(count):
    """Options for so many buses."""
    return [word.format(number) for number in range(count) for word in _BUS]


def cache():
    """Where images are kept."""
    if given := os.environ.get("WAYMARK_HIL_CACHE"):
        return pathlib.Path(given)
    return pathlib.Path(os.environ.get("XDG_CACHE_HOME") or pathlib.Path.home() / ".cache") / "waymark/hil"


def folder_of(arch):
    """Where an architecture's image is: one for all tests."""
    return cache() if arch == "amd64" else cache() / arch


def missing(arch, has_image=False):
    """Debian packages that are missing for a guest of this architecture."""
    programs = [MACHINES[arch]["qemu"][0]]
    if not has_image:
        programs += ["mmdebstrap", "cpio", "mke2fs", "make"] + (["gcc-12"] if arch == "amd64" else ["aarch64-linux-gnu-gcc"])
        programs += {"arm64": ["qemu-aarch64-static"], "armhf": ["qemu-arm-static"]}.get(arch, [])
    path = os.environ.get("PATH", "") + ":/usr/sbin:/sbin"
    return sorted({_NEEDS[program] for program in programs if not shutil.which(program, path=path)})


def prepare(arch, folder, out=None):
    """Makes the image of an architecture in a folder, where it is not there yet: minutes the first time."""
    image = folder / "image"
    if packages := missing(arch, (image / "made_of").is_file()):
        raise HilError(f"a guest needs Debian packages that are missing: sudo apt-get install {' '.join(packages)}")
    done = subprocess.run(["bash", SCRIPTS / "prepare.sh", image, arch], stdout=out, stderr=subprocess.STDOUT if out else None, check=False)
    if done.returncode and (packages := missing(arch)):  # there is an image, of an older kernel
        raise HilError(f"a new image needs packages that are not installed: sudo apt-get install {' '.join(packages)}")
    if done.returncode:
        raise HilError(f"the guest's image was not made (exit code {done.returncode}){f': {out.name}' if out else ''}")
    return image


def kernel_of(image):
    """The kernel to boot: for x86-64 unpacked, once, beside its compressed one, as unpacking it in a guest takes seconds of each start. The layout is of
    Linux' Documentation/arch/x86/boot.rst: payload_offset and payload_length at 0x248, counted from the end of setup_sects + 1 sectors."""
    packed, unpacked = image / "vmlinuz", image / "vmlinux"
    if unpacked.is_file() and unpacked.stat().st_mtime >= packed.stat().st_mtime:
        return unpacked
    data = packed.read_bytes()
    first = (data[0x1F1] + 1) * 512 + int.from_bytes(data[0x248:0x24C], "little")
    payload = data[first:first + int.from_bytes(data[0x24C:0x250], "little")]
    if data[0x202:0x206] != b"HdrS" or not payload.startswith(b"\xfd7zXZ"):
        return packed  # another architecture's, or packed another way
    part = image / f"vmlinux.{os.getpid()}"
    try:
        part.write_bytes(lzma.LZMADecompressor().decompress(payload))
        part.replace(unpacked)  # two that begin at once write the same
    except (OSError, lzma.LZMAError):  # an image of another user, a full disk
        part.unlink(missing_ok=True)
        return packed
    return unpacked


def command_of(image, machine, share, script, devices=(), clock=SLOW, init="", memory_mb=1024):
    """qemu's command line: guest/SCRIPT is run in the guest; `share` is its folder /host."""
    return [str(word) for word in (
        *machine["qemu"], "-accel", "tcg,thread=single", "-smp", "1",
        "-icount", clock, "-m", memory_mb, "-no-reboot",
        "-kernel", kernel_of(image), "-initrd", image / "init.cpio.gz",
        "-append", f"console={machine['console']} quiet panic=-1 {_KERNEL} hil={script} {init}",
        "-drive", f"file={image}/root.ext4,if=virtio,format=raw,readonly=on",
        "-virtfs", f"local,path={share},mount_tag=host,security_model=none,id=host",
        "-display", "none", "-monitor", "none", "-serial", "stdio", *(() if "-nic" in devices else ("-nic", "none")), *devices)]


def processor_s(pid):
    """A process's time on processors until now."""
    try:
        words = pathlib.Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()
    except OSError:
        return 0.0
    return (int(words[11]) + int(words[12])) / os.sysconf("SC_CLK_TCK")


def boot(command, log, limit_s=GUEST_S, watch=None):
    """Runs a guest, for so much of a processor's time; what it prints is kept in `log`, and new lines go to `watch`. Judged by its last word, not by qemu's. After the word
    NO MORE POWER it is killed at a random moment, as a cut of the power would: what it has given to its disk is there."""
    with open(log, "w", encoding="utf-8") as out:
        guest = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=out, stderr=subprocess.STDOUT)
    end_s, has_power, is_late, seen = time.monotonic() + BUSY_DESK * limit_s, True, False, 0
    try:
        while guest.poll() is None:
            text = log.read_text(errors="replace")
            if watch:
                lines = text.splitlines(keepends=True)
                lines = lines if not lines or lines[-1].endswith("\n") else lines[:-1]
                for line in lines[seen:]:
                    watch(line.strip())
                seen = len(lines)
            has_power = "NO MORE POWER" not in text
            if not has_power:
                time.sleep(random.uniform(0, 3))
            is_late = has_power and (processor_s(guest.pid) > limit_s or time.monotonic() > end_s)
            if not has_power or is_late:
                guest.kill()
                guest.wait()
            time.sleep(0.5)
    finally:
        if guest.poll() is None:
            guest.kill()
            guest.wait()
    if is_late:
        with open(log, "a", encoding="utf-8") as out:
            out.write(f"\nthe guest was ended by the desk: it was not done after {limit_s:.0f} s of a processor, or {BUSY_DESK * limit_s:.0f} s in all\n")
    return "GUEST-RC 0" in log.read_text(errors="replace") or not has_power
