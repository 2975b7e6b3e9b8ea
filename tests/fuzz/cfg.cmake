# SPDX-License-Identifier: Apache-2.0
wm_fuzz(fuzz_csv SOURCES fuzz_csv.c USES wm_recording)
wm_fuzz(fuzz_yaml SOURCES fuzz_yaml.c USES wm_recording wm_yaml)
wm_fuzz(fuzz_config SOURCES fuzz_config.c USES wm_config)
wm_fuzz(fuzz_map SOURCES fuzz_map.c USES wm_map)
if(WM_FUZZ)
  target_include_directories(fuzz_csv PRIVATE ${CMAKE_SOURCE_DIR}/drivers/recording)
  target_include_directories(fuzz_yaml PRIVATE ${CMAKE_SOURCE_DIR}/drivers/recording)
endif()
