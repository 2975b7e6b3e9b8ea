#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# packages.sh [--robot] [SYSTEM...]: the packages of the next release on each system, e.g. debian-13-amd64; all of this computer's architecture by default. Each is built
# by ./dev package in a minimal root of that system (an hour on two cores, minutes with its compiler's cache below .cache/systems), then tried in another
# one (try_packages.sh): installed by apt, doctor, replays with the same bits as this build's, services, upgrade from the release before, removal, purge.
# Writes .cache/systems/packages/SYSTEM/{*.deb,build.log,try.log,row} and prints a table. What is built is the last commit, under the next version's number.
# --robot: those of the robot alone (waymark, waymark-gst, waymark-ros2, libwaymark0, libwaymark-dev), a third of the time.
# Exit code 1: something failed, and the table has it. 77: a system can't be had here.
set -euo pipefail
cd "$(dirname "$(readlink -f "$0")")/../.."
[ "$(id -u)" -eq 0 ] || exec sudo --preserve-env=WM_DEBIAN_ARCHIVE,WM_UBUNTU_ARCHIVE bash "$0" "$@"
mkdir -p .cache/systems/packages
out=$(readlink -f .cache/systems/packages) systems=$(readlink -f .cache/systems)
. tests/systems/table.sh
say() { printf '\033[1m== %s\033[0m\n' "$*" >&2; }

needed() { # what a build needs, so that a root has it from the beginning; without the desk's libraries the robot's packages are built
  sed -n '/^PACKAGES_BUILD=/,/^PACKAGES_TEST=/p' dev | sed '/^PACKAGES_TEST/,$d' >"$out/lists"
  (
    . "$out/lists"
    list=("${PACKAGES_BUILD[@]}" "${PACKAGES_PARTS[@]}" ca-certificates)
    if [ -z "$components" ]; then list+=("${PACKAGES_CALIBRATE[@]}"); else mapfile -t list < <(printf '%s\n' "${list[@]}" | grep -vE '^lib(embree|av|sw|hpdf|tinyxml)'); fi
    printf '%s\n' "${list[@]}" | sort -u | paste -sd ,
  )
}

sources() { # COMMIT FOLDER [VERSION] : the sources of a commit, prepared as the release VERSION, without history
  rm -rf "$2"
  git clone -q --shared --no-checkout . "$2"
  (
    cd "$2"
    git checkout -q "$1"
    [ -z "${3:-}" ] || python3 -c "$(cat <<'PY'
import sys
sys.path.insert(0, "toolchain")
import release
release.git("config", "user.name", "trial")
release.git("config", "user.email", "trial@waymark.example")
release.prepare(sys.argv[1])
PY
)" "$3" >/dev/null
    rm -rf .git
  )
}

sum_of() { (cd "$1" && find . -type f -print0 | sort -z | xargs -0 sha256sum | sha256sum | cut -d' ' -f1); }

build() { # SYSTEM SOURCES PACKAGES COMPONENTS [TARGET...] : where they aren't there yet; COMPONENTS "": all
  local name=$1 from=$2 to=$3 newer=() sum
  sum="$(sum_of "$from") $4"
  [ "$(cat "$to/.built" 2>/dev/null)" != "$sum" ] || return 0
  mkdir -p "$to" "$systems/$name-ccache"
  rm -f "$to"/*.deb
  if [[ $name == ubuntu-22.04* ]]; then # its CMake is too old
    [ -x "$systems/cmake/bin/cmake" ] || { python3 -m venv "$systems/cmake" && "$systems/cmake/bin/pip" -q --disable-pip-version-check install --require-hashes -r tests/systems/cmake.txt; }
    newer=(--bind "$(echo "$systems"/cmake/lib/python3*/site-packages/cmake/data):/opt/cmake")
  fi
  say "building in $name (log: $to/build.log)"
  nice -n 19 bash tests/package/fresh.sh --system "$name" --with "$(needed)" --bind "$from:/src" --bind "$to:/out" --bind "$systems/$name-ccache:/root/.cache/ccache" \
    "${newer[@]}" bash -euc '
    export PATH=/opt/cmake/bin:$PATH CCACHE_NOHASHDIR=1 CCACHE_DEPEND=1
    cp -r /src /build && cd /build
    desk=$([ -z "$1" ] || echo "-DWM_RENDER=OFF -DWM_CALIBRATE=OFF -DWM_LIBAV=OFF")
    cmake --preset release -DWM_TESTS=OFF -DWM_REPRODUCIBLE=ON -DCMAKE_SKIP_INSTALL_ALL_DEPENDENCY=ON $desk
    ninja -C build -t targets all >targets
    for target in "${@:2}"; do if grep -q "^$target: " targets; then there+=("$target"); fi; done
    cmake --build build -j "$(nproc)" --target "${there[@]}"
    components=$1
    [ -z "$components" ] || components=$(comm -12 <(tr ";" "\n" <<<"$components" | sort) <(sed -n "s/^set(CPACK_COMPONENTS_ALL \"\(.*\)\")/\1/p" build/CPackConfig.cmake | tr ";" "\n" | sort) | paste -sd ";")
    cd build && cpack -G DEB -B /out ${components:+-D CPACK_COMPONENTS_ALL="$components"}
    rm -rf /out/_CPack_Packages' bash "$4" "${@:5}" >"$to/build.log" 2>&1 || return 1
  echo "$sum" >"$to/.built"
}

