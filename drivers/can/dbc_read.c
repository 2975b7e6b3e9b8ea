// SPDX-License-Identifier: Apache-2.0
// The statements of a DBC file. The needed ones are parsed strictly: BO_, SG_, SIG_VALTYPE_, SG_MUL_VAL_, VAL_ and the
// long names in BA_. Others are skipped: up to their semicolon, or to the next line that begins a statement.
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#include "dbc.h"
#include "dbc_lexer.h"

enum { kMessageBytesMax = 1785, kMessagesMax = 1 << 16, kSignalsMax = 1 << 20, kDetailsMax = 1 << 20 };
static const uint64_t kExtendedFlag = UINT64_C(1) << 31, kExtendedMax = 0x1FFFFFFF, kStandardMax = 0x7FF;

typedef struct reader {
  wm_dbc *dbc;
  wm_error *err;
  lexer lex;
  token now;
  int line;              // first line of the statement
  dbc_message *message;  // whose signals follow; NULL where none
  int skip_signals;      // of VECTOR__INDEPENDENT_SIG_MSG
} reader;

__attribute__((format(printf, 3, 4))) static wm_status bad(reader *r, int line, const char *format, ...) {
  char what[WM_ERROR_TEXT_MAX];
  va_list args;
  va_start(args, format);
  (void)vsnprintf(what, sizeof what, format, args);
  va_end(args);
  return wm_fail(r->err, WM_BAD_CONFIG, "%s:%d: %s", r->dbc->path, line, what);
}

static void advance(reader *r) { r->now = wm_dbc_lexer_next(&r->lex); }

// "BO_ MESSAGE: expected A, found B".
static wm_status expected(reader *r, const char *statement, wm_text subject, const char *what) {
  int at_line_end = r->now.is_first || r->now.kind == TOKEN_END;
  return bad(r, at_line_end ? r->line : r->now.line, "%s %s: expected %s, found %s%s%s", statement,
             wm_text_shown(subject).text, what, at_line_end ? "the end of the line" : "'",
             at_line_end ? "" : wm_text_shown(r->now.text).text, at_line_end ? "" : "'");
}

static int take(reader *r, int kind) {
  if (r->now.kind != kind) return 0;
  advance(r);
  return 1;
}

static int word_as_u64(wm_text word, uint64_t *out) {
  uint64_t value = 0;
  for (size_t i = 0; i < word.length; i++) {
    if (word.at[i] < '0' || word.at[i] > '9' || value > (UINT64_MAX - 9) / 10) return 0;
    value = value * 10 + (uint64_t)(word.at[i] - '0');
  }
  *out = value;
  return word.length > 0;
}

static int word_as_double(wm_text word, double *out) {
  char digits[64];
  if (word.length == 0 || word.length >= sizeof digits) return 0;
  memcpy(digits, word.at, word.length);
  digits[word.length] = '\0';
  if (strspn(digits, "+-.0123456789eE") != word.length) return 0;
  char *end = NULL;
  *out = strtod(digits, &end);
  return *end == '\0' && isfinite(*out);
}

static int take_u64(reader *r, uint64_t *out) {
  if (r->now.kind != TOKEN_WORD || !word_as_u64(r->now.text, out)) return 0;
  advance(r);
  return 1;
}

static int take_double(reader *r, double *out) {
  if (r->now.kind != TOKEN_WORD || !word_as_double(r->now.text, out)) return 0;
  advance(r);
  return 1;
}

// ── where statements begin and end ──────────────────────────────────────────────────────────────────────────────────

static const char *const kUsualSections[] = {"BO_", "SG_", "VAL_", "CM_", "BA_", "BU_", "BS_", "NS_", "VERSION"};

