# SPDX-License-Identifier: Apache-2.0
wm_fuzz(fuzz_wmlog SOURCES fuzz_wmlog.c USES wm_replay)
if(WM_FUZZ)
  target_include_directories(fuzz_wmlog PRIVATE ${CMAKE_SOURCE_DIR}/tests/unit/firmware)
endif()
