# SPDX-License-Identifier: Apache-2.0
"""`waymark hil`: a recording played into a target, and a verdict."""
import argparse
import json
import os
import pathlib
import re
import shlex
import shutil
import signal
import subprocess
import sys
import time

from waymark_fleet.plan import PlanError, desk_program

from . import HilError, compare, fault_judge, guest, limits, page, recording, scenario, targets, verdict
from .judge import Judge, begin_desk
from .progress import Progress
from .replays import Replays

EXAMPLES = """examples:
  waymark hil drive --config robot.yaml --guest amd64
  waymark hil drive --config robot.yaml --host pi@robot --can can0=can1 --faults faults.yaml
  waymark hil drive --config robot.yaml --guest amd64 --compare released/bin/waymark build/bin/waymark
  waymark hil --compare nightly/monday nightly/tuesday
docs/hil.md has a board, step by step. Exit code: 0 all is within its limits, 1 something is not, 2 usage."""


def parser():
    """The command line."""
    out = argparse.ArgumentParser(prog="waymark hil", formatter_class=argparse.RawDescriptionHelpFormatter, epilog=EXAMPLES,
                                  description="Plays a recording into the CAN interfaces, cameras and LCM of a target, runs the robot's program there, and judges its "
                                              "poses, log, losses, deadlines and health. Writes a page, result.json and JUnit XML.")
    out.add_argument("recording", metavar="REC", nargs="?", help="folder in the recording format")
    out.add_argument("--config", metavar="FILE", help="the robot's configuration; devices and files come from the recording where it has none")
    where = out.add_mutually_exclusive_group()
    where.add_argument("--guest", metavar="ARCH", choices=sorted(guest.MACHINES), help="a guest with a real-time kernel and emulated controllers: amd64, arm64 or armhf")
    where.add_argument("--host", metavar="USER@BOARD", help="a board over ssh, with Waymark's package installed")
    where.add_argument("--local", action="store_true", help="this computer: vcan and v4l2loopback, as root")
    out.add_argument("--out", metavar="FOLDER", help="default: hil-NAME-TARGET")
    out.add_argument("--faults", metavar="FILE", help="what breaks, and what must be stated about it (docs/faults.md)")
    out.add_argument("--limits", metavar="FILE", help="other limits than the usual ones")
    out.add_argument("--from", dest="from_s", metavar="S", type=float, default=0.0, help="begin S seconds after the recording's first datum")
    out.add_argument("--until", dest="until_s", metavar="S", type=float, help="end there")
    out.add_argument("--can", metavar="RUN=PLAYER", action="append", default=[], help="--host: what the run hears on RUN is sent on PLAYER, wired to it")
    out.add_argument("--ssh", metavar="OPTIONS", default="", help="--host: more options of ssh, as '-p 2222'")
    out.add_argument("--record", action="store_true", help="the target records beside the run, and its stamps are judged datum by datum")
    out.add_argument("--program", metavar="FILE", help="the waymark of --guest amd64 and --local; this one by default")
    out.add_argument("--package", metavar="FILE", help="the package that a guest installs; needed for arm64 and armhf")
    out.add_argument("--mips", metavar="N", type=int, default=guest.MIPS,
                     help=f"million instructions a second of a guest's one processor, {guest.MIPS_LEAST} to {guest.MIPS_MOST} (default {guest.MIPS})")
    out.add_argument("--played", metavar="FILE", help="--local: a waymark with a recording in the place of the kernel's drivers (build/tests/waymark-played)")
    out.add_argument("--compare", metavar=("BEFORE", "AFTER"), nargs=2, help="folders of two tests; or with REC two programs, packages or configurations, which are tested first")
    out.add_argument("--json", action="store_true", help="print result.json")
    return out


def _cut(given, rec):
    """(from_s, until_s) of the part that is played."""
    until_s = rec.seconds if given.until_s is None else min(given.until_s, rec.seconds)
    if not 0 <= given.from_s < until_s:
        raise HilError(f"--from {given.from_s:g} --until {until_s:g}: the recording has {rec.seconds:.1f} s")
    return given.from_s, until_s


