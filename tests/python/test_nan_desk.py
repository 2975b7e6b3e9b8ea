#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A NaN in each number that a function of the desk's Python takes (the package, waymark_hil, waymark_fleet): it comes out as a NaN, or the function
refuses it. Each public function has a case here or in test_nan.py, or stands in a list with the reason.

    test_nan_desk.py BIN_DIR"""

import contextlib
import io
import sys
import types
import unittest
import warnings

import common
import nans
import numpy as np
import test_nan

sys.path[:0] = [str(common.ROOT / "tools" / folder) for folder in ("hil", "fleet")]

import waymark_fleet.batch
import waymark_fleet.compare
import waymark_fleet.mine
from waymark_fleet import comparison, html, plan, statistics
from waymark_hil import HilError, compare, fault_judge, lcm_log, page, poses, verdict

from waymark import geometry, mavlink, ros
from waymark.bag import clocks, frames, lens_fit, lenses, motion, motion_takers, tags
from waymark.bag import samples as bag_samples
from waymark.bag.cameras import Found
from waymark.bag.decoding import BadMessage
from waymark.causes import changes, fault
from waymark.mcapio import estimates, place, streams
from waymark.suggest import command as suggest_command
from waymark.suggest import drive, parameters, search
from waymark.vda5050 import command as vda5050_command
from waymark.vda5050 import run as vda5050_run

nans.REFUSALS = (HilError, plan.PlanError, BadMessage)
MESSAGES = ros.Messages()
T = np.array([10, 20], dtype=np.int64)
ROTATION = geometry.from_rpy(0.1, 0.2, 0.3)
POSE = geometry.pose([1.0, 2.0, 3.0], [0.0, 0.0, 0.6, 0.8])
INTRINSICS = np.array([500.0, 0.0, 320.0, 0.0, 500.0, 240.0, 0.0, 0.0, 1.0])
PROJECTION = np.array([450.0, 0.0, 320.0, 0.0, 0.0, 450.0, 240.0, 0.0, 0.0, 0.0, 1.0, 0.0])
RAYS = np.array([[0.1, 0.2], [0.3, -0.1]])
PLANE = {f"cov_{name}": np.array([1.0, 1.0]) for name in ("xx", "xy", "yy", "xt", "yt", "tt")} | {"cov_xy": np.zeros(2), "cov_xt": np.zeros(2), "cov_yt": np.zeros(2)}
PLACES = {"t_ns": T, "x_m": np.array([1.0, 2.0]), "y_m": np.array([0.0, 1.0])}
TURNED = PLACES | PLANE | {"qx": np.zeros(2), "qy": np.zeros(2), "qz": np.array([0.0, 0.6]), "qw": np.array([1.0, 0.8])}
INNOVATIONS = {"t_ns": T[:1], "source": np.array(["eye"]), "sensor": np.array(["eye"]), "landmark": np.array([1]), "residual": np.array(["range"]),
               "observed": np.array([2.0]), "expected": np.array([1.5]), "variance": np.array([0.1]), "nis": np.array([1.0]), "gate": np.array([9.0]),
               "verdict": np.array(["fused"])}
STATUS = TURNED | {"state": np.array(["tracking", "lost"]), "lost_probability": np.array([0.1, 0.2]), "fused_until_ns": T, "resets": np.array([0, 1])}
ODOMETRY = TURNED | {f"odom_{name}": np.array([0.5, 0.6]) for name in ("x_m", "y_m", "heading_rad")}
PARTICLES = PLACES | {"heading_rad": np.array([0.1, 0.2]), "weight": np.array([0.5, 0.5])}
NOISE = parameters.Parameter("motion.noise.speed_mps", 0.02, 0.03, 0.0, 10.0, 0.02)
GIVEN = fault.Fault("scale", ((1.1,),), lambda size: [], lambda size: "", (0.1,), (0.01,), is_log=True, named=(1.0,),
                    settled=lambda size, states: (size[0] * states["speed_scale"],))
VALUES = [0.3, 0.1, 0.2, 0.4, 0.5, 0.7]


def symmetric(upper):
    """A covariance of its upper triangle, row by row."""
    size = int(np.sqrt(2 * len(upper)))
    out = np.zeros((size, size))
    out[np.triu_indices(size)] = upper
    return np.triu(out) + np.triu(out, 1).T


def sampled(*values):
    out = bag_samples.Samples(3, "base", "base")
    out.add(1, 2, values)
    return out.values


def odometry(twist, variances):
    """What is read of a message's twist where the variance of its sideways speed says that it is not measured."""
    linear, angular = (types.SimpleNamespace(**dict(zip("xyz", part))) for part in (twist[:3], twist[3:]))
    where, turn = types.SimpleNamespace(x=0.0, y=0.0, z=0.0), types.SimpleNamespace(x=0.0, y=0.0, z=0.0, w=1.0)
    header, covariance = types.SimpleNamespace(stamp=types.SimpleNamespace(sec=1, nanosec=0), frame_id="odom"), np.diag(variances).ravel()
    message = types.SimpleNamespace(header=header, child_frame_id="base", pose=types.SimpleNamespace(pose=types.SimpleNamespace(position=where, orientation=turn)),
                                    twist=types.SimpleNamespace(twist=types.SimpleNamespace(linear=linear, angular=angular), covariance=covariance))
    rows = []
    motion_takers.odometry(types.SimpleNamespace(sample=lambda *given: rows.append(given[-1])), "/odom", message, 1)
    return rows[0][7:]


