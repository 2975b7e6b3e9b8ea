// SPDX-License-Identifier: Apache-2.0
// JSON is a subset of YAML, whose reader is here already.
#include "gpsd_report.h"

#include <float.h>
#include <math.h>
#include <stddef.h>
#include <string.h>

#include "waymark/yaml.h"

#define ATT_LINE_MAX 1024  // bytes; gpsd's longest ATT, with all its fields, is about 600

static const char *const kFixNames[GPSD_FIX_COUNT] = {"fix",
                                                      "fix without corrections",
                                                      "DGPS",
                                                      "RTK fixed",
                                                      "RTK float",
                                                      "dead reckoning of the receiver",
                                                      "GNSS with dead reckoning",
                                                      "surveyed place",
                                                      "simulated fix",
                                                      "P(Y) fix"};

const char *gpsd_fix_name(int fix) { return kFixNames[fix > 0 && fix < GPSD_FIX_COUNT ? fix : 0]; }

// ── fields ──────────────────────────────────────────────────────────────────────────────────────────────────────────

// Days from 1970-01-01 to a date of the Gregorian calendar. Howard Hinnant, chrono-Compatible Low-Level Date
// Algorithms, days_from_civil.
static int64_t days_since_1970(int64_t year, int64_t month, int64_t day) {
  year -= month <= 2;
  const int64_t era = year / 400, of_era = year - era * 400;
  const int64_t of_year = (153 * (month + (month > 2 ? -3 : 9)) + 2) / 5 + day - 1;
  return era * 146097 + of_era * 365 + of_era / 4 - of_era / 100 + of_year - 719468;
}

static int digits(const char *text, size_t from, size_t count, int64_t *out) {
  if (from + count > strlen(text)) return 0;
  *out = 0;
  for (size_t i = from; i < from + count; i++) {
    if (text[i] < '0' || text[i] > '9') return 0;
    *out = *out * 10 + (text[i] - '0');
  }
  return 1;
}

// "2026-11-23T23:50:58.125Z"; WM_TIME_NONE: no such text.
static wm_time_ns utc(const char *text) {
  int64_t year, month, day, hour, minute, second;
  if (!digits(text, 0, 4, &year) || !digits(text, 5, 2, &month) || !digits(text, 8, 2, &day) ||
      !digits(text, 11, 2, &hour) || !digits(text, 14, 2, &minute) || !digits(text, 17, 2, &second))
    return WM_TIME_NONE;
  // 2262 is where 64 bits of nanoseconds end; second 60 is a leap second.
  if (year < 1970 || year > 2261 || month < 1 || month > 12 || day < 1 || day > 31 || hour > 23 || minute > 59 ||
      second > 60)
    return WM_TIME_NONE;
  wm_time_ns fraction_ns = 0, place_ns = WM_NS_PER_S / 10;
  for (size_t i = 20; text[19] == '.' && text[i] >= '0' && text[i] <= '9' && place_ns > 0; i++, place_ns /= 10)
    fraction_ns += (text[i] - '0') * place_ns;
  const int64_t seconds = days_since_1970(year, month, day) * 86400 + hour * 3600 + minute * 60 + second;
  return seconds * WM_NS_PER_S + fraction_ns;
}

static void take_text(const wm_yaml_node *report, const char *key, char *out, size_t capacity) {
  wm_error ignored;
  const wm_yaml_node value = wm_yaml_get(report, key);
  if (!wm_yaml_there(&value) || wm_yaml_string(&value, out, capacity, &ignored) != WM_OK) out[0] = '\0';
}

static gpsd_class class_named(const char *name, size_t length) {
  static const char *const kNames[] = {
      [GPSD_TPV] = "TPV", [GPSD_GST] = "GST", [GPSD_ATT] = "ATT", [GPSD_DEVICE] = "DEVICE", [GPSD_ERROR] = "ERROR"};
  for (int i = GPSD_TPV; i <= GPSD_ERROR; i++)
    if (strlen(kNames[i]) == length && strncmp(name, kNames[i], length) == 0) return (gpsd_class)i;
  return GPSD_OTHER;
}