def _faults(given, waymark):
    """The faults file, checked by `waymark play`."""
    if not given.faults:
        return []
    done = subprocess.run([waymark, "play", given.recording, "--faults", given.faults, "--print-faults"], capture_output=True, text=True, check=False)
    if done.returncode:
        raise HilError((done.stderr.strip() or f"waymark play --print-faults: exit code {done.returncode}").removeprefix("waymark: "))
    return json.loads(done.stdout)["faults"]


def _has_a_disk(faults, from_s, until_s):
    """HilError where the part begins on a full disk: nothing could be judged without the event log."""
    for fault in faults:
        if fault["fault"] == "disk_full" and fault["free_kb"] == 0 and fault["from_s"] <= from_s and fault_judge.is_in(fault, from_s, until_s):
            ends_s = fault.get("until_s")
            raise HilError(f"--from {from_s:g}: the disk is full then (fault '{fault['name']}', from {fault['from_s']:g} s"
                           f"{'' if ends_s is None else f' to {ends_s:g} s'}), so the run would leave no log to judge; begin before it{'' if ends_s is None else ' or after it'}")


def _target(given, waymark):
    pairs = {}
    for word in given.can:
        run, _, player = word.partition("=")
        if not run or not player:
            raise HilError(f"--can {word}: write RUN=PLAYER, as can0=can1")
        pairs[run] = player
    for name in ("program", "package", "played", "config", "faults", "limits"):
        path = getattr(given, name)
        if path and not os.path.isfile(path):
            raise HilError(f"--{name} {path}: is not a file")
    program = pathlib.Path((given.played if given.local else None) or given.program or waymark).resolve()
    if given.host:
        return targets.Host(given.host, shlex.split(given.ssh), pairs)
    if given.guest:
        if not guest.MIPS_LEAST <= given.mips <= guest.MIPS_MOST:
            raise HilError(f"--mips {given.mips}: {guest.MIPS_LEAST} to {guest.MIPS_MOST} million instructions a second are possible")
        return targets.Guest(given.guest, program, given.package, given.mips)
    if given.local:
        return targets.Local(program, given.played)
    raise HilError("where? --guest amd64, --host USER@BOARD or --local (waymark hil --help)")


def _quote(values):
    return " ".join(shlex.quote(str(value)) for value in values)


# Faults that a real controller cannot be made to have.
_VIRTUAL_ALONE = ["bus_off"]


def _player_faults(path, folder, target, buses):
    """faults.yaml for the target: without what its interfaces cannot do, and with the run's interface where a bus goes down. Names of
    those that are left out."""
    text = recording.read_yaml(path)
    run_of, left_out, kept = dict(buses), [], []
    for fault in text["faults"]:
        if fault["fault"] in _VIRTUAL_ALONE and target.where == "guest":
            left_out.append(fault["name"])
            continue
        if fault["fault"] in ("bus_down", "bus_removed") and not target.played and "interface" not in fault and fault.get("bus") in run_of:
            fault["interface"] = run_of[fault["bus"]]
        kept.append(fault)
    (folder / "faults.yaml").write_text(scenario.dump({**text, "faults": kept}), encoding="utf-8")
    return left_out


# A video device without a writer is there and gives nothing: a run states that after two seconds without a picture.
_STALLED_AFTER_S = 2.5


def _as_the_target_has_them(faults, played):
    """The faults as they are on the target: a player cannot unplug a video device, it leaves it without a writer; nor can it leave out a number
    of the device's own count of pictures."""
    out = []
    for fault in faults:
        if fault["fault"] == "camera_unplugged" and not played:
            kept = [statement for statement in fault["health"] if statement["what"] != "text"]
            fault = {**fault, "health": [{**statement, "value": "stalled", "within_s": max(statement["within_s"] or 0, _STALLED_AFTER_S)}
                                         if statement["what"] == "device" and statement["value"] == "absent" else statement for statement in kept]}
        if fault["fault"] == "camera_dropped" and not played:
            fault = {**fault, "health": [{**statement, "not_here": "a video device of a player numbers the pictures that it gets: none is missing by its count"}
                                         if statement["what"] == "counter" and statement["value"] == "lost" else statement for statement in fault["health"]]}
        out.append(fault)
    return out


