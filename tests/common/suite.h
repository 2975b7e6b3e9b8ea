// SPDX-License-Identifier: Apache-2.0
// A test program: each TEST(name) { ... } is a case of it. Its main is in suite.c and runs all cases, in the order of
// the file. It brings the standard headers that most cases use.
#pragma once

#ifdef __cplusplus
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <initializer_list>
#include <limits>
#include <utility>
#else
#include <stdbool.h>
#endif
#include <inttypes.h>
#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "unity.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct suite_case {
  const char *file, *name;
  int line;
  void (*run)(void);
  struct suite_case *next;
} suite_case;

void suite_add(suite_case *added);

// What a program may define: what is done before all cases, and after them. Another return value than SUITE_RUNS is the
// program's exit code, and no case runs; 77: skipped.
#define SUITE_RUNS (-1)
int suite_begin(int argc, char **argv);
void suite_end(void);

#ifdef __cplusplus
}
#endif

#define TEST(name)                                                     \
  static void name(void);                                              \
  __attribute__((constructor)) static void name##_is_a_case(void) {    \
    static suite_case added = {__FILE__, #name, __LINE__, name, NULL}; \
    suite_add(&added);                                                 \
  }                                                                    \
  static void name(void)
