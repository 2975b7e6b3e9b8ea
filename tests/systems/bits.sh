#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# bits.sh [--compile] [SYSTEM...]: do the systems that Waymark is built on give the same bits? SYSTEM is e.g. debian-13-arm64; all of the table by default.
# Unpacks each system's libraries below .cache/systems (by mmdebstrap, 0.3 to 1.5 GB each; nothing of it is installed). Those of an arm64 system whose archive
# can't be had are built from the suite's sources by the suite's own cross compiler (from_sources.sh), which the output says. Then compares
# - what their libjpeg-turbo makes of the same pictures, with SIMD and without (jpegs.c), and their libav of the same videos (videos.c);
# - replays of simulated drives and their event logs by this build, with that system's libraries in place of this one's (tests/boards/bits.py);
# - with --compile: the same by a daemon that the system's own compiler made there (an hour each on two cores).
# Exit code 1: a difference. 77: a system can't be had here, which is said, and the others are the same.
set -euo pipefail
cd "$(dirname "$(readlink -f "$0")")/../.."
[ "$(id -u)" -eq 0 ] || exec sudo bash "$0" "$@"
mkdir -p .cache/systems
systems=$(readlink -f .cache/systems)
here=$PWD
. tests/systems/table.sh
libraries=libc6-dev,libeigen3-dev,libyaml-dev,liblcm-dev,nlohmann-json3-dev,libcli11-dev,libturbojpeg0-dev,libpng-dev,zlib1g-dev,libapriltag-dev,libavformat-dev,libavcodec-dev,libavutil-dev,libswscale-dev
compilers=ninja-build,gcc,g++,g++-aarch64-linux-gnu,python3,python3-yaml,pkg-config,liblcm-bin,dash,bash,coreutils,sed,grep,findutils
compilers+=,make,cmake,meson,autoconf,automake,libtool,libltdl-dev,dpkg-dev,perl,mawk,diffutils,hostname,python3-packaging # of from_sources.sh
sources="zlib libffi glib2.0 libpng1.6 libjpeg-turbo libyaml lcm apriltag ffmpeg"

say() { printf '\033[1m== %s\033[0m\n' "$*"; }

unpack() { # NAME SUITE ARCHIVE COMPONENTS LIBSTDCXX
  local root=$systems/$1 arch=${1##*-} keyring=() packages=$libraries,libstdc++-$5-dev folder
  [ "$arch" = arm64 ] || packages+=,$compilers
  [ "$1" = debian-13-amd64 ] && packages+=,ubuntu-keyring
  [ "$(cat "$root/.complete" 2>/dev/null)" = "$packages" ] && return
  [ "$3" != - ] || { echo "$1: no archive: name it by WM_DEBIAN_ARCHIVE, WM_UBUNTU_ARCHIVE, WM_UBUNTU_PORTS" >>"$root.log"; return 1; }
  if [[ $1 == ubuntu* ]]; then
    unpack $(grep '^debian-13-amd64' <<<"$table") || return 1
    keyring=(--keyring="$systems/debian-13-amd64$ubuntu_keys")
  fi
  rm -rf "$root.new"
  say "unpacking $1"
  for folder in "$2-updates" ""; do # a mirror may be amid taking its updates
    mmdebstrap --variant=extract --architectures="$arch" "${keyring[@]}" --include="$packages" "$2" "$root.new" \
      "deb $3 $2 ${4//,/ }" ${folder:+"deb $3 $folder ${4//,/ }"} >"$root.log" 2>&1 && break
    rm -rf "$root.new"
    [ -n "$folder" ] || return 1
  done
  # One /usr, also where a maintainer script would have made it.
  for folder in bin sbin lib lib64; do
    if [ -d "$root.new/$folder" ] && [ ! -L "$root.new/$folder" ]; then
      mkdir -p "$root.new/usr/$folder"
      cp -a "$root.new/$folder/." "$root.new/usr/$folder/"
      rm -rf "${root:?}.new/$folder"
    fi
    [ -e "$root.new/$folder" ] || { mkdir -p "$root.new/usr/$folder" && ln -s "usr/$folder" "$root.new/$folder"; }
  done
  rm -rf "$root"
  mv "$root.new" "$root"
  echo "$packages" >"$root/.complete"
}

inside() { # ROOT SYSROOT WORD... : a command in ROOT, which sees this checkout at its path, and SYSROOT ("": none) as that of arm64
  unshare --mount --pid --fork --kill-child bash -euc '
    root=$1 here=$2 sysroot=$3
    mkdir -p "$root$here" "$root/dev"
    mount --rbind "$here" "$root$here"
    [ -z "$sysroot" ] || { mkdir -p "$root$here/.cache/sysroot/arm64"; mount --bind "$sysroot" "$root$here/.cache/sysroot/arm64"; }
    mount -t proc proc "$root/proc"
    mount -t tmpfs tmpfs "$root/tmp"
    for device in null urandom; do : >>"$root/dev/$device"; mount --bind "/dev/$device" "$root/dev/$device"; done
    shift 3
    exec nice chroot "$root" env -i HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin LC_ALL=C.UTF-8 "$@"' bash "$1" "$here" "${@:2}"
}

from_sources() { # NAME SUITE ... : an arm64 system by the sources and the cross compiler of its sibling on amd64
  local root=$systems/$1 sibling=${1%-arm64}-amd64 keyring=/usr/share/keyrings/debian-archive-keyring.gpg also=() pcre=pcre2 row archive components
  [[ $1 == *-arm64 ]] && row=$(grep "^$sibling " <<<"$table") && unpack $row || return 1
  [ "$(cat "$root/.complete" 2>/dev/null)" = "$sources" ] && return
  read -r _ _ archive components _ <<<"$row"
  [[ $1 != ubuntu* ]] || keyring=$systems/debian-13-amd64$ubuntu_keys
  [ "$debian" = - ] || also=(--also "$debian")
  [ "$2" != jammy ] || pcre=pcre3 # glib's before 2.74
  say "building $1 from its sources (10 minutes on two idle cores; log: $root.log)"
  rm -rf "$root.new"
  python3 tests/systems/sources.py --components "$components" "${also[@]}" "$keyring" "$archive" "$2" "$root-sources" $pcre $sources >"$root.log" 2>&1 &&
    inside "$systems/$sibling" "" bash "$here/tests/systems/from_sources.sh" "$root-sources" "$root.new" >>"$root.log" 2>&1 || return 1
  rm -rf "$root"
  mv "$root.new" "$root"
  echo "$sources" >"$root/.complete"
}

loaded() { # NAME PROGRAM... : a program with that system's libraries
  local root=$systems/$1
  shift
  case "$root" in
    *-arm64) qemu-aarch64 -L "$root" "$@" ;;
    *) "$root/usr/lib/x86_64-linux-gnu/ld-linux-x86-64.so.2" --library-path "$root/usr/lib/x86_64-linux-gnu" "$@" ;;
  esac
}