def _played_world(folder, given, buses, cameras):
    """What drivers in the place of the kernel's read: tests/faults/played_world.h."""
    played = folder / "played"
    played.mkdir()
    (played / "part").write_text(f"{given.from_s:g} {given.until_s or 0:g}\n")
    os.symlink("../recording", played / "recording")
    if given.faults:
        os.symlink("../faults.yaml", played / "faults.yaml")
    (played / "devices").write_text("".join([f"{run} can:{name}\n" for name, run in buses] + [f"{camera['device']} camera:{camera['name']}\n" for camera in cameras]))


def _runner_plan(faults, from_s, end_s, played):
    """faults.plan: those that happen to the computer and its processes, and to adapters that no played driver takes away, in the part that is played."""
    lines = []
    for number, fault in enumerate(faults):
        if fault["by"] != "runner" or (played and fault.get("by_played_driver")) or not fault_judge.is_in(fault, from_s, end_s):
            continue
        until_s = fault.get("until_s")
        numbers = [fault.get(key) for key in ("free_kb", "share", "cpus") if key in fault]
        text = next((fault[key] for key in ("path", "process", "interface", "bus") if fault.get(key)), "-")
        values = [*(f"{value:g}" for value in numbers), *["0"] * (2 - len(numbers))]
        lines.append(f"{number} {fault['from_s']:g} {end_s if until_s is None else max(until_s, fault['from_s']):g} {fault['fault']} {' '.join(values)} {text}\n")
    return "".join(lines)


def _write_plan(folder, given, target, rec, faults, derived, waymark):
    """plan.sh, faults.plan, the scripts of the target; the facts for the judge."""
    config, buses, cameras = derived
    from_s, until_s = _cut(given, rec)
    player = {run: target.player_of(run) for _, run in buses}
    seconds = until_s - from_s
    play = ["--lcm", config["publish"]["lcm_url"], "--channel-prefix", config["publish"].get("channel_prefix", "WAYMARK_")]
    if not target.played:
        for name, run in buses:
            play += ["--can", f"{name}={player[run]}"]
        for camera in cameras:
            play += ["--camera", f"{camera['name']}={camera['device']},{camera['format']}"]
    left_out = []
    if given.faults:
        left_out = _player_faults(given.faults, folder, target, buses)
        play += ["--faults", "faults.yaml"]
    play += ["--from", f"{from_s:g}"] if from_s else []
    play += ["--until", f"{until_s:g}"] if given.until_s is not None else []
    bits = max((bus.bits / max(rec.seconds, 1) for bus in rec.buses), default=0)
    runner = _runner_plan(faults, from_s, until_s, target.played)
    (folder / "faults.plan").write_text(runner)
    is_local = target.where == "local"
    plays = not target.played or bool(rec.streams or rec.has_sightings)
    lines = {"waymark": waymark if is_local else "waymark", "program": target.program if is_local else "waymark", "plays": int(plays), "seconds": f"{seconds:.2f}", "buses": " ".join(f"{run}={player[run]}" for _, run in buses),
             "bitrate": 500000 if bits < 400000 else 1000000, "has_fd": int(any(bus.has_fd for bus in rec.buses)),
             "cameras": " ".join(camera["device"] for camera in cameras), "where": target.where, "played": int(bool(target.played)),
             "url": config["publish"]["lcm_url"], "priority": (config.get("realtime") or {}).get("priority", "80"), "from_s": f"{from_s:g}", "faults": int(bool(runner)), "lead_s": targets.LEAD_S,
             "record": int(given.record)}
    (folder / "plan.sh").write_text("".join(f"{key}={shlex.quote(str(value))}\n" for key, value in lines.items()) + f"play=({_quote(play)})\n")
    shutil.copytree(targets.SCRIPTS, folder / "target")
    played_streams = {f"can:{name}" for name, _ in buses} | {f"camera:{camera['name']}" for camera in cameras} | set(rec.streams)
    unused = [*rec.not_played, *(bus.name for bus in rec.buses if f"can:{bus.name}" not in played_streams),
              *(camera.name for camera in rec.cameras if f"camera:{camera.name}" not in played_streams)]
    return {"recording": rec.path.resolve(), "first_ns": rec.first_ns, "seconds": seconds, "from_s": from_s, "until_s": until_s, "is_cut": until_s < rec.seconds, "where": target.where, "played": bool(target.played), "buses": buses, "faults": _as_the_target_has_them(faults, target.played),
            "prefix": config["publish"].get("channel_prefix", "WAYMARK_"), "rate_hz": float(config["publish"].get("rate_hz", 50)), "unused": unused, "record": given.record, "cameras": [camera["name"] for camera in cameras], "left_out": left_out, "plays": plays,
            "map": str((folder / config["map"]).resolve()) if "map" in config else None}


