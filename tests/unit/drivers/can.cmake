# SPDX-License-Identifier: Apache-2.0
add_executable(can_judge ${CMAKE_SOURCE_DIR}/tests/judges/can_judge.c)
target_link_libraries(can_judge PRIVATE wm_can wm_rules)
target_include_directories(can_judge PRIVATE ${CMAKE_SOURCE_DIR}/drivers/can)
set_target_properties(can_judge PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tests)
wm_test(can_candump SOURCES can_candump.c USES wm_can)
