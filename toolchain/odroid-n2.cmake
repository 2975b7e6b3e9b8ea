# SPDX-License-Identifier: Apache-2.0
# Hardkernel ODROID-N2, N2+: Cortex-A73 and A53 (armv8-a, crc).
set(WM_ARCH arm64)
set(WM_CPU_FLAGS "-mcpu=cortex-a73.cortex-a53")
include(${CMAKE_CURRENT_LIST_DIR}/debian-cross.cmake)
