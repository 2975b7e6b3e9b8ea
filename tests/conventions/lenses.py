# SPDX-License-Identifier: Apache-2.0
"""Lens models at their limits."""

import cv2
import gtsam
import numpy as np
import pyrealsense2 as rs

K = np.array([[300.0, 0, 640], [0, 300.0, 400], [0, 0, 1]])
FISHEYE = np.array([0.02, -0.003, 0.0005, -0.0001])
NONE = np.zeros(3)
CV, GTSAM, RS = f"OpenCV {cv2.__version__}", "gtsam 4.3.0", "pyrealsense2 2.59.1"


def ray(degrees):
    return np.array([[[np.sin(np.radians(degrees)), 0.0, np.cos(np.radians(degrees))]]])


def fisheye_column(degrees):
    t = np.radians(degrees)
    return 640 + 300 * t * (1 + FISHEYE @ [t**2, t**4, t**6, t**8])


def realsense(model, coefficients):
    lens = rs.intrinsics()
    lens.width, lens.height, lens.ppx, lens.ppy, lens.fx, lens.fy = 640, 480, 320.0, 240.0, 600.0, 600.0
    lens.model, lens.coeffs = getattr(rs.distortion, model), coefficients
    return rs.rs2_project_point_to_pixel(lens, rs.rs2_deproject_pixel_to_point(lens, [600.0, 400.0], 1.0))[0]


def rows():
    ours = "`equidistant` up to where its polynomial turns back, at most 180 degrees from the axis; beyond it no pixel"
    for degrees in (85, 89, 95):
        back = cv2.fisheye.undistortPoints(np.array([[[fisheye_column(degrees), 400.0]]]), K, FISHEYE)[0, 0]
        yield f"OpenCV fisheye: the ray of the pixel at {degrees} degrees", f"{np.degrees(np.arctan(back[0])):.1f} degrees", CV, ours
    for degrees in (85, 95):
        column = cv2.fisheye.projectPoints(ray(degrees), NONE, NONE, K, FISHEYE)[0][0, 0, 0]
        yield f"OpenCV fisheye: the pixel of a ray at {degrees} degrees", f"column {column:.0f}; the model has {fisheye_column(degrees):.0f}", CV, ours
    omni = np.array([[400.0, 0, 640], [0, 400.0, 400], [0, 0, 1]])
    for degrees in (60, 120):
        column = cv2.omnidir.projectPoints(ray(degrees), NONE, NONE, omni, 1.2, np.zeros((1, 4)))[0]
        back = cv2.omnidir.undistortPoints(column, omni, np.zeros((1, 4)), np.array([1.2]), np.eye(3)).ravel()
        yield f"OpenCV omnidir: the direction of the pixel at {degrees} degrees", f"x/z {back[0]:.2f}, without the sign of z", CV, "rays have three coordinates, so that directions behind the camera stay behind it"
    wide, bent = np.array([[600.0, 0, 640], [0, 600.0, 360], [0, 0, 1]]), np.array([-0.35, 0.12, 0, 0])
    for name, options in (("by default", {}), ("with 100 rounds", {"criteria": (3, 100, 1e-12)})):
        at = cv2.undistortPoints(np.array([[[0.0, 0.0]]]), wide, bent, **options)[0, 0]
        off = np.linalg.norm(cv2.projectPoints(np.array([[[*at, 1.0]]]), NONE, NONE, wide, bent)[0])
        yield f"OpenCV undistortPoints {name}: the corner of a wide lens and back", f"{off:.0f} px away", CV, "Newton's method until it stands still; a pixel without a ray is refused"
    pixel = cv2.projectPoints(np.array([[[0.5, 0.2, -2.0]]]), NONE, NONE, wide, bent)[0].ravel()
    yield "OpenCV projectPoints: a point behind the camera", f"pixel {pixel[0]:.0f}, {pixel[1]:.0f}, without a sign", CV, "no pixel"
    fold = np.array([-0.4, 0.0, 0, 0])
    columns = [cv2.projectPoints(ray(a), NONE, NONE, wide, fold)[0].ravel()[0] for a in (40, 60)]
    yield "OpenCV projectPoints: rays at 40 and 60 degrees, k1 -0.4", f"columns {columns[0]:.0f} and {columns[1]:.0f}: the second one is nearer", CV, "no pixel beyond the fold"
    lens, raises = gtsam.Cal3Fisheye(300, 300, 0, 640, 400, *FISHEYE), []
    for degrees in range(1, 90):
        try:
            lens.calibrate(np.array([fisheye_column(degrees), 400.0]))
        except RuntimeError:
            raises.append(degrees)
    yield "GTSAM Cal3Fisheye.calibrate: which of 1 to 89 degrees raise, with k1 to k4 of 0.02, -0.003, 0.0005, -0.0001", f"{raises[0]} to {raises[-1]}", GTSAM, ours
    yield "GTSAM Cal3Fisheye: the pixel of a ray at 95 degrees", f"column {lens.uncalibrate(np.array([np.tan(np.radians(95)), 0.0]))[0]:.0f}; the model has {fisheye_column(95):.0f}", GTSAM, ours
    try:
        gtsam.Cal3DS2(600, 600, 0, 640, 360, *bent).calibrate(np.array([0.0, 0.0]))
        said = "gives a ray"
    except RuntimeError:
        said = "raises"
    yield "GTSAM Cal3DS2.calibrate: the corner of the wide lens above", said, GTSAM, "a ray: the radius grows with the angle everywhere"
    for model, coefficients in (("brown_conrady", [0.1, 0, 0, 0, 0]), ("modified_brown_conrady", [0.1, 0, 0, 0, 0]), ("kannala_brandt4", [*FISHEYE, 0]), ("ftheta", [0.5, 0, 0, 0, 0])):
        yield f"librealsense {model}: pixel 600 to a ray and back", f"{realsense(model, coefficients):.0f}", RS, "the formula of its own `pinhole-radtan`" if model == "brown_conrady" else "the formula of its own `equidistant`" if model == "kannala_brandt4" else "no such model"
