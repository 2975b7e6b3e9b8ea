# SPDX-License-Identifier: Apache-2.0
# NVIDIA Jetson Orin (AGX, NX, Nano): Cortex-A78AE (armv8.2-a, dotprod).
set(WM_ARCH arm64)
set(WM_CPU_FLAGS "-mcpu=cortex-a78ae")
include(${CMAKE_CURRENT_LIST_DIR}/debian-cross.cmake)
