// SPDX-License-Identifier: Apache-2.0
#include "csv.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "waymark/text.h"

#define TIME_LIMIT INT64_C(4000000000000000000)  // ns; differences of two stamps fit into 64 bits

static csv_field trimmed(const char *text, size_t length) {
  while (length > 0 && (*text == ' ' || *text == '\t')) text++, length--;
  while (length > 0 && (text[length - 1] == ' ' || text[length - 1] == '\t')) length--;
  return (csv_field){text, length};
}

static void split(csv_reader *self, const char *text, size_t length) {
  self->fields_found = 0;
  for (;;) {
    const char *comma = memchr(text, ',', length);
    size_t n = comma ? (size_t)(comma - text) : length;
    if (self->fields_found < CSV_FIELDS_MAX) self->fields[self->fields_found] = trimmed(text, n);
    self->fields_found++;
    if (!comma) return;
    text += n + 1;
    length -= n + 1;
  }
}

wm_status csv_fail(const csv_reader *self, wm_error *err, wm_status status, const char *text) {
  return wm_fail(err, status, "%s:%ld: %s", self->lines.path, self->lines.number > 0 ? self->lines.number : 1, text);
}

static wm_status fail_field(const csv_reader *self, wm_error *err, wm_status status, size_t column, csv_field field,
                            const char *why) {
  char shown[WM_SHOW_TEXT_MAX], text[256];
  snprintf(text, sizeof text, "%s: '%s' %s", self->format->columns[column].name,
           wm_show_text(field.text, field.length, shown, sizeof shown), why);
  return csv_fail(self, err, status, text);
}

static wm_status fail_range(const csv_reader *self, wm_error *err, size_t column, csv_field field, double min,
                            double max) {
  char why[96];
  if (min == DBL_MIN)
    snprintf(why, sizeof why, "is outside of what can be (above 0, up to %.10g)", max);
  else
    snprintf(why, sizeof why, "is outside of what can be (%.10g to %.10g)", min, max);
  return fail_field(self, err, WM_NOT_FINITE, column, field, why);
}

wm_status csv_next(csv_reader *self, wm_error *err) {
  for (;;) {
    const char *text;
    size_t length;
    wm_status status = lines_next(&self->lines, &text, &length, &self->line_problem, err);
    if (status != WM_OK) return status;
    csv_field all = trimmed(text, length);
    if (all.length == 0 && !self->line_problem) continue;
    split(self, text, length);
    return WM_OK;
  }
}

static int same(csv_field field, const char *name) {
  return field.length == strlen(name) && memcmp(field.text, name, field.length) == 0;
}

static int find_column(const csv_format *format, csv_field field) {
  for (int i = 0; format->columns[i].name; i++)
    if (same(field, format->columns[i].name)) return i;
  return -1;
}

static const char *columns_of(const csv_format *format, char *out, size_t capacity) {
  size_t used = 0;
  out[0] = '\0';
  for (int i = 0; format->columns[i].name; i++) {
    if (format->columns[i].need == CSV_OPTIONAL) continue;
    int n = snprintf(out + used, capacity - used, "%s%s", used ? "," : "", format->columns[i].name);
    if (n > 0 && used + (size_t)n < capacity) used += (size_t)n;
  }
  return out;
}

static wm_status fail_missing(const csv_reader *self, int column, wm_error *err) {
  char all[192], text[448], shown[WM_SHOW_TEXT_MAX], hint[128] = "";
  const char *const wanted[] = {self->format->columns[column].name, NULL};
  for (size_t i = 0; i < self->field_count; i++) {
    wm_show_text(self->fields[i].text, self->fields[i].length, shown, sizeof shown);
    if (find_column(self->format, self->fields[i]) < 0 && wm_word_nearest(shown, wanted))
      snprintf(hint, sizeof hint, " (the header has '%s': is it meant?)", shown);
  }
  if (self->field_count == 1 && (memchr(self->fields[0].text, ';', self->fields[0].length) ||
                                 memchr(self->fields[0].text, '\t', self->fields[0].length)))
    snprintf(hint, sizeof hint, " (commas part the fields)");
  const unsigned first =
      self->field_count > 0 && self->fields[0].length > 1 ? (unsigned char)self->fields[0].text[0] : 0;
  if (first == 0xFF || first == 0xFE) snprintf(hint, sizeof hint, " (the file is in UTF-16: save it in UTF-8)");
  snprintf(text, sizeof text, "the column '%s' is missing%s; needed in the header, in any order: %s", wanted[0], hint,
           columns_of(self->format, all, sizeof all));
  return csv_fail(self, err, WM_BAD_CONFIG, text);
}

// The missing column of which this is the name without its unit ("bearing" of "bearing_rad"), or NULL.
static const char *begins_missing(const csv_reader *self, const char *shown) {
  const size_t length = strlen(shown);
  for (int i = 0; length > 0 && self->format->columns[i].name; i++)
    if (self->place[i] < 0 && strncmp(self->format->columns[i].name, shown, length) == 0 &&
        self->format->columns[i].name[length] == '_')
      return self->format->columns[i].name;
  return NULL;
}

