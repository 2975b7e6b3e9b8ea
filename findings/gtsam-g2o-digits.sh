#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# GTSAM's writeG2o has six digits: metres of a UTM map are gone.
# gtsam 4.3.0. Expected: a graph that is written and read is the graph. Seen: a northing of 5333444.56 m is written as 5.33344e+06; two poses
# that are 3 m apart are one place. The order of an optimised map in a national grid is lost by saving it.
. "$(dirname "$0")/common.sh"
pip_packages gtsam==4.3.0 numpy==2.4.6
seen='VERTEX_SE2 0 691608 5.33344e+06 0.123457
VERTEX_SE2 1 691608 5.33345e+06 0.123457
read: 0.0 m east, 10.0 m north apart; given 0.4 m, 3.1 m'
cd "$work"
"$python" - <<'EOF' | as_seen
import gtsam
graph, given = gtsam.NonlinearFactorGraph(), gtsam.Values()
given.insert(0, gtsam.Pose2(691607.87, 5333444.56, 0.123456789))
given.insert(1, gtsam.Pose2(691608.27, 5333447.66, 0.123456789))
gtsam.writeG2o(graph, given, "map.g2o")
print(open("map.g2o").read().strip())
def apart(values):
    a, b = values.atPose2(0), values.atPose2(1)
    return b.x() - a.x(), b.y() - a.y()
_, read = gtsam.readG2o("map.g2o", False)
print("read: {:.1f} m east, {:.1f} m north apart; given {:.1f} m, {:.1f} m".format(*apart(read), *apart(given)))
EOF