static gpsd_class class_of(const wm_yaml_node *report) {
  char name[16];
  take_text(report, "class", name, sizeof name);
  return class_named(name, strlen(name));
}

// Whether a line begins with a class that has no reader here. Such lines are not parsed: log batches of gpsd 3.22 to
// 3.25 have a name twice, and SKY reports are the longest and most frequent ones.
static int is_of_no_use(const char *line, size_t length) {
  static const char kBegin[] = "{\"class\":\"";
  const size_t begin = sizeof kBegin - 1;
  if (length < begin || memcmp(line, kBegin, begin) != 0) return 0;
  const char *end = memchr(line + begin, '"', length - begin);
  return end && line[length - 1 - (line[length - 1] == '\r')] == '}' &&
         class_named(line + begin, (size_t)(end - line) - begin) == GPSD_OTHER;
}

#define FIELD(name, field) \
  { name, offsetof(gpsd_report, field) }
static const struct {
  const char *name;
  size_t at;
} kNumbers[] = {FIELD("mode", mode),           FIELD("status", status),
                FIELD("lat", latitude_deg),    FIELD("lon", longitude_deg),
                FIELD("altHAE", ellipsoid_m),  FIELD("alt", alt_m),
                FIELD("epx", east_m),          FIELD("epy", north_m),
                FIELD("eph", across_m),        FIELD("epv", up_m),
                FIELD("speed", speed_mps),     FIELD("track", track_deg),
                FIELD("eps", speed_error_mps), FIELD("epd", track_error_deg),
                FIELD("heading", heading_deg), FIELD("activated", activated)};

// A value that is no number ("nan", a time) leaves the field absent.
static void take_numbers(const wm_yaml_node *report, gpsd_report *out) {
  wm_error ignored;
  for (size_t i = 0; i < sizeof kNumbers / sizeof kNumbers[0]; i++) {
    double *number = (double *)(void *)((char *)out + kNumbers[i].at);
    const wm_yaml_node value = wm_yaml_get(report, kNumbers[i].name);
    if (wm_yaml_there(&value) && wm_yaml_f64(&value, -DBL_MAX, DBL_MAX, number, &ignored) == WM_OK) continue;
    *number = (double)NAN;
  }
}

// gpsd 3.22 writes the time of an ATT with a comma too many before it and none behind it; `out` is without both. 0: no
// room.
static size_t mended(const char *line, size_t length, char *out, size_t capacity) {
  size_t count = 0;
  for (size_t i = 0; i < length; i++) {
    if (count + 2 > capacity) return 0;
    if (i > 0 && line[i] == ',' && line[i - 1] == ',') continue;
    if (i > 1 && line[i] == '"' && line[i - 1] == '"' && line[i - 2] == 'Z') out[count++] = ',';
    out[count++] = line[i];
  }
  return count;
}

static wm_status parse(const char *line, size_t length, wm_yaml **out) {
  char text[ATT_LINE_MAX];
  wm_error ignored;
  const wm_status status = wm_yaml_parse(line, length, "gpsd", out, &ignored);
  if (status == WM_OK) return status;
  const size_t count = mended(line, length, text, sizeof text);
  return count > 0 ? wm_yaml_parse(text, count, "gpsd", out, &ignored) : status;
}

const char *gpsd_report_read(const char *line, size_t length, gpsd_report *out) {
  char time[40] = "";
  wm_yaml *document = NULL;
  memset(out, 0, sizeof *out);
  if (length == 0 || line[0] != '{') return "is not a JSON object";
  if (is_of_no_use(line, length)) return NULL;
  if (parse(line, length, &document) != WM_OK) return "is not valid JSON";
  const wm_yaml_node report = wm_yaml_root(document);
  out->kind = class_of(&report);
  take_text(&report, out->kind == GPSD_DEVICE ? "path" : "device", out->device, sizeof out->device);
  take_text(&report, "message", out->message, sizeof out->message);
  take_text(&report, "time", time, sizeof time);
  out->time_ns = utc(time);
  take_numbers(&report, out);
  wm_yaml_free(document);
  return NULL;
}
