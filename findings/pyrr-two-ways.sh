#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# A quaternion of pyrr turns a vector one way, and the matrix that it makes of that quaternion turns it the other way.
# pyrr 0.10.3. Expected: q * v and q.matrix33 * v are the same vector. Seen: a quarter turn about z takes x to y by the quaternion and to -y by its own
# matrix, and the same three Euler angles are rotations about other axes in both classes. A point that is turned through a matrix for speed lands on the
# robot's other side.
. "$(dirname "$0")/common.sh"
pip_packages pyrr==0.10.3 numpy==1.26.4
seen='quarter turn about z, of x: quaternion 0 1 0, its matrix 0 -1 0, Matrix33.from_z_rotation 0 -1 0
Euler angles 90 0 0, of the vector 1 2 3: quaternion 1 -3 2, its matrix 1 3 -2, Matrix33.from_eulers 1 3 -2
Euler angles 0 90 0, of the vector 1 2 3: quaternion 3 2 -1, its matrix -3 2 1, Matrix33.from_eulers 2 -1 3'
"$python" - <<'EOF' | as_seen
import numpy as np
from pyrr import Matrix33, Quaternion, Vector3
def text(vector): return " ".join(f"{round(float(x), 9) + 0:g}" for x in vector)
q, x = Quaternion.from_z_rotation(np.pi / 2), Vector3([1.0, 0.0, 0.0])
other = Matrix33.from_z_rotation(np.pi / 2)
print(f"quarter turn about z, of x: quaternion {text(q * x)}, its matrix {text(q.matrix33 * x)}, Matrix33.from_z_rotation {text(other * x)}")
v = Vector3([1.0, 2.0, 3.0])
for angles in ((90, 0, 0), (0, 90, 0)):
    q = Quaternion.from_eulers(np.radians(angles))
    print(f"Euler angles {text(angles)}, of the vector 1 2 3: quaternion {text(q * v)}, its matrix {text(q.matrix33 * v)}, "
          f"Matrix33.from_eulers {text(Matrix33.from_eulers(np.radians(angles)) * v)}")
EOF
