// SPDX-License-Identifier: Apache-2.0
// Loading of DBC files, and searches in them.
#include "dbc.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>

enum { kLargestFile = 16 * 1024 * 1024 };

#define J1939_FORMAT 3      // of VFrameFormat, where the file doesn't list its values
#define NO_ADDRESS 0xFEu    // J1939's null address, which files have where the sender is left open
#define ADDRESS_MASK 0xFFu  // the sender's, the lowest byte of a J1939 id
#define PGN_MASK 0x03FFFF00u
#define DESTINATION_MASK 0xFF00u  // of a PDU1 format: the second byte is below PDU2_FIRST
#define PDU2_FIRST 0xF0u

static int by_id(const void *a, const void *b) {
  const dbc_message *x = a, *y = b;
  uint64_t i = dbc_key(x->id, x->is_extended), j = dbc_key(y->id, y->is_extended);
  return i != j ? (i > j) - (i < j) : (x->line > y->line) - (x->line < y->line);
}

static int by_name(const void *a, const void *b) {
  const dbc_signal *x = a, *y = b;
  int order = text_compare(x->name, y->name);
  return order ? order : (x->line > y->line) - (x->line < y->line);
}

static wm_status sort_signals(const wm_dbc *dbc, const dbc_message *m, wm_error *err) {
  dbc_signal *signals = dbc->signals + m->first_signal;
  if (m->signal_count > 0) qsort(signals, m->signal_count, sizeof *signals, by_name);
  for (size_t k = 1; k < m->signal_count; k++)
    if (text_compare(signals[k].name, signals[k - 1].name) == 0)
      return wm_fail(err, WM_BAD_CONFIG, "%s:%d: SG_ %s: %s has a signal of this name already, in line %d", dbc->path,
                     signals[k].line, wm_text_shown(signals[k].name).text, wm_text_shown(m->name).text,
                     signals[k - 1].line);
  return WM_OK;
}

static int is_same_number(double a, double b) { return a <= b && a >= b; }

static int is_same_signal(const dbc_signal *a, const dbc_signal *b) {
  return text_compare(a->name, b->name) == 0 && signal_same(&a->bits, &b->bits) &&
         text_compare(a->unit, b->unit) == 0 && is_same_number(a->factor, b->factor) &&
         is_same_number(a->offset, b->offset) && a->is_selector == b->is_selector && a->is_selected == b->is_selected &&
         a->selected_by == b->selected_by;
}

// The same message again, as of a file that was put together of several.
static int is_same_message(const wm_dbc *dbc, const dbc_message *a, const dbc_message *b) {
  if (text_compare(a->name, b->name) != 0 || a->length != b->length || a->signal_count != b->signal_count) return 0;
  for (uint32_t i = 0; i < a->signal_count; i++)
    if (!is_same_signal(&dbc->signals[a->first_signal + i], &dbc->signals[b->first_signal + i])) return 0;
  return 1;
}

// By id. Of several messages of one id the first is kept.
static wm_status sort_messages(wm_dbc *dbc, wm_error *err) {
  if (dbc->message_count > 0) qsort(dbc->messages, dbc->message_count, sizeof *dbc->messages, by_id);
  size_t kept = 0;
  for (size_t i = 0; i < dbc->message_count; i++) {
    const dbc_message m = dbc->messages[i];
    const wm_status status = sort_signals(dbc, &m, err);
    if (status != WM_OK) return status;
    dbc_message *before = kept > 0 ? &dbc->messages[kept - 1] : NULL;
    if (!before || dbc_key(m.id, m.is_extended) != dbc_key(before->id, before->is_extended)) {
      dbc->messages[kept++] = m;
    } else if (before->twin_line == 0 && !is_same_message(dbc, before, &m)) {
      before->twin = m.name;
      before->twin_line = m.line;
    }
  }
  dbc->message_count = kept;
  return WM_OK;
}

// "mN" without SG_MUL_VAL_ is selected by the message's only multiplexer that isn't selected itself.
static void find_plain_selectors(wm_dbc *dbc) {
  for (size_t i = 0; i < dbc->message_count; i++) {
    const dbc_message *m = &dbc->messages[i];
    uint32_t end = m->first_signal + m->signal_count, only = DBC_NONE, count = 0;
    for (uint32_t k = m->first_signal; k < end; k++)
      if (dbc->signals[k].is_selector && !dbc->signals[k].is_selected) {
        only = k;
        count++;
      }
    for (uint32_t k = m->first_signal; k < end; k++)
      if (dbc->signals[k].is_selected && dbc->signals[k].selector == DBC_NONE && count == 1)
        dbc->signals[k].selector = only;
  }
}

