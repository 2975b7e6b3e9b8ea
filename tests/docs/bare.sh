#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# bare.sh [PAGE...]: what a new user does, in a fresh minimal Debian (tests/package/fresh.sh): a clone of this checkout's last commit,
# ./dev build, then each tutorial's commands out of its page (default: all), with their times.
# WM_CCACHE=FOLDER shares a cache of the compiler: the build's time is then no cold one, which the output states.
set -euo pipefail
cd "$(dirname "$(readlink -f "$0")")/../.."
pages=("$@")
[ ${#pages[@]} -gt 0 ] || pages=(landmarks floor-plan tags board hil)
clone=$(mktemp -d)
trap 'rm -rf "$clone"' EXIT
git clone -q . "$clone/waymark"
bind=(--bind "$clone:/clone")
if [ -n "${WM_CCACHE:-}" ]; then
  bind+=(--bind "$WM_CCACHE:/root/.cache/ccache")
  echo "the compiler's cache is shared: the time of ./dev build is not that of a first build"
fi
bash tests/package/fresh.sh "${bind[@]}" bash -c '
  set -e
  cd /clone/waymark
  took() { local begin=$SECONDS; "$@" || { echo "failed: $*"; return 1; }; echo "== $((SECONDS - begin)) s: $*"; }
  log() { "$@" >/clone/log 2>&1 || { tail -40 /clone/log; return 1; }; }
  took log ./dev --yes build
  ls build/bin | wc -l
  failed=0
  for page; do took python3 tests/docs/tutorial.py "docs/tutorials/$page.md" build/bin || failed=1; done
  exit $failed' - "${pages[@]}"