def _begin_later(config, folder, rec, from_s, waymark):
    """With --from the start pose is where a replay of what comes before ends: that of the recording is of its first moment."""
    if from_s <= 0 or "initial_pose" not in config:
        return
    before = folder / "before"
    done = subprocess.run([waymark, "replay", rec.path, "--config", folder / "robot.yaml", "--until", f"{from_s + 0.2:g}", "--out", before],
                          capture_output=True, text=True, check=False)
    if done.returncode or not scenario.begin_at(config, folder, before / "published.csv", rec.first_ns + round(from_s * 1e9)):
        why = next((line for line in reversed(done.stderr.splitlines()) if line.startswith("waymark: ")), "it publishes no pose")
        raise HilError(f"--from {from_s:g}: a replay up to there has no start pose: {why}")
    shutil.rmtree(before)


def _folder_of(given, rec, target):
    """The test's folder, new: one that has another test's files is refused, unless it is one of ours."""
    name = re.sub(r"[^\w.-]+", "-", f"hil-{rec.name}-{target.name}")
    folder = pathlib.Path(given.out or name)
    if folder.is_dir() and any(folder.iterdir()) and not (folder / "plan.sh").exists() and not (folder / "result.json").exists():
        raise HilError(f"--out {folder}: has other files in it; name another folder")
    shutil.rmtree(folder, ignore_errors=True)
    (folder / "out").mkdir(parents=True)
    return folder.resolve()


def test(given, beside, types):
    """Runs and judges one test. Its result, as result.json has it."""
    waymark = desk_program("waymark", beside)[0]
    sheet = page.sheet(beside)  # a program that is missing is known before the test, not after it
    if not given.config:
        raise HilError("--config FILE is needed: the robot's configuration")
    rec = recording.read(given.recording)
    target = _target(given, waymark)
    faults = _faults(given, waymark)
    _, until_s = _cut(given, rec)
    _has_a_disk(faults, given.from_s, until_s)
    progress = Progress(until_s - given.from_s)
    run_limits, _ = limits.read(given.limits, target.where == "local")
    begun_s = time.monotonic()
    target.prepare(progress)
    folder = _folder_of(given, rec, target)
    survives = any(fault["fault"] in ("process_killed", "power_cut") for fault in faults)
    derived = scenario.derive(given.config, rec, folder, target.single_core, survives)
    os.symlink(rec.path.resolve(), folder / "recording")
    _begin_later(derived[0], folder, rec, given.from_s, waymark)
    if target.played:
        _played_world(folder, given, derived[1], derived[2])
    facts = _write_plan(folder, given, target, rec, faults, derived, waymark)
    progress.step(f"{target.name}: {rec.name}, {facts['seconds']:.0f} s")
    checks, replays = verdict.Checks(), Replays(waymark)
    try:
        if target.where != "local":  # beside the target, where that takes nothing from it
            begin_desk(replays, folder, facts)
        is_good = target.run(folder, facts, progress)
        progress.step("judging")
        judge = Judge(checks, folder, facts, run_limits, replays, types)
        judge.all(is_good)
    finally:
        replays.end()
    progress.end()
    computer = (folder / "out/computer.txt").read_text(errors="replace").split("\n") if (folder / "out/computer.txt").exists() else []
    result = {"name": f"waymark hil {rec.name}", "recording": rec.name, "config": str(given.config), "target": target.name, "computer": [*(line for line in computer if line), *target.computer],
              "seconds": facts["seconds"], "took_s": round(time.monotonic() - begun_s, 1), "figures": {k: v for k, v in judge.figures.items() if v is not None},
              "threads": getattr(judge, "threads", []), "play": judge.played.get("streams", []), "per_second": page.per_second(judge.series)}
    result = verdict.write(folder, result, checks, judge.said[-20000:])
    (folder / "report.html").write_text(page.make(sheet, result, judge.series, faults), encoding="utf-8")
    for name in ("same", "desk", "state"):
        shutil.rmtree(folder / name, ignore_errors=True)
    for again in folder.glob("again-*"):
        shutil.rmtree(again)
    return folder, result