wm_status wm_dbc_parse(const char *source, size_t length, const char *path, wm_dbc **out, wm_error *err) {
  *out = NULL;
  if (length > kLargestFile) return wm_fail(err, WM_BAD_CONFIG, "%s: larger than 16 MB: not a DBC file", path);
  wm_dbc *dbc = calloc(1, sizeof *dbc);
  if (dbc) dbc->source = malloc(length + 1);
  if (!dbc || !dbc->source) {
    wm_dbc_free(dbc);
    return wm_fail(err, WM_FULL, "%s: no memory", path);
  }
  (void)snprintf(dbc->path, sizeof dbc->path, "%s", path);
  dbc->j1939_format = J1939_FORMAT;
  memcpy(dbc->source, source, length);
  dbc->source[length] = '\0';

  wm_status status = wm_dbc_read(dbc, length, DBC_DEFINITIONS, err);
  if (status == WM_OK) status = sort_messages(dbc, err);
  if (status == WM_OK) status = wm_dbc_read(dbc, length, DBC_DETAILS, err);
  if (status != WM_OK) {
    wm_dbc_free(dbc);
    return status;
  }
  find_plain_selectors(dbc);
  *out = dbc;
  return WM_OK;
}

// NULL where it cannot be read, with the reason in *err.
static char *read_whole(FILE *file, const char *path, size_t *length, wm_error *err) {
  char *source = malloc(kLargestFile + 1);  // untouched pages cost nothing
  if (!source) {
    (void)wm_fail(err, WM_IO, "%s: no memory", path);
    return NULL;
  }
  *length = fread(source, 1, kLargestFile + 1, file);
  if (!ferror(file)) return source;
  (void)wm_fail(err, WM_IO, "%s: cannot be read: %s", path, strerror(errno));
  free(source);
  return NULL;
}

wm_status wm_dbc_load(const char *path, wm_dbc **out, wm_error *err) {
  *out = NULL;
  FILE *file = fopen(path, "rb");
  if (!file)
    return wm_fail(err, errno == ENOENT ? WM_NOT_FOUND : WM_IO, "%s: cannot be opened: %s", path, strerror(errno));
  size_t length = 0;
  char *source = read_whole(file, path, &length, err);
  (void)fclose(file);
  wm_status status = source ? wm_dbc_parse(source, length, path, out, err) : WM_IO;
  free(source);
  return status;
}

void wm_dbc_free(wm_dbc *dbc) {
  if (!dbc) return;
  free(dbc->source);
  free(dbc->messages);
  free(dbc->signals);
  free(dbc->values);
  free(dbc->ranges);
  free(dbc);
}

dbc_message *wm_dbc_find(const wm_dbc *dbc, uint64_t key) {
  size_t low = 0, high = dbc->message_count;
  while (low < high) {
    size_t middle = low + (high - low) / 2;
    dbc_message *m = &dbc->messages[middle];
    uint64_t here = dbc_key(m->id, m->is_extended);
    if (here == key) return m;
    if (here < key) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  return NULL;
}

// SAE J1939-21: priority (3 bits), data page (2), PDU format (8), PDU specific (8), source address (8).
uint32_t wm_j1939_pgn_mask(uint32_t id) {
  const int has_destination = (id >> 16 & 0xFFu) < PDU2_FIRST;
  return has_destination ? PGN_MASK & ~DESTINATION_MASK : PGN_MASK;
}

static int is_j1939(const wm_dbc *dbc, const dbc_message *m) {
  if (!m->is_extended || m->format == DBC_OTHER_FORMAT) return 0;
  return m->format == DBC_J1939 || dbc->default_format == DBC_J1939 || (m->id & ADDRESS_MASK) == NO_ADDRESS;
}

// Where a file has several messages of one PGN, they differ by their sender: the address counts then.
wm_can_match wm_dbc_match(const wm_dbc *dbc, const dbc_message *message) {
  wm_can_match out = {message->id, message->is_extended ? 0x1FFFFFFFu : 0x7FFu, message->is_extended};
  if (!is_j1939(dbc, message)) return out;
  const uint32_t pgn = wm_j1939_pgn_mask(message->id);
  out.mask = pgn;
  for (size_t i = 0; i < dbc->message_count && (message->id & ADDRESS_MASK) != NO_ADDRESS; i++) {
    const dbc_message *other = &dbc->messages[i];
    if (other == message || !is_j1939(dbc, other) || (other->id ^ message->id) & pgn) continue;
    out.mask |= ADDRESS_MASK | ((other->id ^ message->id) & DESTINATION_MASK ? DESTINATION_MASK : 0);
  }
  return out;
}

dbc_signal *wm_dbc_find_signal(const wm_dbc *dbc, const dbc_message *message, wm_text name) {
  size_t low = message->first_signal, high = low + message->signal_count;
  while (low < high) {
    size_t middle = low + (high - low) / 2;
    int order = text_compare(dbc->signals[middle].name, name);
    if (order == 0) return &dbc->signals[middle];
    if (order < 0) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  return NULL;
}

int wm_dbc_selectors(const wm_dbc *dbc, const dbc_signal *signal, uint32_t out[DBC_SELECTORS_MAX]) {
  int count = 0;
  while (signal->is_selected) {
    if (signal->selector == DBC_NONE || count == DBC_SELECTORS_MAX) return -1;
    out[count++] = signal->selector;
    signal = &dbc->signals[signal->selector];
  }
  return count;
}

int wm_dbc_selects(const wm_dbc *dbc, const dbc_signal *selected, uint64_t raw) {
  if (selected->range_count == 0) return raw == selected->selected_by;
  for (uint32_t i = 0; i < selected->range_count; i++) {
    const dbc_range *range = &dbc->ranges[selected->first_range + i];
    if (raw >= range->low && raw <= range->high) return 1;
  }
  return 0;
}
