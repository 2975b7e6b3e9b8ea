# SPDX-License-Identifier: Apache-2.0
# NVIDIA Jetson Xavier (AGX, NX): Carmel, which gcc 12 doesn't know by name.
set(WM_ARCH arm64)
set(WM_CPU_FLAGS "-march=armv8.2-a+fp16")
include(${CMAKE_CURRENT_LIST_DIR}/debian-cross.cmake)
