// SPDX-License-Identifier: Apache-2.0
#include "cli/check/edits.h"

#include <ctype.h>
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "waymark/map.h"
#include "waymark/text.h"
#include "waymark/yaml.h"

#define COLUMNS_MAX 64
#define ROW_GROWTH_BYTES 64  // a row's new numbers are longer by at most this

// ── tables ──────────────────────────────────────────────────────────────────────────────────────────────────────────

typedef struct slice {
  const char *at;
  size_t length;
} slice;

static size_t fields_of(slice line, slice out[COLUMNS_MAX]) {
  size_t count = 0;
  const char *end = line.at + line.length;
  for (const char *at = line.at; count < COLUMNS_MAX;) {
    const char *comma = memchr(at, ',', (size_t)(end - at));
    out[count++] = (slice){at, (size_t)((comma ? comma : end) - at)};
    if (!comma) break;
    at = comma + 1;
  }
  return count;
}

static int is_word(slice s, const char *word) { return s.length == strlen(word) && memcmp(s.at, word, s.length) == 0; }

static size_t column_of(const slice *fields, size_t count, const char *name) {
  for (size_t i = 0; i < count; i++)
    if (is_word(fields[i], name)) return i;
  return COLUMNS_MAX;
}

// Takes the next line, without its end, off the text; 0 at its end.
static int take_line(slice *text, slice *line) {
  if (text->length == 0) return 0;
  const char *feed = memchr(text->at, '\n', text->length);
  const size_t used = feed ? (size_t)(feed - text->at) + 1 : text->length;
  *line = (slice){text->at, feed ? used - 1 : used};
  if (line->length > 0 && line->at[line->length - 1] == '\r') line->length--;
  text->at += used;
  text->length -= used;
  return 1;
}

static int32_t new_id(const id_table *ids, int32_t id) {
  for (size_t i = 0; i < ids->count; i++)
    if (ids->from[i] == id) return ids->to[i];
  return id;
}

static size_t write_number(const file_edit *edit, slice field, char *out) {
  int64_t whole;
  double number;
  if (wm_text_to_i64(field.at, field.length, &whole) == WM_TEXT_OK && edit->kind == EDIT_IDS)
    return (size_t)snprintf(out, ROW_GROWTH_BYTES, "%" PRId32, new_id(edit->ids, (int32_t)whole));
  if (wm_text_to_i64(field.at, field.length, &whole) == WM_TEXT_OK && rint(edit->factor) == edit->factor &&
      rint(edit->offset) == edit->offset) {
    int64_t product;
    if (!__builtin_mul_overflow(whole, (int64_t)edit->factor, &product) &&
        !__builtin_add_overflow(product, (int64_t)edit->offset, &product))
      return (size_t)snprintf(out, ROW_GROWTH_BYTES, "%" PRId64, product);
  }
  if (wm_text_to_f64(field.at, field.length, &number) == WM_TEXT_OK)
    return (size_t)snprintf(out, ROW_GROWTH_BYTES, "%.12g", edit->factor * number + edit->offset);
  memcpy(out, field.at, field.length);  // empty, or no number: stays
  return field.length;
}

static size_t write_row(const file_edit *edit, const slice *fields, size_t count, const size_t columns[2], char *out) {
  size_t used = 0;
  for (size_t i = 0; i < count; i++) {
    slice field = fields[i];
    if (edit->kind == EDIT_SWAP && i == columns[0] && columns[1] < count) field = fields[columns[1]];
    if (edit->kind == EDIT_SWAP && i == columns[1] && columns[0] < count) field = fields[columns[0]];
    if (i > 0) out[used++] = ',';
    if (edit->kind != EDIT_SWAP && i == columns[0] && field.length < ROW_GROWTH_BYTES) {
      used += write_number(edit, field, out + used);
    } else {
      memcpy(out + used, field.at, field.length);
      used += field.length;
    }
  }
  out[used++] = '\n';
  return used;
}

typedef struct timed_row {
  int64_t t;
  size_t at;  // in the file
  slice line;
} timed_row;

static int by_time(const void *a, const void *b) {
  const timed_row *x = a, *y = b;
  if (x->t != y->t) return x->t < y->t ? -1 : 1;
  return x->at < y->at ? -1 : 1;
}