def text_of(folder, result):
    """The verdict for a terminal."""
    rows, lines = result["checks"], []
    for group in dict.fromkeys(row["group"] for row in rows):
        mine = [row for row in rows if row["group"] == group]
        bad = [row for row in mine if row["status"] == verdict.FAILED]
        word = "FAILED" if bad else "good" if any(row["status"] == verdict.PASSED for row in mine) else "-"
        texts = [f"{row['name']}: {row['text']}" for row in bad] or [row["text"] for row in mine]
        lines.append(f"{word:7} {group}: " + "; ".join(dict.fromkeys(texts)))
    counts = {status: sum(row["status"] == status for row in rows) for status in (verdict.PASSED, verdict.FAILED, verdict.SKIPPED)}
    lines.append(f"{result['verdict']}: {counts['passed']} checks passed, {counts['failed']} failed, {counts['skipped']} not judged, in {result['took_s']:.0f} s; "
                 f"{folder}/report.html, junit.xml, result.json")
    return "\n".join(lines)


def _two(given, beside, types):
    """Tests two programs, packages or configurations on the same target. Their folders."""
    out = pathlib.Path(given.out or "hil-compare")
    folders = []
    for side, path in zip(("before", "after"), given.compare):
        if not os.path.isfile(path):
            raise HilError(f"--compare {path}: is not a file; with REC give programs, packages (.deb) or configurations (.yaml)")
        words = argparse.Namespace(**vars(given))
        key = "config" if path.endswith((".yaml", ".yml")) else "package" if path.endswith(".deb") else "played" if given.played else "program"
        setattr(words, key, path)
        words.out, words.compare = str(out / side), None
        folder, result = test(words, beside, types)
        print(f"{side}: {path}\n{text_of(folder, result)}")
        folders.append(folder)
    return folders


def main(argv=None, beside=None, types=None):
    """The program."""
    given = parser().parse_args(argv)
    beside = beside or pathlib.Path(sys.argv[0]).resolve().parent
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
    signal.signal(signal.SIGHUP, lambda *_: sys.exit(129))
    try:
        if given.compare and not given.recording:
            return compare.main(given, *given.compare, beside)
        if not given.recording:
            raise HilError("a recording is needed, or --compare with the folders of two tests (waymark hil --help)")
        if given.compare:
            return compare.main(given, *_two(given, beside, types), beside)
        folder, result = test(given, beside, types)
        print(json.dumps(result, indent=1) if given.json else text_of(folder, result))
        return 1 if result["verdict"] == verdict.FAILED else 0
    except (HilError, PlanError, OSError) as error:
        print(f"waymark hil: {error}", file=sys.stderr)
        return 2
    except (KeyboardInterrupt, subprocess.TimeoutExpired) as error:
        print(f"waymark hil: stopped ({type(error).__name__}); the target is as it was", file=sys.stderr)
        return 130
