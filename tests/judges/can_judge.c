// SPDX-License-Identifier: Apache-2.0
// What our readers make of candump lines and DBC files, printed for a judge to compare (tests/judges/can_judge.py).
//
//   can_judge candump < LOG      "t_ns iface id ext remote error fd flags length HEX", or "refused TEXT", a line each
//   can_judge dbc FILE < LOG     every signal that is in each frame: "line MESSAGE SIGNAL VALUE", VALUE by %.17g
//   can_judge list FILE          "MESSAGE id ext length SIGNAL" for each signal
#include <stdio.h>
#include <stdlib.h>

#include "dbc.h"

static char line[1 << 16];

static int next_line(size_t *length) {
  if (!fgets(line, sizeof line, stdin)) return 0;
  *length = strlen(line);
  return 1;
}

static int judge_candump(void) {
  wm_can_frame f;
  wm_error err;
  for (size_t length; next_line(&length);) {
    wm_status status = wm_candump_parse(line, length, &f, &err);
    if (status == WM_AGAIN) continue;
    if (status != WM_OK) {
      printf("refused %s\n", err.text);
      continue;
    }
    printf("%lld %s %X %d %d %d %d %X %u ", (long long)f.t_ns, f.iface, f.id, f.is_extended, f.is_remote, f.is_error,
           f.is_fd, f.fd_flags, f.length);
    for (int i = 0; i < f.length; i++) printf("%02X", f.data[i]);
    printf("\n");
  }
  return 0;
}

static int is_present(const wm_dbc *dbc, const dbc_signal *s, const payload *data, unsigned length) {
  uint32_t above[DBC_SELECTORS_MAX];
  int count = wm_dbc_selectors(dbc, s, above);
  if (count < 0) return 0;
  const dbc_signal *below = s;
  for (int i = 0; i < count; i++) {
    const dbc_signal *selector = &dbc->signals[above[i]];
    if (signal_bytes(&selector->bits) > length) return 0;
    if (!wm_dbc_selects(dbc, below, signal_raw(&selector->bits, data))) return 0;
    below = selector;
  }
  return signal_bytes(&s->bits) <= length;
}

static void print_name(wm_text short_name, wm_text long_name) {
  wm_text name = long_name.length ? long_name : short_name;
  printf("%.*s ", (int)name.length, name.at);
}

static int judge_dbc(const wm_dbc *dbc) {
  wm_can_frame f;
  wm_error err;
  payload data;
  size_t number = 0;
  for (size_t length; next_line(&length); number++) {
    if (wm_candump_parse(line, length, &f, &err) != WM_OK || f.is_error || f.is_remote) continue;
    const dbc_message *m = wm_dbc_find(dbc, dbc_key(f.id, f.is_extended));
    if (!m) continue;
    payload_set(&data, f.data, f.length);
    for (uint32_t i = 0; i < m->signal_count; i++) {
      const dbc_signal *s = &dbc->signals[m->first_signal + i];
      if (!is_present(dbc, s, &data, f.length)) continue;
      printf("%zu ", number);
      print_name(m->name, m->long_name);
      print_name(s->name, s->long_name);
      printf("%.17g\n", signal_number(&s->bits, signal_raw(&s->bits, &data)) * s->factor + s->offset);
    }
  }
  return 0;
}

static int judge_list(const wm_dbc *dbc) {
  for (size_t i = 0; i < dbc->message_count; i++) {
    const dbc_message *m = &dbc->messages[i];
    for (uint32_t k = 0; k < m->signal_count; k++) {
      const dbc_signal *s = &dbc->signals[m->first_signal + k];
      print_name(m->name, m->long_name);
      printf("%X %d %u ", m->id, m->is_extended, m->length);
      print_name(s->name, s->long_name);
      printf("%d %.17g %.17g %.17g %.17g %.*s\n", s->bits.kind, s->factor, s->offset, s->min, s->max,
             (int)s->unit.length, s->unit.at);
    }
  }
  return 0;
}

int main(int argc, char **argv) {
  if (argc == 2 && strcmp(argv[1], "candump") == 0) return judge_candump();
  wm_dbc *dbc = NULL;
  wm_error err;
  if (argc != 3 || (strcmp(argv[1], "dbc") != 0 && strcmp(argv[1], "list") != 0)) {
    fprintf(stderr, "usage: can_judge candump | dbc FILE | list FILE\n");
    return 2;
  }
  if (wm_dbc_load(argv[2], &dbc, &err) != WM_OK) {
    fprintf(stderr, "%s\n", err.text);
    return 1;
  }
  int code = strcmp(argv[1], "dbc") == 0 ? judge_dbc(dbc) : judge_list(dbc);
  wm_dbc_free(dbc);
  return code;
}
