#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Somebody else's program, built against what is installed, by find_package and by pkg-config, hears the poses of a run.
# downstream.sh BUILD. In a network of its own; skipped (77) where there is no right to one, or no LCM to build with.
set -euo pipefail
if [ "${WM_OWN_NETWORK:-}" != 1 ]; then
  unshare -rn true 2>/dev/null || { echo "skipped: no right to a network namespace"; exit 77; }
  exec env WM_OWN_NETWORK=1 unshare -rn bash "$0" "$@"
fi
build=$(readlink -f "$1")
here=$(dirname "$(readlink -f "$0")")
dir=$(mktemp -d)
trap 'rm -r "$dir"' EXIT
ip link set lo up
ip route add 224.0.0.0/4 dev lo

for component in runtime library dev; do
  DESTDIR=$dir/root cmake --install "$build" --prefix /usr --component "$component" >>"$dir/install.log" || { cat "$dir/install.log"; exit 1; }
done
usr=$dir/root/usr

echo "by find_package"
for standards in "11 20" "23 23"; do
  cmake -G Ninja -S "$here/downstream" -B "$dir/cmake" -DCMAKE_PREFIX_PATH="$usr" -DCMAKE_BUILD_TYPE=Release -DCMAKE_C_STANDARD="${standards% *}" \
    -DCMAKE_CXX_STANDARD="${standards#* }" >"$dir/cmake.log" 2>&1 || { cat "$dir/cmake.log"; exit 1; }
  cmake --build "$dir/cmake" >"$dir/cmake.log" 2>&1 || { cat "$dir/cmake.log"; exit 1; }
done
"$dir/cmake/filters" | grep -q '^landmark_ekf: '

echo "by pkg-config"
PKG_CONFIG_PATH=$(dirname "$(find "$usr" -name waymark.pc)")
export PKG_CONFIG_PATH
# shellcheck disable=SC2046 # words are meant
cc -Wall -Wextra -Werror -o "$dir/hear" "$here/downstream/hear.c" $(pkg-config --cflags --libs waymark)
# shellcheck disable=SC2046
c++ -Wall -Wextra -Werror -o "$dir/filters" "$here/downstream/filters.cpp" $(pkg-config --cflags --libs --static waymark-estimator)
"$dir/filters" | grep -q '^slam: '
in_standard() { # STANDARD SOURCE MODULE... : an example, with the compiler's warnings as errors
  local compiler=c++
  [[ $1 != c++* ]] && compiler=cc
  # shellcheck disable=SC2046
  $compiler "-std=$1" -Wall -Wextra -Wpedantic -Werror -o "$dir/$(basename "${2%.*}")-$1" "$here/downstream/$2" $(pkg-config --cflags --libs "${@:3}")
}
for standard in c11 c17 c2x; do
  in_standard $standard robot.c waymark-session
  in_standard $standard hear.c waymark
done
for standard in c++17 c++20 c++23; do in_standard $standard robot.cpp waymark-session; done
for standard in c++20 c++23; do in_standard $standard filters.cpp --static waymark-estimator; done
for robot in "$dir"/robot-c* "$dir"/cmake/robot "$dir"/cmake/robot_cpp; do
  { LD_LIBRARY_PATH=$PKG_CONFIG_PATH/.. "$robot" 2>&1 || true; } | grep -q '^usage: robot'
done

echo "a part alone, and one that is not"
find_part() { # COMPONENT [CMAKE_OPTION...]
  printf 'cmake_minimum_required(VERSION 3.13)\nproject(part C)\nfind_package(waymark REQUIRED COMPONENTS %s)\n' "$1" >"$dir/part.txt"
  mkdir -p "$dir/part" && cp "$dir/part.txt" "$dir/part/CMakeLists.txt" && rm -rf "$dir/part-build"
  cmake -G Ninja -DCMAKE_MAKE_PROGRAM="$(command -v ninja)" -DCMAKE_C_COMPILER="$(command -v cc)" -S "$dir/part" -B "$dir/part-build" -DCMAKE_PREFIX_PATH="$usr" "${@:2}" 2>&1
}
no_lcm=(-DCMAKE_FIND_USE_CMAKE_SYSTEM_PATH=OFF -DCMAKE_FIND_USE_SYSTEM_ENVIRONMENT_PATH=OFF)
find_part session "${no_lcm[@]}" >"$dir/part.log" || { cat "$dir/part.log"; exit 1; }
! find_part messages "${no_lcm[@]}" >"$dir/part.log" && tr -s '\n ' ' ' <"$dir/part.log" | grep -q 'messages: LCM is missing: install liblcm-dev'
! find_part sessions >"$dir/part.log" && tr -s '\n ' ' ' <"$dir/part.log" | grep -q "'sessions' is not a component; messages, estimator and session are"

# Headers stand on their own, in C and in C++.
for header in "$usr"/include/waymark/*.h; do
  printf '#include <waymark/%s>\n' "$(basename "$header")"
done >"$dir/all.c"
for standard in c++17 c++20 c++23; do
  # shellcheck disable=SC2046
  echo '#include <waymark/waymark.hpp>' | c++ -std=$standard -x c++ -fsyntax-only -Wall -Wextra -Wpedantic -Werror - $(pkg-config --cflags waymark-session)
done
# shellcheck disable=SC2046
cc -std=c17 -fsyntax-only -Wall -Wextra -Werror "$dir/all.c" $(pkg-config --cflags waymark)
# shellcheck disable=SC2046
c++ -std=c++20 -x c++ -fsyntax-only -Wall -Werror "$dir/all.c" $(pkg-config --cflags waymark)

echo "hearing"
mkdir "$dir/rec"
cat >"$dir/rec/recording.yaml" <<'EOT'
format: waymark-recording/1
name: straight
duration_s: 3
streams: [motion.csv]
vehicle: {initial_pose: {t_ns: 0, x_m: 1, y_m: 2, heading_rad: 0}}
EOT
{
  echo t_ns,v_mps,w_radps
  for i in $(seq 0 149); do echo "$((i * 20))000000,0.5,0"; done
} >"$dir/rec/motion.csv"
printf 'format: waymark-config/1\nestimator: odometry\nrealtime: {lock_memory: false}\n' >"$dir/config.yaml"
"$dir/cmake/hear" 20 >"$dir/heard" &
first=$!
"$dir/hear" 20 >"$dir/heard-too" &
second=$!
sleep 0.3
"$usr/bin/waymark" run --config "$dir/config.yaml" --recording "$dir/rec" --out "$dir/out" >"$dir/run.log" 2>&1 || { cat "$dir/run.log"; exit 1; }
wait "$first"
wait "$second"
head -3 "$dir/heard"
for heard in "$dir/heard" "$dir/heard-too"; do
  [ "$(grep -cE '^x [12]\.[0-9]{3} m, y 2\.000 m, heading 0\.0000 rad, sigma ' "$heard")" -eq 20 ] || { echo "not what was sent:"; cat "$heard"; exit 1; }
done
