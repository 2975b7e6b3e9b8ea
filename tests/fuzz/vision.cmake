# SPDX-License-Identifier: Apache-2.0
wm_fuzz(fuzz_video SOURCES fuzz_video.c USES wm_video)
if(WM_FUZZ)
  target_include_directories(fuzz_video PRIVATE ${CMAKE_SOURCE_DIR}/drivers/recording)
endif()
wm_fuzz(fuzz_mr SOURCES fuzz_mr.cpp USES wm_estimator)
