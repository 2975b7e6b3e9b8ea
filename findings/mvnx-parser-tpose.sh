#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# mvnx-parser has the identity pose for the T-pose of an Xsens recording.
# mvnx-parser 0.0.5. MVNX has three frames before the measured ones: identity, tpose, tpose-isb. Its text: tpose is the T-pose as a frame. Expected: that of
# the type tpose. Seen: that of the type identity, for both. A body whose pose is taken against the T-pose has bent joints.
. "$(dirname "$0")/common.sh"
pip_packages mvnx-parser==0.0.5
seen='identity: 1 0 0 0
tpose: 1 0 0 0
tpose_isb: 1 0 0 0'
cat >"$work/recording.mvnx" <<'EOF'
<?xml version="1.0"?>
<mvnx xmlns="http://www.xsens.com/mvn/mvnx" version="4"><subject label="a" segmentCount="1"><frames>
  <frame time="0" type="identity"><orientation>1 0 0 0</orientation></frame>
  <frame time="0" type="tpose"><orientation>0.7071 0 0 0.7071</orientation></frame>
  <frame time="0" type="tpose-isb"><orientation>0.5 0.5 0.5 0.5</orientation></frame>
  <frame time="0" type="normal"><orientation>1 0 0 0</orientation></frame>
</frames></subject></mvnx>
EOF
"$python" - "$work/recording.mvnx" <<'EOF' | as_seen
import sys
from mvnx_parser.parser import Mvnx_p
recording = Mvnx_p(sys.argv[1])
for name in "identity", "tpose", "tpose_isb": print(f"{name}: " + " ".join(getattr(recording, name)["orientation"][0]))
EOF
