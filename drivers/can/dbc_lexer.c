// SPDX-License-Identifier: Apache-2.0
#include "dbc_lexer.h"

static const char kMarks[] = ":|@()[],;";

// A line ends with LF, CRLF or, in files of old editors, with CR alone.
static int is_line_end(const lexer *self) {
  return *self->at == '\n' || (*self->at == '\r' && (self->at + 1 == self->end || self->at[1] != '\n'));
}

static int is_space(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n' || c == '\f' || c == '\v'; }
static int is_mark(char c) { return c != '\0' && strchr(kMarks, c) != NULL; }

void wm_dbc_lexer_start(lexer *self, const char *source, size_t length) {
  *self = (lexer){source, source + length, 1, 1};
  if (length >= 3 && memcmp(source, "\xEF\xBB\xBF", 3) == 0) self->at += 3;  // UTF-8's byte order mark
}

// A backslash escapes the following quote, as in cantools and CANdb++.
static token read_string(lexer *self) {
  token out = {.kind = TOKEN_STRING, .line = self->line};
  const char *from = ++self->at;
  while (self->at < self->end && *self->at != '"') {
    if (*self->at == '\\' && self->at + 1 < self->end && self->at[1] == '"') self->at++;
    if (is_line_end(self)) self->line++;
    self->at++;
  }
  out.text = (wm_text){from, (size_t)(self->at - from)};
  if (self->at == self->end) {
    out.kind = TOKEN_OPEN_STRING;
  } else {
    self->at++;
  }
  return out;
}

static void skip_blanks_and_comments(lexer *self) {
  for (; self->at < self->end; self->at++) {
    if (is_line_end(self)) {
      self->line++;
      self->is_first = 1;
    } else if (*self->at == '/' && self->at + 1 < self->end && self->at[1] == '/') {  // to the line's end
      while (self->at + 1 < self->end && self->at[1] != '\n' && self->at[1] != '\r') self->at++;
    } else if (!is_space(*self->at)) {
      return;
    }
  }
}

token wm_dbc_lexer_next(lexer *self) {
  skip_blanks_and_comments(self);
  token out = {.kind = TOKEN_END, .line = self->line, .text = {self->at, 0}};
  int is_first = self->is_first;
  self->is_first = 0;
  if (self->at < self->end) {
    const char *from = self->at;
    if (*from == '"') {
      out = read_string(self);
    } else if (is_mark(*from)) {
      self->at++;
      out.kind = (unsigned char)*from;
      out.text.length = 1;
    } else {
      while (self->at < self->end && !is_space(*self->at) && !is_mark(*self->at) && *self->at != '"') self->at++;
      out.kind = TOKEN_WORD;
      out.text.length = (size_t)(self->at - from);
    }
  }
  out.is_first = is_first;
  return out;
}
