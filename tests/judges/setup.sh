#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Puts the tests' outside judges (cantools, python-can, evo, mypy and others: requirements.in) into .cache/venv, each file checked by its
# sum. Quick when it is done already. Needs python3 with venv (Debian: python3-venv) or virtualenv, and nothing else.
set -euo pipefail
cd "$(dirname "$(readlink -f "$0")")/../.."
requirements=tests/judges/requirements.txt
venv=.cache/venv
stamp=$venv/judges.sha256

mkdir -p .cache
exec 9>.cache/venv.lock
flock 9 # two builds at once share the folder

sum=$(sha256sum <"$requirements")
[ -e "$stamp" ] && [ "$(cat "$stamp")" = "$sum" ] && exit 0

if [ ! -x "$venv/bin/python" ]; then
  python3 -m venv "$venv" 2>/dev/null || virtualenv -q "$venv" ||
    { echo "setup.sh: python3 has no venv here; install the package python3-venv (or virtualenv)" >&2; exit 1; }
fi
echo "fetching the tests' outside judges (cantools, python-can, evo, mypy ...)"
"$venv/bin/python" -m pip -q --disable-pip-version-check install --only-binary :all: --require-hashes -r "$requirements"
printf '%s\n' "$sum" >"$stamp"
