# SPDX-License-Identifier: Apache-2.0
"""Gyroscopes and accelerometers: directions, units, first seconds, noise."""

import ahrs
import allantools
import imufusion
import numpy as np

AHRS, FUSION, ALLAN = "ahrs 0.4.0", "imufusion 1.3.3", "AllanTools 2024.6"


def quarter_turn(name, **options):
    """Heading after a turn of 90 degrees to the left, by gyroscope and accelerometer."""
    gyro = np.zeros((400, 3))
    gyro[:200, 2] = np.radians(45)
    q = getattr(ahrs.filters, name)(gyr=gyro, acc=np.tile([0, 0, 9.81], (400, 1)), frequency=100.0, **options).Q[-1]
    return round(np.degrees(2 * np.arctan2(q[3], q[0])))


def level(convention, up):
    """Roll of an IMU that leans by 0.1 rad and measures `up` g on its z axis."""
    settings = imufusion.AhrsSettings()
    settings.convention = getattr(imufusion, "CONVENTION_" + convention)
    filtered = imufusion.Ahrs()
    filtered.set_settings(settings)
    for _ in range(2000):
        filtered.update_no_magnetometer(np.zeros(3), np.array([0, 0.1, up]))
    return imufusion.quaternion_to_euler(filtered.get_quaternion())[0]


def heading(skip):
    filtered = imufusion.Ahrs()
    if skip:
        filtered.skip_startup()
    for _ in range(300):
        filtered.update_no_magnetometer(np.array([0, 0, 10.0]), np.array([0, 0, 1.0]))
    return imufusion.quaternion_to_euler(filtered.get_quaternion())[2]


def rows():
    left = "positive to the left, in the axes of `base_link`"
    for name in ("Madgwick", "Mahony", "EKF", "AQUA", "Complementary", "UKF"):
        yield f"ahrs {name}: heading after a turn of 90 degrees to the left", f"{quarter_turn(name)} degrees", AHRS, left
    tilted = dict(acc=np.array([[0, 2.9, 9.37]] * 2), mag=np.array([[20.0, 0, -40]] * 2))
    tilt, saam, famc = (getattr(ahrs.filters, name)(**tilted).Q[0] for name in ("Tilt", "SAAM", "FAMC"))
    inverse = np.array([1, -1, -1, -1])
    for name, q in (("SAAM", saam), ("FAMC", famc)):
        same, other = abs(q @ tilt) > 0.999, abs(q * inverse @ tilt) > 0.999
        yield f"ahrs {name} against Tilt, of one accelerometer and magnetometer", "the same rotation" if same else "the inverse rotation" if other else "another rotation", AHRS, "no magnetometer"
    for convention in ("NWU", "NED"):
        for up in (0.99, -0.99):
            yield f"imufusion {convention}: roll of an IMU that measures 0.1 g on y and {up} g on z", f"{level(convention, up):.0f} degrees", FUSION, "at rest an accelerometer measures +9.81 m/s2 upwards"
    for skip in (False, True):
        yield f"imufusion: heading after 30 degrees in the first 3 s{', with skip_startup' if skip else ''}", f"{heading(skip):.1f} degrees", FUSION, "the gyroscope counts from the first sample on"
    yield "imufusion: units of its gyroscope and accelerometer", "degrees/s and g" if abs(heading(True) - 30) < 0.1 else "others", FUSION, "rad/s and m/s2"
    rates = np.random.RandomState(1).randn(100000) * 0.1
    for name, options in (("by default", {}), ('with data_type="freq"', {"data_type": "freq"})):
        yield f"allantools oadev {name}: white noise of 0.1 at 100 Hz, at 1 s", f"{allantools.oadev(rates, rate=100, taus=[1], **options)[1][0]:.2f}", ALLAN, "noise densities, of rates"
