// SPDX-License-Identifier: Apache-2.0
#include "cli/causes.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include "cli/commands.h"
#include "waymark/yaml.h"

#define ANSWER_BYTES_MAX ((size_t)1 << 20)
#define TEXT_MAX 2000

// In the child: becomes the engine, with its output into the pipe.
static void become(const causes_question *question, int to) {
  const char *words[16] = {"waymark causes", question->config, question->recording, "--json"};
  const struct {
    const char *name, *value;
  } options[] = {{"--landmarks", question->landmarks},
                 {"--calibration", question->calibration},
                 {"--map", question->map},
                 {"--apply", question->apply_to}};
  size_t count = 4;
  for (size_t i = 0; i < sizeof options / sizeof options[0]; i++) {
    if (!options[i].value) continue;
    words[count++] = options[i].name;
    words[count++] = options[i].value;
  }
  if (question->clocks_apart) words[count++] = "--clocks-apart";
  if (dup2(to, STDOUT_FILENO) >= 0) run_desk_command("causes", (char *const *)words);
  _exit(127);
}

// All that comes through the pipe, ended by 0; NULL: no memory, or too much.
static char *read_all(int from) {
  char *text = malloc(ANSWER_BYTES_MAX + 1);
  size_t used = 0;
  while (text && used < ANSWER_BYTES_MAX) {
    const ssize_t n = read(from, text + used, ANSWER_BYTES_MAX - used);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) break;
    used += (size_t)n;
  }
  if (text) text[used] = '\0';
  return text;
}

static void text_of(const wm_yaml_node *map, const char *key, char *out, size_t capacity) {
  const wm_yaml_node node = wm_yaml_get(map, key);
  out[0] = '\0';
  if (wm_yaml_there(&node) && wm_yaml_string(&node, out, capacity, NULL) != WM_OK) out[0] = '\0';
}

static uint64_t count_of(const wm_yaml_node *map, const char *key) {
  int64_t count = 0;
  const wm_yaml_node node = wm_yaml_get(map, key);
  return wm_yaml_there(&node) && wm_yaml_i64(&node, 0, INT64_MAX, &count, NULL) == WM_OK ? (uint64_t)count : 0;
}

// Whether the answer's causes are such that the filter's states take up whole; the pose is right beside them.
static int are_taken_up(const wm_yaml_node *root) {
  const wm_yaml_node node = wm_yaml_get(root, "taken_up");
  int is_true = 0;
  return wm_yaml_there(&node) && wm_yaml_bool(&node, &is_true, NULL) == WM_OK && is_true;
}

// A finding for each item of a list.
static int take_list(const wm_yaml_node *root, const char *key, wm_finding_id id, wm_severity severity,
                     wm_findings *found) {
  static char what[TEXT_MAX], fix[TEXT_MAX], told[TEXT_MAX];
  const wm_yaml_node list = wm_yaml_get(root, key);
  const size_t count = wm_yaml_is_list(&list) ? wm_yaml_count(&list) : 0;
  text_of(root, "told", told, sizeof told);
  for (size_t i = 0; i < count; i++) {
    const wm_yaml_node item = wm_yaml_item(&list, i);
    text_of(&item, "what", what, sizeof what);
    text_of(&item, "fix", fix, sizeof fix);
    wm_find(found, id, severity, "cause", fix, "%s%s", what,
            id == WM_FOUND_LIKELY_CAUSE ? told
            : i + 1 < count             ? "; or:"
                                        : ": the drive fits with each of these, and cannot tell them apart");
  }
  return count > 0;
}

static void take(const char *json, wm_findings *found, causes_answer *out) {
  wm_yaml *doc;
  if (!json || !json[0] || wm_yaml_parse(json, strlen(json), "waymark causes", &doc, NULL) != WM_OK) return;
  const wm_yaml_node root = wm_yaml_root(doc), applied = wm_yaml_get(&root, "applied");
  out->is_answered = 1;
  out->rows = count_of(&root, "rows");
  out->drives = count_of(&root, "drives");
  const int is_note = are_taken_up(&root) && wm_findings_of(found, WM_SEVERITY_BAD) == 0;
  out->is_found =
      take_list(&root, "causes", WM_FOUND_LIKELY_CAUSE, is_note ? WM_SEVERITY_NOTE : WM_SEVERITY_BAD, found);
  out->is_undecided = take_list(&root, "undecided", WM_FOUND_CAUSE_UNDECIDED, WM_SEVERITY_NOTE, found);
  for (size_t i = 0; i < 2 && wm_yaml_is_list(&applied) && i < wm_yaml_count(&applied); i++) {
    const wm_yaml_node item = wm_yaml_item(&applied, i);
    if (wm_yaml_string(&item, out->applied[i], sizeof out->applied[i], NULL) != WM_OK) out->applied[i][0] = '\0';
  }
  wm_yaml_free(doc);
}

void causes_ask(const causes_question *question, wm_findings *found, causes_answer *out) {
  int ends[2], status = 0;
  *out = (causes_answer){.is_installed = desk_command_is_there("causes")};
  if (!out->is_installed || pipe(ends) != 0) return;
  (void)fflush(stdout);
  const pid_t child = fork();
  if (child == 0) {
    (void)close(ends[0]);
    become(question, ends[1]);
  }
  (void)close(ends[1]);
  out->json = child > 0 ? read_all(ends[0]) : NULL;
  (void)close(ends[0]);
  while (child > 0 && waitpid(child, &status, 0) < 0 && errno == EINTR) continue;
  take(out->json, found, out);
  if (out->is_answered) return;
  free(out->json);
  out->json = NULL;
}
