// SPDX-License-Identifier: Apache-2.0
// Opens every recording of WM_DATA_DIR and holds what its sources hand out against the `counts` that its
// recording.yaml gives.
#include <dirent.h>
#include <unistd.h>

#include "common/folder.h"
#include "common/suite.h"
#include "waymark/recording.h"

static const char *data_dir;

static void print_warning(void *context, wm_note note, const char *text) {
  printf("  %s, %d: %s\n", (const char *)context, (int)note, text);
}

// What the source's kind is called under `counts`, NULL where nothing is.
static const char *count_key(const wm_source *source) {
  if (strcmp(source->name, "motion") == 0 || strcmp(source->name, "motion6") == 0) return "motion_rows";
  if (strncmp(source->name, "sightings:", 10) == 0) return "sightings";
  if (strcmp(source->name, "gnss") == 0) return "gnss_rows";
  if (strcmp(source->name, "stereo") == 0) return "stereo_rows";
  return NULL;
}

static uint64_t skipped_of(const wm_source *source) { return source->counts.malformed + source->counts.not_finite; }

static void drain(wm_source *source, const char *name) {
  static wm_event event;
  wm_error err = {0};
  wm_time_ns newest_ns = WM_TIME_NONE;
  uint64_t events = 0;
  wm_status status;
  while ((status = source->ops->next(source, &event, &err)) == WM_OK) {
    TEST_ASSERT_TRUE_MESSAGE(event.arrival_ns >= newest_ns, name);
    TEST_ASSERT_EQUAL_UINT32(events, event.seq);
    TEST_ASSERT_EQUAL(source->index, event.source);
    TEST_ASSERT_TRUE(source->kinds & WM_EVENT_BIT(event.kind));
    newest_ns = event.arrival_ns;
    events++;
  }
  TEST_ASSERT_EQUAL_MESSAGE(WM_END, status, err.text);
  TEST_ASSERT_EQUAL_UINT64(events, source->counts.received);
  // Some recordings hold rows as a sensor gave them without an echo (a range of 0): few, and counted.
  const uint64_t skipped = skipped_of(source);
  if (skipped > 0) printf("  %s: %llu rows: %s\n", name, (unsigned long long)skipped, source->counts.first_problem);
  TEST_ASSERT_TRUE_MESSAGE(skipped * 100 < events, source->counts.first_problem);
}

// CAN: every frame of the log becomes an event or is counted.
static void check_frames(const wm_yaml_node *root, const wm_source *source) {
  wm_yaml_node node = wm_yaml_get(root, "counts.can_frames");
  if (strcmp(source->name, "can") != 0 || !wm_yaml_there(&node)) return;
  int64_t expected;
  wm_error err;
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_yaml_i64(&node, 0, INT64_MAX, &expected, &err), err.text);
  const wm_source_counts *n = &source->counts;
  TEST_ASSERT_EQUAL_UINT64((uint64_t)expected, n->received + n->ignored + n->frozen);
}

// A kind's count is that of all its sources.
static void check_count(const wm_yaml_node *root, wm_source *const *sources, size_t count, size_t of,
                        const char *name) {
  char key[64];
  if (!count_key(sources[of])) return;
  snprintf(key, sizeof key, "counts.%s", count_key(sources[of]));
  wm_yaml_node node = wm_yaml_get(root, key);
  if (!wm_yaml_there(&node)) return;
  int64_t expected;
  uint64_t received = 0;
  wm_error err;
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_yaml_i64(&node, 0, INT64_MAX, &expected, &err), err.text);
  for (size_t i = 0; i < count; i++)
    if (count_key(sources[i]) && strcmp(count_key(sources[i]), count_key(sources[of])) == 0)
      received += sources[i]->counts.received + skipped_of(sources[i]);
  TEST_ASSERT_EQUAL_UINT64_MESSAGE((uint64_t)expected, received, name);
}

// The data may lie beside folders of other formats.
static int is_recording(const char *about) {
  char head[400] = "";
  FILE *file = fopen(about, "r");
  TEST_ASSERT_NOT_NULL(file);
  (void)fread(head, 1, sizeof head - 1, file);
  (void)fclose(file);
  return strstr(head, "waymark-recording/") != NULL;
}

