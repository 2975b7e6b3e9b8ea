# SPDX-License-Identifier: Apache-2.0
if(TARGET wm_web)
  wm_fuzz(fuzz_web SOURCES fuzz_web.cpp USES wm_web wm_report)
  wm_fuzz(fuzz_edit SOURCES fuzz_edit.cpp USES wm_building)
endif()
