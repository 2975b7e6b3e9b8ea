# SPDX-License-Identifier: Apache-2.0
# Any 64-bit ARM board: armv8-a.
set(WM_ARCH arm64)
set(WM_CPU_FLAGS "")
include(${CMAKE_CURRENT_LIST_DIR}/debian-cross.cmake)
