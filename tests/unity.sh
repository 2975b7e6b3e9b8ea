#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Unity 2.6.1 into FOLDER, pinned by its sums, from the PyPI wheel that carries it. CMake runs this where FOLDER has none.
# usage: unity.sh FOLDER    needs python3 with venv (Debian: python3-venv)
set -euo pipefail
mkdir -p "$1"
folder=$(readlink -f "$1")
cd "$(dirname "$(readlink -f "$0")")/.."
mkdir -p .cache
exec 9>.cache/venv.lock
flock 9 # two builds at once share the folder
[ -e "$folder/unity.c" ] && exit 0
[ -x .cache/venv/bin/pip ] || python3 -m venv .cache/venv ||
  { echo "unity.sh: python3 has no venv here; install the package python3-venv" >&2; exit 1; }
tmp=$(mktemp -d)
trap 'rm -r "$tmp"' EXIT
.cache/venv/bin/pip -q --disable-pip-version-check download --no-deps --require-hashes -d "$tmp" -r tests/unity.txt
python3 -m zipfile -e "$tmp"/*.whl "$tmp/wheel"
cd "$tmp/wheel/vyperling/c"
sha256sum --quiet -c "$OLDPWD/tests/unity.sha256"
cp unity.h unity_internals.h "$folder/"
cp unity.c "$folder/unity.c.new"
mv "$folder/unity.c.new" "$folder/unity.c" # last: what is there is whole
