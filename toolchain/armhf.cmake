# SPDX-License-Identifier: Apache-2.0
# Any 32-bit ARM board with NEON (a Cortex-A of armv7-a has it but for a few of the first).
set(WM_ARCH armhf)
set(WM_CPU_FLAGS "-march=armv7-a -mfpu=neon")
include(${CMAKE_CURRENT_LIST_DIR}/debian-cross.cmake)
