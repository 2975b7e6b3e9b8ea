# SPDX-License-Identifier: Apache-2.0
"""Robots on a floor plan, simulated without pictures: a car in corridors that the seed draws, and one with two driven wheels in a flat.
A camera sees the joints of wall and floor."""
import re

import replays

CAMERA = (0.33, 0.0, 0.5), (0.0, 20.0, 0.0)  # place, m; roll, pitch, yaw, degrees
START = (0.0, 0.0)  # of the robot that was made last
HEAD = """format: waymark-scenario/1
name: plan
clock_start_s: 5000
pictures: {samples: 1}
"""
COMMON = HEAD + f"""cameras: [{{name: front, size: [640, 360], xyz_m: {list(CAMERA[0])}, rpy_deg: {list(CAMERA[1])}}}]
sensors: [{{kind: edges, camera: front, name: floor, sigma_px: 0.7, range_m: 5, outlier_percent: 5, missed_percent: 20}}]
errors: {{wheel_radius_percent: 0.7, track_percent: 1, yaw_rate_bias_mradps: 4, yaw_rate_noise_mradps: 3, slip_percent: 0.3,
  camera_mounting_deg: 0.2, camera_mounting_mm: 5, camera_intrinsics_percent: 0.1, frame_stamp_jitter_ms: 2, start_xy_m: 0.03, start_heading_deg: 0.5}}
"""
CORRIDOR = """world: {kind: corridor, variant: easy}
robot:
  wheel_radius_m: 0.11
  ticks_per_turn: 2048
  track_m: 0.6
  wheelbase_m: 1.0
  wheels_send: speeds
  steering_table: {actuator_mm: [8, 18, 30, 42, 52, 60, 71, 84, 98], road_wheel_deg: [-41, -29, -17, -7, 0, 5.5, 13, 25, 39]}
bus: {wheels_hz: 100, yaw_rate_hz: 100, steering_hz: 50, gear_hz: 10, stamp_jitter_ms: 2}
"""
FLAT = """world: {kind: corridor, plan: PLANS/rooms-l-flat.yaml}
robot: {wheel_radius_m: 0.1, ticks_per_turn: 4096, track_m: 0.45, body: {front_m: 0.25, back_m: 0.25, width_m: 0.4}}
bus: {wheels_hz: 100, yaw_rate_hz: 100, gear_hz: 0, stamp_jitter_ms: 1}
ROUTE"""


def _simulated(folder, seed, options, text, seconds):
    global START
    scenario = folder.with_suffix(".scenario.yaml")
    scenario.write_text(COMMON + text)
    replays.command(options.bin_dir / "waymark-simulate", scenario, "--no-video", "--seed", seed, "--duration", seconds, "--out", folder)
    START = tuple(float(n) for n in re.search(r"x_m: ([-\d.]+), y_m: ([-\d.]+)", (folder / "recording.yaml").read_text()).groups())


def corridor(folder, seed, options):
    """A car in corridors."""
    _simulated(folder, seed, options, CORRIDOR, 60)


def flat(folder, seed, options):
    """Two driven wheels in a flat."""
    worlds = options.source_dir.resolve() / "config/worlds"
    route = re.search(r"(?ms)^route:.*?(?=^\S)", (worlds / "rooms-l-flat.yaml").read_text() + "\nend")[0]
    _simulated(folder, seed, options, FLAT.replace("PLANS", str(worlds / "plans")).replace("ROUTE", route), 60)
