# SPDX-License-Identifier: Apache-2.0
wm_fuzz(fuzz_wmlog SOURCES fuzz_wmlog.c USES wm_replay)
if(WM_FUZZ)
  target_include_directories(fuzz_wmlog PRIVATE ${CMAKE_SOURCE_DIR}/tests/unit/firmware)
endif()
wm_fuzz(fuzz_library SOURCES fuzz_library.c USES wm_session)
if(TARGET wm_ros2)
  wm_fuzz(fuzz_ros2 SOURCES fuzz_ros2.cpp USES wm_ros2)
endif()
