# SPDX-License-Identifier: Apache-2.0
wm_test(config_parse SOURCES config_parse.c config_registry.c USES wm_config)
wm_test(config_shipped SOURCES config_shipped.c USES wm_config)
wm_test(wm_errors_config
  SOURCES errors/errors_config.c errors/errors_config_cases.c
  USES wm_config wm_recording)

# Prints what docs/config.md is made of; tests/golden/docs.py runs it.
add_executable(config_reference config_reference.c)
target_link_libraries(config_reference PRIVATE wm_config wm_rules m)
set_target_properties(config_reference PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tests)
