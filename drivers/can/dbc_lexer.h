// SPDX-License-Identifier: Apache-2.0
// A DBC file as words, strings and single marks.
#ifndef WM_CAN_DBC_LEXER_H
#define WM_CAN_DBC_LEXER_H

#include "text.h"

// The values of marks are the characters themselves.
enum { TOKEN_END = 0, TOKEN_WORD = 256, TOKEN_STRING, TOKEN_OPEN_STRING };

typedef struct token {
  int kind;
  wm_text text;  // of a string: without its quotes
  int line;      // from 1; of a string that goes over several lines the first
  int is_first;  // the first token of its line
} token;

typedef struct lexer {
  const char *at, *end;
  int line;
  int is_first;
} lexer;

void wm_dbc_lexer_start(lexer *self, const char *source, size_t length);
// At the end always TOKEN_END; TOKEN_OPEN_STRING for an unterminated string. Cost: linear in the text passed.
token wm_dbc_lexer_next(lexer *self);

#endif
