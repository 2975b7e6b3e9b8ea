#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# from_sources.sh SOURCES ROOT: builds the libraries of an arm64 system into ROOT, from the unpacked source packages of
# sources.py, by the cross compiler of the root that this runs in. C's and C++'s library are that compiler's.
# Flags are those that the packages are built with (dpkg-buildflags of this root). What the robot and the tests of decoders do
# not use is left out: bindings, tools, tests, FFmpeg's other formats.
set -euo pipefail
sources=$1 root=$2 triplet=aarch64-linux-gnu
export LC_ALL=C # an unpacked root may have no other
lib=/usr/lib/$triplet

link_tools() { # what maintainer scripts would have linked
  cd /usr/bin
  local link
  for link in awk:mawk which:which.debianutils "automake:$(echo automake-1*)" "aclocal:$(echo aclocal-1*)"; do
    [ -e "${link%:*}" ] || ln -s "${link#*:}" "${link%:*}"
  done
}

lay_out() { # the compiler's libraries at a system's own paths; headers without machine code from this root
  local folder
  mkdir -p "$root$lib" "$root/usr/include" "$root/usr/share/pkgconfig" "$root/usr/bin"
  for folder in bin lib; do ln -s "usr/$folder" "$root/$folder"; done
  cp -a /usr/$triplet/lib/. "$root$lib/"
  cp -a /usr/$triplet/include/. "$root/usr/include/"
  cp -aL "$root$lib/ld-linux-aarch64.so.1" "$root/usr/lib/"
  for folder in /usr/include/{eigen3,nlohmann,CLI} /usr/share/{eigen3,cmake} /usr/lib/cmake; do
    [ ! -e "$folder" ] || cp -a --parents "$folder" "$root"
  done
}