def camera_info(k, p, r, d):
    return types.SimpleNamespace(width=640, height=480, roi=types.SimpleNamespace(width=0, height=0, x_offset=0, y_offset=0), binning_x=0, binning_y=0,
                                 distortion_model="plumb_bob", k=k, p=p, r=r, d=d)


def lens(message, is_rectified):
    found = lenses.of(message, is_rectified, (640, 480))
    if found.entry is None:
        raise ValueError(found.notes[-1])
    return found


def moved_corner(*given):
    """A corner of a rectified picture in the raw one."""
    message = camera_info(*given)
    return tags.to_raw(Found("eye", lens(message, False), "eye", (), message), np.array([[100.0, 100.0]]))


def written_motion(*twist):
    """The rows of a drive of three messages, of which the second has this twist."""
    written = []
    into = types.SimpleNamespace(note=lambda *words: None, writer=types.SimpleNamespace(table=lambda name, table: written.append(table)))
    times = np.array([10, 20, 30], dtype=np.int64)
    motion.write(into, motion.Motion("/odom", times, times, np.array([[0.5, 0.2, 0.0, 0.0, 0.0, 0.1], twist, [0.5, 0.2, 0.0, 0.0, 0.0, 0.1]])), False)
    if len(written[0]["t_ns"]) < len(times):
        raise ValueError("the message is left out")
    return written


def scored(fit):
    return drive.Score(np.ones((2, 30)), np.ones((2, 30)), fits={(split, 0, 1, "range"): tuple(fit) for split in range(3)}, caps={(0, 1, "range"): 1.0})


def posed(x, y, qz, qw, xx, yy):
    message = types.SimpleNamespace(position_m=[x, y, 0.0], orientation_xyzw=[0.0, 0.0, qz, qw], covariance=[[xx, 0.0], [0.0, yy]], t_ns=5)
    return lcm_log.heading(message), lcm_log.rows([message]), lcm_log.sigma_m(message)


def judged(before, after):
    row = {"status": "done", "figures": {}}
    pairs = [({**row, "figures": {"position_rmse_m": a, "nees_mean": a, "anees_dof": 3, "lost_share": a}},
              {**row, "figures": {"position_rmse_m": b, "nees_mean": b, "anees_dof": 3, "lost_share": b}}) for a, b in zip(before, after)]
    return [row["drives"] == len(pairs) or np.nan for row in comparison.judge(pairs) if row["figure"] in ("position", "nees", "lost")]


