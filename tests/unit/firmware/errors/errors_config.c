// SPDX-License-Identifier: Apache-2.0
// Every case of kErrorCases gives its message. With --markdown: prints the table's rows for docs/errors.md.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "common/folder.h"
#include "config/config.h"
#include "errors_case.h"
#include "unity.h"
#include "waymark/recording.h"

#define CONFIG_HEAD "format: waymark-config/1\nestimator: landmark_ekf\n"

static const char *const kGood[][2] = {
    {"recording.yaml", "format: waymark-recording/1\n"},
    {"motion.csv", "t_ns,v_mps,w_radps\n0,0,0\n"},
    {NULL, NULL},
};
// For the cases about CAN, in place of motion.csv.
static const char *const kGoodCan[][2] = {
    {"recording.yaml", "format: waymark-recording/1\n"},
    {"vehicle.dbc", "BU_: CAR\nBO_ 291 SPEED: 2 CAR\n SG_ SPEED : 0|16@1+ (0.01,0) [0|0] \"km/h\" CAR\n"},
    {"can-signals.yaml", "- {quantity: vehicle_speed, message: SPEED, signal: SPEED}\n"},
    {"can.log", "(1.000000) can0 123#0001\n"},
    {NULL, NULL},
};

void setUp(void) { folder_make(); }
void tearDown(void) { folder_remove(); }

// The message with "rec" in place of the folder's path.
static void without_folder(const char *text, char *out, size_t capacity) {
  const char *folder = folder_path("");
  size_t n = strlen(folder) - 1, used = 0;  // without the slash at its end
  while (*text && used + 4 < capacity) {
    if (strncmp(text, folder, n) == 0) {
      memcpy(out + used, "rec", 3);
      used += 3;
      text += n;
    } else {
      out[used++] = *text++;
    }
  }
  out[used] = '\0';
}

static wm_status run_config(const error_case *c, wm_error *err) {
  char text[2048];
  wm_config config;
  int whole = strncmp(c->input, "format", 6) == 0;
  snprintf(text, sizeof text, "%s%s", whole ? "" : CONFIG_HEAD, c->input);
  wm_status status = wm_config_parse(text, strlen(text), c->file, &config, err);
  wm_config_free(&config);
  return status;
}

static wm_status open_recording(const error_case *c, wm_recording **out, wm_error *err) {
  char dir[512];
  const char *const(*good)[2] = strncmp(c->file, "can", 3) == 0 || strstr(c->file, ".dbc") ? kGoodCan : kGood;
  for (; (*good)[0]; good++) folder_write((*good)[0], (*good)[1]);
  if (c->input)
    folder_write(c->file, c->input);
  else
    (void)unlink(folder_path(c->file));
  snprintf(dir, sizeof dir, "%s", folder_path(""));
  return wm_recording_open(dir, NULL, NULL, NULL, out, err);
}

static wm_status run_recording(const error_case *c, wm_error *err) {
  wm_recording *recording;
  wm_status status = open_recording(c, &recording, err);
  wm_recording_close(recording);
  return status;
}

// Reads all sources; the first problem that one reports is the message.
static wm_status run_row(const error_case *c, wm_error *err) {
  wm_recording *recording;
  wm_status status = open_recording(c, &recording, err);
  if (status != WM_OK) return status;
  size_t count;
  wm_source *const *sources = wm_recording_sources(recording, &count);
  static wm_event event;
  err->text[0] = '\0';
  for (size_t i = 0; i < count; i++) {
    while (sources[i]->ops->next(sources[i], &event, NULL) == WM_OK) continue;
    const wm_source_counts *n = &sources[i]->counts;
    if (n->malformed + n->not_finite > 0 && !err->text[0])
      snprintf(err->text, sizeof err->text, "%s", n->first_problem);
  }
  wm_recording_close(recording);
  return err->text[0] ? WM_BAD_DATA : WM_OK;
}

static void run_case(const error_case *c) {
  char message[WM_ERROR_TEXT_MAX];
  wm_error err = {0};
  wm_status status = c->kind == ERROR_CONFIG      ? run_config(c, &err)
                     : c->kind == ERROR_RECORDING ? run_recording(c, &err)
                                                  : run_row(c, &err);
  TEST_ASSERT_NOT_EQUAL_MESSAGE(WM_OK, status, c->name);
  without_folder(err.text, message, sizeof message);
  const char *more = strstr(c->message, "...)");
  if (more && strncmp(c->message, message, (size_t)(more - c->message)) == 0) return;
  TEST_ASSERT_EQUAL_STRING_MESSAGE(c->message, message, c->name);
}

static const error_case *current;
static void one_case(void) { run_case(current); }

// As a cell of a markdown table: lines parted by <br>, bars escaped.
static void print_cell(const char *text) {
  size_t n = strlen(text);
  while (n > 0 && text[n - 1] == '\n') n--;
  int open = 0;
  for (size_t i = 0; i < n; i++) {
    if (!open && text[i] != '\n') putchar('`');
    open = text[i] != '\n';
    if (text[i] == '\n')
      printf("%s<br>", i > 0 && text[i - 1] != '\n' ? "`" : "");
    else if (text[i] == '|')
      printf("\\|");
    else if (text[i] == '\t')
      printf("→");
    else
      putchar(text[i]);
  }
  if (open) putchar('`');
}

static void print_row(const error_case *c) {
  printf("| %s | ", c->name);
  if (c->kind != ERROR_CONFIG) printf("%s: ", c->file);
  if (c->input && *c->input)
    print_cell(c->input);
  else
    printf(c->input ? "(empty)" : "(not there)");
  printf(" | ");
  print_cell(c->message);
  printf(" |\n");
}

int main(int argc, char **argv) {
  int markdown = argc > 1 && strcmp(argv[1], "--markdown") == 0;
  if (markdown) {
    for (current = kErrorCases; current->name; current++) print_row(current);
    return 0;
  }
  UNITY_BEGIN();
  for (current = kErrorCases; current->name; current++) UnityDefaultTestRun(one_case, current->name, __LINE__);
  return UNITY_END();
}
