# SPDX-License-Identifier: Apache-2.0
wm_bench(late SOURCES bench_late.c USES wm_fusion)