static void check_recording(const char *name) {
  char dir[512], about[600];
  wm_error err = {0};
  wm_recording *recording;
  wm_yaml *doc;
  snprintf(dir, sizeof dir, "%s/%s", data_dir, name);
  snprintf(about, sizeof about, "%s/recording.yaml", dir);
  wm_status status = wm_recording_open(dir, NULL, print_warning, (void *)name, &recording, &err);
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, status, err.text);
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_yaml_load(about, &doc, &err), err.text);
  wm_yaml_node root = wm_yaml_root(doc);
  size_t count;
  wm_source *const *sources = wm_recording_sources(recording, &count);
  uint64_t events = 0;
  for (size_t i = 0; i < count; i++) {
    drain(sources[i], name);
    check_frames(&root, sources[i]);
    events += sources[i]->counts.received;
    printf("  %-22s %-18s %8llu events, %llu out of order\n", name, sources[i]->name,
           (unsigned long long)sources[i]->counts.received, (unsigned long long)sources[i]->counts.out_of_order);
  }
  for (size_t i = 0; i < count; i++) check_count(&root, sources, count, i, name);
  TEST_ASSERT_GREATER_THAN_UINT64_MESSAGE(0, events, name);
  wm_yaml_free(doc);
  wm_recording_close(recording);
}

TEST(every_recording) {
  DIR *dir = opendir(data_dir);
  TEST_ASSERT_NOT_NULL(dir);
  int checked = 0;
  for (struct dirent *entry; (entry = readdir(dir));) {
    char about[1024];
    snprintf(about, sizeof about, "%s/%s/recording.yaml", data_dir, entry->d_name);
    if (access(about, R_OK) != 0) continue;
    if (!is_recording(about)) {
      printf("  %-22s is of another format\n", entry->d_name);
      continue;
    }
    check_recording(entry->d_name);
    checked++;
  }
  closedir(dir);
  TEST_ASSERT_GREATER_THAN(0, checked);
}

// A line of a CSV with its columns in reverse order, the stamp once more as arrival_ns, and a CRLF.
static void write_reversed(FILE *to, char *line, int is_header) {
  char *field[16];
  size_t count = 0;
  line[strcspn(line, "\r\n")] = '\0';
  for (char *rest = line; rest && count < 16; count++) field[count] = strsep(&rest, ",");
  for (size_t i = count; i-- > 0;) fprintf(to, "%s,", field[i]);
  fprintf(to, "%s\r\n", is_header ? "arrival_ns" : field[0]);
}

static void copy_reversed(const char *dir, const char *file) {
  char path[512], line[512];
  snprintf(path, sizeof path, "%s/%s", dir, file);
  FILE *from = fopen(path, "r"), *to = fopen(folder_path(file), "w");
  TEST_ASSERT_TRUE(from && to);
  for (int first = 1; fgets(line, sizeof line, from); first = 0) write_reversed(to, line, first);
  fclose(from);
  fclose(to);
}

// The same data in another order of columns, with CRLF and arrival_ns, are the same events to the last bit.
TEST(columns_in_any_order) {
  static wm_event a, b;
  char dir[512];
  wm_error err = {0};
  wm_recording *plain, *turned;
  size_t count, turned_count;
  snprintf(dir, sizeof dir, "%s/starry-night-plan-a", data_dir);
  if (access(dir, R_OK) != 0) TEST_IGNORE_MESSAGE("no starry-night-plan-a");
  folder_make();
  folder_write("recording.yaml", "format: waymark-recording/1\n");
  copy_reversed(dir, "motion.csv");
  copy_reversed(dir, "sightings.csv");
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_recording_open(dir, NULL, NULL, NULL, &plain, &err), err.text);
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_recording_open(folder_path(""), NULL, NULL, NULL, &turned, &err), err.text);
  wm_source *const *sources = wm_recording_sources(plain, &count);
  wm_source *const *others = wm_recording_sources(turned, &turned_count);
  TEST_ASSERT_EQUAL(count, turned_count);
  for (size_t i = 0; i < count; i++) {
    while (sources[i]->ops->next(sources[i], &a, &err) == WM_OK) {
      TEST_ASSERT_EQUAL(WM_OK, others[i]->ops->next(others[i], &b, &err));
      TEST_ASSERT_EQUAL_MEMORY(&a, &b, WM_EVENT_SMALL_BYTES);
    }
    TEST_ASSERT_EQUAL(WM_END, others[i]->ops->next(others[i], &b, &err));
    TEST_ASSERT_TRUE(sources[i]->in_order && !others[i]->in_order);
  }
  wm_recording_close(plain);
  wm_recording_close(turned);
  folder_remove();
}

int suite_begin(int argc, char **argv) {
  (void)argc, (void)argv;
  data_dir = getenv("WM_DATA_DIR");
  if (!data_dir || access(data_dir, R_OK) != 0) {
    puts("skipped: no recordings in WM_DATA_DIR");
    return 77;
  }
  return SUITE_RUNS;
}