def tests_compared(one, two):
    def side(value):
        return {"figures": {"memory_mb": value}, "per_second": {"memory_mb": [[k, value + 0.001 * k] for k in range(8)]}, "checks": []}
    return compare.judge(side(one), side(two), {"memory_mb": (0.05, 1.0)}) or np.nan  # a figure that is none is not compared


def added(value, limit):
    checks = verdict.Checks()
    checks.at_most("run", "error", value, limit, "an error")
    return [check for check in checks if check.status != verdict.FAILED] or float("nan")  # a check that fails refuses


def option(parser, *words):
    """What a command line makes of a number as text."""
    def read(number):
        said = io.StringIO()
        with contextlib.redirect_stderr(said):
            try:
                return vars(parser.parse_args([*words[:-1], f"{words[-1]}={number}"]))
            except SystemExit:
                raise ValueError(said.getvalue()) from None
    return read


def error_of(x, y):
    """Of a pose between two references."""
    heard = fault_judge.Heard([], [], [(0.0, 0.0, 0.0, 0.0, 0.0), (0.4, x, y, 0.1, 0.0)], "", 1.0)
    return heard.error(0.2, types.SimpleNamespace(position_m=[1.0, 0.0, 0.0], orientation_xyzw=[0.0, 0.0, 0.0, 1.0]))


