# SPDX-License-Identifier: Apache-2.0
"""The drives of `waymark bench`: recordings that a script writes, the same on every board, without a simulator or a file to fetch.

Numbers are rounded before they are written, so that another computer's sine makes no other bytes."""
import math
import random
import struct

# Rows of bits of the first identities of tag36h11 [Olson2011], 6 x 6, from the upper left; white is 1.
TAG36H11 = (0xD5D628584, 0xD97F18B49, 0xDD280910E, 0xE479E9C98, 0xEBCBCA822, 0xF31DAB3AC, 0x056A5D085, 0x10652E1D4, 0x22B1DFEAD,
            0x265AD0472, 0x34FE91B86, 0x3FF962CD5, 0x43A25329A, 0x474B4385F, 0x4E9D243E9, 0x5246149AE, 0x5997F5538, 0x683BB6C4C)
RECORDING = "format: waymark-recording/1\nname: {name}\nduration_s: {seconds}\nstreams: [{streams}]\nvehicle: {{initial_pose: {pose}}}\n"
CONFIG = "format: waymark-config/1\nestimator: {estimator}\n"
NS = 1_000_000_000

# ── tags on a wall, seen straight on: pictures whose every pixel is exact ──────────────────────────────────────────────
WALL_M, CAMERA_Z_M = 2.25, 0.4  # from the camera to the wall; the camera's height
TAG_M, COLUMN_M, ROWS_M = 0.16, 0.5, (0.75, 0.05)  # black square; from column to column; heights of the two rows
SIDEWAYS_MPS, PICTURES_HZ = 0.1, 10
BLACK, WHITE, NOISE = 40, 200, 7  # grey values; noise is 0 to NOISE, a mask


def panorama(width, height, pixels_per_m, columns):
    """Rows of the wall as the camera sees it, from the leftmost place on: bytes each."""
    length = width + round(COLUMN_M * columns * pixels_per_m)
    module = round(TAG_M * pixels_per_m) // 8
    rows = [bytearray([WHITE]) * length for _ in range(height)]
    for identity in range(2 * columns):
        column, row = divmod(identity, 2)
        left = length - width // 2 - round(COLUMN_M * column * pixels_per_m) - 4 * module
        top = height // 2 - round((ROWS_M[row] - CAMERA_Z_M) * pixels_per_m) - 4 * module
        for y in range(8):
            bits = [0] * 8 if y in (0, 7) else [0, *((TAG36H11[identity] >> (35 - 6 * (y - 1) - x) & 1) for x in range(6)), 0]
            line = b"".join(bytes([WHITE if bit else BLACK]) * module for bit in bits)
            for at in range(top + y * module, top + (y + 1) * module):
                rows[at][left:left + 8 * module] = line
    return rows


def avi(width, height, pictures):
    """Uncompressed grey pictures as an AVI."""
    def chunk(name, data):
        return name + struct.pack("<I", len(data)) + data

    strf = struct.pack("<IiiHH4sIiiII", 40, width, height, 1, 8, b"Y800", width * height, 0, 0, 0, 0)
    strh = b"vidsY800" + bytes(12) + struct.pack("<II", 1, PICTURES_HZ) + bytes(28)
    head = chunk(b"LIST", b"hdrl" + chunk(b"avih", bytes(56)) + chunk(b"LIST", b"strl" + chunk(b"strh", strh) + chunk(b"strf", strf)))
    return chunk(b"RIFF", b"AVI " + head + chunk(b"LIST", b"movi" + b"".join(chunk(b"00db", picture) for picture in pictures)))