// VERSION, FILTER, or capitals with an underscore at the end, as all of DBC's sections are written.
static int is_section(wm_text word) {
  if (text_is(word, "VERSION") || text_is(word, "FILTER")) return 1;
  if (word.length < 3 || word.at[word.length - 1] != '_') return 0;
  for (size_t i = 0; i < word.length; i++)
    if (word.at[i] != '_' && (word.at[i] < 'A' || word.at[i] > 'Z')) return 0;
  return 1;
}

static int begins_statement(const token *t) { return t->is_first && t->kind == TOKEN_WORD && is_section(t->text); }

static wm_status skip_statement(reader *r) {
  while (r->now.kind != TOKEN_END && !begins_statement(&r->now)) {
    if (r->now.kind == TOKEN_OPEN_STRING)
      return bad(r, r->now.line, "the string that begins here never ends; a quote (\") is missing");
    if (take(r, ';')) break;
    advance(r);
  }
  return WM_OK;
}

static wm_status skip_line(reader *r) {
  while (r->now.kind != TOKEN_END && !r->now.is_first) {
    if (r->now.kind == TOKEN_OPEN_STRING)
      return bad(r, r->now.line, "the string that begins here never ends; a quote (\") is missing");
    advance(r);
  }
  return WM_OK;
}

// The names that NS_ lists are sections' names, each alone on its line.
static wm_status skip_new_symbols(reader *r) {
  take(r, ':');
  while (r->now.kind == TOKEN_WORD) {
    lexer ahead = r->lex;
    token next = wm_dbc_lexer_next(&ahead);
    if (r->now.is_first && !next.is_first && next.kind != TOKEN_END) return WM_OK;
    advance(r);
  }
  return WM_OK;
}

// ── BO_, SG_ ────────────────────────────────────────────────────────────────────────────────────────────────────────

static void *room_for_one(void *items, size_t count, size_t *room, size_t item_bytes) {
  if (count < *room) return items;
  size_t more = *room ? 2 * *room : 16;
  void *grown = realloc(items, more * item_bytes);
  if (grown) *room = more;
  return grown;
}

#define APPEND(r, items, count, room, item)                                                       \
  do {                                                                                            \
    void *grown_ = room_for_one((r)->dbc->items, (r)->dbc->count, &(r)->dbc->room, sizeof(item)); \
    if (!grown_) return wm_fail((r)->err, WM_FULL, "%s: no memory", (r)->dbc->path);              \
    (r)->dbc->items = grown_;                                                                     \
    (r)->dbc->items[(r)->dbc->count++] = (item);                                                  \
  } while (0)

// BO_ ID NAME: LENGTH [SENDER]
static wm_status read_message(reader *r) {
  dbc_message m = {.line = r->line, .first_signal = (uint32_t)r->dbc->signal_count};
  r->message = NULL;
  r->skip_signals = 0;
  uint64_t id = 0, length = 0;
  if (!take_u64(r, &id)) return expected(r, "BO_", r->now.text, "the message's id, a decimal number");
  m.name = r->now.text;
  if (!take(r, TOKEN_WORD)) return expected(r, "BO_", m.name, "the message's name");
  if (!take(r, ':')) return expected(r, "BO_", m.name, "a colon behind the message's name");
  if (!take_u64(r, &length)) return expected(r, "BO_", m.name, "the length in bytes");
  if (length > kMessageBytesMax)
    return bad(r, m.line, "BO_ %s: %llu bytes; a frame has 0 to 64, and what goes over several frames at most %d",
               wm_text_shown(m.name).text, (unsigned long long)length, kMessageBytesMax);
  if (text_is(m.name, "VECTOR__INDEPENDENT_SIG_MSG")) {  // holds signals that belong to no message
    r->skip_signals = 1;
    return skip_line(r);
  }
  m.is_extended = (id & kExtendedFlag) != 0;
  uint64_t bare = id & ~kExtendedFlag;
  if (bare > kExtendedMax)
    return bad(r, m.line, "BO_ %s: id %llu is above 29 bits", wm_text_shown(m.name).text, (unsigned long long)id);
  if (!m.is_extended && bare > kStandardMax)
    return bad(r, m.line, "BO_ %s: id %llu is above 11 bits; a 29-bit id is written with bit 31 set, as %llu",
               wm_text_shown(m.name).text, (unsigned long long)id, (unsigned long long)(id | kExtendedFlag));
  m.id = (uint32_t)bare;
  m.length = (uint32_t)length;
  if (r->dbc->message_count == kMessagesMax) return bad(r, m.line, "more than %d messages", kMessagesMax);
  APPEND(r, messages, message_count, message_room, m);
  r->message = &r->dbc->messages[r->dbc->message_count - 1];
  return skip_line(r);
}

