# SPDX-License-Identifier: Apache-2.0
# Any 32-bit ARM board of Debian's armhf: armv7-a, VFPv3-D16; NEON where the board says it has it (math/vectors.cpp).
set(WM_ARCH armhf)
set(WM_CPU_FLAGS "")
include(${CMAKE_CURRENT_LIST_DIR}/debian-cross.cmake)
