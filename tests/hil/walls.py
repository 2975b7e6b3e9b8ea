# SPDX-License-Identifier: Apache-2.0
"""config/datasets/office-walls.yaml on a device: two detectors, the black box and a recording read one camera. The run's poses are those of
the replay of that recording; the processor's time is compared with that of each detector's run alone."""
import subprocess

import drives
import messages
import service

SECONDS, BEGIN_S = 40, 3


def prepare(work, root, here, simulate):
    recording, folder, can, pictures = service.scenario_of("walls", work, root, here, simulate)
    first = service.first_ns(recording)
    service.write_timeline(folder / "timeline", service.without([*can, *pictures], first, (SECONDS, 1e9)))
    (folder / "duration").write_text(f"{SECONDS}\n")
    robot = (folder / "robot.yaml").read_text().replace("/dev/robot-camera", "/dev/video10").replace("/var/lib/waymark", "/run/keep")
    (folder / "robot.yaml").write_text(robot)
    # A detector alone, without black box and recording: what is common to both runs is one decoding and the pipeline.
    alone = robot[:robot.index("start: {")]
    (folder / "apriltag.yaml").write_text(alone.replace("  mr: {size_m: 0.27}\n", ""))
    (folder / "mr.yaml").write_text(alone.replace("  apriltag: {}\n", ""))
    (folder / "both.yaml").write_text(alone)


def cpu_s(path):
    """User and system time that bash's `time` printed."""
    return sum(map(float, path.read_text().split()))


def judge(work, waymark, root):
    out, failures = work / "share/out/walls", []
    replay = subprocess.run([waymark, "replay", out / "rec", "--config", out / "rec/config.yaml", "--frames-of", out / "drive/events.wmlog",
                             "--out", work / "walls-again"], capture_output=True, text=True)
    if replay.returncode:
        return [f"walls: the recording doesn't replay: {replay.stderr[-300:]}"]
    poses = messages.rows(messages.heard(work, out / "heard.lcm")[0])
    rows = drives.table(work / "walls-again/published.csv")
    poses = [p for p in poses if p[0] > rows[0][0] + BEGIN_S * 10**9]
    apart = list(drives.apart_of(poses, rows, 0))
    worst_m, worst_deg = max(m for _, m, _ in apart), max(d for *_, d in apart)
    recorded = len(drives.rows(out / "rec/video/front.csv"))
    boxed = sum(len(path.read_text().splitlines()) - 1 for path in (out / "keep/box").glob("pictures-front-*.csv"))
    print(f"walls: {len(apart)} poses over LCM at most {worst_m:.4f} m and {worst_deg:.3f} degrees from the replay of the recording; "
          f"{recorded} pictures recorded, {boxed} in the black box")
    if len(apart) < 40 * (SECONDS - BEGIN_S - 3) or worst_m > drives.POSITION_M or worst_deg > drives.HEADING_DEG:
        failures.append("walls: the poses are not those of the replay of the recording")
    if recorded < 0.95 * service.RATE_HZ * SECONDS or boxed < 10:
        failures.append("walls: pictures are missing in the recording or the black box")
    used = {name: cpu_s(out / f"{name}.cpu") for name in ("apriltag", "mr", "both", "robot")}
    print(f"walls: {SECONDS} s take {used['both']:.2f} s of the processor with both detectors on one decoding; alone {used['apriltag']:.2f} s (apriltag) "
          f"and {used['mr']:.2f} s (mr), {used['apriltag'] + used['mr']:.2f} s together; with black box and recording {used['robot']:.2f} s")
    if used["both"] > 0.95 * (used["apriltag"] + used["mr"]):
        failures.append("walls: two detectors on one camera take as much of the processor as two decodings")
    return failures