build() { # PACKAGE HOW OPTION...
  echo "== $1"
  (
    cd "$sources/$1"
    eval "$(dpkg-buildflags --export=sh)" # their paths are of this folder
    export CFLAGS+=" ${CFLAGS_MORE:-}" CPPFLAGS+=" -I$root/usr/include -I$root/usr/include/$triplet" LDFLAGS+=" -L$root$lib -Wl,-rpath-link,$root$lib"
    "${@:2}"
  )
  rm -f "$root$lib"/*.la # libtool's, with paths of a running system
}

by_autotools() { # [ONLY=FOLDER] OPTION...
  local where=.
  case "${1:-}" in ONLY=*) where=${1#*=} && shift ;; esac
  autoreconf -fi
  ./configure --host=$triplet --build="$(dpkg-architecture -qDEB_BUILD_GNU_TYPE)" --prefix=/usr --libdir=$lib --disable-static "$@"
  make -j2 -C "$where"
  make -C "$where" install DESTDIR="$root"
}

by_cmake() { # OPTION...
  cmake -B obj -G Ninja -DCMAKE_BUILD_TYPE=None -DCMAKE_INSTALL_PREFIX=/usr -DCMAKE_INSTALL_LIBDIR=$lib \
    -DCMAKE_SYSTEM_NAME=Linux -DCMAKE_SYSTEM_PROCESSOR=aarch64 -DCMAKE_C_COMPILER=$triplet-gcc -DCMAKE_CXX_COMPILER=$triplet-g++ -DCMAKE_LIBRARY_ARCHITECTURE=$triplet \
    -DCMAKE_FIND_ROOT_PATH="$root" -DCMAKE_FIND_ROOT_PATH_MODE_LIBRARY=ONLY -DCMAKE_FIND_ROOT_PATH_MODE_INCLUDE=ONLY "$@"
  ninja -j2 -C obj
  DESTDIR=$root ninja -C obj install
}

glib() { # what LCM uses of it, without objects and input and output. Below "properties": what it would find by running programs
  cat >"$sources/arm64.ini" <<EOT
[binaries]
c = '$triplet-gcc'
cpp = '$triplet-g++'
ar = '$triplet-ar'
strip = '$triplet-strip'
pkgconfig = 'pkg-config'
[host_machine]
system = 'linux'
cpu_family = 'aarch64'
cpu = 'aarch64'
endian = 'little'
[properties]
needs_exe_wrapper = true
growing_stack = false
have_c99_vsnprintf = true
have_c99_snprintf = true
have_unix98_printf = true
va_val_copy = true
have_proc_self_cmdline = true
EOT
  meson setup obj --cross-file "$sources/arm64.ini" --prefix=/usr --libdir=lib/$triplet --buildtype=plain --wrap-mode=nodownload \
    -Dtests=false -Dnls=disabled -Dlibmount=disabled -Dselinux=disabled -Dlibelf=disabled -Dxattr=false
  ninja -j2 -C obj $(ninja -C obj -t targets all | sed -n 's/^\(g[a-z]*\/libg[a-z]*-2.0\.so[.0-9]*\):.*/\1/p' | grep -E '^g(lib|thread)/')
  local include=$root/usr/include/glib-2.0
  mkdir -p "$include/glib/deprecated" "$root$lib/glib-2.0/include"
  cp -a obj/g{lib,thread}/libg*-2.0.so* "$root$lib/"
  cp glib/glib.h "$include/"
  cp glib/*.h obj/glib/*.h "$include/glib/"
  cp glib/deprecated/*.h "$include/glib/deprecated/"
  cp obj/glib/glibconfig.h "$root$lib/glib-2.0/include/"
  cp obj/meson-private/g{lib,thread}-2.0.pc "$root$lib/pkgconfig/"
}

by_configure() { # OPTION... : a script that is not autoconf's
  ./configure --prefix=/usr --libdir=$lib "$@"
  make -j2
  make install DESTDIR="$root"
}

build_all() {
  CHOST=$triplet CFLAGS_MORE="-D_REENTRANT -O3" build zlib by_configure --shared
  build libffi by_autotools --disable-docs
  build "$(cd "$sources" && echo pcre?)" by_autotools --enable-utf --enable-unicode-properties
  build glib2.0 glib
  build libpng1.6 by_autotools
  build libjpeg-turbo by_cmake -DWITH_JPEG8=1 -DENABLE_STATIC=OFF
  build libyaml by_autotools
  # The library alone: LCM's tools and tests run lcm-gen, which would not be of this processor.
  if [ -f "$sources/lcm/CMakeLists.txt" ]; then
    build lcm by_cmake -DLIB_SUFFIX=/$triplet -DLCM_ENABLE_{JAVA,LUA,PYTHON,TESTS,EXAMPLES}=OFF
  else
    build lcm by_autotools ONLY=lcm --without-python
  fi
  build apriltag by_cmake
  build ffmpeg by_configure --incdir=/usr/include/$triplet --enable-cross-compile --cross-prefix=$triplet- --target-os=linux --arch=aarch64 --toolchain=hardened \
    --enable-gpl --enable-shared --disable-static --disable-autodetect --disable-programs --disable-doc --disable-everything \
    --enable-decoder=h264,mpeg4,mpeg1video,mpeg2video --enable-parser=h264,mpeg4video,mpegvideo --enable-demuxer=h264,m4v,mpegvideo,mov --enable-protocol=file
}

link_tools
export DEB_VENDOR PKG_CONFIG_SYSROOT_DIR=$root PKG_CONFIG_LIBDIR=$root$lib/pkgconfig:$root/usr/share/pkgconfig
DEB_VENDOR=$(. /etc/os-release && echo "${NAME%% *}") # dpkg's flags are a vendor's
eval "$(dpkg-architecture -aarm64 -s 2>/dev/null)"
lay_out
build_all
sed -i "s|/usr/$triplet/lib/|$lib/|g" "$root$lib/libc.so" # a linker script, which named the compiler's folder while that linked
{ $triplet-gcc --version | head -1; cat "$sources/versions"; } >"$root/.versions"
