# SPDX-License-Identifier: Apache-2.0
"""Judges what came back from a target: out/ of a test's folder, against replays at the desk and the limits."""
import json
import re

from . import HilError, fault_judge, lcm_log, poses, samples, stamps

_WAKE_MS = 0.2  # a wake-up that is late by less than this is in order, whatever cyclictest measures
_SETTLED_S = 3.0  # devices that are looked for twice a second are found, and the first buffers are thrown away
_MIN_RATE_HZ = 30  # fewer poses of a second that can be compared are no comparison
_LOST = ["lost", "dropped", "late", "overflows", "malformed", "not_finite", "out_of_order", "future"]


def load(path, default=None):
    """JSON of a file that may be missing or empty."""
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return default


def part(facts):
    """Words for a replay of the part that was played, and a little more: the poses of its end lie between two."""
    words = ["--from", f"{facts['from_s']:g}"] if facts["from_s"] > 0 else []
    return words + (["--until", f"{facts['until_s'] + 1:g}"] if facts["is_cut"] else [])


def begin_desk(replays, folder, facts):
    """Begins the replay of the part: it needs nothing of the target."""
    replays.begin(folder / "desk", facts["recording"], "--config", folder / "robot.yaml", *part(facts))


class Judge:
    """One test. `facts` are the desk's data about it: see hil.py."""

    def __init__(self, checks, folder, facts, limits, replays, types):
        self.checks, self.folder, self.out, self.facts, self.limits, self.replays = checks, folder, folder / "out", facts, limits, replays
        self.figures, self.series, self.notes = {}, {}, []
        self.types = types
        self.drives = sorted((path for path in self.out.glob("drive*") if path.is_dir()), key=lambda path: (len(path.name), path.name))
        self.played = load(self.out / "played.json", {})
        self.said = (self.out / "said.txt").read_text(errors="replace") if (self.out / "said.txt").exists() else ""
        start = (self.out / "start_ns").read_text().strip() if (self.out / "start_ns").exists() else ""
        # The recording's first datum on the target's clock; --from is due at the stamp of the file.
        self.start_ns = int(start) - round(facts["from_s"] * 1e9) if start.isdigit() else None
        self.faults = facts.get("faults") or []
        self.before_faults_s = min((fault["from_s"] for fault in self.faults if fault_judge.is_in(fault, facts["from_s"], facts["until_s"])), default=float("inf"))
        self.is_broken = self.before_faults_s < float("inf")  # something is, in the part that was played
        # The fault that cuts an event log short.
        self.full_disk = next((fault for fault in self.faults if fault["fault"] == "disk_full" and fault.get("free_kb", 0) == 0
                               and fault_judge.is_in(fault, facts["from_s"], facts["until_s"])), None)
        self.log_ends_ns = None  # of a log that is cut short, on the target's clock

    def begin_replays(self):
        """Begins all replays; each judgement waits for its own."""
        begin_desk(self.replays, self.folder, self.facts)
        for drive in self.drives:
            words = ["--map", self.facts["map"]] if self.facts.get("map") else []
            self.replays.begin(self.folder / f"again-{drive.name}", drive / "events.wmlog", *words)
        if self.drives:
            self.replays.begin(self.folder / "same", self.facts["recording"], "--config", self.folder / "robot.yaml", *part(self.facts),
                               "--frames-of", self.drives[0] / "events.wmlog")

    # ── the target and the player ───────────────────────────────────────────────────────────────────────────────────

    def target(self, is_good):
        """What drive.sh and the doctor found."""
        failures = (self.out / "failures").read_text().splitlines() if (self.out / "failures").exists() else []
        for text in failures:
            self.checks.add("target", text.split(":")[0][:60], False, text)
        if not is_good and not failures:
            tail = [line for line in (self.folder / "target.log").read_text(errors="replace").splitlines() if line.strip()][-3:]
            self.checks.add("target", "it ran to its end", False, "the target's part ended early: " + " / ".join(tail))
        doctor = load(self.out / "doctor.json", {})
        found = [f for f in doctor.get("findings", []) if f["severity"] not in ("good", "note")]
        # What a kernel of a desk or a guest has not is no fault of a board.
        is_board = self.facts["where"] == "host"
        text = "; ".join(f"{f['about']}: {f['text']} ({f['fix']})" for f in found) or f"{len(doctor.get('findings', []))} findings, none is bad"
        self.checks.add("target", "doctor", (not found if is_board else True if not found else None) if doctor else False, text if doctor else "waymark doctor gave nothing")
        code = (self.out / "exit_code").read_text().strip() if (self.out / "exit_code").exists() else "none"
        may_be_full = any(fault["fault"] == "disk_full" for fault in self.faults)
        self.checks.add("target", "waymark run", code == "0" or (code == "1" and may_be_full), f"exit code {code}")

    def _opened_again(self, stream):
        """How often a fault of the part had the player open a camera's device again."""
        kind, _, name = stream.partition(":")
        return sum(kind == "camera" and fault["fault"] == "camera_unplugged" and (fault.get("camera") or name) == name
                   and fault_judge.is_in(fault, self.facts["from_s"], self.facts["until_s"]) for fault in self.faults)

    def player(self):
        """How late the player was, and what it could not place."""
        streams = self.played.get("streams", [])
        if not self.facts["plays"]:
            self.checks.add("player", "played", True, "CAN and pictures came from the place of the kernel's drivers")
            return
        if not streams:
            self.checks.add("player", "played", False, "the player gave no account (out/played.json)")
            return
        limit_ms = self.limits["play_late_ms"]
        for stream in streams:
            late_ms = stream["p99_us"] / 1e3
            text = f"{stream['sent']} sent, late by {stream['p50_us'] / 1e3:.3f} ms (p50), {late_ms:.3f} ms (p99), {stream['max_us'] / 1e3:.3f} ms (largest)"
            opened = self._opened_again(stream["name"])
            if 100 * opened > stream["sent"]:  # to open a device takes milliseconds: the datum after that is late, and 99 of 100 has none to spare
                self.checks.add("player", stream["name"], None, f"{text}; its device was opened again {opened} times, by faults", late_ms, limit_ms)
                continue
            self.checks.at_most("player", stream["name"], late_ms, limit_ms if limit_ms is not None else float("inf"), text)
        self.figures["play_late_p99_ms"] = max(stream["p99_us"] for stream in streams) / 1e3
        self.figures["play_late_max_ms"] = max(stream["max_us"] for stream in streams) / 1e3
        left_out = [name for name in self.played.get("not_placed", []) if not self.facts["played"] or not name.startswith(("can:", "camera:"))]
        unused = set(self.facts["unused"])
        missing = [name for name in left_out if not any(name.startswith(one) or name.endswith(one) for one in unused)]
        self.checks.add("player", "all of the recording", None if left_out and not missing else not missing,
                        "everything was played" if not left_out else f"not played: {', '.join(left_out)}")

    # ── the run's log and poses ─────────────────────────────────────────────────────────────────────────────────────

    def logs(self):
        """Each event log gives its run's poses again, bit by bit."""
        if not self.drives:
            self.checks.add("log", "event log", False, "the run left no folder")
        for drive in self.drives:
            name = f"{drive.name}: the same bits at the desk"
            try:
                self.replays.result(self.folder / f"again-{drive.name}")
            except HilError as error:
                self.checks.add("log", name, False, str(error))
                continue
            live, again = ((folder / "trajectory.csv").read_bytes() for folder in (drive, self.folder / f"again-{drive.name}"))
            is_cut = drive != self.drives[-1] or self.full_disk is not None  # killed, or on a full disk: what its disk has is judged
            whole = live[:live.rfind(b"\n") + 1] if is_cut else live
            same = again.startswith(whole) or whole.startswith(again) if is_cut else live == again
            rows = max(min(whole.count(b"\n"), again.count(b"\n")) - 1, 0)
            text = f"{rows} fused poses, {'each the same bits' if same else 'they differ'}"
            if is_cut and drive == self.drives[0]:
                text += self._log_end(again)
            self.checks.add("log", name, same if rows > 0 or not self.full_disk else None, text)
            if drive == self.drives[0]:
                self.figures["same_bits"] = same

    def _log_end(self, again):
        """Notes where a log that is cut short ends: the last pose of its replay. In words."""
        last = again.rstrip(b"\n").rpartition(b"\n")[2].split(b",")[0]
        if not last.isdigit() or self.start_ns is None:
            return "; the log has none"
        self.log_ends_ns = int(last)
        return f"; the log ends {(self.log_ends_ns - self.start_ns) * 1e-9 - self.facts['from_s']:.1f} s after the part's begin"

    def _hear(self):
        if not (self.out / "heard.lcm").exists() or self.start_ns is None:
            return [], []
        heard_poses, healths = lcm_log.heard(self.types, self.out / "heard.lcm", self.facts["prefix"])
        return [p for _, p in heard_poses if p.t_ns > 0], [h for _, h in healths]

    def _reference(self, offset_ns):
        """Where the robot was, on the target's clock: truth where there is one, else the replay at the desk."""
        truth = self.facts["recording"] / "truth.csv"
        rows = self._truth_rows() if truth.is_file() else poses.table(self.folder / "desk/published.csv")
        return [((t + offset_ns - self.start_ns) * 1e-9, x, y, heading, z) for t, x, y, heading, z in rows], "truth" if truth.is_file() else "replay at the desk"

    def poses(self):
        """Poses over LCM beside the replay of what the run saw, and beside the truth."""
        self.heard, self.healths = self._hear()
        self.offset_ns = self.played.get("offset_ns")
        if not self.heard or not self.drives:
            self.checks.add("poses", "heard", False, f"{len(self.heard)} poses were heard over LCM")
            return
        try:
            self.replays.result(self.folder / "desk")
            said = self.replays.result(self.folder / "same")
        except HilError as error:
            self._without_a_log(error)
            return
        self.offset_ns = int(re.search(r"clock is (-?\d+) ns ahead", said).group(1))
        rows = poses.table(self.folder / "same/published.csv")
        begun_ns = rows[0][0] + self.offset_ns + poses.BEGIN_NS if rows else 0
        # The replay has data beyond --until; a log that is cut short has none.
        until_ns = self.start_ns + int(min(self.before_faults_s, self.facts["until_s"] + (-0.3 if self.facts["is_cut"] else 0.5)) * 1e9)
        until_ns = min(until_ns, self.log_ends_ns or until_ns)
        live = [row for row in lcm_log.rows(self.heard) if begun_ns < row[0] < until_ns]
        apart = list(poses.apart_of(live, rows, self.offset_ns))
        judged_s = (until_ns - max(begun_ns, self.start_ns + int(self.facts["from_s"] * 1e9))) * 1e-9
        enough = len(apart) >= min(_MIN_RATE_HZ, 0.6 * self.facts["rate_hz"]) * max(judged_s - 1, 0.1)
        worst_m, worst_deg = poses.largest(m for _, m, _ in apart), poses.largest(d for *_, d in apart)
        ends = "" if not self.is_broken else "before the log ends" if until_ns == self.log_ends_ns else "before the first fault"
        text = (f"{len(apart)} of {len(self.heard)} poses over LCM, in {max(judged_s, 0):.0f} s {ends}".rstrip()
                + ("" if worst_m is None else f": at most {worst_m:.4f} m and {worst_deg:.3f} degrees from the replay of what the run saw"))
        self.checks.add("poses", "enough to compare", None if self.is_broken and judged_s < 1 else enough, text)
        if worst_m is not None:
            self.checks.at_most("poses", "distance from the replay", worst_m, self.limits["position_m"] or float("inf"), f"at most {worst_m:.4f} m")
            self.checks.at_most("poses", "heading from the replay", worst_deg, self.limits["heading_deg"] or float("inf"), f"at most {worst_deg:.3f} degrees")
            self.figures |= {"position_max_m": worst_m, "heading_max_deg": worst_deg, "position_rmse_m": poses.rms(m for _, m, _ in apart),
                             "heading_rmse_deg": poses.rms(d for *_, d in apart)}
        self.series["apart_m"] = [((t - self.start_ns) * 1e-9, m) for t, m, _ in apart]
        first = next((p for p in self.heard if p.state == 1), None)
        self.figures["first_pose_s"] = (first.t_ns - self.start_ns) * 1e-9 - self.facts["from_s"] if first else None
        self._truth(live)
        self.reference, self.reference_is = self._reference(self.offset_ns)

    def _without_a_log(self, error):
        """No replay of what the run saw. A log that a full disk or a kill cut short may have too little for it: faults are judged all the same, by the
        player's clock."""
        if not (self.full_disk or len(self.drives) > 1) or not (self.folder / "desk/published.csv").is_file():
            self.checks.add("poses", "replay at the desk", False, str(error))
            return
        first_s = min(fault["from_s"] for fault in self.faults if fault["fault"] in ("disk_full", "process_killed", "power_cut")
                      and fault_judge.is_in(fault, self.facts["from_s"], self.facts["until_s"])) - self.facts["from_s"]
        self.checks.add("poses", "distance from the replay", None, f"the log ends with a fault {first_s:g} s after the part's begin, and has too little to be compared; "
                        f"begin earlier (--from). {error}")
        self.offset_ns = self.offset_ns if self.offset_ns is not None else self.start_ns - self.facts["first_ns"]
        self.reference, self.reference_is = self._reference(self.offset_ns)

    def _truth_rows(self):
        """The truth; without its heights where the run is in the plane."""
        return poses.table(self.facts["recording"] / "truth.csv", not poses.is_planar(self.folder / "desk/published.csv"))

    def _truth(self, live):
        truth = self.facts["recording"] / "truth.csv"
        if not truth.is_file():
            return
        rows = self._truth_rows()
        live_rows = list(poses.differences(live, rows, self.offset_ns))
        until_ns = max((row[0] for row in live), default=0) - self.offset_ns
        desk = [row for row in poses.table(self.folder / "desk/published.csv") if row[0] <= until_ns]
        live_m, desk_m = poses.rms(m for _, m, _ in live_rows), poses.rms(m for _, m, _ in poses.differences(desk, rows, 0))
        self.figures |= {"truth_rmse_m": live_m, "desk_truth_rmse_m": desk_m}
        self.series["truth_m"] = [((t - self.start_ns) * 1e-9, m) for t, m, _ in live_rows]
        if live_m is None or not desk_m:
            self.checks.add("truth", "error", None, "the truth has no time in common with the run")
            return
        ratio = self.limits["truth_ratio"]
        self.checks.at_most("truth", "error", live_m, float("inf") if ratio is None else ratio * desk_m + 0.001,
                            f"{live_m:.4f} m RMS from the truth on the target, {desk_m:.4f} m in the replay at the desk")

    # ── the target's figures ────────────────────────────────────────────────────────────────────────────────────────

    def _at_first(self, name, key):
        """A counter when the devices had settled: the first buffers of a video device are old ones, and are thrown away."""
        if self.start_ns is None:
            return 0
        settled_ns = self.start_ns + int((self.facts["from_s"] + _SETTLED_S) * 1e9)
        health = next((h for h in getattr(self, "healths", []) if h.t_ns >= settled_ns), None)
        source = lcm_log.source(health, name) if health else None
        return getattr(source, key, 0) if source else 0

    def losses(self):
        """What each source lost since the devices had settled. Where faults are, their own lines of health judge it."""
        health = load(self.drives[0] / "health.json", {}) if self.drives else {}
        worst = 0.0
        for name, source in (health.get("sources") or {}).items():
            received = source.get("received") or 0
            counted = {key: n for key in _LOST if (n := (source.get(key) or 0) - self._at_first(name, key)) > 0}
            share = sum(counted.values()) / max(received + source.get("lost", 0), 1)
            worst = max(worst, share)
            text = f"{received} received, " + (", ".join(f"{n} {key}" for key, n in counted.items()) or "none lost, dropped or late")
            limit = self.limits["lost_share"]
            self.checks.add("losses", name, None if self.is_broken or limit is None else share <= limit and received > 0, text, share, limit)
        self.figures["lost_share"] = worst
        for line in (self.out / "buses.txt").read_text().splitlines() if (self.out / "buses.txt").exists() else []:
            name, errors, packets = line.split()
            sent = next((stream["sent"] for stream in self.played.get("streams", []) if stream["name"] == f"can:{name}"), None)
            self.checks.add("losses", f"interface {name}", None if self.is_broken else errors == "0", f"{packets} frames received, {errors} errors of the controller"
                            + ("" if sent is None else f", {sent} sent"), float(errors), 0.0)

    def timing(self):
        """Deadlines, wake-ups beside cyclictest, memory. Where faults are, their bounds of rate and gaps judge what a missed deadline does."""
        timing = load(self.drives[0] / "timing.json", {}) if self.drives else {}
        if len(self.drives) > 1:
            timing = load(self.drives[-1] / "timing.json", {})
        if not timing:
            self.checks.add("timing", "timing.json", False, "the run left none")
            return
        missed, total = timing["deadlines_missed"], max(timing["deadlines_total"], 1)
        limit = self.limits["deadlines_missed_share"]
        self.checks.add("timing", "deadlines", None if limit is None or self.is_broken else missed / total <= limit, f"{missed} of {total} missed", missed / total, limit)
        self.figures |= {"deadlines_missed_share": missed / total}
        for stage in ("wake", "loop", "correct", "detect", "send", "predict"):
            if (timing.get(stage) or {}).get("count"):
                self.figures |= {f"{stage}_p50_us": timing[stage]["p50_us"], f"{stage}_p99_us": timing[stage]["p99_us"]}
        beside = samples.wake_us(self.out)
        wake = (timing.get("wake") or {}).get("p99_us")
        ratio = self.limits["wake_over_cyclictest"]
        if wake is not None and beside:
            self.figures["beside_p99_us"] = beside["p99_us"]
            good = wake <= max(1e3 * _WAKE_MS, (ratio or 0) * beside["p99_us"])
            self.checks.add("timing", "wake-up", None if ratio is None else good, f"{wake:.0f} us (p99), {beside['what']} beside it {beside['p99_us']:.0f} us; largest "
                            f"{timing['wake']['max_us']:.0f} and {beside['max_us']:.0f} us", wake, max(1e3 * _WAKE_MS, (ratio or 0) * beside["p99_us"]))
        for key in ("allocations_after_start", "page_faults_after_start"):
            if timing.get(key) is not None:
                is_locked = key == "allocations_after_start" or "memory is not locked" not in self.said
                self.checks.add("timing", key.replace("_", " "), timing[key] == 0 if is_locked else None, f"{timing[key]} on the estimator's thread", timing[key], 0)
        self.figures["arena_mb"] = (timing.get("memory_bytes") or 0) / 1e6 or None

    def computer(self):
        """Processor per thread, memory, temperature and clock rate over the time."""
        found = samples.read(self.out)
        self.threads = found.threads
        self.series |= {"temperature_c": found.temperature, "clock_mhz": found.clock, "memory_mb": found.memory, "cpu_share": found.cpu}
        total = sum(share for _, share in found.threads) if found.threads else None
        top = found.threads[0] if found.threads else None
        self.figures |= {"cpu_share": total, "memory_mb": found.memory_peak_mb}

        def judge(name, value, text):
            limit = self.limits[name]
            self.checks.add("computer", name.replace("_", " "), None if value is None or limit is None else value <= limit, text, value, limit)
        judge("cpu_share", total, "no process was seen" if total is None else
              f"{100 * total:.1f} % of one processor: " + ", ".join(f"{name} {100 * share:.1f} %" for name, share in found.threads[:8]))
        judge("thread_cpu_share", top and top[1], "no process was seen" if not top else f"{top[0]}: {100 * top[1]:.1f} %")
        judge("memory_mb", found.memory_peak_mb, "not seen" if found.memory_peak_mb is None else f"{found.memory_peak_mb:.1f} MB resident at most")
        hottest = max((v for _, v in found.temperature), default=None)
        judge("temperature_c", hottest, "the target has no thermometer" if hottest is None else f"{hottest:.1f} degrees at most, {min(v for _, v in found.temperature):.1f} at least")
        clocks = [v for _, v in found.clock]
        limit = self.limits["clock_share"]
        self.checks.add("computer", "clock rate", None if not clocks or limit is None else min(clocks) >= limit * max(clocks),
                        "the target has no cpufreq" if not clocks else f"{min(clocks):.0f} to {max(clocks):.0f} MHz",
                        min(clocks) / max(clocks) if clocks else None, limit)

    # ── faults ──────────────────────────────────────────────────────────────────────────────────────────────────────

    def _done(self):
        """{number: what the player or the target did of the fault}"""
        done = {}
        by_name = {fault["name"]: fault for fault in self.played.get("faults", [])}
        for number, fault in enumerate(self.faults):
            found = by_name.get(fault["name"])
            if found and found.get("done"):
                done[number] = {"done": True}
            elif found and found.get("failure"):
                done[number] = {"done": False, "why": f"the player could not do it: {found['failure']}"}
        for line in (self.out / "faults.txt").read_text().splitlines() if (self.out / "faults.txt").exists() else []:
            number, event, at_s, *why = line.split(" ", 3)
            if event == "absent":
                done[int(number)] = {"done": False, "absent": True, "why": "not on this target: " + " ".join(why)}
            elif event == "begin":
                done[int(number)] = {"done": True}
            elif event == "end" and int(number) in done:
                done[int(number)]["ended_s"] = float(at_s)
        for number, fault in enumerate(self.faults):
            if not fault_judge.is_in(fault, self.facts["from_s"], self.facts["until_s"]):
                done[number] = {"done": False, "absent": True, "why": "not in the part that was played"}
            elif fault["name"] in self.facts["left_out"]:
                done[number] = {"done": False, "absent": True, "why": "not possible on this target's CAN controllers"}
            elif self.facts["played"] and fault.get("by_played_driver"):
                done[number] = {"done": True}
            elif fault["by"] == "played driver":
                done.setdefault(number, {"done": False, "absent": True, "why": "not possible with a real driver"})
        return done

    def health(self):
        """Faults, and what health has while nothing is broken."""
        if not getattr(self, "healths", None) or self.start_ns is None or not hasattr(self, "reference"):
            if self.faults or not getattr(self, "healths", None):
                self.checks.add("health", "heard", False, "no health was heard over LCM, or no pose")
            return
        def at(t_ns):
            return (t_ns - self.start_ns) * 1e-9
        heard = fault_judge.Heard([(at(p.t_ns), p) for p in self.heard], [(at(h.t_ns), h) for h in self.healths], self.reference, self.said,
                                  self.facts["until_s"])
        done = self._done()
        happened = [fault for number, fault in enumerate(self.faults) if done.get(number, {}).get("done")]
        for number, fault in enumerate(self.faults):
            fault_judge.judge(self.checks, fault, heard, done.get(number, {}), f"by the {self.reference_is}", happened)
        self._devices(heard)
        others = max((h.other_runs_total for h in self.healths), default=0)
        self.checks.add("health", "alone on its channels", others == 0, f"{others} other runs were heard on {self.facts['prefix']}HEALTH")

    def _devices(self, heard):
        """Devices work while nothing is broken: from three seconds on, away from faults and three seconds after them."""
        broken = [(fault["from_s"] - 0.1, (fault.get("until_s") or heard.end_s) + _SETTLED_S + 1) for fault in self.faults]
        wrong, judged = {}, 0
        for t, health in heard.healths_between(self.facts["from_s"] + _SETTLED_S, heard.end_s - 0.5):
            if any(a <= t < b for a, b in broken):
                continue
            judged += 1
            for source in health.sources[:health.source_count]:
                state = lcm_log.DEVICES[source.device]
                if state not in ("works", "recording"):
                    wrong.setdefault(f"{lcm_log.name_of(source)} {state}", []).append(t)
        self.checks.add("health", "devices work while nothing is broken", None if judged == 0 else not wrong,
                        f"{judged} healths: " + ("; ".join(f"{what} {len(ts)} times, first at {ts[0]:.1f} s" for what, ts in wrong.items()) or "all devices work"))

    def all(self, is_good):
        """Every judgement, in the report's order."""
        self.begin_replays()
        self.target(is_good)
        self.player()
        self.logs()
        self.poses()
        self.losses()
        if self.facts["record"] and self.start_ns is not None and "offset_ns" in self.played:
            stamps.judge(self, self.facts["buses"], self.facts["cameras"], _SETTLED_S)
        self.timing()
        self.computer()
        self.health()
