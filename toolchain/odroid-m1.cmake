# SPDX-License-Identifier: Apache-2.0
# Hardkernel ODROID-M1, M1S: Cortex-A55 (armv8.2-a, dotprod).
set(WM_ARCH arm64)
set(WM_CPU_FLAGS "-mcpu=cortex-a55")
include(${CMAKE_CURRENT_LIST_DIR}/debian-cross.cmake)
