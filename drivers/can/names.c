// SPDX-License-Identifier: Apache-2.0
#include "names.h"

enum { kLongestName = 128, kWordsMax = 12 };

// A name in capitals, cut into its words: "Gear 1 | Engaged" is GEAR, 1, ENGAGED.
typedef struct words {
  char letters[kLongestName];
  const char *word[kWordsMax];
  int count;
} words;

static int is_letter(char c) { return (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9'); }

static void split(wm_text name, words *out) {
  size_t n = name.length < kLongestName - 1 ? name.length : kLongestName - 1;
  out->count = 0;
  for (size_t i = 0; i < n; i++) {
    char c = name.at[i];
    if (c >= 'a' && c <= 'z') c = (char)(c - 'a' + 'A');
    int inside = is_letter(c);
    out->letters[i] = inside ? c : '\0';
    int begins = inside && (i == 0 || out->letters[i - 1] == '\0');
    if (begins && out->count < kWordsMax) out->word[out->count++] = out->letters + i;
  }
  out->letters[n] = '\0';
}

static int is_one_of(const char *word, const char *const *list) {
  for (; *list; list++)
    if (strcmp(word, *list) == 0) return 1;
  return 0;
}

static int begins_with_one_of(const char *word, const char *const *list) {
  for (; *list; list++)
    if (strncmp(word, *list, strlen(*list)) == 0) return 1;
  return 0;
}

static int all_digits(const char *word) { return *word && strspn(word, "0123456789") == strlen(word); }

int wm_gear_direction(wm_text name, double *direction) {
  static const char *const kAbout[] = {"GEAR", "GANG", "LEVER", "SELECTOR", "SHIFTER", "POSITION", "POS", NULL};
  static const char *const kForward[] = {"D", "DRIVE", "FORWARD", "FORWARDS", "FWD", "F",   "S", "SPORT",
                                         "B", "L",     "LOW",     "MANUAL",   "M",   "ECO", NULL};
  static const char *const kReverse[] = {"R", "REVERSE", "REV", "BACKWARD", "BACKWARDS", "BACK", NULL};
  static const char *const kStanding[] = {"N", "NEUTRAL", "P", "PARK", "PARKING", "PARKED", NULL};
  words w;
  split(name, &w);
  int i = 0;
  while (i < w.count && is_one_of(w.word[i], kAbout)) i++;
  if (i == w.count) return 0;
  const char *word = w.word[i];
  int numbered = strchr("DSFM", *word) && all_digits(word + 1);     // D1, S4, M2
  int counted = *word >= '1' && *word <= '9' && strlen(word) <= 3;  // 1, 2nd, 10
  if (is_one_of(word, kForward) || numbered || counted) {
    *direction = 1.0;
  } else if (is_one_of(word, kReverse)) {
    *direction = -1.0;
  } else if (is_one_of(word, kStanding)) {
    *direction = 0.0;
  } else {
    return 0;
  }
  return 1;
}

int wm_means_no_value(wm_text name) {
  static const char *const kNot[] = {"NO", "OK", "VALID", "WITHOUT", NULL};
  static const char *const kGone[] = {"SNA",    "INVALID", "UNAVAIL", "NOTAVAIL",  "ERROR",   "FAULT",     "FAIL",
                                      "FEHLER", "INIT",    "UNDEF",   "UNGUELTIG", "UNKNOWN", "UNBEKANNT", NULL};
  static const char *const kMissing[] = {"AVAIL", "DEFINED", "VALID", "PRESENT", NULL};
  words w;
  split(name, &w);
  if (w.count > 0 && is_one_of(w.word[0], kNot)) return 0;
  for (int i = 0; i < w.count; i++) {
    if (begins_with_one_of(w.word[i], kGone)) return 1;
    if (i > 0 && strcmp(w.word[i - 1], "NOT") == 0 && begins_with_one_of(w.word[i], kMissing)) return 1;
  }
  return 0;
}

int wm_counter_likeness(wm_text name) {
  static const char *const kSurely[] = {"ALIV", "ROLL", "MSGCOUNT", "MSGCNT", "MSG_COUNT", "MSG_CNT", NULL};
  static const char *const kLikely[] = {"COUNT", "CNT", "ZAEHLER", "SEQ", NULL};
  static const char *const kWheel[] = {"WHEEL", "TICK", "PULS", "IMP", "ODO", "DIST", "ENC", "LEFT", "RIGHT", NULL};
  char capitals[kLongestName];
  size_t n = name.length < kLongestName - 1 ? name.length : kLongestName - 1;
  for (size_t i = 0; i < n; i++)
    capitals[i] = (char)(name.at[i] >= 'a' && name.at[i] <= 'z' ? name.at[i] - 'a' + 'A' : name.at[i]);
  capitals[n] = '\0';
  for (int i = 0; kSurely[i]; i++)
    if (strstr(capitals, kSurely[i])) return 2;
  for (int i = 0; kWheel[i]; i++)  // these signals count distance, not messages
    if (strstr(capitals, kWheel[i])) return 0;
  for (int i = 0; kLikely[i]; i++)
    if (strstr(capitals, kLikely[i])) return 1;
  return 0;
}
