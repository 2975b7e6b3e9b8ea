# SPDX-License-Identifier: Apache-2.0
# Recordings in, files out, through replay and through the real threads.
wm_test(run_replay SOURCES test_replay.c small_recording.c USES wm_replay)
wm_test(run_live SOURCES test_live.c small_recording.c USES wm_run pthread LABELS threads)
