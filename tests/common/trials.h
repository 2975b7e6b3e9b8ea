// SPDX-License-Identifier: Apache-2.0
// How many samples, seeds or views a test that has many takes.
#pragma once

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

// `all` of them; where the tests run in an emulator (WM_FEWER=N in the environment, by cmake/WaymarkOptions.cmake) or
// in the gate (WM_GATE=N, by ./dev test) an N-th part, but at least `least`, and the test prints so.
static inline uint64_t wm_trials(uint64_t all, uint64_t least) {
  const char *name = getenv("WM_FEWER") ? "WM_FEWER" : "WM_GATE", *fewer = getenv(name);
  const uint64_t part = fewer ? strtoull(fewer, NULL, 10) : 1;
  const uint64_t wanted = part > 1 ? all / part : all;
  const uint64_t taken = wanted > least ? wanted : least < all ? least : all;
  if (taken < all)
    printf("%llu of %llu trials (%s=%s)\n", (unsigned long long)taken, (unsigned long long)all, name, fewer);
  return taken;
}