def tags(folder, width, height, seconds=3):
    """A robot that moves to its left along a wall with two rows of tags, of which it sees about twelve; its last place (x, y)."""
    focal_px = width * 0.703125  # 450 and 900: pixels of the wall are whole ones
    pixels_per_m = focal_px / WALL_M
    columns, count = len(TAG36H11) // 2, round(seconds * PICTURES_HZ)
    wall = panorama(width, height, pixels_per_m, columns)
    step_px = round(SIDEWAYS_MPS / PICTURES_HZ * pixels_per_m)
    begin_m = 1.6  # left of the first column; tags fill the picture from here on
    left_px = len(wall[0]) - width - round(begin_m * pixels_per_m)
    noise = random.Random(1).randbytes(width * height + count)
    mask = int.from_bytes(bytes([NOISE]) * (width * height), "little")
    pictures = []
    for i in range(count):
        at = left_px - i * step_px
        clean = int.from_bytes(b"".join(row[at:at + width] for row in wall), "little")
        pictures.append((clean + (int.from_bytes(noise[i:i + width * height], "little") & mask)).to_bytes(width * height, "little"))
    write(folder, {
        "recording.yaml": RECORDING.format(name=folder.name, seconds=seconds, streams="motion.csv", pose=f"{{t_ns: 0, x_m: 0, y_m: {begin_m}, heading_rad: 0}}"),
        "calibration.yaml": f"cameras:\n  front: {{model: pinhole-radtan, size: [{width}, {height}], intrinsics: [{focal_px}, {focal_px}, {width / 2 - 0.5}, {height / 2 - 0.5}], "
                            f"distortion: [0, 0, 0, 0], mounting: {{xyz_m: [0, 0, {CAMERA_Z_M}], rpy_deg: [0, 0, 0]}}}}\nmarkers: {{family: tag36h11, size_m: {TAG_M}}}\n",
        "landmarks.csv": "id,x_m,y_m,z_m,sigma_m\n" + "".join(f"{i},{WALL_M},{i // 2 * COLUMN_M},{ROWS_M[i % 2]},0.002\n" for i in range(2 * columns)),
        "motion.csv": "t_ns,v_mps,w_radps,vy_mps\n" + "".join(f"{i * 20_000_000},0,0,{SIDEWAYS_MPS}\n" for i in range(seconds * 50)),
        "video/front.csv": "frame,t_ns,exposure_ns\n" + "".join(f"{i},{i * NS // PICTURES_HZ},0\n" for i in range(count)),
        "robot.yaml": CONFIG.format(estimator="landmark_ekf") + "vision: {apriltag: {}}\n"})
    (folder / "video/front.avi").write_bytes(avi(width, height, pictures))
    return 0.0, begin_m + SIDEWAYS_MPS * (seconds - 1 / 50)


# ── a circle among landmarks, and in a room ────────────────────────────────────────────────────────────────────────────
RADIUS_M, SPEED_MPS = 2.5, 0.8
LANDMARKS = ((4, 1), (-3, 4), (-4, -2), (3, -4), (0.5, 5), (5, -1.5))
BEARING_RAD, RANGE_M = 0.01, 0.05  # sigmas of a sighting
ROOM_M, CELL_M, VIEW_M, POINT_M = (12.0, 8.0), 0.05, 4.0, 0.02  # the room, a cell of its map, what is seen of its walls, sigma of a point


def on_circle(t_s):
    """Pose (x, y, heading) on a circle about the origin, to the left."""
    angle = SPEED_MPS * t_s / RADIUS_M
    return RADIUS_M * math.cos(angle), RADIUS_M * math.sin(angle), math.remainder(angle + math.pi / 2, 2 * math.pi)


def seen_from(pose, x_m, y_m):
    """A point of the map in base_link."""
    dx, dy, (c, s) = x_m - pose[0], y_m - pose[1], (math.cos(pose[2]), math.sin(pose[2]))
    return c * dx + s * dy, c * dy - s * dx


def circle(folder, seconds):
    """What both drives on the circle have: (files, last place)."""
    pose = f"{{t_ns: 0, x_m: {RADIUS_M}, y_m: 0, heading_rad: {math.pi / 2:.6f}}}"
    files = {"motion.csv": "t_ns,v_mps,w_radps\n" + "".join(f"{i * 20_000_000},{SPEED_MPS},{SPEED_MPS / RADIUS_M}\n" for i in range(seconds * 50)),
             "recording.yaml": RECORDING.format(name=folder.name, seconds=seconds, streams="motion.csv, {}", pose=pose)}
    return files, on_circle(seconds - 1 / 50)[:2]


