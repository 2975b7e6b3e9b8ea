#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# run.sh [--setup] [--write] [GROUND ...]: the tables of docs/conventions.md against the libraries they speak of.
# --setup puts those into .cache/conventions (1.5 GB) first; skips (77) where they are not there.
set -euo pipefail
cd "$(dirname "$(readlink -f "$0")")/../.."
venv=.cache/conventions
if [ "${1:-}" = --setup ]; then
  shift
  python3 -m venv --without-pip "$venv"
  if command -v uv >/dev/null; then
    uv -q pip install --python "$venv/bin/python" --only-binary :all: -r tests/conventions/requirements.txt
  else
    python3 -m pip -q --python "$venv/bin/python" install --only-binary :all: -r tests/conventions/requirements.txt
  fi
fi
[ -x "$venv/bin/python" ] || { echo "skipped: the libraries are not in $venv; tests/conventions/run.sh --setup puts them there"; exit 77; }
export PROJ_NETWORK=OFF TZ=UTC
exec "$venv/bin/python" tests/conventions/tables.py "$@"
