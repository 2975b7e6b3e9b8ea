#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The site of documents: build.sh [--check] OUT. Puts Sphinx and its theme into .cache/docs-venv, each file checked by its sum.
# --check: skipped (77) where they or doxygen are missing; nothing is fetched.
set -euo pipefail
check=""
[ "${1:-}" = --check ] && { check=1; shift; }
out=$(mkdir -p "${1:?usage: build.sh [--check] OUT}" && readlink -f "$1")
cd "$(dirname "$(readlink -f "$0")")/../.."
venv=.cache/docs-venv stamp=.cache/docs-venv/requirements.sha256
sum=$(sha256sum <tools/docs/requirements.txt)
if [ -n "$check" ] && ! command -v doxygen >/dev/null; then echo "skipped: doxygen is not there (./dev docs installs it)"; exit 77; fi
if [ "$(cat "$stamp" 2>/dev/null)" != "$sum" ]; then
  [ -z "$check" ] || { echo "skipped: Sphinx is not there (./dev docs fetches it)"; exit 77; }
  [ -x "$venv/bin/python" ] || python3 -m venv "$venv"
  echo "fetching Sphinx and its theme"
  "$venv/bin/python" -m pip -q --disable-pip-version-check install --only-binary :all: --require-hashes -r tools/docs/requirements.txt
  printf '%s\n' "$sum" >"$stamp"
fi
WM_DOCS_OUT=$out "$venv/bin/python" -m sphinx -q -W --keep-going -b html -c tools/docs -d "$out/doctrees" . "$out/html"
rm -rf "$out/html/.buildinfo"
python3 tools/docs/links.py "$out/html"
