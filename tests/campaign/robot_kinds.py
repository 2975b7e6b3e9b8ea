# SPDX-License-Identifier: Apache-2.0
"""A robot of robots.py, drawn: its scenario (docs/scenario.md), the configuration that its user writes, and what it is, in words.

Ranges are of robots that people build: indoors, in a yard, a car; wheels with and without a gyro, measured twists, an IMU,
holonomic and skid-steer bases; one or two sensors of landmarks, markers, or a receiver. Errors are of a tape measure and a data
sheet, within the priors of the defaults. Wheels slip by up to 1 % for seconds, and data are up to 200 ms late."""

# m of the wheel and the track, the factors of the route's lengths and radii, m/s
SIZES = {"small": (0.04, 0.3, 0.5, 0.6, 0.4), "yard": (0.1, 0.5, 1, 1, 0.8), "car": (0.31, 1.5, 6, 6, 6)}
TURNS = (("turn", -60), ("turn", 100), ("straight", 4), ("turn", 80), ("straight", 4), ("stand", 2), ("turn", 60), ("straight", 8),
         ("turn", 90), ("straight", 4), ("turn", 90), ("straight", 6), ("stand", 1))


def legs(long, round_, speed_mps):
    out = []
    for kind, size in (("stand", 3), ("straight", 5), *TURNS):
        if kind == "stand":
            out.append({"stand_s": size})
        elif kind == "straight":
            out.append({"straight_m": size * long, "speed_mps": speed_mps})
        else:
            out.append({"turn_deg": size, "radius_m": 1.3 * round_, "ease_m": 0.5 * round_, "speed_mps": 0.75 * speed_mps})
    return out


def draw_gyro(r, errors):
    errors.update(yaw_rate_bias_mradps=r.choice((2, 8)), yaw_rate_bias_walk_mradps_per_sqrt_min=0.3, yaw_rate_noise_mradps=r.choice((2, 6)))


def draw_wheels(r, base, scenario, errors, config):
    """Wheels on a bus: ticks or speeds, with a gyro or without."""
    has_gyro = base in ("ticks and gyro", "speeds and gyro", "car")
    scenario["bus"] = {"wheels_hz": r.choice((20, 50)), "yaw_rate_hz": 100 if has_gyro else 0, "steering_hz": 0,
                       "gear_hz": 10 if base == "speeds and gyro" else 0, "stamp_jitter_ms": 0.3}
    errors.update(wheel_radius_percent=r.choice((0.5, 1.5)), track_percent=r.choice((1, 3)), slip_percent=r.choice((0, 0.5, 1)))
    if has_gyro:
        draw_gyro(r, errors)
    if base == "car":
        scenario["robot"]["wheelbase_m"] = 2.7
    if base == "speeds and gyro":
        scenario["robot"]["wheels_send"] = "speeds"
    if base == "skid steer":
        scenario["motion"] = {"base": "skid_steer", "track_scale": r.choice((1.3, 1.5, 1.7))}
        errors.update(track_percent=5, rotation_center_m=0.1, wheel_noise_mm_per_sqrt_m=5)
        config["motion"] = {"drive": "skid_steer"}


def draw_twist(r, base, long, scenario, errors, config):
    """Measured twists, sideways too, with an IMU's gyro or without."""
    twist = {"rate_hz": r.choice((10, 50)), "speed_noise_mps": 0.02 * long, "speed_noise_percent": 3, "turn_noise_mradps": 10,
             "turn_noise_percent": 5}
    scenario["motion"] = {"twist": twist}
    config["motion"] = {"twist": "measured"}
    errors.update(speed_percent=r.choice((1, 4)), turn_percent=r.choice((1, 3)))
    if base.startswith("holonomic"):
        twist.update(side_noise_mps=0.02 * long, side_noise_percent=6)
        scenario["motion"].update(base="holonomic", crab_deg=r.choice((20, 50)), crab_m=8 * long)
        config["motion"]["drive"] = "holonomic"
        errors["side_percent"] = r.choice((1, 4))
    if base.endswith("IMU"):
        scenario["motion"]["imu"] = {"rate_hz": 100, "accelerometer_noise_mps2": 0.02, "accelerometer_bias_mps2": 0.05}
        draw_gyro(r, errors)


