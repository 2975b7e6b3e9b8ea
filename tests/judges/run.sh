#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# run.sh SCRIPT ARGUMENTS...: a judge by the Python of .cache/venv; skips (77) where setup.sh has not made it.
cd "$(dirname "$(readlink -f "$0")")/../.." || exit 1
venv=${WM_JUDGES:-.cache/venv} # another folder: tests/releases/releases.py
python=$venv/bin/python
if [ ! -x "$python" ] || [ ! -e "$venv/judges.sha256" ]; then
  echo "skipped: the judges are not in .cache/venv; tests/judges/setup.sh puts them there"
  exit 77
fi
exec "$python" "$@"
