# SPDX-License-Identifier: Apache-2.0
add_executable(wm_bench_late bench_late.c)
target_link_libraries(wm_bench_late PRIVATE wm_fusion wm_rules m)
set_target_properties(wm_bench_late PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bench)