// M, mN or mNM behind a signal's name.
static wm_status read_multiplexing(reader *r, dbc_signal *s) {
  wm_text word = r->now.text;
  if (text_is(word, "M") || text_is(word, "m")) {  // VW's files have it in lower case
    s->is_selector = 1;
  } else {
    s->is_selector = word.length > 0 && word.at[word.length - 1] == 'M';
    wm_text digits = {word.at + 1, word.length - 1 - s->is_selector};
    if (word.at[0] != 'm' || word.length < 2 || !word_as_u64(digits, &s->selected_by))
      return expected(r, "SG_", s->name, "a colon, or M, m0, m1 ... (multiplexing) and then a colon");
    s->is_selected = 1;
  }
  advance(r);
  return WM_OK;
}

// START|LENGTH@ORDER SIGN
static wm_status read_bits(reader *r, dbc_signal *s) {
  uint64_t start = 0, length = 0;
  if (!take_u64(r, &start) || start >= 8 * kMessageBytesMax)
    return expected(r, "SG_", s->name, "the start bit, as in 0|16@1+");
  if (!take(r, '|')) return expected(r, "SG_", s->name, "a | behind the start bit, as in 0|16@1+");
  token at = r->now;
  if (!take_u64(r, &length)) return expected(r, "SG_", s->name, "the length in bits, as in 0|16@1+");
  if (length < 1 || length > 64)
    return bad(r, at.line, "SG_ %s: a length of %s bits; 1 to 64 are possible", wm_text_shown(s->name).text,
               wm_text_shown(at.text).text);
  if (!take(r, '@')) return expected(r, "SG_", s->name, "an @ behind the length, as in 0|16@1+");
  wm_text order = r->now.text;
  if (r->now.kind != TOKEN_WORD || order.length != 2)
    return expected(r, "SG_", s->name, "byte order and sign: 1+, 1-, 0+ or 0-");
  if (order.at[0] != '0' && order.at[0] != '1')
    return bad(r, r->now.line, "SG_ %s: byte order '%c' is unknown; 1 is Intel (little endian), 0 is Motorola",
               wm_text_shown(s->name).text, wm_text_shown(order).text[0]);
  if (order.at[1] != '+' && order.at[1] != '-')
    return bad(r, r->now.line, "SG_ %s: sign '%c' is unknown; + is unsigned, - is signed", wm_text_shown(s->name).text,
               wm_text_shown(order).text[1]);
  s->bits = (signal_bits){.start = (uint16_t)start,
                          .length = (uint8_t)length,
                          .is_motorola = order.at[0] == '0',
                          .kind = order.at[1] == '-' ? SIGNAL_SIGNED : SIGNAL_UNSIGNED};
  advance(r);
  return WM_OK;
}

// (FACTOR,OFFSET) [MIN|MAX] "UNIT"
static wm_status read_scaling(reader *r, dbc_signal *s) {
  if (!take(r, '(') || !take_double(r, &s->factor) || !take(r, ',') || !take_double(r, &s->offset) || !take(r, ')'))
    return expected(r, "SG_", s->name, "(FACTOR,OFFSET), two numbers with a decimal point");
  if (!take(r, '[') || !take_double(r, &s->min) || !take(r, '|') || !take_double(r, &s->max) || !take(r, ']'))
    return expected(r, "SG_", s->name, "[MIN|MAX], two numbers ([0|0] where there is no range)");
  s->unit = r->now.text;
  if (!take(r, TOKEN_STRING)) return expected(r, "SG_", s->name, "the unit in quotes (\"\" where there is none)");
  return WM_OK;
}

