#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# A URDF's joint that states no axis turns about z in kinpy, and about x in URDF.
# kinpy 0.6.1, yourdfpy 0.0.60, urchin 0.0.30, ikpy 4.2.1, pytransform3d 3.17.0. URDF's default axis is (1, 0, 0). Expected: all five take y to z. Seen:
# four do; kinpy turns about z and takes y to -x. A camera on a hinge that tilts in the simulator pans in the robot's program.
. "$(dirname "$0")/common.sh"
pip_packages kinpy==0.6.1 yourdfpy==0.0.60 urchin==0.0.30 ikpy==4.2.1 pytransform3d==3.17.0
seen='kinpy: y is at -1 0 0
yourdfpy: y is at 0 0 1
urchin: y is at 0 0 1
ikpy: y is at 0 0 1
pytransform3d: y is at 0 0 1'
cd "$work"
cat >robot.urdf <<'EOF'
<robot name="r"><link name="base"/><link name="camera"/>
<joint name="hinge" type="revolute"><parent link="base"/><child link="camera"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint></robot>
EOF
"$python" - 2>/dev/null <<'EOF' | as_seen
import numpy as np
def say(name, matrix): print(f"{name}: y is at", *(f"{round(float(x), 9) + 0:g}" for x in matrix[:3, 1]), flush=True)
quarter = np.pi / 2
import kinpy
say("kinpy", kinpy.build_chain_from_urdf(open("robot.urdf").read()).forward_kinematics({"hinge": quarter})["camera"].matrix())
import yourdfpy
robot = yourdfpy.URDF.load("robot.urdf")
robot.update_cfg({"hinge": quarter})
say("yourdfpy", robot.get_transform("camera", "base"))
import urchin
say("urchin", urchin.URDF.load("robot.urdf").link_fk(cfg={"hinge": quarter}, use_names=True)["camera"])
import ikpy.chain
say("ikpy", ikpy.chain.Chain.from_urdf_file("robot.urdf", base_elements=["base"]).forward_kinematics([0, quarter]))
from pytransform3d.urdf import UrdfTransformManager
manager = UrdfTransformManager()
manager.load_urdf(open("robot.urdf").read())
manager.set_joint("hinge", quarter)
say("pytransform3d", manager.get_transform("camera", "base"))
EOF
