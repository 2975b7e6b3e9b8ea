#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# In a DXF an arc's numbers can be of a mirrored system where a line's are not.
# ezdxf 1.4.5. Expected: an arc and a line that both have the place (5, 2) are there. Seen: with the extrusion (0, 0, -1), which drawing programs
# write when something was mirrored, the arc and the polyline are at (-5, 2), and the line with the same extrusion is at (5, 2). A plan that
# is read by its dxf.center has doors and round walls on the other side of the building.
. "$(dirname "$0")/common.sh"
pip_packages ezdxf==1.4.5 numpy==2.4.6
seen='arc: dxf.center (5, 2), in the world (-5, 2)
polyline: get_points (5, 2), in the world (-5, 2)
line: dxf.start (5, 2), in the world (5, 2)'
"$python" - <<'EOF' | as_seen
import ezdxf
from ezdxf.path import make_path
def xy(point): return f"({point[0]:.0f}, {point[1]:.0f})"
space, mirrored = ezdxf.new().modelspace(), {"extrusion": (0, 0, -1)}
arc = space.add_arc((5, 2), 1, 0, 90, dxfattribs=mirrored)
polyline = space.add_lwpolyline([(5, 2), (6, 2)], dxfattribs=mirrored)
line = space.add_line((5, 2), (6, 2), dxfattribs=mirrored)
print("arc: dxf.center", xy(arc.dxf.center) + ", in the world", xy(arc.ocs().to_wcs(arc.dxf.center)))
print("polyline: get_points", xy(polyline.get_points("xy")[0]) + ", in the world", xy(make_path(polyline).start))
print("line: dxf.start", xy(line.dxf.start) + ", in the world", xy(make_path(line).start))
EOF
