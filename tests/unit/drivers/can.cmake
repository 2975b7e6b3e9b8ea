# SPDX-License-Identifier: Apache-2.0
add_executable(can_judge ${CMAKE_SOURCE_DIR}/tests/judges/can_judge.c)
target_link_libraries(can_judge PRIVATE wm_can wm_rules)
target_include_directories(can_judge PRIVATE ${CMAKE_SOURCE_DIR}/drivers/can)
set_target_properties(can_judge PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tests)
wm_test(can_bits SOURCES can_bits.c USES wm_can)
target_include_directories(can_bits PRIVATE ${CMAKE_SOURCE_DIR}/drivers/can)
wm_test(can_candump SOURCES can_candump.c USES wm_can)
wm_test(can_dbc SOURCES can_dbc.c USES wm_can)
target_include_directories(can_dbc PRIVATE ${CMAKE_SOURCE_DIR}/drivers/can)
wm_test(wm_errors_can SOURCES can_errors.c USES wm_can)
wm_test(can_decode SOURCES can_decode.c USES wm_can)
wm_test(can_senders SOURCES can_senders.c USES wm_can)
wm_test(can_gnss SOURCES can_gnss.c USES wm_can m)
wm_test(can_bind SOURCES can_bind.c USES wm_can m)

# Outside judges: python-can for logs, cantools for DBC (tests/judges/setup.sh installs them).
wm_script_test(can_judge COMMAND tests/judges/run.sh tests/judges/can_judge.py $<TARGET_FILE:can_judge>)

# A CAN interface as a source, on a system that does what the test says.
wm_test(can_queue SOURCES can_queue.c USES wm_can_device)
target_include_directories(can_queue PRIVATE ${CMAKE_SOURCE_DIR}/drivers/can)
wm_test(can_device SOURCES can_device.c fake_can.c USES wm_can_device wm_clock)
target_include_directories(can_device PRIVATE ${CMAKE_SOURCE_DIR}/drivers/can)
