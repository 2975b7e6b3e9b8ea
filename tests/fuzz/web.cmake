# SPDX-License-Identifier: Apache-2.0
if(TARGET wm_web)
  wm_fuzz(fuzz_web SOURCES fuzz_web.cpp USES wm_web wm_report)
endif()
