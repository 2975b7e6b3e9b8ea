# SPDX-License-Identifier: Apache-2.0
wm_fuzz(fuzz_candump SOURCES fuzz_candump.c USES wm_can)
wm_fuzz(fuzz_dbc SOURCES fuzz_dbc.c USES wm_can)
if(TARGET fuzz_dbc)
  target_include_directories(fuzz_dbc PRIVATE ${CMAKE_SOURCE_DIR}/drivers/can)
endif()
