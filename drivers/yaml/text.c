// SPDX-License-Identifier: Apache-2.0
#include "waymark/text.h"

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

#include "waymark/utf8.h"

#define NUMBER_MAX 63  // letters; a double needs 24
#define WORD_MAX 63    // letters that are compared

static int is_digit(char c) { return c >= '0' && c <= '9'; }

static size_t skip_digits(const char *text, size_t length, size_t i) {
  while (i < length && is_digit(text[i])) i++;
  return i;
}

// [+-] digits [. digits] [e [+-] digits], with at least one digit before the exponent.
static int is_decimal(const char *text, size_t length) {
  size_t i = 0;
  if (i < length && (text[i] == '+' || text[i] == '-')) i++;
  size_t start = i;
  i = skip_digits(text, length, i);
  size_t digits = i - start;
  if (i < length && text[i] == '.') {
    size_t after = i + 1;
    i = skip_digits(text, length, after);
    digits += i - after;
  }
  if (digits == 0) return 0;
  if (i < length && (text[i] == 'e' || text[i] == 'E')) {
    i++;
    if (i < length && (text[i] == '+' || text[i] == '-')) i++;
    size_t exponent = i;
    i = skip_digits(text, length, i);
    if (i == exponent) return 0;
  }
  return i == length;
}

static int spells_not_finite(const char *word, double *out) {
  static const char *const kInfinite[] = {"inf", ".inf", "infinity", NULL};
  double sign = 1.0;
  if (*word == '+' || *word == '-') sign = *word++ == '-' ? -1.0 : 1.0;
  if (strcasecmp(word, "nan") == 0 || strcasecmp(word, ".nan") == 0) {
    *out = (double)NAN;
    return 1;
  }
  for (size_t i = 0; kInfinite[i]; i++) {
    if (strcasecmp(word, kInfinite[i]) != 0) continue;
    *out = sign * HUGE_VAL;
    return 1;
  }
  return 0;
}

wm_text_number wm_text_to_f64(const char *text, size_t length, double *out) {
  char word[NUMBER_MAX + 1];
  if (length == 0 || length > NUMBER_MAX) return WM_TEXT_NOT_A_NUMBER;
  memcpy(word, text, length);
  word[length] = '\0';
  if (!is_decimal(word, length)) return spells_not_finite(word, out) ? WM_TEXT_NOT_FINITE : WM_TEXT_NOT_A_NUMBER;
  double value = strtod(word, NULL);  // no part of Waymark calls setlocale: the decimal point is '.'
  if (!isfinite(value)) return WM_TEXT_TOO_LARGE;
  *out = value;
  return WM_TEXT_OK;
}

wm_text_number wm_text_to_i64(const char *text, size_t length, int64_t *out) {
  size_t i = 0;
  int negative = 0;
  if (i < length && (text[i] == '+' || text[i] == '-')) negative = text[i++] == '-';
  if (i == length || skip_digits(text, length, i) != length) return WM_TEXT_NOT_A_NUMBER;
  int64_t value = 0;  // negative while it is built, because that range is larger by one
  for (; i < length; i++) {
    int digit = text[i] - '0';
    if (value < (INT64_MIN + digit) / 10) return WM_TEXT_TOO_LARGE;
    value = value * 10 - digit;
  }
  if (!negative && value == INT64_MIN) return WM_TEXT_TOO_LARGE;
  *out = negative ? value : -value;
  return WM_TEXT_OK;
}

int wm_word_distance(const char *a, const char *b) {
  int rows[3][WORD_MAX + 1];
  size_t na = strnlen(a, WORD_MAX), nb = strnlen(b, WORD_MAX);
  int *before = rows[0], *last = rows[1], *now = rows[2];
  for (size_t j = 0; j <= nb; j++) last[j] = (int)j;
  for (size_t i = 1; i <= na; i++) {
    now[0] = (int)i;
    for (size_t j = 1; j <= nb; j++) {
      int best = last[j - 1] + (a[i - 1] != b[j - 1]);
      if (last[j] + 1 < best) best = last[j] + 1;
      if (now[j - 1] + 1 < best) best = now[j - 1] + 1;
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] && before[j - 2] + 1 < best)
        best = before[j - 2] + 1;
      now[j] = best;
    }
    int *oldest = before;
    before = last;
    last = now;
    now = oldest;
  }
  return last[nb];
}

const char *wm_word_nearest(const char *word, const char *const *known) {
  const char *nearest = NULL;
  int best = 3;
  for (; *known; known++) {
    int distance = wm_word_distance(word, *known);
    if (distance < best && 2 * (size_t)distance < strlen(word)) {  // most letters are the same
      best = distance;
      nearest = *known;
    }
  }
  return nearest;
}

const char *wm_show_text(const char *text, size_t length, char *out, size_t capacity) {
  size_t used = 0, i = 0;
  size_t room = capacity > 4 ? capacity - 4 : 0;  // for "..." and the terminator
  while (i < length) {
    const unsigned char *s = (const unsigned char *)text + i;
    const size_t n = wm_utf8_shown(s, length - i), bytes = n > 0 ? n : 1;
    if (used + bytes > room) {
      memcpy(out + used, "...", capacity > 4 ? 3 : 0);
      used += capacity > 4 ? 3 : 0;
      break;
    }
    if (n == 0)
      out[used] = '?';
    else
      memcpy(out + used, s, bytes);
    used += bytes;
    i += bytes;
  }
  if (capacity > 0) out[used] = '\0';
  return out;
}

static wm_status read_all(int fd, const char *path, size_t max_bytes, char **out, size_t *length, wm_error *err) {
  size_t used = 0, capacity = 4096;
  char *text = malloc(capacity + 1);
  for (;;) {
    if (!text) return wm_fail(err, WM_IO, "%s: no memory to read it", path);
    ssize_t n = read(fd, text + used, capacity - used);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) {
      free(text);
      return wm_fail(err, WM_IO, "%s: cannot be read: %s", path, strerror(errno));
    }
    if (n == 0) break;
    used += (size_t)n;
    if (used > max_bytes) {
      free(text);
      return wm_fail(err, WM_FULL, "%s: larger than %zu bytes, the most that is read", path, max_bytes);
    }
    if (used < capacity) continue;
    capacity *= 2;
    char *larger = realloc(text, capacity + 1);
    if (!larger) free(text);
    text = larger;
  }
  text[used] = '\0';
  *out = text;
  *length = used;
  return WM_OK;
}

wm_status wm_text_read_file(const char *path, size_t max_bytes, char **out, size_t *length, wm_error *err) {
  *out = NULL;
  *length = 0;
  int fd = open(path, O_RDONLY | O_CLOEXEC);
  if (fd < 0 && errno == ENOENT) return wm_fail(err, WM_NOT_FOUND, "%s: there is no such file", path);
  if (fd < 0) return wm_fail(err, WM_IO, "%s: cannot be opened: %s", path, strerror(errno));
  wm_status status = read_all(fd, path, max_bytes, out, length, err);
  close(fd);
  return status;
}

void wm_json_text(const char *text, FILE *to) {
  (void)fputc('"', to);
  for (const unsigned char *c = (const unsigned char *)text; *c; c++) {
    if (*c == '"' || *c == '\\')
      (void)fprintf(to, "\\%c", *c);
    else if (*c < ' ')
      (void)fprintf(to, "\\u%04x", *c);
    else
      (void)fputc(*c, to);
  }
  (void)fputc('"', to);
}
