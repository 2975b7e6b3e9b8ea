#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# A joint's axis of length 2 means three things in five readers of URDF.
# pin 4.1.0, mujoco 4.0.0, yourdfpy 0.0.60, ikpy 4.2.1, pybullet 3.2.7. URDF's axis is a direction. Expected: all of them take it as one. Seen: a lift at
# 0.5 m is at 0.5 m in pin and mujoco and at 1.0 m in the other three; ikpy's "rotation" of a hinge stretches by 2.3. An axis that was
# measured, or rounded to "0.7 0.7 0", puts a camera on a mast somewhere else in each tool.
. "$(dirname "$0")/common.sh"
pip_packages pin==4.1.0 mujoco==4.0.0 yourdfpy==0.0.60 ikpy==4.2.1 pybullet==3.2.7 numpy==2.4.6
seen='pin: lift at 0.5 m
mujoco: lift at 0.5 m
yourdfpy: lift at 1.0 m
ikpy: lift at 1.0 m, determinant of the hinge 2.3
pybullet: lift at 1.0 m'
cd "$work"
"$python" - 2>/dev/null <<'EOF' | grep '^[a-z]*: ' | as_seen
import numpy as np, pinocchio, mujoco, yourdfpy, ikpy.chain, pybullet
mass = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
rest = '<parent link="base"/><child link="{}"/><axis xyz="0 0 2"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint>'
open("robot.urdf", "w").write('<robot name="r">' + "".join(f'<link name="{n}">{mass}</link>' for n in ("base", "lift", "arm"))
    + '<joint name="up" type="prismatic">' + rest.format("lift") + '<joint name="turn" type="revolute">' + rest.format("arm") + "</robot>")
def say(name, height, more=""): print(f"{name}: lift at {height:.1f} m{more}", flush=True)
m = pinocchio.buildModelFromUrdf("robot.urdf")
data, q = m.createData(), pinocchio.neutral(m)
q[m.joints[m.getJointId("up")].idx_q] = 0.5
pinocchio.framesForwardKinematics(m, data, q)
say("pin", data.oMf[m.getFrameId("lift")].translation[2])
m = mujoco.MjModel.from_xml_path("robot.urdf")
data = mujoco.MjData(m)
data.joint("up").qpos[0] = 0.5
mujoco.mj_forward(m, data)
say("mujoco", data.body("lift").xpos[2])
robot = yourdfpy.URDF.load("robot.urdf", load_meshes=False)
robot.update_cfg({"up": 0.5, "turn": 0.0})
say("yourdfpy", robot.get_transform("lift", "base")[2, 3])
up, turn = (ikpy.chain.Chain.from_urdf_file("robot.urdf", base_elements=["base", name]) for name in ("up", "turn"))
say("ikpy", up.forward_kinematics([0, 0.5])[2, 3], f", determinant of the hinge {np.linalg.det(turn.forward_kinematics([0, 0.5])[:3, :3]):.1f}")
pybullet.connect(pybullet.DIRECT)
body = pybullet.loadURDF("robot.urdf")
joint = {pybullet.getJointInfo(body, k)[1]: k for k in range(2)}[b"up"]
pybullet.resetJointState(body, joint, 0.5)
say("pybullet", pybullet.getLinkState(body, joint, computeForwardKinematics=1)[4][2])
EOF