// An unused column: an error where its name is near a missing one, else a warning.
static wm_status check_unknown(const csv_reader *self, csv_field field, wm_warn_fn warn, void *context, wm_error *err) {
  char shown[WM_SHOW_TEXT_MAX], text[256];
  wm_show_text(field.text, field.length, shown, sizeof shown);
  for (int i = 0; self->format->columns[i].name; i++) {
    const char *const known[] = {self->format->columns[i].name, NULL};
    if (self->place[i] >= 0 || !wm_word_nearest(shown, known)) continue;
    snprintf(text, sizeof text, "unknown column '%s'; did you mean '%s'?", shown, known[0]);
    return csv_fail(self, err, WM_BAD_CONFIG, text);
  }
  if (warn) {
    const char *meant = begins_missing(self, shown);
    snprintf(text, sizeof text, "%s:1: unknown column '%s', ignored%s%s%s", self->lines.path, shown,
             meant ? "; did you mean '" : "", meant ? meant : "", meant ? "'?" : "");
    warn(context, meant ? WM_NOTE_MISSPELT : WM_NOTE_UNUSED, text);
  }
  return WM_OK;
}

static wm_status read_header(csv_reader *self, wm_warn_fn warn, void *context, wm_error *err) {
  char text[320], all[192];
  const csv_column *columns = self->format->columns;
  wm_status status = csv_next(self, err);
  if (status == WM_IO) return status;
  if (status == WM_END || self->line_problem) {
    snprintf(text, sizeof text, "no header line; needed: %s", columns_of(self->format, all, sizeof all));
    return csv_fail(self, err, WM_BAD_CONFIG, text);
  }
  if (self->fields_found > CSV_FIELDS_MAX) return csv_fail(self, err, WM_BAD_CONFIG, "more than 64 columns");
  self->field_count = self->fields_found;
  for (size_t f = 0; f < self->field_count; f++) {
    int column = find_column(self->format, self->fields[f]);
    if (column < 0) continue;
    if (self->place[column] >= 0) {
      snprintf(text, sizeof text, "the column '%s' appears twice", columns[column].name);
      return csv_fail(self, err, WM_BAD_CONFIG, text);
    }
    self->place[column] = (int)f;
  }
  int alternatives = 0, have = 0;
  for (int i = 0; columns[i].name; i++) {
    if (columns[i].need == CSV_ONE_OF) alternatives++, have += self->place[i] >= 0;
    if (columns[i].need >= CSV_MAY_EMPTY && columns[i].need != CSV_ONE_OF && self->place[i] < 0)
      return fail_missing(self, i, err);
  }
  for (int i = 0; alternatives && !have && columns[i].name; i++)
    if (columns[i].need == CSV_ONE_OF) return fail_missing(self, i, err);
  for (size_t f = 0; f < self->field_count; f++) {
    if (find_column(self->format, self->fields[f]) >= 0) continue;
    if (self->fields[f].length == 0) {
      snprintf(text, sizeof text, "column %zu has no name", f + 1);
      return csv_fail(self, err, WM_BAD_CONFIG, text);
    }
    status = check_unknown(self, self->fields[f], warn, context, err);
    if (status != WM_OK) return status;
  }
  return WM_OK;
}

wm_status csv_open(csv_reader *self, const char *path, const csv_format *format, wm_warn_fn warn, void *context,
                   wm_error *err) {
  memset(self, 0, sizeof *self);
  self->format = format;
  for (int i = 0; i < CSV_COLUMNS_MAX; i++) self->place[i] = -1;
  wm_status status = lines_open(&self->lines, path, err);
  if (status != WM_OK) return status;
  status = read_header(self, warn, context, err);
  if (status != WM_OK) csv_close(self);
  return status;
}

void csv_close(csv_reader *self) { lines_close(&self->lines); }

csv_field csv_name(const csv_reader *self) {
  for (int i = 0; self->format->columns[i].name; i++) {
    if (self->format->columns[i].type != CSV_NAME) continue;
    size_t found = self->fields_found < CSV_FIELDS_MAX ? self->fields_found : CSV_FIELDS_MAX;
    if (!self->line_problem && self->place[i] >= 0 && (size_t)self->place[i] < found)
      return self->fields[self->place[i]];
  }
  return (csv_field){"", 0};
}

#define STAMP_DIGITS_MAX 24  // of a stamp without its sign; 64 bits have 19