versions() { # NAME : of what decodes and computes there
  local folder=$systems/$1/usr/lib/x86_64-linux-gnu pc=()
  [[ $1 == *-amd64 ]] || folder=$systems/$1/usr/lib/aarch64-linux-gnu
  for name in libturbojpeg libpng libavcodec libswscale apriltag yaml-0.1; do
    pc+=("$name $(sed -n 's/^Version: //p' "$folder/pkgconfig/$name.pc" 2>/dev/null)")
  done
  printf '%s; ' "${pc[@]}"
}

compile() { # NAME : the daemon by that system's compiler, in NAME-build
  local root=$systems/$1 arch=${1##*-} out=$systems/$1-build
  local tools=$systems/${1%-*}-amd64 options=(-DWM_TESTS=OFF -DWM_RENDER=OFF -DWM_LIBCAMERA=OFF -DWM_ROS2=OFF -DWM_CALIBRATE=OFF -DWM_LIBAV=OFF)
  # CMake of one version for all: Ubuntu 22.04's is too old.
  [ -x "$systems/cmake/bin/cmake" ] || { python3 -m venv "$systems/cmake" && "$systems/cmake/bin/pip" -q --disable-pip-version-check install --require-hashes -r tests/systems/cmake.txt; } || return 1
  local cmake
  cmake=$(echo "$systems"/cmake/lib/python3*/site-packages/cmake/data/bin/cmake)
  if [ "$arch" = arm64 ]; then options+=("-DCMAKE_TOOLCHAIN_FILE=$here/toolchain/arm64.cmake"); else options+=(-DCMAKE_C_COMPILER=gcc -DCMAKE_CXX_COMPILER=g++); fi
  mkdir -p "$out"
  say "compiling in $1"
  inside "$tools" "$([ "$arch" = amd64 ] || echo "$root")" bash -euc \
    '"$1" -G Ninja -S "$2" -B "$3" -DCMAKE_BUILD_TYPE=RelWithDebInfo "${@:4}" && "$1" --build "$3" --target waymark' \
    bash "$cmake" "$here" "$out" "${options[@]}" >"$out/compile.log" 2>&1 || { tail -20 "$out/compile.log" >&2; return 1; }
}

is_compiled="" chosen=()
for word in "$@"; do if [ "$word" = --compile ]; then is_compiled=1; else chosen+=("$word"); fi; done
[ ${#chosen[@]} -gt 0 ] || mapfile -t chosen < <(cut -d' ' -f1 <<<"$table")
[ -x build/bin/waymark-simulate ] || { echo "skipped: there is no build (./dev build)"; exit 77; }
code=0 there=()
for name in "${chosen[@]}"; do
  row=$(grep "^$name " <<<"$table") || { echo "bits.sh: '$name' is none of: $(cut -d' ' -f1 <<<"$table" | xargs)" >&2; exit 2; }
  if unpack $row; then there+=("$name"); elif from_sources $row; then
    there+=("$name")
    echo "$name: built from its sources by its own cross compiler:"
    sed 's/^/  /' "$systems/$name/.versions"
  else
    echo "$name can't be had: $(grep -m1 -E '^(E|Err|W):' "$systems/$name.log" || tail -1 "$systems/$name.log") (log: $systems/$name.log)"
    code=77
  fi
done

say "pictures"
mkdir -p build/systems
gcc -O1 -o build/systems/jpegs tests/systems/jpegs.c -lturbojpeg
build/systems/jpegs >build/systems/here.txt
for name in "${there[@]}"; do
  program=build/systems/jpegs
  if [[ $name == *-arm64 ]]; then
    program=build/systems/jpegs-arm64
    aarch64-linux-gnu-gcc -O1 -idirafter /usr/include -o $program tests/systems/jpegs.c "$systems/$name/usr/lib/aarch64-linux-gnu/libturbojpeg.so" -Wl,--allow-shlib-undefined
  fi
  for simd in 0 1; do
    JSIMD_FORCENONE=$simd loaded "$name" $program >"build/systems/$name.txt" || true
    if diff build/systems/here.txt "build/systems/$name.txt" >build/systems/diff; then
      echo "$name, SIMD $([ $simd = 1 ] && echo off || echo on): $(wc -l <build/systems/here.txt) results are the same ($(versions "$name"))"
    else
      echo "$name, SIMD $([ $simd = 1 ] && echo off || echo on): other results (< here, > there)"
      cat build/systems/diff
      code=1
    fi
  done
done

say "videos"
libav=(-lavformat -lavcodec -lavutil -lswscale)
gcc -O1 -o build/systems/videos tests/systems/videos.c "${libav[@]}"
for codec in libx264 mpeg4 mpeg2video; do build/systems/videos make "build/systems/clip.$codec" "$codec" 2>/dev/null; done
# Compiled for each system, as each libav has its own interface. Some of its libraries lie in folders of their own.
for name in "${there[@]}"; do
  root=$systems/$name triplet=x86_64-linux-gnu
  [[ $name == *-amd64 ]] || triplet=aarch64-linux-gnu
  folder=/usr/lib/$triplet:/usr/lib/$triplet/pulseaudio:/usr/lib/$triplet/blas:/usr/lib/$triplet/lapack
  if [ $triplet = aarch64-linux-gnu ]; then
    libav_there=("${libav[@]/#-l/$root/usr/lib/$triplet/lib}")
    aarch64-linux-gnu-gcc -O1 -w -idirafter "$root/usr/include" -idirafter "$root/usr/include/$triplet" -o build/systems/videos-arm64 tests/systems/videos.c \
      "${libav_there[@]/%/.so}" -Wl,--allow-shlib-undefined
    program=(qemu-aarch64 -L "$root" -E "LD_LIBRARY_PATH=$folder" build/systems/videos-arm64)
  else
    mkdir -p "$root/tmp"
    cp tests/systems/videos.c "$root/tmp/"
    chroot "$root" gcc -O1 -w -o /tmp/videos /tmp/videos.c "${libav[@]}" -Wl,--allow-shlib-undefined
    program=("$root/usr/lib/$triplet/ld-linux-x86-64.so.2" --library-path "$root${folder//:/:$root}" "$root/tmp/videos")
  fi
  for codec in libx264 mpeg4 mpeg2video; do
    here_line=$(build/systems/videos "build/systems/clip.$codec")
    there_line=$(LD_LIBRARY_PATH='' "${program[@]}" "build/systems/clip.$codec") || there_line="no result"
    if [ "$here_line" = "$there_line" ]; then echo "$name: the same, $there_line"; else
      echo "$name: here $here_line, there $there_line"
      code=1
    fi
  done
done

builds=()
for name in "${there[@]}"; do
  if [[ $name == *-amd64 ]]; then builds+=("build@$systems/$name"); elif [ -x build-arm64/bin/waymark ]; then builds+=("build-arm64@$systems/$name"); fi
  if [ -n "$is_compiled" ]; then
    if compile "$name"; then builds+=("$systems/$name-build@$systems/$name"); else
      echo "$name: does not compile"
      code=1
    fi
  fi
done
say "replays"
[ -x build-arm64/bin/waymark ] || echo "replays on arm64 are left out: ./dev board arm64 build makes their daemon"
python3 tests/boards/bits.py --worlds build "${builds[@]}" || code=1
exit $code
