# SPDX-License-Identifier: Apache-2.0
"""Descriptions of robots, simulators, and libraries near the hardware."""

import os
import tempfile
from pathlib import Path

import depthai
import ikpy.chain
import mujoco
import numpy as np
import pinocchio
import pybullet
import yourdfpy
from gpiozero import Device, RotaryEncoder
from gpiozero.pins.mock import MockFactory
from pytransform3d.urdf import UrdfTransformManager
from wpimath.estimator import DifferentialDrivePoseEstimator
from wpimath.geometry import Pose2d, Rotation2d, Rotation3d
from wpimath.kinematics import DifferentialDriveKinematics

INERTIA = '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
JOINT = '<parent link="base"/><child link="{}"/><axis xyz="0 0 2"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint>'
ROBOT = (f'<robot name="r"><link name="base"><inertial><origin xyz="0.3 0 0.1"/><mass value="10"/>{INERTIA}</inertial></link>'
         + "".join(f'<link name="{name}"><inertial><mass value="1"/>{INERTIA}</inertial></link>' for name in ("lift", "arm")) + '<link name="laser"/>'
         + '<joint name="up" type="prismatic">' + JOINT.format("lift") + '<joint name="turn" type="revolute">' + JOINT.format("arm")
         + '<joint name="fixed" type="fixed"><parent link="base"/><child link="laser"/><origin xyz="0.2 0 0.5"/></joint></robot>')


def lifts(path):
    """The height of a lift at 0.5 m whose axis has length 2, by reader."""
    m = pinocchio.buildModelFromUrdf(path)
    data, q = m.createData(), pinocchio.neutral(m)
    q[m.joints[m.getJointId("up")].idx_q] = 0.5
    pinocchio.framesForwardKinematics(m, data, q)
    yield "pin 4.1.0", data.oMf[m.getFrameId("lift")].translation[2]
    m = mujoco.MjModel.from_xml_path(path)
    data = mujoco.MjData(m)
    data.joint("up").qpos[0] = 0.5
    mujoco.mj_forward(m, data)
    yield "mujoco 4.0.0", data.body("lift").xpos[2]
    t = UrdfTransformManager()
    t.load_urdf(Path(path).read_text())
    t.set_joint("up", 0.5)
    yield "pytransform3d 3.17.0", t.get_transform("lift", "base")[2, 3]
    robot = yourdfpy.URDF.load(path, load_meshes=False)
    robot.update_cfg({"up": 0.5, "turn": 0.0})
    yield "yourdfpy 0.0.60", robot.get_transform("lift", "base")[2, 3]
    yield "ikpy 4.2.1", ikpy.chain.Chain.from_urdf_file(path, base_elements=["base", "up"]).forward_kinematics([0, 0.5])[2, 3]
    body = pybullet.loadURDF(path)
    joint = {pybullet.getJointInfo(body, k)[1]: k for k in range(3)}[b"up"]
    pybullet.resetJointState(body, joint, 0.5)
    yield "pybullet 3.2.7", pybullet.getLinkState(body, joint, computeForwardKinematics=1)[4][2]


def of_descriptions():
    path = str(Path(tempfile.mkdtemp()) / "robot.urdf")
    Path(path).write_text(ROBOT)
    pybullet.connect(pybullet.DIRECT)
    for version, height in lifts(path):
        yield f"{version.split()[0]}: height of a lift at 0.5 m whose axis has the length 2", f"{height:.1f} m", version, "`waymark init` uses the origins of joints, not their axes"
    model = mujoco.MjModel.from_xml_path(path)
    yield "MuJoCo: bodies of a URDF with base, lift, arm and laser", ", ".join(model.body(k).name for k in range(model.nbody)), "mujoco 4.0.0", "keeps the names of fixed links"
    body = pybullet.loadURDF(path, basePosition=[1, 2, 0])
    place = pybullet.getBasePositionAndOrientation(body)[0]
    yield "PyBullet: place of a base that was loaded at 1, 2, 0", ", ".join(f"{v:.1f}" for v in place) + ": the centre of mass", "pybullet 3.2.7", "poses are of `base_link`"


def of_estimators():
    for age in (1.4, 2.5, 3.1, -100.0):
        estimator = DifferentialDrivePoseEstimator(DifferentialDriveKinematics(0.5), Rotation2d(0), 0.0, 0.0, Pose2d())
        for k in range(1000):
            estimator.updateWithTime(k * 0.02, Rotation2d(0), k * 0.02, k * 0.02)
        x = estimator.getEstimatedPosition().X()
        estimator.addVisionMeasurement(Pose2d(x - age, 0, Rotation2d(0)), 999 * 0.02 - age)
        moved = estimator.getEstimatedPosition().X() - x
        yield f"WPILib: an exact measurement {f'{age} s old' if age > 0 else '100 s in the future'}, at 1 m/s", f"moves the pose by {moved + 0.0:.2f} m", "robotpy-wpimath 2026.2.2", "fused at its stamp, or refused and counted: `late`, `future`"
    r = Rotation3d(0.1, 0.2, 0.3)
    yield "WPILib Rotation3d(0.1, 0.2, 0.3): X, Y, Z", f"{r.X():.1f}, {r.Y():.1f}, {r.Z():.1f}: Rz Ry Rx", "robotpy-wpimath 2026.2.2", "the same"


def of_hardware():
    Device.pin_factory = MockFactory()
    for name, pins, options in (("", (2, 3), {}), (", max_steps=0", (4, 5), {"max_steps": 0})):
        encoder = RotaryEncoder(*pins, **options)
        a, b = (Device.pin_factory.pin(pin) for pin in pins)
        a.drive_high(), b.drive_high()
        for _ in range(40):
            a.drive_low(), b.drive_low(), a.drive_high(), b.drive_high()
        yield f"gpiozero RotaryEncoder: steps after 160 edges{name}", str(encoder.steps), "gpiozero 2.0.1.post3", "`ticks.csv`: counts of edges, unwrapped"
    calibration, socket = depthai.CalibrationHandler(), depthai.CameraBoardSocket.CAM_A
    calibration.setCameraIntrinsics(socket, [[800.0, 0, 640], [0, 800, 400], [0, 0, 1]], 1280, 800)
    for width, height in ((640, 400), (640, 480), (1280, 720)):
        K = calibration.getCameraIntrinsics(socket, width, height)
        yield f"depthai: matrix of {width} x {height} of a camera of 1280 x 800", f"f {K[0][0]:.0f}, cx {K[0][2]:.0f}, cy {K[1][2]:.0f}", "depthai 3.12.0", "one size a camera, that of its calibration"


def rows():
    silence, out = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    os.dup2(out, 1)  # PyBullet and depthai print from C
    try:
        made = [*of_descriptions(), *of_estimators(), *of_hardware()]
    finally:
        os.dup2(silence, 1)
    yield from made
