# SPDX-License-Identifier: Apache-2.0
wm_fuzz(fuzz_gpsd SOURCES fuzz_gpsd.c USES wm_gpsd)
wm_fuzz(fuzz_dvl SOURCES fuzz_dvl.c USES wm_dvl)
wm_fuzz(fuzz_iio SOURCES fuzz_iio.c USES wm_iio)
if(WM_FUZZ)
  target_include_directories(fuzz_gpsd PRIVATE ${CMAKE_SOURCE_DIR}/drivers/gnss)
  target_include_directories(fuzz_dvl PRIVATE ${CMAKE_SOURCE_DIR}/drivers/dvl)
  target_include_directories(fuzz_iio PRIVATE ${CMAKE_SOURCE_DIR}/drivers/iio)
endif()
