# SPDX-License-Identifier: Apache-2.0
"""Pictures and maps as pictures: sizes, greys, distances."""

import tempfile
from pathlib import Path

import cv2
import numpy as np
import scipy
import scipy.ndimage as nd
from PIL import Image, __version__ as pillow

CV, PIL, SCIPY = f"OpenCV {cv2.__version__}", f"Pillow {pillow}", f"scipy {scipy.__version__}"


def middle(a):
    return (a * np.arange(a.shape[1])).sum() / a.sum()


def rows():
    folder = Path(tempfile.mkdtemp())
    y, x = np.mgrid[0:128, 0:128].astype(np.float32)
    spot = np.exp(-((x - 60) ** 2 + (y - 64) ** 2) / 50).astype(np.float32)
    whole = "pictures keep the size that `calibration.yaml` states; another size is refused"
    for name in ("INTER_AREA", "INTER_NEAREST"):
        yield f"OpenCV resize, {name}: a spot at x 60 at half the size", f"{middle(cv2.resize(spot, (64, 64), interpolation=getattr(cv2, name))):.2f}", CV, whole
    yield "OpenCV pyrDown: the same", f"{middle(cv2.pyrDown(spot)):.2f}", CV, whole
    yield "Pillow resize, NEAREST: the same", f"{middle(np.asarray(Image.fromarray(spot).resize((64, 64), Image.NEAREST))):.2f}", PIL, whole
    hill = np.exp(-((np.arange(1000) - 900) / 40.0) ** 2)[None]
    at = [(z * (np.arange(100) + 0.5)).sum() / z.sum() * 10 for z in (nd.zoom(hill, (1, 0.1), order=1)[0], nd.zoom(hill, (1, 0.1), order=1, grid_mode=True, mode="nearest")[0])]
    yield "scipy zoom 0.1 of 1000 cells: a hill at cell 900.5", f"at {at[0]:.1f}; with grid_mode at {at[1]:.1f}", SCIPY, "maps are not resampled"
    turned = cv2.warpAffine(np.arange(16, dtype=np.uint8).reshape(4, 4), cv2.getRotationMatrix2D((2, 2), 180, 1), (4, 4))
    yield "OpenCV: a 4 x 4 picture turned by 180 degrees about (2, 2)", f"{int((turned[0] == 0).sum())} of 4 pixels of the first row are empty", CV, "maps are turned by their yaw, not as pictures"
    free = np.full((200, 200), 255, np.uint8)
    free[0, 0] = 0
    for mask in (3, 5, 0):
        d = cv2.distanceTransform(free, cv2.DIST_L2, mask)
        yield f"OpenCV distanceTransform, mask {mask or 'precise'}: 100 cells along a row, 100 along a diagonal", f"{d[0, 100]:.1f}, {d[100, 100]:.1f}", CV, "Euclidean, to the place of the nearest edge"
    folder.joinpath("P2.pgm").write_bytes(b"P2\n3 1\n100\n0 50 100\n")
    folder.joinpath("P5.pgm").write_bytes(b"P5\n3 1\n100\n" + bytes([0, 50, 100]))
    scaled = "all are scaled to 255"
    for kind, name in (("P2", "text"), ("P5", "binary")):
        yield f"OpenCV: greys 0, 50, 100 of a PGM of {name} with the maximum 100", ", ".join(map(str, cv2.imread(str(folder / f"{kind}.pgm"), 0)[0])), CV, scaled
        yield f"Pillow: the same, {name}", ", ".join(map(str, np.asarray(Image.open(folder / f"{kind}.pgm"))[0])), PIL, scaled
    cv2.imwrite(str(folder / "16.png"), np.array([[0, 100 * 257, 205 * 257, 65535]], np.uint16))
    yield "Pillow convert(\"L\") of a 16-bit PNG of 0, 100, 205, 255 times 257", ", ".join(map(str, np.asarray(Image.open(folder / "16.png").convert("L"))[0])), PIL, "the same 0, 100, 205, 255"
    yield "OpenCV IMREAD_GRAYSCALE of it", ", ".join(map(str, cv2.imread(str(folder / "16.png"), 0)[0])), CV, "the same 0, 100, 205, 255"
    Image.fromarray(np.array([[[0, 0, 0, 0], [205, 205, 205, 255]]], np.uint8)).save(folder / "clear.png")
    yield "OpenCV IMREAD_GRAYSCALE of a transparent pixel", f"{cv2.imread(str(folder / 'clear.png'), 0)[0, 0]}: black", CV, "a cell of a map is unknown"
    exif = Image.Exif()
    exif[0x0112] = 6
    Image.fromarray(np.zeros((48, 64), np.uint8)).save(folder / "turned.jpg", exif=exif)
    cv, pil = cv2.imread(str(folder / "turned.jpg"), 0).shape, Image.open(folder / "turned.jpg").size
    yield "OpenCV imread of a JPEG of 64 x 48 with EXIF orientation 6", f"{cv[1]} x {cv[0]}", CV, "the picture as it is stored: 64 x 48"
    yield "Pillow: the same", f"{pil[0]} x {pil[1]}", PIL, "the picture as it is stored"
    t = np.linspace(0, 2 * np.pi, 10001)
    worst = np.abs(np.angle(np.exp(1j * (cv2.phase(np.cos(t), np.sin(t)).ravel() - t)))).max()
    yield "OpenCV phase: largest error", f"{np.degrees(worst):.4f} degrees", CV, "its own arctangent, the same bits on all computers"
    floor = cv2.GaussianBlur(np.random.RandomState(2).rand(85, 85).astype(np.float32), (0, 0), 2)
    for n in (64, 65):
        found = cv2.phaseCorrelate(floor[10:10 + n, 10:10 + n].copy(), floor[10:10 + n, 7:7 + n].copy())[0][0]
        yield f"OpenCV phaseCorrelate: a shift of 3 px at {n} x {n}", f"{found:.0f} px", CV, "not used"
    box = cv2.minAreaRect(np.array([[0, 0], [10, 0], [10, 4], [0, 4]], np.float32))
    yield "OpenCV minAreaRect: angle of a 10 x 4 box that lies flat", f"{box[2]:.0f} degrees, with the sides {box[1][0]:.0f} and {box[1][1]:.0f}", CV, "not used"
    filled = np.pad(np.ones((10, 10), np.uint8), 5)
    yield "OpenCV contourArea of a filled square of 10 x 10 pixels", f"{cv2.contourArea(cv2.findContours(filled, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)[0][0]):.0f}", CV, "borders lie half a pixel outside of the pixels' middles"
