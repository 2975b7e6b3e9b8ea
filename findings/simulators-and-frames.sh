#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Of one URDF MuJoCo drops the base and the sensors' links, and PyBullet's base is not the base.
# mujoco 4.0.0, pybullet 3.2.7. Expected: both know the frames "base" and "laser", and the base is where it was put. Seen: MuJoCo welds links on
# fixed joints to the world and has neither; PyBullet's getBasePositionAndOrientation is the centre of mass: a base that was loaded at (1, 2, 0)
# is at (1.3, 2, 0.1), and setting that pose again moves the robot. Poses of a simulator that are taken for the base's are off by the
# centre of mass.
. "$(dirname "$0")/common.sh"
pip_packages mujoco==4.0.0 pybullet==3.2.7 numpy==2.4.6
seen='mujoco: world arm
pybullet: base loaded at (1, 2, 0) is at (1.3, 2.0, 0.1)
pybullet: laser after setting (1, 2, 0): (0.9, 2.0, 0.4)'
cd "$work"
"$python" - 2>/dev/null <<'EOF' | grep -o '[a-z]*: .*' | as_seen
import mujoco, pybullet
inertia = '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
open("robot.urdf", "w").write(f'''<robot name="r"><link name="base"><inertial><origin xyz="0.3 0 0.1"/><mass value="10"/>{inertia}</inertial></link>
<link name="arm"><inertial><mass value="1"/>{inertia}</inertial></link><link name="laser"/>
<joint name="turn" type="continuous"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/></joint>
<joint name="fixed" type="fixed"><parent link="base"/><child link="laser"/><origin xyz="0.2 0 0.5"/></joint></robot>''')
model = mujoco.MjModel.from_xml_path("robot.urdf")
print("mujoco:", *(model.body(k).name for k in range(model.nbody)), flush=True)
def rounded(place): return tuple(round(x, 1) for x in place)
pybullet.connect(pybullet.DIRECT)
body = pybullet.loadURDF("robot.urdf", basePosition=[1, 2, 0])
print("\npybullet: base loaded at (1, 2, 0) is at", rounded(pybullet.getBasePositionAndOrientation(body)[0]), flush=True)
pybullet.resetBasePositionAndOrientation(body, [1, 2, 0], [0, 0, 0, 1])
laser = {pybullet.getJointInfo(body, k)[1]: k for k in range(2)}[b"fixed"]
print("pybullet: laser after setting (1, 2, 0):", rounded(pybullet.getLinkState(body, laser, computeForwardKinematics=1)[4]), flush=True)
EOF