CASES = {
    # the package
    "suggest.command: --from": (option(suggest_command._parser(), "run", "--from"), [1.5]),
    "suggest.command: --minutes": (option(suggest_command._parser(), "run", "--minutes"), [1.5]),
    "mavlink.Frame.__init__": (lambda north, x, y: mavlink.Frame(north, (x, y)).local(POSE[:3, 3], [0.0, 0.0, 0.0, 1.0], np.eye(6)).position, [25.0, 1.0, 2.0]),
    "mavlink.Frame.local": (lambda *pose: list(mavlink.Frame(25.0).local(*pose)), [[1.0, 2.0, 3.0], [0.0, 0.0, 0.6, 0.8], np.eye(6)]),
    "mavlink.Frame.planar": (lambda *pose: list(mavlink.Frame(25.0).planar(mavlink.Local(*pose))), [np.ones(3), ROTATION, np.eye(6)]),
    "mavlink.Frame.east_north": (lambda x, y: mavlink.Frame(25.0).east_north([x, y, 0.0]), [1.0, 2.0]),
    "mavlink.upper": (lambda value: mavlink.upper(np.full((6, 6), value)), [1.0]),
    "mavlink.full": (mavlink.full, [mavlink.upper(np.eye(6))]),
    "mavlink: --north": (option(mavlink._parser(), "--link=udpout:a:1", "--north"), [25.0]),
    "mavlink: --rate": (option(mavlink._parser(), "--link=udpout:a:1", "--rate"), [25.0]),
    "mavlink: --duration": (option(mavlink._parser(), "--link=udpout:a:1", "--duration"), [25.0]),
    "mavlink: --zero": (lambda x: option(mavlink._parser(), "--link=udpout:a:1", "--zero")(f"{x},1"), [25.0]),
    "vda5050: --rate": (option(vda5050_command._parser(), "--broker=mqtt://a", "--manufacturer=A", "--serial=1", "--site=.", "--rate"), [25.0]),
    "vda5050.run.heading_of": (lambda *xyzw: vda5050_run.heading_of(xyzw), [0.0, 0.0, 0.6, 0.8]),
    "bag.clocks.seconds": (clocks.seconds, [2e9]),
    "bag.frames.mounting": (frames.mounting, [POSE[:3]]),
    "bag.frames.camera_pose": (lambda matrix: frames.camera_pose("eye", matrix), [POSE]),
    "bag.lenses.of": (lambda k: lens(camera_info(k, np.zeros(12), np.zeros(9), np.zeros(5)), False).entry, [INTRINSICS]),
    "bag.lenses.of: distortion": (lambda d: lens(camera_info(INTRINSICS, np.zeros(12), np.zeros(9), d), False).entry, [np.array([0.1, 0.01, 0.001, 0.002])]),
    "bag.lenses.of: rectified": (lambda p: lens(camera_info(INTRINSICS, p, np.eye(3).ravel(), np.zeros(5)), True).entry, [PROJECTION]),
    "bag.tags.to_raw": (moved_corner, [INTRINSICS, PROJECTION, geometry.from_rpy(0.02, 0.01, 0.03).ravel(), np.array([0.1, 0.01, 0.001, 0.002])]),
    "bag.motion_takers.odometry": (lambda *twist: odometry(twist, np.full(6, 0.01)), [0.5, 0.1, 0.0, 0.0, 0.0, 0.1]),
    "bag.motion.write": (written_motion, [0.5, 0.2, 0.0, 0.0, 0.0, 0.1]),
    "bag.lens_fit.rational": (lens_fit.rational, [np.array([0.1, 0.0, 0.01, 0.0]), RAYS]),
    "bag.lens_fit.radtan": (lens_fit.radtan, [[0.1, 0.0, 0.01, 0.0], RAYS]),
    "bag.lens_fit.equidistant": (lens_fit.equidistant, [[0.1, 0.0, 0.01, 0.0], RAYS]),
    "bag.lens_fit.fitted": (lambda *four: lens_fit.fitted(lambda rays: rays, four, (640, 480)), [500.0, 500.0, 320.0, 240.0]),
    "bag.motion.pose_rates": (motion.pose_rates, [np.array([0, 10**9]), np.array([[0.0, 0, 0], [1, 0, 0]]), np.stack([ROTATION, ROTATION])]),
    "bag.motion.to_base": (motion.to_base, [np.ones((2, 6)), POSE[:3]]),
    "bag.samples.Samples.add": (sampled, [1.0, 2.0, 3.0]),
    "bag.tags.pose_table": (lambda columns, rpy: tags.pose_table([T, T, *columns, T], "eye", rpy), [[np.ones(2)] * 6, [1.0, 2.0]]),
    "causes.changes.column": (lambda factor, offset: changes.column("a.csv", "x_m", factor, offset).apply(b"x_m\n1\n"), [2.0, 1.0]),
    "causes.changes.stretched": (lambda rate: changes.stretched("a.csv", "t_ns", rate, 5).apply(b"t_ns\n100\n"), [0.1]),
    "causes.changes.numbers": (changes.numbers, [[1.0, 2.0]]),
    "causes.changes.degrees": (changes.degrees, [1.0]),
    "causes.fault.Clock.original": (lambda size: fault.Clock("eye", 0).original((size,)), [0.1]),
    "causes.fault.Clock.original: rate": (lambda size: fault.Clock("eye", 0, True).original((size,)), [0.1]),
    "causes.fault.Clock.later_s": (lambda size: fault.Clock("eye", 0).later_s((size,)), [0.1]),
    "causes.fault.Fault.by_states": (GIVEN.by_states, [{"speed_scale": 1.1}]),
    "causes.fault.Fault.moved": (lambda size, way: GIVEN.moved((size,), 0, way), [1.1, 0.1]),
    "causes.fault.Fault.unit": (lambda size: GIVEN.unit((size,)) or np.nan, [1.1]),
    "causes.fault.Fault.neat": (lambda size: GIVEN.neat((size,)), [1.1]),
    "causes.fault.factor_words": (fault.factor_words, [1.1]),
    "mcapio.estimates.positions": (estimates.positions, [PLACES]),
    "mcapio.estimates.quaternions": (estimates.quaternions, [{name: TURNED[name] for name in ("qx", "qy", "qz", "qw")} | {"x_m": T}]),
    "mcapio.estimates.ros_covariance": (lambda numbers, turns: estimates.ros_covariance(np.stack([symmetric(numbers)]), turns), [np.ones(21), np.array([[0.0, 0.0, 0.6, 0.8]])]),
    "mcapio.estimates.points": (lambda where: estimates.points(MESSAGES, "/a", 5, where).message.is_dense or np.nan, [np.ones((2, 3))]),
    "mcapio.estimates.path": (lambda where, turns: estimates.path(MESSAGES, "/a", 5, 5, (T, where, turns)), [np.ones((2, 3)), np.ones((2, 4))]),
    "mcapio.estimates.poses": (lambda table: estimates.poses(MESSAGES, "/a", table, T), [TURNED]),
    "mcapio.estimates.frames": (lambda table: estimates.frames(MESSAGES, table, T), [{k: v for k, v in ODOMETRY.items() if k not in PLANE}]),
    "mcapio.estimates.odometry": (lambda place_, linear, angular: estimates.odometry(MESSAGES, 5, 5, place_, linear, angular),
                                  [(1.0, 2.0, 0.1), [1.0, 0.0, 0.0], [0.0, 0.0, 0.1]]),
    "mcapio.estimates.status": (lambda table: estimates.status(MESSAGES, table, T),
                                [{k: v for k, v in STATUS.items() if k in ("t_ns", "state", "lost_probability", "fused_until_ns", "resets")}
                                 | {k: PLANE[k] for k in PLANE if k not in ("cov_xy", "cov_xt", "cov_yt")} | {k: np.zeros(2, int) for k in ("cov_xy", "cov_xt", "cov_yt")}]),
    "mcapio.estimates.innovations": (lambda table: estimates.innovations(MESSAGES, table), [INNOVATIONS]),
    "mcapio.estimates.innovations: sigma": (lambda variance: [item.message.sigma for item in estimates.innovations(
        MESSAGES, {**INNOVATIONS, "variance": np.array([variance])})], [0.1]),
    "mcapio.estimates.particles": (lambda table: [item.message for item in estimates.particles(MESSAGES, table) if item.topic == "/waymark/particles"],
                                   [{k: v for k, v in PARTICLES.items() if k != "weight"} | {"weight": np.ones(2, int)}]),
    "mcapio.estimates.ellipse": (lambda x, y, cov: estimates.ellipse(MESSAGES, "a", 1, 5, (x, y), symmetric(cov), MESSAGES.colour(1.0, 1.0, 1.0)), [1.0, 2.0, np.array([2.0, 1.0, 2.0])]),
    "mcapio.streams.row": (lambda table: [streams.register(MESSAGES, "motion.csv", ["t_ns", "v_mps"]),
                                          streams.row(MESSAGES, "waymark_msgs/msg/Motion", table, 0, "base")], [{"t_ns": T, "v_mps": np.array([1.0])}]),
    "mcapio.place.mounting_matrix": (lambda xyz, rpy: place.mounting_matrix({"xyz_m": xyz, "rpy_deg": rpy}), [[1.0, 2.0, 3.0], [1.0, 2.0, 3.0]]),
    "ros.Messages.pose_of": (MESSAGES.pose_of, [POSE[:3]]),
    "ros.Messages.transform": (lambda matrix: MESSAGES.transform(5, "a", "b", matrix), [POSE[:3]]),
    "ros.Messages.cloud": (lambda xyz: np.frombuffer(MESSAGES.cloud(5, "a", xyz).data, "<f4"), [np.ones((2, 3))]),
    "ros.Messages.cloud: is_dense": (lambda xyz: MESSAGES.cloud(5, "a", xyz).is_dense or np.nan, [np.ones((2, 3))]),
    "ros.Messages.colour": (MESSAGES.colour, [0.1, 0.2, 0.3, 0.4]),
    "suggest.drive.differences": (drive.differences, [{"observed": np.array([1.0]), "expected": np.array([0.5]), "residual": np.array(["range"])}]),
    "suggest.search.residuals_of": (lambda fit: [(found.rms, found.refused, found.nis) for found in search.residuals_of(scored(fit), 0, search.ALL).values()],
                                    [[10.0, 1.0, 2.0, 8.0]]),
    "suggest.search.growth_of": (lambda squares, later: search.growth_of(scored([10.0, 1.0, squares, 8.0]), scored([10.0, 1.0, later, 8.0]), search.ALL), [2.0, 3.0]),
    "suggest.parameters.Parameter.trials": (NOISE.trials, [0.02, 2.0]),
    "suggest.parameters.Parameter.between": (NOISE.between, [0.04, 0.5]),
    # waymark_hil
    "lcm_log.heading": (lambda *q: posed(0.0, 0.0, *q, 1.0, 1.0)[0], [0.6, 0.8]),
    "lcm_log.rows": (lambda *place_: posed(*place_, 1.0, 1.0)[1], [1.0, 2.0, 0.6, 0.8]),
    "lcm_log.sigma_m": (lambda *variances: posed(0.0, 0.0, 0.6, 0.8, *variances)[2], [0.01, 0.01]),
    "fault_judge.Heard.error": (error_of, [1.0, 0.0]),
    "compare.judge": (tests_compared, [100.0, 120.0]),
    "page.per_second": (lambda value: page.per_second({"a": [(0.5, value)]})["a"] or np.nan, [1.0]),  # a second without a number is none
    "poses.heading_of": (poses.heading_of, [0.0, 0.0, 0.6, 0.8]),
    "poses.between": (lambda a, b: poses.between((0, *a), (10, *b), 5), [[1.0, 2.0, 0.1, 0.0], [2.0, 2.0, 0.2, 0.0]]),
    "poses.away": (lambda pose, other: poses.away((0, *pose), (*other, 0.2, 0.0)), [[1.0, 2.0, 0.1, 0.0], [1.0, 3.0]]),
    "poses.rms": (poses.rms, [VALUES]),
    "poses.largest": (poses.largest, [VALUES]),
    "poses.quantile": (lambda values: poses.quantile(values, 0.5), [VALUES]),
    "verdict.Checks.at_most": (added, [1.0, 2.0]),
    # waymark_fleet
    "compare.tolerances_of": (lambda size: waymark_fleet.compare.tolerances_of([f"position={size}"]), [0.1]),
    "compare.parser: --alpha": (option(waymark_fleet.compare.parser(), "a", "b", "--alpha"), [0.01]),
    "mine.parser: --within": (option(waymark_fleet.mine.parser(), "a", "--out", "b", "--within"), [2.5]),
    "comparison.judge": (judged, [[1.0] * 7, [1.1, 1.2, 1.1, 1.3, 1.1, 1.2, 1.1]]),  # a drive without a number is not counted,
    "batch.duration": (waymark_fleet.batch.duration, [100.0]),
    "html.short": (lambda value: html.short(value).replace("–", "nan"), [1.5]),  # a dash
    "statistics.trimmed_mean": (statistics.trimmed_mean, [VALUES]),
    "statistics.bca_interval": (statistics.bca_interval, [VALUES]),
    "statistics.signed_rank": (statistics.signed_rank, [VALUES]),
    "statistics.holm": (statistics.holm, [VALUES]),
}
# Modules and functions whose numbers can't be NaN, or are absent as NaN by what they state; "*": all of a module.
WITHOUT = {
    "waymark": {
        "whole numbers or text": "bag.can.CanLog.finish bag.imu.Imu.leave_out bag.clocks.once bag.clocks.settle bag.clocks.Clock.mended bag.clocks.silences bag.clocks.excess bag.clocks.growth bag.clocks.onto bag.pictures.Depths.grey_byte bag.turns.settle bag.collection.Collection.on_clock "
                                 "bag.pictures.Depths.grey bag.tables.without_arrival bag.tags.corner_table causes.trial.Blocks.of causes.trial.Undo.original "
                                 "recording.jpeg_of recording.RecordingWriter.restamp",
        "NaN is absent: windows, updates and samples without a number are left out": "bag.clocks.goes_on bag.stuck.repeats bag.stuck.limit bag.compare.held bag.compare.Likeness.differs bag.compare.likeness "
                                 "bag.compare.turns bag.compare.moves bag.course.off_world bag.collection.Collection.sample causes.trial.likelihoods causes.trial.judged causes.plan.judged mcapio.estimates.bounds "
                                 "mcapio.estimates.hypotheses mcapio.place.landmarks vda5050.run.quality",
        "of calibrations and transforms, which are refused where one is NaN": "bag.frames.is_optical",
        "corners, whose reader refuses NaN": "bag.tags.of_another_picture",
        "poses, of which those of NaN are left out before": "bag.course.contradiction",
        "bounds of options, written in their parsers": "numbers.between",
        "written by the table of mistakes": "causes.fault.discrete",
        "limits of time, whose options are read by numbers.finite": "avi.AviWriter.__init__ causes.search.Search.__init__ causes.search.Search.part_s causes.trial.Blocks.part "
                                 "causes.trial.Trials.run foxglove_server.serve live.Live.next mavlink.Bridge.run pool.Pool.run suggest.search.Search.__init__",
        "values of the table of parameters, whose reader refuses NaN": "suggest.drive.Run.drive suggest.drive.Scores.of suggest.drive.Scores.with_states",
        "in test_nan.py": "replaying.replay recording.RecordingWriter.landmarks recording.RecordingWriter.frame",
    },
    "waymark_hil": {
        "starts programs and machines": "guest.* targets.* replays.* progress.* samples.* hil.*",
        "files and their names": "compare.load compare.main lcm_log.types lcm_log.logged lcm_log.heard lcm_log.name_of lcm_log.source page.sheet page.make "
                                 "poses.is_planar poses.table recording.* scenario.* stamps.* verdict.junit verdict.write limits.read",
        "whole runs, out of the functions that have a case": "compare.compare judge.* fault_judge.* poses.at poses.around poses.differences poses.apart_of "
                                 "verdict.Checks.add",
    },
    "waymark_fleet": {
        "starts programs with drives that it draws, and shows what they measured": "bench.* bench_drives.* cell.* incidents.* wmlog.*",
        "a grid of what is drawn, which is finite": "html.round_steps",
        "files, names and text": "sums.* plan.* html.style html.escape html.page html.section html.tiles html.table mine_page.* compare_page.*",
        "whole batches, out of the functions that have a case": "batch.* compare.* mine.* comparison.load comparison.pairs_of comparison.name_of comparison.difference comparison.worst",
        "counts": "statistics.sign_test",
    },
}
FOLDERS = {"waymark": "tools/python/src/waymark", "waymark_hil": "tools/hil/waymark_hil", "waymark_fleet": "tools/fleet/waymark_fleet"}


class Numbers(unittest.TestCase):
    def test_a_variance_of_nan_hides_none_that_marks_a_speed_as_not_measured(self):
        for marked in (-1.0, 1e9):
            self.assertTrue(np.isnan(odometry([0.5, 0.1, 0.0, 0.0, 0.0, 0.1], [0.01, marked, np.nan, 0.01, 0.01, 0.01])[1]))

    def test_a_nan_comes_out_or_is_refused(self):
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            nans.check(self, CASES, least=250)

    def test_each_function_has_a_case_or_a_reason(self):
        cased = {name.split(":")[0] for name in CASES | test_nan.CASES}
        for package, reasons in WITHOUT.items():
            listed, there = {name for text in reasons.values() for name in text.split()}, set()
            for name, has_numbers in nans.functions(common.ROOT / FOLDERS[package]):
                there |= {name, f"{name.split('.')[0]}.*"}
                if has_numbers:
                    self.assertTrue(name in cased or name in listed or f"{name.split('.')[0]}.*" in listed, f"{package}: {name} has no case, and no reason for none")
            self.assertEqual(listed - there, set(), f"{package}: reasons for what is not there")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[1:])
