# SPDX-License-Identifier: Apache-2.0
# Recordings in, files out, through replay, through the real threads, and from the command line.
wm_test(run_replay SOURCES test_replay.c small_recording.c USES wm_replay)
wm_test(run_live SOURCES test_live.c small_recording.c USES wm_run pthread LABELS threads)
wm_test(run_devices SOURCES test_devices.c small_recording.c USES wm_run pthread LABELS threads)
target_include_directories(run_devices PRIVATE ${CMAKE_SOURCE_DIR}/drivers/can)
wm_script_test(run_service COMMAND bash ${CMAKE_CURRENT_SOURCE_DIR}/service.sh)
wm_script_test(run_command_line COMMAND bash ${CMAKE_CURRENT_SOURCE_DIR}/cli.sh)
wm_script_test(run_lcm_tools COMMAND python3 ${CMAKE_CURRENT_SOURCE_DIR}/lcm_tools.py LABELS release-only)
wm_script_test(run_system_calls COMMAND python3 ${CMAKE_CURRENT_SOURCE_DIR}/system_calls.py LABELS release-only)
wm_script_test(run_recordings COMMAND python3 ${CMAKE_CURRENT_SOURCE_DIR}/recordings.py LABELS release-only)
wm_script_test(run_live_minute COMMAND python3 ${CMAKE_CURRENT_SOURCE_DIR}/recordings.py live LABELS slow release-only)
wm_script_test(edge_drives COMMAND python3 ${CMAKE_CURRENT_SOURCE_DIR}/edge_drives.py ${CMAKE_SOURCE_DIR} ${CMAKE_BINARY_DIR}
  LABELS slow release-only TIMEOUT 1200)
wm_script_test(run_check_faults COMMAND python3 ${CMAKE_CURRENT_SOURCE_DIR}/check_faults.py)
wm_script_test(run_frames_of COMMAND python3 ${CMAKE_CURRENT_SOURCE_DIR}/frames_of.py LABELS release-only)
wm_script_test(run_landmarks_from_pixels COMMAND python3 ${CMAKE_CURRENT_SOURCE_DIR}/landmarks_from_pixels.py LABELS release-only)
wm_script_test(run_edges_hardship COMMAND python3 ${CMAKE_CURRENT_SOURCE_DIR}/edges_hardship.py LABELS release-only)
wm_script_test(run_disk_full COMMAND python3 ${CMAKE_CURRENT_SOURCE_DIR}/disk_full.py LABELS release-only)
