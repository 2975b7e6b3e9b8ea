# SPDX-License-Identifier: Apache-2.0
"""Edge points as a detector would give them, without pictures: rays over the floor from the camera's place to the first edge of
the map, four times a second. Noise 1 cm and 0.4 % of the range, 3 % of the points anywhere on their rays."""
import math
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "contract"))
import mistakes  # noqa: E402
import replays  # noqa: E402

EYE_X_M, NEAREST_M, FARTHEST_M = 1.1, 0.4, 5.0
RAYS_DEG = range(-60, 61, 5)
PERIOD_NS = 250_000_000
SIGMA_M, SIGMA_REL, OUTLIERS = 0.01, 0.004, 0.03


class EdgeMap:
    """The map's layer of edges as bytes, kept in `cache`: reading the PNG takes longer than a drive."""

    def __init__(self, folder, cache):
        text = (folder / "map.yaml").read_text()
        self.resolution = float(text.split("resolution:")[1].split()[0])
        self.x_m, self.y_m = (float(v) for v in text.split("origin: [")[1].split("]")[0].split(",")[:2])
        self.width = int.from_bytes((folder / "edges.png").read_bytes()[16:20], "big")
        if not cache.exists():
            cache.parent.mkdir(parents=True, exist_ok=True)
            part = cache.with_suffix(f".{id(self)}")
            part.write_bytes(b"".join(bytes(row) for row in mistakes.png_rows((folder / "edges.png").read_bytes())))
            part.rename(cache)
        self.grey = cache.read_bytes()
        self.height = len(self.grey) // self.width

    def distance(self, x_m, y_m, angle):
        """To the first edge along a ray, or None."""
        step = 0.7 * self.resolution
        dx, dy = math.cos(angle) * step / self.resolution, math.sin(angle) * step / self.resolution
        column, row = (x_m - self.x_m) / self.resolution, self.height - (y_m - self.y_m) / self.resolution
        for k in range(int(FARTHEST_M / step)):
            c, r = int(column + k * dx), int(row - k * dy)
            if not (0 <= c < self.width and 0 <= r < self.height):
                return None
            if self.grey[r * self.width + c] > 127 and k * step >= NEAREST_M:
                return k * step
        return None


def add(recording, edges, random):
    """points.csv of a recording with truth, listed in its recording.yaml."""
    out, last = ["t_ns,x_m,y_m"], None
    for row in replays.rows(recording / "truth.csv"):
        t = int(row["t_ns"])
        if last is not None and t - last < PERIOD_NS:
            continue
        last, heading = t, 2 * math.atan2(float(row["qz"]), float(row["qw"]))
        x, y = float(row["x_m"]) + EYE_X_M * math.cos(heading), float(row["y_m"]) + EYE_X_M * math.sin(heading)
        for degrees in RAYS_DEG:
            angle = math.radians(degrees)
            d = edges.distance(x, y, heading + angle)
            if d is None:
                continue
            d = random.uniform(NEAREST_M, d) if random.random() < OUTLIERS else d + random.gauss(0, SIGMA_M + SIGMA_REL * d)
            out.append(f"{t},{EYE_X_M + d * math.cos(angle):.4f},{d * math.sin(angle):.4f}")
    (recording / "points.csv").write_text("\n".join(out) + "\n")
    listed = (recording / "recording.yaml").read_text()
    (recording / "recording.yaml").write_text(listed.replace("streams: [", "streams: [points.csv, "))
