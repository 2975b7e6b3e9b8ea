# SPDX-License-Identifier: Apache-2.0
# NVIDIA Jetson TX1 and Nano: Cortex-A57 (armv8-a, crc); TX2: the same beside two Denver 2 cores, which run it too.
set(WM_ARCH arm64)
set(WM_CPU_FLAGS "-mcpu=cortex-a57")
include(${CMAKE_CURRENT_LIST_DIR}/debian-cross.cmake)