// "1700000000.0" and "1.7e+18", as programs write whole numbers that they hold as floating point, exactly: by their
// digits. WM_TEXT_NOT_A_NUMBER where there is a fraction.
static wm_text_number whole_of_decimal(csv_field field, int64_t *out) {
  char digits[STAMP_DIGITS_MAX + 2];
  double value;
  int64_t exponent = 0, behind_point = 0;
  size_t used = 0, i = 0;
  int has_point = 0;
  if (wm_text_to_f64(field.text, field.length, &value) != WM_TEXT_OK) return WM_TEXT_NOT_A_NUMBER;
  for (; i < field.length && field.text[i] != 'e' && field.text[i] != 'E'; i++) {
    if (field.text[i] == '.') {
      has_point = 1;
      continue;
    }
    if (used == STAMP_DIGITS_MAX) return WM_TEXT_NOT_A_NUMBER;
    digits[used++] = field.text[i];
    behind_point += has_point;
  }
  i += i + 1 < field.length && field.text[i + 1] == '+';
  if (i < field.length && wm_text_to_i64(field.text + i + 1, field.length - i - 1, &exponent) != WM_TEXT_OK)
    return WM_TEXT_NOT_A_NUMBER;
  for (; behind_point > exponent && used > 1; behind_point--)
    if (digits[--used] != '0') return WM_TEXT_NOT_A_NUMBER;
  for (; behind_point < exponent; exponent--) {
    if (used == STAMP_DIGITS_MAX) return WM_TEXT_TOO_LARGE;
    digits[used++] = '0';
  }
  return behind_point == exponent ? wm_text_to_i64(digits, used, out) : WM_TEXT_NOT_A_NUMBER;
}

static wm_status read_whole(const csv_reader *self, size_t column, csv_field field, int64_t *out, wm_error *err) {
  const csv_column *c = &self->format->columns[column];
  int64_t min = c->type == CSV_TIME ? -TIME_LIMIT : (int64_t)c->min,
          max = c->type == CSV_TIME ? TIME_LIMIT : (int64_t)c->max;
  wm_text_number kind = wm_text_to_i64(field.text, field.length, out);
  if (kind == WM_TEXT_NOT_A_NUMBER) kind = whole_of_decimal(field, out);
  if (kind == WM_TEXT_NOT_A_NUMBER) return fail_field(self, err, WM_BAD_DATA, column, field, "is not a whole number");
  if (kind == WM_TEXT_OK && *out >= min && *out <= max) return WM_OK;
  return fail_range(self, err, column, field, (double)min, (double)max);
}

static wm_status read_number(const csv_reader *self, size_t column, csv_field field, double *out, wm_error *err) {
  const csv_column *c = &self->format->columns[column];
  wm_text_number kind = wm_text_to_f64(field.text, field.length, out);
  if (kind == WM_TEXT_NOT_A_NUMBER) return fail_field(self, err, WM_BAD_DATA, column, field, "is not a number");
  if (kind == WM_TEXT_NOT_FINITE) return fail_field(self, err, WM_NOT_FINITE, column, field, "is not a finite number");
  if (kind == WM_TEXT_OK && *out >= c->min && *out <= c->max) return WM_OK;
  return fail_range(self, err, column, field, c->min, c->max);
}

// What a field that was refused shows: a stamp of seconds, an angle or another number beyond its limits.
static wm_row_problem problem_of(const csv_column *column, csv_field field, wm_status status) {
  double value;
  const size_t length = strlen(column->name);
  if (wm_text_to_f64(field.text, field.length, &value) != WM_TEXT_OK) return WM_ROW_OTHER;
  if (status == WM_BAD_DATA) return column->type == CSV_TIME ? WM_ROW_STAMP_OF_SECONDS : WM_ROW_OTHER;
  const int is_angle = length > 4 && strcmp(column->name + length - 4, "_rad") == 0 && fabs(value) > column->max;
  return is_angle ? WM_ROW_ANGLE : WM_ROW_VALUE;
}

wm_status csv_read(csv_reader *self, csv_row *row, wm_error *err) {
  char text[96];
  self->problem = WM_ROW_OTHER;
  if (self->line_problem) return csv_fail(self, err, WM_BAD_DATA, self->line_problem);
  if (self->fields_found != self->field_count) {
    snprintf(text, sizeof text, "%zu fields where the header has %zu", self->fields_found, self->field_count);
    return csv_fail(self, err, WM_BAD_DATA, text);
  }
  row->line = self->lines.number;
  row->name = "", row->name_length = 0;
  for (size_t i = 0; self->format->columns[i].name; i++) {
    const csv_column *column = &self->format->columns[i];
    csv_field field = self->place[i] >= 0 ? self->fields[self->place[i]] : (csv_field){"", 0};
    row->whole[i] = WM_TIME_NONE;
    row->number[i] = (double)NAN;
    if (field.length == 0 && column->need == CSV_NEEDED) {
      snprintf(text, sizeof text, "%s: is empty, but needed", column->name);
      return csv_fail(self, err, WM_BAD_DATA, text);
    }
    if (field.length == 0) continue;
    wm_status status = WM_OK;
    if (column->type == CSV_NAME)
      row->name = field.text, row->name_length = field.length;
    else if (column->type == CSV_NUMBER)
      status = read_number(self, i, field, &row->number[i], err);
    else
      status = read_whole(self, i, field, &row->whole[i], err);
    if (status == WM_OK) continue;
    self->problem = problem_of(column, field, status);
    return status;
  }
  return WM_OK;
}
