# SPDX-License-Identifier: Apache-2.0
"""Rotations: order of numbers, order of axes, lengths, straight down, the long way."""

import numpy as np
import pyquaternion
import scipy
import spatialmath
import sympy
import transforms3d
from pymavlink import quaternion as mavlink, rotmat
from pytransform3d import rotations as p3d
from scipy.spatial.transform import Rotation
import subprocess
import tempfile
from pathlib import Path

SCIPY, T3D, P3D, PQ, SYMPY = f"scipy {scipy.__version__}", "transforms3d 0.4.2", "pytransform3d 3.17.0", "pyquaternion 0.9.9", f"sympy {sympy.__version__}"
EIGEN = r"""
#include <Eigen/Geometry>
#include <cstdio>
using namespace Eigen;
int main() {
  const Vector3d a = Matrix3d(AngleAxisd(-0.1, Vector3d::UnitZ())).eulerAngles(2, 1, 0);
  printf("%.2f, %.2f, %.2f\n", a[0], a[1], a[2]);
  Matrix3Xd from(3, 4);
  from << 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1;
  printf("%.1f\n", umeyama(from, Matrix3Xd(1.1 * from))(0, 0));
  Quaterniond zero(0, 0, 0, 0);
  zero.normalize();
  printf("%s\n", zero.toRotationMatrix().isApprox(Matrix3d::Identity()) ? "no rotation" : "not finite");
  printf("%.2f\n", Quaterniond(0.9, 0, 0, 0.9).toRotationMatrix().determinant());
  printf("%.0f.%.0f.%.0f\n", (double)EIGEN_WORLD_VERSION, (double)EIGEN_MAJOR_VERSION, (double)EIGEN_MINOR_VERSION);
}
"""


def eigen():
    folder = Path(tempfile.mkdtemp())
    folder.joinpath("main.cpp").write_text(EIGEN)
    subprocess.run(["g++", "-w", "-I/usr/include/eigen3", folder / "main.cpp", "-o", folder / "main"], check=True)
    return subprocess.run([folder / "main"], capture_output=True, text=True, check=True).stdout.split("\n")


def raises(function):
    try:
        return function()
    except Exception:  # noqa: BLE001  (that it raises is what is measured)
        return "raises"


def about_z(degrees):
    return np.array([np.cos(np.radians(degrees / 2)), 0, 0, np.sin(np.radians(degrees / 2))])


def heading(q):
    return round(abs(np.degrees(np.angle((q[0] + 1j * q[3]) ** 2))))


