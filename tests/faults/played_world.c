// SPDX-License-Identifier: Apache-2.0
#include "played_world.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define FAULTS_MAX 64

typedef struct fault {
  double from_s, until_s, value;
  char what[32];
} fault;

static pthread_once_t once = PTHREAD_ONCE_INIT;
static played_item *items;
static size_t item_count;
static wm_time_ns first_ns;
static _Atomic wm_time_ns begin_ns;  // 0: not yet
static fault faults[FAULTS_MAX];
static size_t fault_count;

static char *read_file(const char *folder, const char *name, size_t *length) {
  char path[600];
  (void)snprintf(path, sizeof path, "%s/%s", folder, name);
  FILE *f = fopen(path, "rb");
  if (!f) {
    perror(path);
    exit(3);
  }
  (void)fseek(f, 0, SEEK_END);
  *length = (size_t)ftell(f);
  rewind(f);
  char *data = calloc(*length + 1, 1);
  if (!data || fread(data, 1, *length, f) != *length) exit(3);
  (void)fclose(f);
  return data;
}

static int parse(const char *line, const uint8_t *pictures, size_t pictures_length, played_item *out) {
  long long t_ns;
  int used = 0;
  unsigned id = 0;
  char data[32] = "";
  size_t offset = 0, bytes = 0;
  memset(out, 0, sizeof *out);
  if (sscanf(line, "%lld %c%n", &t_ns, &out->kind, &used) != 2) return 0;
  out->due_ns = t_ns;
  if (out->kind == 'p') {
    if (sscanf(line + used, "%zu %zu", &offset, &bytes) != 2 || offset + bytes > pictures_length) return 0;
    out->data = pictures + offset;
    out->bytes = (uint32_t)bytes;
    return 1;
  }
  if (out->kind != 'c' || sscanf(line + used, "%x %16s", &id, data) < 1) return 0;
  out->frame.id = id;
  out->frame.length = (uint8_t)(strlen(data) / 2);
  for (size_t i = 0; i < out->frame.length; i++) {
    unsigned byte = 0;
    (void)sscanf(data + 2 * i, "%2x", &byte);
    out->frame.data[i] = (uint8_t)byte;
  }
  return 1;
}

static void read_world(void) {
  const char *folder = getenv("WM_PLAYED");
  size_t length, pictures_length;
  uint32_t numbers[256] = {0};
  if (!folder) exit(3);
  char *text = read_file(folder, "timeline", &length);
  const uint8_t *pictures = (const uint8_t *)read_file(folder, "pictures", &pictures_length);
  items = calloc(length / 4 + 1, sizeof *items);
  if (!items) exit(3);
  for (char *rest = text, *line; (line = strsep(&rest, "\n")) != NULL;) {
    if (!parse(line, pictures, pictures_length, &items[item_count])) continue;
    items[item_count].number = numbers[(uint8_t)items[item_count].kind]++;
    item_count++;
  }
  if (item_count > 0) first_ns = items[0].due_ns;
  for (size_t i = 0; i < item_count; i++) items[i].due_ns -= first_ns;
  free(text);
  text = read_file(folder, "faults", &length);
  for (char *rest = text, *line; (line = strsep(&rest, "\n")) != NULL && fault_count < FAULTS_MAX;) {
    fault *f = &faults[fault_count];
    fault_count += sscanf(line, "%lf %lf %31s %lf", &f->from_s, &f->until_s, f->what, &f->value) >= 3;
  }
  free(text);
}

// 1: the world has begun.
static int look_for_begin(void) {
  char path[600];
  long long ns = 0;
  (void)pthread_once(&once, read_world);
  if (begin_ns) return 1;
  (void)snprintf(path, sizeof path, "%s/begin", getenv("WM_PLAYED"));
  FILE *f = fopen(path, "r");
  if (!f) return 0;
  if (fscanf(f, "%lld", &ns) == 1) begin_ns = ns;
  (void)fclose(f);
  return begin_ns != 0;
}

wm_time_ns played_now_ns(void) {
  struct timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return (wm_time_ns)now.tv_sec * WM_NS_PER_S + now.tv_nsec;
}

const played_item *played_next(char kind, wm_time_ns from_ns, size_t *next) {
  if (!look_for_begin()) return NULL;
  wm_time_ns since_ns = from_ns - begin_ns;
  while (*next < item_count && (items[*next].kind != kind || items[*next].due_ns < since_ns)) (*next)++;
  return *next < item_count ? &items[*next] : NULL;
}

wm_time_ns played_due_ns(const played_item *item) { return begin_ns + item->due_ns; }

int played_fault(const char *what, double *value) {
  if (!look_for_begin()) return 0;
  double now_s = (double)(played_now_ns() - begin_ns) * 1e-9;
  for (size_t i = 0; i < fault_count; i++) {
    if (now_s < faults[i].from_s || now_s >= faults[i].until_s || strcmp(faults[i].what, what) != 0) continue;
    if (value) *value = faults[i].value;
    return 1;
  }
  return 0;
}

int played_is_hit(uint32_t number, double percent) {
  uint32_t x = number * 2654435761u + 12345u;
  x ^= x >> 15;
  x *= 2246822519u;
  x ^= x >> 13;
  return (double)(x % 10000u) < percent * 100;
}

int played_sleep(wm_time_ns when_ns, int wait_ms) {
  wm_time_ns end_ns = played_now_ns() + wait_ms * WM_NS_PER_MS;
  int is_soon = when_ns <= end_ns;
  wm_time_ns until_ns = is_soon ? when_ns : end_ns;
  struct timespec until = {until_ns / WM_NS_PER_S, until_ns % WM_NS_PER_S};
  (void)clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, NULL);
  return is_soon;
}