def draw_eye(r, kind, i, long, mounted):
    """A sensor of landmarks: bearings, ranges, both, depths; or of coded markers."""
    eye = {"kind": "landmarks", "name": f"eye{i}", "xyz_m": mounted(), "rate_hz": r.choice((2, 5, 15)), "phase_ms": 7 + 5 * i,
           "range_m": r.choice((4, 8)) * long, "outlier_percent": r.choice((0, 2))}
    if kind != "range":
        eye.update(field_of_view_deg=r.choice((60, 120, 360)), rpy_deg=[0, 0, r.choice((0, 0, 30, 180))])
    if kind in ("both", "bearing", "depth"):
        eye["bearing_sigma_deg"] = r.choice((0.3, 1.5))
    if kind in ("both", "depth"):
        eye["range_sigma_m"] = r.choice((0.02, 0.1)) * long
    if kind == "depth":
        eye.update(range_is="depth", field_of_view_deg=60)
    if kind == "range":
        eye.update(range_sigma_m=r.choice((0.05, 0.15)), range_m=30 * long)
    if kind == "markers":
        eye.update(kind="markers", bearing_sigma_deg=0.5, range_sigma_m=0.02 * long, heading_sigma_deg=2)
    return eye


def draw_receiver(r, fix, size, mounted):
    receiver = {"kind": "gnss", "name": "receiver", "xyz_m": mounted(), "rate_hz": r.choice((1, 5)), "latency_ms": r.choice((50, 200))}
    if fix == "RTK":
        return {**receiver, "sigma_xy_m": 0.02, "sigma_z_m": 0.03}
    of_car = size == "car"
    return {**receiver, "sigma_xy_m": 1.0 if of_car else 0.3, "sigma_z_m": 1.0, "wander_m": 2 if of_car else 0.5, "wander_s": 60}


def draw(r, seed):
    base = r.choice(("ticks", "ticks and gyro", "speeds and gyro", "twist", "twist and IMU", "holonomic", "holonomic and IMU",
                     "skid steer", "car"))
    size = "car" if base == "car" else r.choice(("small", "yard"))
    wheel_m, track_m, long, round_, speed_mps = SIZES[size]
    scenario = {"format": "waymark-scenario/1", "name": f"robot-{seed}", "about": base, "seed": seed, "clock_start_s": 100, "world": {},
                "robot": {"wheel_radius_m": wheel_m, "ticks_per_turn": r.choice((360, 1024, 4096)), "track_m": track_m}}
    errors = {"start_xy_m": 0.15 if size == "car" else 0.05, "start_heading_deg": r.choice((0.5, 2)), "camera_yaw_deg": r.choice((0, 1, 3))}
    config = {"format": "waymark-config/1"}
    if base in ("ticks", "ticks and gyro", "speeds and gyro", "skid steer", "car"):
        draw_wheels(r, base, scenario, errors, config)
    else:
        draw_twist(r, base, long, scenario, errors, config)

    def mounted():
        return [r.uniform(-0.5, 0.5) * track_m, r.uniform(-0.4, 0.4) * track_m, r.uniform(0.1, 1.0) * track_m]

    mode = r.choice(("known", "positions")) if size == "car" else r.choice(("known", "known", "slam", "positions"))
    kinds, sensors = [], []
    if mode != "positions":
        scenario["world"] = {"scatter": {"count": r.choice((6, 12, 25)), "aside_m": [0.5 * long, 3 * long], "apart_m": 0.7 * long}}
        if mode == "slam":
            scenario["world"]["map"] = "none"
        else:
            errors["landmark_m"] = r.choice((0, 0.02, 0.05)) * long
        kinds = [r.choice(("both", "bearing", "depth", "markers") if mode == "slam" else ("both", "bearing", "range", "depth", "markers"))]
        if r.random() < 0.25:
            kinds.append(r.choice(("both", "bearing")))
        sensors = [draw_eye(r, kind, i, long, mounted) for i, kind in enumerate(kinds)]
    late_ms = r.choice((0, 60, 150))
    for eye in sensors:
        eye["latency_ms"] = late_ms
    if mode == "positions" or (mode == "known" and size != "small" and r.random() < 0.2):
        kinds.append(r.choice(("RTK", "code")))
        sensors.append(draw_receiver(r, kinds[-1], size, mounted))
    scenario.update(sensors=sensors, errors={k: v for k, v in errors.items() if v}, route={
        "start": {"x_m": 0, "y_m": 0, "heading_deg": 0}, "acceleration_mps2": 2 if size == "car" else 0.6, "laps": 2,
        "legs": legs(long, round_, speed_mps)})
    config["estimator"] = "slam" if mode == "slam" else "landmark_ekf"
    return scenario, config, f"{size}, {base}: {', '.join(kinds)}; {config['estimator']}"