// SG_ NAME [M|mN|mNM] : BITS SCALING [RECEIVERS]
static wm_status read_signal(reader *r) {
  int line = r->line;
  if (r->skip_signals) return skip_line(r);
  dbc_signal s = {.line = line, .name = r->now.text, .selector = DBC_NONE};
  if (!take(r, TOKEN_WORD)) return expected(r, "SG_", r->now.text, "the signal's name");
  if (!r->message)
    return bad(r, line, "SG_ %s: a signal outside of a message; its BO_ line has to stand before it",
               wm_text_shown(s.name).text);
  wm_status status = WM_OK;
  if (r->now.kind == TOKEN_WORD) status = read_multiplexing(r, &s);
  if (status == WM_OK && !take(r, ':')) status = expected(r, "SG_", s.name, "a colon behind the signal's name");
  if (status == WM_OK) status = read_bits(r, &s);
  if (status == WM_OK) status = read_scaling(r, &s);
  if (status != WM_OK) return status;
  if (r->dbc->signal_count == kSignalsMax) return bad(r, line, "more than %d signals", kSignalsMax);
  APPEND(r, signals, signal_count, signal_room, s);
  r->message->signal_count++;
  return skip_line(r);
}

// ── attributes of messages and signals in other sections
// ───────────────────────────────────────────────────────────────

static dbc_message *find_message(const reader *r, uint64_t id) {
  return wm_dbc_find(r->dbc, dbc_key((uint32_t)(id & ~kExtendedFlag), (id & kExtendedFlag) != 0));
}

// ID SIGNAL. 0 where either is unknown, as in some makers' files: the statement is skipped.
static int take_signal(reader *r, const dbc_message **message, dbc_signal **signal) {
  uint64_t id = 0;
  if (!take_u64(r, &id) || r->now.kind != TOKEN_WORD || id > UINT32_MAX) return 0;
  wm_text name = r->now.text;
  advance(r);
  *message = find_message(r, id);
  *signal = *message ? wm_dbc_find_signal(r->dbc, *message, name) : NULL;
  return *signal != NULL;
}

// SIG_VALTYPE_ ID SIGNAL : 0|1|2; integer, float, double
static wm_status read_value_type(reader *r) {
  int line = r->line;
  const dbc_message *m = NULL;
  dbc_signal *s = NULL;
  if (!take_signal(r, &m, &s)) return skip_statement(r);
  uint64_t type = 0;
  take(r, ':');
  if (!take_u64(r, &type) || type > 2)
    return expected(r, "SIG_VALTYPE_", s->name, "0 (integer), 1 (32-bit float) or 2 (64-bit float)");
  if (type > 0) {
    unsigned needed = type == 1 ? 32 : 64;
    if (s->bits.length != needed)
      return bad(r, line, "SIG_VALTYPE_ %s: a float of %u bits, but the signal (line %d) has %u",
                 wm_text_shown(s->name).text, needed, s->line, s->bits.length);
    s->bits.kind = type == 1 ? SIGNAL_FLOAT : SIGNAL_DOUBLE;
  }
  return skip_statement(r);
}

// LOW-HIGH, one word
static int take_range(reader *r, dbc_range *out) {
  wm_text word = r->now.text;
  const char *dash = r->now.kind == TOKEN_WORD ? memchr(word.at, '-', word.length) : NULL;
  if (!dash) return 0;
  wm_text low = {word.at, (size_t)(dash - word.at)}, high = {dash + 1, word.length - low.length - 1};
  if (!word_as_u64(low, &out->low) || !word_as_u64(high, &out->high)) return 0;
  advance(r);
  return 1;
}

