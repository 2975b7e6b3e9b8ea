# SPDX-License-Identifier: Apache-2.0
# What the boards' toolchain files share: Debian's cross compilers, a sysroot of ./dev sysroot, tests under qemu-user.
# Before it: WM_ARCH (arm64, armhf) and WM_CPU_FLAGS.
set(CMAKE_SYSTEM_NAME Linux)
if(WM_ARCH STREQUAL arm64)
  set(CMAKE_SYSTEM_PROCESSOR aarch64)
  set(WM_TRIPLET aarch64-linux-gnu)
  set(WM_QEMU qemu-aarch64)
else()
  set(CMAKE_SYSTEM_PROCESSOR armv7l)
  set(WM_TRIPLET arm-linux-gnueabihf)
  set(WM_QEMU qemu-arm)
endif()
get_filename_component(CMAKE_SYSROOT "${CMAKE_CURRENT_LIST_DIR}/../.cache/sysroot/${WM_ARCH}" REALPATH)
if(NOT EXISTS ${CMAKE_SYSROOT}/.complete)
  message(FATAL_ERROR "There is no sysroot for ${WM_ARCH} in ${CMAKE_SYSROOT}. Make it: ./dev sysroot ${WM_ARCH}")
endif()
set(CMAKE_C_COMPILER ${WM_TRIPLET}-gcc)
set(CMAKE_CXX_COMPILER ${WM_TRIPLET}-g++)
set(CMAKE_LIBRARY_ARCHITECTURE ${WM_TRIPLET})
# -Wno-psabi: gcc 12 tells on ARM that gcc 10 passed some C++ arguments differently; nothing here meets its code.
set(CMAKE_C_FLAGS_INIT "${WM_CPU_FLAGS}")
set(CMAKE_CXX_FLAGS_INIT "${WM_CPU_FLAGS} -Wno-psabi")
set(CMAKE_CROSSCOMPILING_EMULATOR ${WM_QEMU} -L ${CMAKE_SYSROOT})
set(CPACK_DEBIAN_PACKAGE_ARCHITECTURE ${WM_ARCH})
# Whose libraries staged.cmake finds there.
set(CPACK_WM_SYSROOT ${CMAKE_SYSROOT})
set(CPACK_WM_TRIPLET ${WM_TRIPLET})

# Libraries and headers are the sysroot's alone, programs the host's alone (lcm-gen, python3).
set(CMAKE_FIND_ROOT_PATH ${CMAKE_SYSROOT})
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
set(ENV{PKG_CONFIG_SYSROOT_DIR} ${CMAKE_SYSROOT})
set(ENV{PKG_CONFIG_LIBDIR} ${CMAKE_SYSROOT}/usr/lib/${WM_TRIPLET}/pkgconfig:${CMAKE_SYSROOT}/usr/share/pkgconfig)
set(ENV{PKG_CONFIG_PATH} "")
