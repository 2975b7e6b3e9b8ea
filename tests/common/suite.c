// SPDX-License-Identifier: Apache-2.0
#include "suite.h"

#include <stdio.h>
#include <string.h>

static suite_case *cases;

static int is_before(const suite_case *a, const suite_case *b) {
  const int files = strcmp(a->file, b->file);
  return files != 0 ? files < 0 : a->line < b->line;
}

void suite_add(suite_case *added) {
  suite_case **at = &cases;
  while (*at && is_before(*at, added)) at = &(*at)->next;
  added->next = *at;
  *at = added;
}

__attribute__((weak)) void setUp(void) {}
__attribute__((weak)) void tearDown(void) {}
__attribute__((weak)) void suite_end(void) {}
__attribute__((weak)) int suite_begin(int argc, char **argv) {
  (void)argc, (void)argv;
  return SUITE_RUNS;
}

int main(int argc, char **argv) {
  UnityBegin(cases->file);
  const int status = suite_begin(argc, argv);
  if (status != SUITE_RUNS) return status;
  for (const suite_case *c = cases; c; c = c->next) {
    Unity.TestFile = c->file;
    UnityDefaultTestRun(c->run, c->name, c->line);
  }
  suite_end();
  return UnityEnd();
}
