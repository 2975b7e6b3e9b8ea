# SPDX-License-Identifier: Apache-2.0
"""Square markers: corners, pixels and directions of AprilTag's library, its wrappers and OpenCV."""

import cv2
import dt_apriltags
import numpy as np
import pupil_apriltags

FAMILY = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
LEFT, TOP, SIDE, SCALE = 100.25, 120.5, 160, 8  # px of the picture; pictures are drawn SCALE times as large
PRINT = np.array([[LEFT, TOP], [LEFT + SIDE, TOP], [LEFT + SIDE, TOP + SIDE], [LEFT, TOP + SIDE]])
NAMES = ("upper left", "upper right", "lower right", "lower left")


def picture():
    """OpenCV's print 7, upright, its outer corners at PRINT, where 0 is the left side of the first pixel; a blur of 0.6 px."""
    large = np.full((480 * SCALE, 640 * SCALE), 255, np.uint8)
    x, y, side = int(LEFT * SCALE), int(TOP * SCALE), SIDE * SCALE
    large[y:y + side, x:x + side] = cv2.aruco.generateImageMarker(FAMILY, 7, side, borderBits=1)
    large = cv2.GaussianBlur(large, (0, 0), 0.6 * SCALE)
    return np.round(large.reshape(480, SCALE, 640, SCALE).mean((1, 3))).astype(np.uint8)


def order(corners):
    return [NAMES[int(np.argmin(np.linalg.norm(PRINT - corner, axis=1)))] for corner in corners]


def offset(corners):
    """Mean of the corners against the print, px."""
    return np.mean(corners, axis=0) - PRINT.mean(axis=0)


def opencv(image, refinement):
    parameters = cv2.aruco.DetectorParameters()
    parameters.cornerRefinementMethod = getattr(cv2.aruco, "CORNER_REFINE_" + refinement)
    return cv2.aruco.ArucoDetector(FAMILY, parameters).detectMarkers(image)[0][0].reshape(4, 2)


def library(image, wrapper=pupil_apriltags, **options):
    return wrapper.Detector(families="tag36h11", **{"quad_decimate": 1.0, **options}).detect(image)[0]


def convention(corners):
    x = offset(corners)[0]
    return "0 is the middle of the first pixel" if abs(x + 0.5) < 0.13 else "0 is the left side of the first pixel" if abs(x) < 0.13 else f"neither: {x:+.2f} px"


def rows():
    image, april, cv = picture(), "pupil-apriltags 1.0.4", f"OpenCV {cv2.__version__}"
    ours = "0 is the middle of the first pixel, in all files and messages"
    plain, half = library(image), library(image, quad_decimate=2.0)
    yield "AprilTag: which corner comes first, of a print as OpenCV draws it", f"{order(plain.corners)[0]}, then {order(plain.corners)[1]}", april, "[marker-corners.csv](recording-format.md) begins with the upper left one and goes on clockwise"
    yield "OpenCV: the same", f"{order(opencv(image, 'SUBPIX'))[0]}, then {order(opencv(image, 'SUBPIX'))[1]}", cv, "the same order"
    pose = pupil_apriltags.Detector(families="tag36h11", quad_decimate=1.0).detect(image, True, (600, 600, 320, 240), 0.16)[0]
    turn = np.degrees(np.arctan2(pose.pose_R[1, 0], pose.pose_R[0, 0]))
    yield "AprilTag: turn of OpenCV's upright print of a tag36h11", f"{abs(turn):.0f} degrees", april, "the four oldest families are read as OpenCV draws them ([families](detectors/markers.md))"
    yield "AprilTag: place of column 0", convention(plain.corners), april, ours
    for name, do in (("SUBPIX", "the same origin: its corners are taken as they are"), ("APRILTAG", "corners need half a pixel subtracted: 0 is the pixel's side there")):
        x = offset(opencv(image, name))
        yield f"OpenCV: mean of the corners with CORNER_REFINE_{name}, of one print", f"{x[0]:+.1f}, {x[1]:+.1f} px from where 0 is the left side of the first pixel", cv, do
    square = np.full((480, 640), 255, np.uint8)
    square[120:280, 100:260] = cv2.aruco.generateImageMarker(FAMILY, 7, 160, borderBits=1)
    for name in ("NONE", "APRILTAG"):
        c = opencv(square, name)
        yield f"OpenCV: width of a print of 160 px with CORNER_REFINE_{name}", f"{c[:, 0].max() - c[:, 0].min():.0f} px", cv, "measures the edges again, sub-pixel, in the raw picture"
    yield "AprilTag: largest move of a corner by quad_decimate 2", f"{np.abs(half.corners - plain.corners).max():.1f} px", april, "no decimation"
    rough = library(image, quad_decimate=2.0, refine_edges=0)
    yield "the same without refine_edges", f"{np.abs(rough.corners - plain.corners).max():.1f} px", april, "no decimation"
    yield "AprilTag: corners by its decode_sharpening", "the same" if np.array_equal(library(image, decode_sharpening=1.0).corners, plain.corners) else "others", april, "no sharpening"
    other = library(image, dt_apriltags)
    yield "dt-apriltags against pupil-apriltags", f"corners differ by {np.abs(other.corners - plain.corners).max():.2f} px", "dt-apriltags 3.1.7", "-"
    mirrored = pupil_apriltags.Detector(families="tag36h11").detect(np.ascontiguousarray(image[:, ::-1]))
    yield "AprilTag: a mirrored picture", f"{len(mirrored)} tags", april, "-"
    yield "OpenCV: a GridBoard's first marker", "y down: its first corner is at " + ", ".join(f"{v:.0f}" for v in cv2.aruco.GridBoard((2, 2), 1.0, 0.5, FAMILY).getObjPoints()[0][0]), cv, "marks of boards have their places in the board's file"