static wm_status sort_rows(slice rest, size_t column, size_t rows, char *out, size_t *used) {
  timed_row *all = calloc(rows + 1, sizeof *all);
  if (!all) return WM_IO;
  size_t count = 0;
  slice line, fields[COLUMNS_MAX];
  while (count < rows && take_line(&rest, &line)) {
    const size_t n = fields_of(line, fields);
    all[count] = (timed_row){.at = count, .line = line};
    if (column < n) (void)wm_text_to_i64(fields[column].at, fields[column].length, &all[count].t);
    count++;
  }
  qsort(all, count, sizeof *all, by_time);
  for (size_t i = 0; i < count; i++) {
    memcpy(out + *used, all[i].line.at, all[i].line.length);
    *used += all[i].line.length;
    out[(*used)++] = '\n';
  }
  free(all);
  return WM_OK;
}

static wm_status edit_table(const file_edit *edit, slice text, char **out, size_t *out_length, wm_error *err) {
  slice head, line, names[COLUMNS_MAX], fields[COLUMNS_MAX];
  size_t rows = 1;
  for (size_t i = 0; i < text.length; i++) rows += text.at[i] == '\n';
  if (!take_line(&text, &head)) return wm_fail(err, WM_NOT_FOUND, "%s: is empty", edit->file);
  const size_t count = fields_of(head, names), sensor = column_of(names, count, "sensor");
  const size_t columns[2] = {column_of(names, count, edit->name), column_of(names, count, edit->text)};
  if (columns[0] == COLUMNS_MAX) return wm_fail(err, WM_NOT_FOUND, "%s: has no %s", edit->file, edit->name);
  *out = malloc(head.length + text.length + rows * (ROW_GROWTH_BYTES + 2) + 2);
  if (!*out) return wm_fail(err, WM_IO, "no memory to edit a file");
  memcpy(*out, head.at, head.length);
  size_t used = head.length;
  (*out)[used++] = '\n';
  if (edit->kind == EDIT_SORT) {
    *out_length = used;
    return sort_rows(text, columns[0], rows, *out, out_length);
  }
  while (take_line(&text, &line)) {
    const size_t n = fields_of(line, fields);
    const int is_other = edit->only[0] && sensor < n && !is_word(fields[sensor], edit->only);
    const size_t none[2] = {COLUMNS_MAX, COLUMNS_MAX};
    used += write_row(edit, fields, n, is_other ? none : columns, *out + used);
  }
  *out_length = used;
  return WM_OK;
}

// ── signals ─────────────────────────────────────────────────────────────────────────────────────────────────────────

// Place of the signal's definition "START|LENGTH@ORDER" in the text; NULL: none.
static const char *signal_at(const file_edit *edit, const char *text) {
  int is_inside = edit->only[0] == '\0';
  const size_t length = strlen(edit->name), message = strlen(edit->only);
  for (const char *line = text; line && *line; line = strchr(line, '\n'), line += line ? 1 : 0) {
    const char *at = line + strspn(line, " \t");
    if (strncmp(at, "BO_ ", 4) == 0 && edit->only[0]) {
      at += 4 + strspn(at + 4, " 0123456789");
      is_inside = strncmp(at, edit->only, message) == 0 && (at[message] == ':' || at[message] == ' ');
    } else if (is_inside && strncmp(at, "SG_ ", 4) == 0 && strncmp(at + 4, edit->name, length) == 0 &&
               isspace((unsigned char)at[4 + length])) {
      const char *colon = strchr(at, ':');
      return colon ? colon + 1 + strspn(colon + 1, " ") : NULL;
    }
  }
  return NULL;
}

// First bit of the same bytes in the other order: Intel counts from the lowest bit of the first byte, Motorola begins
// at its highest one.
static int other_start(int start, int is_intel) { return is_intel ? start / 8 * 8 + 7 : start / 8 * 8; }