def rows():
    ours = "files and messages: x, y, z, w"
    yield "scipy as_quat of no rotation", ", ".join(f"{v:.0f}" for v in Rotation.identity().as_quat()), SCIPY, ours
    yield "transforms3d, pytransform3d, pyquaternion, MAVLink: of no rotation", ", ".join(f"{v:.0f}" for v in transforms3d.quaternions.mat2quat(np.eye(3))), T3D, ours
    lower, upper = (Rotation.from_euler(axes, [0.1, 0.2, 0.3]).as_matrix() for axes in ("xyz", "ZYX"))
    yield "scipy from_euler(\"xyz\", roll, pitch, yaw)", "Rz Ry Rx" if np.allclose(lower, Rotation.from_euler("ZYX", [0.3, 0.2, 0.1]).as_matrix()) else "Rx Ry Rz", SCIPY, "`rpy` is Rz(yaw) Ry(pitch) Rx(roll)"
    se3 = spatialmath.SO3.RPY([0.1, 0.2, 0.3]).R
    yield "spatialmath RPY(0.1, 0.2, 0.3)", "Rz Ry Rx" if np.allclose(se3, lower) else "another order", "spatialmath 1.1.18", "the same"
    x = sympy.rot_axis3(sympy.pi / 2) * sympy.Matrix([1, 0, 0])
    yield "sympy rot_axis3(pi/2) of the x axis", f"y {int(x[1])}: clockwise", SYMPY, "positive is counter-clockwise"
    for name, matrix in (("a mirror", np.diag([1, 1, -1.0])), ("twice a rotation", 2 * np.eye(3)), ("a shear of 0.2", np.array([[1, 0.2, 0], [0, 1, 0], [0, 0, 1.0]]))):
        out = raises(lambda m=matrix: Rotation.from_matrix(m).as_matrix())
        yield f"scipy from_matrix of {name}", out if isinstance(out, str) else f"a rotation by {np.degrees(Rotation.from_matrix(matrix).magnitude()):.1f} degrees", SCIPY, "rotations are quaternions; one whose length is more than 1 % off is refused"
    yield "pytransform3d check_matrix of twice a rotation", str(raises(lambda: p3d.check_matrix(2 * np.eye(3)))), P3D, "as above"
    yield "scipy from_quat of 0, 0, 0, 0", str(raises(lambda: Rotation.from_quat([0, 0, 0, 0]).as_quat())), SCIPY, "refused"
    yield "transforms3d quat2mat of 0, 0, 0, 0", "no rotation" if np.allclose(transforms3d.quaternions.quat2mat([0, 0, 0, 0]), np.eye(3)) else "not finite", T3D, "refused"
    yield "transforms3d rotate_vector by a quaternion of length 2", f"{np.linalg.norm(transforms3d.quaternions.rotate_vector([1, 0, 0], 2 * about_z(40))):.0f} times as long", T3D, "refused"
    yield "scipy as_euler straight down: yaw 0.4, roll 0.1", "yaw {:.1f}, roll {:.1f}".format(*Rotation.from_euler("ZYX", [0.4, np.pi / 2, 0.1]).as_euler("ZYX")[[0, 2]]), SCIPY, "roll 0, yaw 0.3: the same rotation"
    yield "transforms3d mat2euler: the same", "yaw {2:.1f}, roll {0:.1f}".format(*transforms3d.euler.mat2euler(transforms3d.euler.euler2mat(0.1, np.pi / 2, 0.4))), T3D, "the same rotation"
    slope = pyquaternion.Quaternion(matrix=Rotation.from_euler("ZYX", [30, 20, 10], degrees=True).as_matrix())
    yield "pyquaternion yaw_pitch_roll of Rz(30) Ry(20) Rx(10)", ", ".join(f"{v:.1f}" for v in np.degrees(slope.yaw_pitch_roll)), PQ, "30, 20, 10"
    shortest = "headings and rotations take the short way"
    a, b = about_z(170), about_z(-170)
    yield "pytransform3d quaternion_slerp: half-way from 170 to -170 degrees", f"{heading(p3d.quaternion_slerp(a, b, 0.5))}", P3D, shortest
    u, v = (spatialmath.UnitQuaternion.Rz(x, unit="deg") for x in (170, -170))
    yield "spatialmath UnitQuaternion.interp: the same", f"{heading(u.interp(v, 0.5).vec)}", "spatialmath 1.1.18", shortest
    r, s = (spatialmath.SO3.Rz(x, unit="deg") for x in (170, -170))
    middle = r.interp(s, 0.5).R
    yield "spatialmath SO3.interp: the same", f"{round(abs(np.degrees(np.arctan2(middle[1, 0], middle[0, 0]))))}", "spatialmath 1.1.18", shortest
    p, q = pyquaternion.Quaternion(a), pyquaternion.Quaternion(b)
    yield "pyquaternion slerp: the same", f"{heading(pyquaternion.Quaternion.slerp(p, q, 0.5).elements)}", PQ, shortest
    before = pyquaternion.Quaternion(a)
    pyquaternion.Quaternion.slerp(before, pyquaternion.Quaternion(b), 0.5)
    yield "pyquaternion slerp: its first argument afterwards", "has the other sign" if np.allclose(before.elements, -a) else "as before", PQ, "arguments do not change"
    found = Rotation.align_vectors([[0, 1, 0]], [[1, 0, 0]])[0].apply([1, 0, 0])
    yield "scipy align_vectors(a, b)", "takes b to a" if np.allclose(found, [0, 1, 0]) else "takes a to b", SCIPY, "-"
    m = rotmat.Matrix3()
    m.from_euler(0, 0, np.pi / 2)
    turned, by_q = m * rotmat.Vector3(1, 0, 0), mavlink.Quaternion([0, 0, np.pi / 2]).transform(rotmat.Vector3(1, 0, 0))
    yield "pymavlink: x axis by Matrix3 and by Quaternion.transform, yaw 90 degrees", f"y {turned.y:.0f} and y {by_q.y:.0f}", "pymavlink 2.4.50", "-"
    angles, scale, zero, determinant, version = eigen()[:5]
    yield "Eigen eulerAngles(2, 1, 0) of a yaw of -0.1", angles, f"Eigen {version}", "its own formulas: -0.1, 0, 0"
    yield "Eigen umeyama without a third argument: points 1.1 times as far apart", f"scale {scale}", f"Eigen {version}", "`waymark eval --align se3` has no scale"
    yield "Eigen: 0, 0, 0, 0 normalised", zero, f"Eigen {version}", "refused"
    yield "Eigen toRotationMatrix of 0, 0, 0.9, 0.9: determinant", determinant, f"Eigen {version}", "refused: its length is not 1"
