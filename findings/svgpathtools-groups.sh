#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# svgpathtools.svg2paths leaves out the transforms of a drawing's groups and paths.
# svgpathtools 1.8.0. Expected: a wall in a group that is moved by 50 begins at 50. Seen: it begins at 0, as does one with a transform of its own;
# Document(...).paths() has both right. A floor plan's rooms lie on top of each other, or at another scale.
. "$(dirname "$0")/common.sh"
pip_packages svgpathtools==1.8.0 numpy==2.4.6
seen='svg2paths: 0 0
Document: 50 50'
cd "$work"
"$python" - <<'EOF' | as_seen
import svgpathtools
open("plan.svg", "w").write('<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100"><g transform="translate(50,0)"><path d="M 0 0 L 10 0"/></g>'
                            '<path transform="translate(50,0)" d="M 0 5 L 10 5"/></svg>')
print("svg2paths:", *(int(path.start.real) for path in svgpathtools.svg2paths("plan.svg")[0]))
print("Document:", *(int(path.start.real) for path in svgpathtools.Document("plan.svg").paths()))
EOF