// SG_MUL_VAL_ ID SIGNAL MULTIPLEXER 1-1, 3-7;
static wm_status read_selection(reader *r) {
  const dbc_message *m = NULL;
  dbc_signal *s = NULL;
  if (!take_signal(r, &m, &s)) return skip_statement(r);
  const dbc_signal *selector = r->now.kind == TOKEN_WORD ? wm_dbc_find_signal(r->dbc, m, r->now.text) : NULL;
  if (!selector) return expected(r, "SG_MUL_VAL_", s->name, "the name of a multiplexer of the same message");
  advance(r);
  s->is_selected = 1;
  s->selector = (uint32_t)(selector - r->dbc->signals);
  s->first_range = (uint32_t)r->dbc->range_count;
  s->range_count = 0;
  do {
    dbc_range range = {0};
    if (!take_range(r, &range)) return expected(r, "SG_MUL_VAL_", s->name, "ranges of values, as in 1-1, 3-7");
    if (r->dbc->range_count == kDetailsMax) return bad(r, r->now.line, "more than %d ranges", kDetailsMax);
    APPEND(r, ranges, range_count, range_room, range);
    s->range_count++;
  } while (take(r, ','));
  return skip_statement(r);
}

// VAL_ ID SIGNAL 0 "name" 1 "name";
static wm_status read_values(reader *r) {
  const dbc_message *m = NULL;
  dbc_signal *s = NULL;
  if (!take_signal(r, &m, &s)) return skip_statement(r);
  s->first_value = (uint32_t)r->dbc->value_count;
  s->value_count = 0;
  double raw = 0;
  while (take_double(r, &raw)) {
    wm_text name = r->now.text;
    if (!take(r, TOKEN_STRING)) return expected(r, "VAL_", s->name, "a name in quotes behind each value");
    if (raw != floor(raw) || fabs(raw) > 9e15) continue;  // not an integer, so no gear
    if (r->dbc->value_count == kDetailsMax) return bad(r, r->now.line, "more than %d named values", kDetailsMax);
    dbc_value value = {(int64_t)raw, name};
    APPEND(r, values, value_count, value_room, value);
    s->value_count++;
  }
  return skip_statement(r);
}

// BA_DEF_ BO_ "VFrameFormat" ENUM "StandardCAN","ExtendedCAN","reserved","J1939PG";
static wm_status read_definition(reader *r) {
  uint64_t value = 0;
  if (r->now.kind == TOKEN_WORD) advance(r);
  if (!text_is(r->now.text, "VFrameFormat") || !take(r, TOKEN_STRING)) return skip_statement(r);
  if (!take(r, TOKEN_WORD)) return skip_statement(r);
  for (; r->now.kind == TOKEN_STRING; value++) {
    if (text_is(r->now.text, "J1939PG")) r->dbc->j1939_format = value;
    advance(r);
    take(r, ',');
  }
  return skip_statement(r);
}

// The value of VFrameFormat, a number or its name.
static dbc_format frame_format(const reader *r) {
  uint64_t value = 0;
  if (r->now.kind == TOKEN_STRING) return text_is(r->now.text, "J1939PG") ? DBC_J1939 : DBC_OTHER_FORMAT;
  if (r->now.kind != TOKEN_WORD || !word_as_u64(r->now.text, &value)) return DBC_UNSTATED;
  return value == r->dbc->j1939_format ? DBC_J1939 : DBC_OTHER_FORMAT;
}

// BA_DEF_DEF_ "VFrameFormat" "J1939PG";
static wm_status read_default(reader *r) {
  if (text_is(r->now.text, "VFrameFormat") && take(r, TOKEN_STRING) && frame_format(r) == DBC_J1939)
    r->dbc->default_format = DBC_J1939;
  return skip_statement(r);
}