# What the others say of the same drives: this build's poses.
drives() {
  local drive
  [ -x build/bin/waymark-simulate ] || { echo "skipped: there is no build (./dev build)" >&2; exit 77; }
  rm -rf "$out/drives" && mkdir -p "$out/drives"
  for drive in crossing:crossing-points seabed-points:seabed-points loops-markers:loops-markers; do
    build/bin/waymark-simulate "config/worlds/${drive%:*}.yaml" --no-video --out "$out/drives/${drive#*:}" >/dev/null
    cp "config/datasets/${drive#*:}.yaml" "$out/drives/"
  done
  cp tests/systems/replay_drives.sh "$out/drives"
  bash "$out/drives/replay_drives.sh" "$out/drives" build/bin/waymark >"$out/drives/expected"
}

try() { # SYSTEM OLDER NEWER : a row of the table
  say "trying in $1 (log: $out/$1/try.log)"
  nice -n 19 bash tests/package/fresh.sh --system "$1" --bind "$2:/older" --bind "$3:/newer" --bind "$out/drives:/drives" --bind "$PWD/tests/systems:/tests" \
    bash /tests/try_packages.sh >"$out/$1/try.log" 2>&1 || return 1
  sed -n 's/^ROW //p' "$out/$1/try.log"
}

robot="runtime;gst;ros2;library;dev" targets=(all) components=""
if [ "${1:-}" = --robot ]; then
  shift
  components=$robot
  targets=(waymark waymark-play waymark-web waymark-camera waymark-gst waymark-ros2 wm_shared wm_public wm_public_estimator wm_compressed)
fi
chosen=("$@")
[ ${#chosen[@]} -gt 0 ] || mapfile -t chosen < <(cut -d' ' -f1 <<<"$table" | grep -- "-$(dpkg --print-architecture)$")
version=$(sed -n 's/^project(waymark VERSION \([0-9.]*\).*/\1/p' CMakeLists.txt)
older=$(git log --format=%H --grep "^release $version\$" -1)
sources HEAD "$out/sources" "$(awk -F. '{print $1 "." $2 + 1 ".0"}' <<<"$version")"
sources "$older" "$out/older-sources"
drives
code=0 built=()
for name in "${chosen[@]}"; do
  if build "$name" "$out/sources" "$out/$name" "$components" "${targets[@]}"; then built+=("$name"); fi
done
build "debian-12-$(dpkg --print-architecture)" "$out/older-sources" "$out/older" runtime waymark waymark-play waymark-web waymark-camera wm_compressed || { tail -5 "$out/older/build.log" >&2; code=1; }
echo "| system | packages built | installed | same bits | services | upgrade from $version | removed, purged | kB | kB of dependencies added | depends on |" >"$out/table"
echo "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |" >>"$out/table"
for name in "${chosen[@]}"; do
  if [[ " ${built[*]} " != *" $name "* ]]; then
    row="no: $(grep -m1 -E 'error:|Error|^E:|FAILED' "$out/$name/build.log" || tail -1 "$out/$name/build.log") | | | | | | | | |" code=1
  elif ! row=$(try "$name" "$out/older" "$out/$name"); then
    row="yes | $(tail -1 "$out/$name/try.log") | | | | | | | |" code=1
  fi
  echo "| $name | $row" >>"$out/table"
done
cat "$out/table"
exit $code
