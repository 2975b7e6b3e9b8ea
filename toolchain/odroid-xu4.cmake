# SPDX-License-Identifier: Apache-2.0
# Hardkernel ODROID-XU4, HC1, MC1: Cortex-A15 and A7 (armv7ve, NEON, VFPv4).
set(WM_ARCH armhf)
set(WM_CPU_FLAGS "-mcpu=cortex-a15.cortex-a7 -mfpu=neon-vfpv4")
include(${CMAKE_CURRENT_LIST_DIR}/debian-cross.cmake)