// BA_ "SystemMessageLongSymbol" BO_ ID "name"; BA_ "SystemSignalLongSymbol" SG_ ID SIGNAL "name"; BA_ "VFrameFormat"
// BO_ ID 3;
static wm_status read_attribute(reader *r) {
  wm_text attribute = r->now.text;
  if (!take(r, TOKEN_STRING) || r->now.kind != TOKEN_WORD) return skip_statement(r);
  const int is_format = text_is(attribute, "VFrameFormat");
  if (is_format || text_is(attribute, "SystemMessageLongSymbol")) {
    uint64_t id = 0;
    advance(r);
    dbc_message *m = take_u64(r, &id) && id <= UINT32_MAX ? find_message(r, id) : NULL;
    if (m && is_format) m->format = (uint8_t)frame_format(r);
    if (m && !is_format && r->now.kind == TOKEN_STRING) m->long_name = r->now.text;
  } else if (text_is(attribute, "SystemSignalLongSymbol")) {
    const dbc_message *m = NULL;
    dbc_signal *s = NULL;
    advance(r);
    if (take_signal(r, &m, &s) && r->now.kind == TOKEN_STRING) s->long_name = r->now.text;
  }
  return skip_statement(r);
}

// ── the file ────────────────────────────────────────────────────────────────────────────────────────────────────────

static wm_status unknown_statement(reader *r) {
  shown found = wm_text_shown(r->now.text);
  if (r->now.text.length > 0 && (r->now.text.at[0] == '<' || r->now.text.at[0] == '{'))
    return bad(r, r->now.line, "this is XML or JSON, not DBC; export the database as DBC (cantools convert does it)");
  const char *close = NULL;
  for (size_t i = 0; i < sizeof kUsualSections / sizeof *kUsualSections && r->now.kind == TOKEN_WORD; i++)
    if (wm_text_distance(r->now.text, text_of(kUsualSections[i]), 1) <= 1) close = kUsualSections[i];
  if (close) return bad(r, r->now.line, "expected a statement, found '%s'; did you mean %s?", found.text, close);
  return bad(r, r->now.line, "expected a statement such as BO_, SG_ or VAL_, found '%s'", found.text);
}

static wm_status read_statement(reader *r, dbc_pass pass) {
  wm_text keyword = r->now.text;
  int defining = pass == DBC_DEFINITIONS;
  r->line = r->now.line;
  if (r->now.kind != TOKEN_WORD || !is_section(keyword)) return unknown_statement(r);
  advance(r);
  if (text_is(keyword, "BO_")) return defining ? read_message(r) : skip_line(r);
  if (text_is(keyword, "SG_")) return defining ? read_signal(r) : skip_line(r);
  r->message = NULL;
  r->skip_signals = 0;
  if (text_is(keyword, "NS_")) return skip_new_symbols(r);
  if (defining) return skip_statement(r);
  if (text_is(keyword, "SIG_VALTYPE_")) return read_value_type(r);
  if (text_is(keyword, "SG_MUL_VAL_")) return read_selection(r);
  if (text_is(keyword, "VAL_")) return read_values(r);
  if (text_is(keyword, "BA_DEF_")) return read_definition(r);
  if (text_is(keyword, "BA_DEF_DEF_")) return read_default(r);
  if (text_is(keyword, "BA_")) return read_attribute(r);
  return skip_statement(r);
}

wm_status wm_dbc_read(wm_dbc *dbc, size_t length, dbc_pass pass, wm_error *err) {
  reader r = {.dbc = dbc, .err = err};
  if (memchr(dbc->source, '\0', length))
    return wm_fail(err, WM_BAD_CONFIG, "%s: holds zero bytes: not a DBC text (save it as UTF-8 or Windows-1252)",
                   dbc->path);
  wm_dbc_lexer_start(&r.lex, dbc->source, length);
  advance(&r);
  wm_status status = WM_OK;
  while (status == WM_OK && r.now.kind != TOKEN_END) {
    if (take(&r, ';')) continue;  // a second semicolon does no harm
    status = read_statement(&r, pass);
  }
  return status;
}