def sightings(folder, estimator, seconds=40):
    """Bearings and ranges of six landmarks at 10 Hz."""
    files, end = circle(folder, seconds)
    noise, rows = random.Random(2), ["t_ns,sensor,id,bearing_rad,range_m"]
    for i in range(seconds * 10):
        for identity, place in enumerate(LANDMARKS):
            ahead, left = seen_from(on_circle(i / 10), *place)
            bearing, distance = math.atan2(left, ahead) + noise.gauss(0, BEARING_RAD), math.hypot(ahead, left) + noise.gauss(0, RANGE_M)
            rows.append(f"{i * NS // 10},eye,{identity},{math.remainder(bearing, 2 * math.pi):.6f},{distance:.6f}")
    files["recording.yaml"] = files["recording.yaml"].replace("{}", "sightings.csv")
    write(folder, {**files, "sightings.csv": "\n".join(rows) + "\n", "robot.yaml": CONFIG.format(estimator=estimator),
                   "calibration.yaml": f"sensors: {{eye: {{mounting: {{xyz_m: [0, 0, 0]}}, bearing_sigma_rad: {BEARING_RAD}, range_sigma_m: {RANGE_M}}}}}\n",
                   "landmarks.csv": "id,x_m,y_m,z_m,sigma_m\n" + "".join(f"{i},{x},{y},0,0.01\n" for i, (x, y) in enumerate(LANDMARKS))})
    return end


def room(folder, seconds=20):
    """Points of a room's walls at 10 Hz, on its floor plan."""
    files, end = circle(folder, seconds)
    width, height = (round(side / CELL_M) for side in ROOM_M)
    right, top = (side / 2 for side in ROOM_M)
    walls = [(x * 0.1 - right, y) for x in range(round(ROOM_M[0] * 10)) for y in (-top, top)]
    walls += [(x, y * 0.1 - top) for y in range(round(ROOM_M[1] * 10)) for x in (-right, right)]
    noise, rows = random.Random(3), ["t_ns,x_m,y_m"]
    for i in range(seconds * 10):
        for place in walls:
            ahead, left = seen_from(on_circle(i / 10), *place)
            if ahead > 0 and math.hypot(ahead, left) < VIEW_M:
                rows.append(f"{i * NS // 10},{ahead + noise.gauss(0, POINT_M):.4f},{left + noise.gauss(0, POINT_M):.4f}")
    inside = bytes(255 if 0 < c < width - 1 and 0 < r < height - 1 else 0 for r in range(height) for c in range(width))
    files["recording.yaml"] = files["recording.yaml"].replace("{}", "points.csv")
    write(folder, {**files, "points.csv": "\n".join(rows) + "\n", "robot.yaml": CONFIG.format(estimator="edge_mcl"), "calibration.yaml": "{}\n",
                   "map/map.yaml": f"image: free.pgm\nresolution: {CELL_M}\norigin: [{-right - CELL_M / 2}, {-top - CELL_M / 2}, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.2\n"
                                   "layers: {edges: edges.pgm, drivable: free.pgm}\n"})
    head = f"P5\n{width} {height}\n255\n".encode()
    (folder / "map/free.pgm").write_bytes(head + inside)
    (folder / "map/edges.pgm").write_bytes(head + bytes(255 - value for value in inside))
    return end


def write(folder, files):
    for name, text in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)


# name: (what it is, who writes it, stages of timing.json that are its figures)
DRIVES = {
    "tags-vga": ("twelve tags in a picture, 640 x 480", lambda folder: tags(folder, 640, 480), ("detect", "correct")),
    "tags-720p": ("the same, 1280 x 720", lambda folder: tags(folder, 1280, 720), ("detect", "correct")),
    "landmarks": ("six landmarks, landmark_ekf", lambda folder: sightings(folder, "landmark_ekf"), ("predict", "correct")),
    "slam": ("the same without a map, slam", lambda folder: sightings(folder, "slam"), ("predict", "correct")),
    "plan": ("a room's walls on its floor plan, edge_mcl", room, ("predict", "correct")),
}