static wm_status edit_signal(const file_edit *edit, const char *text, size_t length, const char *comment, char **out,
                             size_t *out_length, wm_error *err) {
  char sign = '+', was[120];
  int start, bits, order, used = 0;
  double scale, offset;
  const char *at = signal_at(edit, text);
  // The text is the DBC's own; sscanf reads five numbers, whose limits are looked at.
  if (!at || sscanf(at, "%d|%d@%d%c (%lf,%lf)%n", &start, &bits, &order, &sign, &scale, &offset, &used) < 6 ||
      used == 0 || start < 0 || start > 511)  // NOLINT(cert-err34-c)
    return wm_fail(err, WM_NOT_FOUND, "%s: has no signal %s", edit->file, edit->name);
  (void)snprintf(was, sizeof was, "%.*s", used, at);
  if (edit->layout == LAYOUT_ORDER) start = other_start(start, order);
  if (edit->layout == LAYOUT_ORDER || edit->layout == LAYOUT_ORDER_START) order = !order;
  if (edit->layout == LAYOUT_SIGN) sign = sign == '+' ? '-' : '+';
  start += (int)edit->offset;
  if (start < 0) return wm_fail(err, WM_NOT_FOUND, "%s: no bit before the first", edit->file);
  const size_t room = length + 512, before = (size_t)(at - text);
  *out = malloc(room);
  if (!*out) return wm_fail(err, WM_IO, "no memory to edit a file");
  int n = snprintf(*out, room, "%.*s%d|%d@%d%c (%.9g,%.9g)%s", (int)before, text, start, bits, order, sign,
                   scale * edit->factor, offset * edit->factor, at + used);
  if (n > 0 && comment[0])
    n += snprintf(*out + n, room - (size_t)n, "\nCM_ \"%s: %s was %s\";\n", comment, edit->name, was);
  *out_length = n > 0 ? (size_t)n : 0;
  return WM_OK;
}

// ── pictures ────────────────────────────────────────────────────────────────────────────────────────────────────────

static wm_status edit_picture(const file_edit *edit, const char *bytes, size_t length, char **out, size_t *out_length,
                              wm_error *err) {
  wm_grey picture;
  wm_status status = wm_grey_decode(bytes, length, edit->file, &picture, err);
  if (status != WM_OK) return status;
  const size_t width = picture.width_px, height = picture.height_px, count = width * height;
  for (size_t i = 0; i < count; i++) {
    const size_t row = i / width, column = i % width;
    const size_t other = edit->factor < 0 ? (height - 1 - row) * width + column : row * width + width - 1 - column;
    if (other <= i) continue;
    const uint8_t kept = picture.pixels[i];
    picture.pixels[i] = picture.pixels[other];
    picture.pixels[other] = kept;
  }
  status = wm_grey_encode(&picture, edit->file, (void **)out, out_length, err);
  free(picture.pixels);
  return status;
}

// ── interface ───────────────────────────────────────────────────────────────────────────────────────────────────────

wm_status edit_text(const file_edit *edit, const char *text, size_t length, const char *comment, char **out,
                    size_t *out_length, wm_error *err) {
  *out = NULL;
  if (edit->kind == EDIT_VALUE)
    return wm_yaml_edit(text, length, edit->name, edit->text, comment, out, out_length, err);
  if (edit->kind == EDIT_SIGNAL) return edit_signal(edit, text, length, comment, out, out_length, err);
  if (edit->kind == EDIT_MIRROR) return edit_picture(edit, text, length, out, out_length, err);
  return edit_table(edit, (slice){text, length}, out, out_length, err);
}

void edit_words(const file_edit *edit, char *out, size_t capacity) {
  const char *name = edit->name;
  size_t used = 0;
  out[0] = '\0';
  const id_table *ids = edit->ids;
  int is_reversed = edit->kind == EDIT_IDS && ids->count > 1;
  for (size_t i = 1; is_reversed && i < ids->count; i++)
    is_reversed = ids->from[i] + ids->to[i] == ids->from[0] + ids->to[0];
  switch (edit->kind) {
    case EDIT_SWAP: (void)snprintf(out, capacity, "swap the columns %s and %s", name, edit->text); return;
    case EDIT_SORT: (void)snprintf(out, capacity, "sort the rows by %s", name); return;
    case EDIT_MIRROR:
      (void)snprintf(out, capacity, "mirror the picture (%s)", edit->factor < 0 ? "top and bottom" : "left and right");
      return;
    case EDIT_IDS:
      if (is_reversed) used += (size_t)snprintf(out, capacity, "id = %" PRId32 " - id: ", ids->from[0] + ids->to[0]);
      for (size_t i = 0; i < ids->count && used + 24 < capacity; i++)
        used += (size_t)snprintf(out + used, capacity - used, "%s%" PRId32 " -> %" PRId32, i ? ", " : "id ",
                                 ids->from[i], ids->to[i]);
      return;
    case EDIT_COLUMN:
      if (edit->offset != 0 && edit->factor != 1)
        (void)snprintf(out, capacity, "%s = %.9g %+.9g %s", name, edit->offset, edit->factor, name);
      else if (edit->offset != 0)
        (void)snprintf(out, capacity, "%s %+.12g", name, edit->offset);
      else
        (void)snprintf(out, capacity, "%s times %.9g", name, edit->factor);
      return;
    default: return;
  }
}
