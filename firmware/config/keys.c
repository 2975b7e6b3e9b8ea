// SPDX-License-Identifier: Apache-2.0
#include "config/keys.h"
#include "config/detectors.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "waymark/recording.h"
#include "waymark/streams.h"
#include "waymark/text.h"

#define NO_LIKENESS 100  // above any distance of two keys

static const char *const kFormats[] = {"waymark-config/1", NULL};
static const char *const kSampleAt[] = {"stamp", "next_stamp", NULL};
static const char *const kSightings[] = {"none", "lcm", NULL};
static const char *const kLcmClocks[] = {"here", "sender", NULL};             // wm_lcm_clock
static const char *const kTake[] = {"position", "course", "antennas", NULL};  // wm_gpsd_from
static const char *const kGpsdClocks[] = {"receiver", "utc", NULL};           // wm_gpsd_clock
static const char *const kStamps[] = {"auto", "start", "end", NULL};          // wm_stamp_point

const config_key kConfigKeys[] = {
    {"format", CONFIG_CHOICE, CONFIG_NEEDED, .about = "Version of the format.", .names = kFormats},
    {"estimator", CONFIG_ESTIMATOR, "by sources and maps",
     .about = "Name of the estimator; its parameters stand under the key of its name. Left out, the program chooses "
              "(docs/estimators.md), and reports which."},
    {"sources", CONFIG_LIST, "none",
     .about = "Settings of sources, in the order that holds at equal stamps. See below.", .of = kConfigSourceKeys,
     .max = WM_SOURCES_MAX},
    {"calibration", CONFIG_FILE, "the recording's", .about = "calibration.yaml to take instead of the recording's."},
    {"landmarks", CONFIG_FILE, "the recording's", .about = "landmarks.csv to take instead of the recording's."},
    {"dbc", CONFIG_FILE, "the recording's", .about = "DBC file to take instead of the recording's vehicle.dbc."},
    {"can_signals", CONFIG_FILE, "the recording's", .about = "can-signals.yaml to take instead of the recording's."},
    {"devices", CONFIG_MAP, "none",
     .about = "The robot's own devices, for `waymark run` without a recording. See below.", .of = kConfigDevicesKeys},
    {"map", CONFIG_FILE, "the recording's map/map.yaml",
     .about = "Raster map (a map.yaml) to take instead of the recording's."},
    {"site", CONFIG_PATH, "none",
     .about =
         "A building's folder and the floor where the robot begins, `SITE/FLOOR`: its landmarks, map, origin and saved "
         "points; `SITE` alone: one of its floors. landmark_ekf changes between floors (docs/building.md)."},
    {"initial_pose", CONFIG_MAP, "the recording's",
     .about = "Start pose: `t_ns`, `x_m`, `y_m`, `z_m`, `heading_rad` or `heading_deg`, `qx`, `qy`, `qz`, `qw`, "
              "`sigma_xy_m`, "
              "`sigma_heading_rad` or `sigma_heading_deg`; what is absent is unknown.",
     .names = wm_start_keys},
    {"vision", CONFIG_MAP, "none",
     .about =
         "Detectors on pictures, each with its parameters: `{edges: {}}`. See below. Beside the parameters `cameras: "
         "[NAME]` names the cameras; without it all cameras with pictures are used."},
    {"vision.cascade.classes", CONFIG_LIST, CONFIG_NEEDED,
     .about = "Classes of landmarks, at most 8 (docs/landmarks.md).", .of = kConfigClassKeys,
     .max = WM_CONFIG_CASCADES_MAX},
    {"start.saved_pose", CONFIG_PATH, "none",
     .about = "File that keeps the robot's last pose, on devices: a run begins there, if it isn't older than "
              "start.max_age_s, "
              "whatever `initial_pose` is."},
    {"start.saved_map", CONFIG_PATH, "none",
     .about = "File for the map of `slam`, or of `stereo_ekf` with slam.key_frames, on devices, with its covariances "
              "and the "
              "calibration states. The next run continues "
              "with it, if estimator, parameters and calibration are the same. Its start pose is `start.saved_pose`; "
              "without "
              "one the robot is relocalized in the map."},
    {"black_box.folder", CONFIG_PATH, "none",
     .about =
         "Folder, on devices, for event logs of the last seconds. They are kept when the robot gets lost or a run was "
         "killed, the newest 20 times."},
    {"publish.picture_socket", CONFIG_PATH, "none",
     .about = "Local socket over which `waymark web` gets pictures with what the detectors found, twice a second while "
              "a person "
              "looks (docs/live.md). Its owner and group may read it."},
    {"publish.lcm_url", CONFIG_TEXT, "LCM's own", .about = "LCM provider, e.g. `udpm://239.255.76.67:7667?ttl=0`."},
    {"publish.channel_prefix", CONFIG_TEXT, "WAYMARK_", .about = "What each channel's name begins with."},
    {"commands.socket", CONFIG_PATH, "none",
     .about = "Local datagram socket (a file) on which a run takes set_pose_t, set_floor_t and reset_t, encoded as for "
              "LCM: from "
              "programs of "
              "this computer that may write the file (owner and group)."},
    {0},
};

const config_key kConfigSourceKeys[] = {
    {"name", CONFIG_SOURCE, CONFIG_NEEDED,
     .about = "`can`, `motion`, `motion6`, `increments`, `ticks`, `speeds`, `steering`, `imu`, `heading`, `depth`, "
              "`sightings`, `markers`, `stereo`, `points` or `gnss`; "
              "`sightings:SENSOR` for one "
              "sensor; a detector under `vision`, or `DETECTOR:CAMERA`."},
    {"use", CONFIG_BOOL, "true", .about = "false: the source is not opened."},
    {"lateness_max_ms", CONFIG_NUMBER, "merge.lateness_max_ms",
     .about = "ms, at most merge.horizon_ms. A datum that arrives later than this after its stamp is late, and "
              "dropped. Where neither this nor "
              "merge.lateness_max_ms is given, three late data in a row raise it, up to merge.horizon_ms.",
     .max = 60000},
    {"period_ms", CONFIG_NUMBER, "0",
     .about =
         "ms. Above 0: the source sends nothing within this time after a datum, and the merge does not wait for it.",
     .max = 60000},
    {"ready_after_ms", CONFIG_NUMBER, "0",
     .about =
         "ms. A detector on recorded pictures, in a replay: the arrival of its observations after the picture's. On "
         "devices the measured time of detection counts (`detect` in timing.json).",
     .max = 60000},
    {"sample_at", CONFIG_CHOICE, "stamp",
     .about =
         "`motion` and `motion6` of a recording. next_stamp: a row is stamped with the beginning of the interval over "
         "which "
         "it was measured; its values get the stamp of the next row.",
     .names = kSampleAt},
    {"from_s", CONFIG_NUMBER, "the beginning", .about = "s from the run's first stamp. Earlier data are not taken.",
     .min = -HUGE_VAL, .max = HUGE_VAL},
    {"until_s", CONFIG_NUMBER, "the end", .about = "s from the run's first stamp. Later data are not taken.",
     .min = -HUGE_VAL, .max = HUGE_VAL},
    {0},
};

const config_key kConfigClassKeys[] = {
    {"file", CONFIG_FILE, CONFIG_NEEDED, .about = "Cascade in OpenCV's format (XML)."},
    {"height_m", CONFIG_NUMBER, CONFIG_NEEDED, .about = "m. Height of what the cascade's window shows.", .min = 0.01,
     .max = 100},
    {0},
};

const config_key kConfigDevicesKeys[] = {
    {"can", CONFIG_LIST, "none", .about = "CAN interfaces.", .of = kConfigCanDeviceKeys, .max = WM_CAN_DEVICES_MAX},
    {"cameras", CONFIG_LIST, "none", .about = "Cameras.", .of = kConfigCameraDeviceKeys, .max = WM_CAMERA_DEVICES_MAX},
    {"lcm", CONFIG_LIST, "none", .about = "Streams that other programs send over LCM.", .of = kConfigLcmDeviceKeys,
     .max = WM_LCM_DEVICES_MAX},
    {"gpsd", CONFIG_LIST, "none", .about = "GNSS receivers, by gpsd.", .of = kConfigGpsdDeviceKeys,
     .max = WM_GPSD_DEVICES_MAX},
    {"iio", CONFIG_MAP, "none", .about = "The IMU, by the kernel's IIO.", .of = kConfigIioDeviceKeys},
    {"dvl", CONFIG_MAP, "none",
     .about = "A Doppler velocity log of Water Linked's kind (A50, A125), over TCP: the stream motion6.",
     .of = kConfigDvlDeviceKeys},
    {"sightings", CONFIG_CHOICE, "none", .about = "lcm: another program sends sightings of landmarks (docs/live.md).",
     .names = kSightings},
    {0},
};

const config_key kConfigCanDeviceKeys[] = {
    {"interface", CONFIG_TEXT, CONFIG_NEEDED, .about = "SocketCAN's name of it, e.g. `can0`. It needn't be there yet."},
    {"dbc", CONFIG_FILE, "`dbc` at the top", .about = "DBC file of this bus."},
    {"can_signals", CONFIG_FILE, "`can_signals` at the top",
     .about = "Which signals of this bus are which quantities."},
    {0},
};

const config_key kConfigLcmDeviceKeys[] = {
    {"stream", CONFIG_CHOICE, CONFIG_NEEDED,
     .about =
         "The stream of a recording that another program sends over LCM: motion.csv as motion_t, imu.csv as imu_t ... "
         "(motion-sources.md).",
     .names = wm_stream_names},
    {"channel", CONFIG_TEXT, "the stream's name in capitals", .about = "LCM channel, behind publish.channel_prefix."},
    {"clock", CONFIG_CHOICE, "here",
     .about = "Whose clock `t_ns` is of. here: CLOCK_MONOTONIC of this computer. sender: a monotonic clock of the "
              "sender's own, "
              "followed by the smallest delay.",
     .names = kLcmClocks},
    {"rate_max_hz", CONFIG_NUMBER, "1000", .about = "Messages beyond this rate are dropped.", .max = 10000},
    {0},
};

const config_key kConfigGpsdDeviceKeys[] = {
    {"take", CONFIG_CHOICE, "position",
     .about = "position: the stream gnss, in metres about `gnss: {origin}` of calibration.yaml. course: the stream "
              "heading by "
              "the "
              "velocity's direction, for a robot that only drives forwards. antennas: the stream heading, of a "
              "receiver with "
              "two antennas.",
     .names = kTake},
    {"host", CONFIG_TEXT, "localhost", .about = "Computer on which gpsd runs."},
    {"port", CONFIG_WHOLE, "2947", .about = "Its port.", .min = 1, .max = 65535},
    {"device", CONFIG_PATH, "any", .about = "Of several receivers this one, as gpsd names it, e.g. `/dev/ttyACM0`."},
    {"clock", CONFIG_CHOICE, "receiver",
     .about = "receiver: the receiver's UTC is followed by the smallest delay. utc: this computer's wall clock is set "
              "(chrony "
              "with "
              "the receiver's pulse, NTP), and a delay of the receiver does no harm.",
     .names = kGpsdClocks},
    {"latency_ms", CONFIG_NUMBER, "0",
     .about =
         "ms. Least time from the measurement to its arrival, by the receiver's data sheet and its line: 20 to 200.",
     .max = 5000},
    {"accuracy_scale", CONFIG_NUMBER, "1",
     .about = "Sigmas in gpsd's accuracies (epx, epy, eph, epv, epd), whose confidence depends on the receiver.",
     .min = DBL_MIN, .max = 100},
    {"course_min_mps", CONFIG_NUMBER, "1", .about = "m/s. `take: course`: slower, the velocity's direction is noise.",
     .min = DBL_MIN, .max = 100},
    {"sigma_deg", CONFIG_NUMBER, "1", .about = "deg. `take: antennas`: sigma of the heading.", .min = DBL_MIN,
     .max = 90},
    {0},
};

const config_key kConfigIioDeviceKeys[] = {
    {"device", CONFIG_TEXT, CONFIG_NEEDED,
     .about = "Name of the IMU, as `cat /sys/bus/iio/devices/*/name` prints it. It needn't be there yet."},
    {"trigger", CONFIG_TEXT, "its own", .about = "Name of the trigger that samples it, e.g. of an iio-trig-hrtimer."},
    {"rate_hz", CONFIG_NUMBER, "the driver's", .about = "Sampling rate, one that the driver has.", .max = 10000},
    {0},
};

const config_key kConfigDvlDeviceKeys[] = {
    {"host", CONFIG_TEXT, CONFIG_NEEDED, .about = "Its address, as its web page has it, e.g. `192.168.194.95`."},
    {"port", CONFIG_WHOLE, "16171", .about = "Its port.", .min = 1, .max = 65535},
    {0},
};

const config_key kConfigCameraDeviceKeys[] = {
    {"name", CONFIG_TEXT, CONFIG_NEEDED, .about = "The camera's name in calibration.yaml, which has its size."},
    {"device", CONFIG_PATH, "by card and bus",
     .about = "`/dev/video0`, or a name that stays the same when it is plugged in again: `/dev/v4l/by-id/...`."},
    {"card", CONFIG_TEXT, "as first opened",
     .about = "The model, as `v4l2-ctl -D` prints it: another camera is not taken for this one."},
    {"bus", CONFIG_TEXT, "as first opened", .about = "Where it is plugged in, as `v4l2-ctl -D` prints it."},
    {"libcamera", CONFIG_TEXT, "by V4L2",
     .about = "Instead of device, card and bus: libcamera's identifier, as `cam -l` prints it in brackets (live.md)."},
    {"gst", CONFIG_TEXT, "by V4L2",
     .about = "Instead of device, card and bus: a GStreamer pipeline, e.g. `v4l2src ! videoconvert` (live.md)."},
    {"format", CONFIG_CHOICE, "the driver's", .about = "What the camera sends.", .names = wm_camera_formats},
    {"rate_hz", CONFIG_NUMBER, "the driver's", .about = "Pictures a second.", .max = 1000},
    {"exposure_ms", CONFIG_NUMBER, "the driver's",
     .about = "ms. Exposure, where the driver does not report it: a picture's time is the middle of it.", .max = 1000},
    {"latency_ms", CONFIG_NUMBER, "0", .about = "ms. From the exposure's start or end to the driver's stamp.",
     .max = 1000},
    {"stamp", CONFIG_CHOICE, "auto",
     .about = "The moment that the driver's stamp marks; auto: as the driver reports it.", .names = kStamps},
    {"controls", CONFIG_MAP, "none",
     .about =
         "V4L2 controls by the names of `v4l2-ctl -l`, e.g. `{auto_exposure: 1, gain: 20}`; libcamera's by its own, "
         "whole numbers, e.g. `{AeEnable: 0, ExposureTime: 4000}`."},
    {0},
};

static const config_key *find_key(const config_key *keys, const char *key) {
  while (strcmp(keys->key, key) != 0) keys++;
  return keys;
}

wm_status config_check_keys(const wm_yaml_node *map, const config_key *keys, wm_error *err) {
  const char *names[32] = {NULL};
  for (size_t i = 0; keys[i].key && i + 1 < sizeof names / sizeof names[0]; i++) names[i] = keys[i].key;
  return wm_yaml_check_keys(map, names, WM_YAML_STRICT, NULL, err);
}

wm_status config_number(const wm_yaml_node *map, const config_key *keys, const char *key, double *out, wm_error *err) {
  const config_key *const of = find_key(keys, key);
  wm_yaml_node node = wm_yaml_get(map, key);
  return wm_yaml_there(&node) ? wm_yaml_f64(&node, of->min, of->max, out, err) : WM_OK;
}

wm_status config_whole(const wm_yaml_node *map, const config_key *keys, const char *key, int32_t *out, wm_error *err) {
  const config_key *const of = find_key(keys, key);
  wm_yaml_node node = wm_yaml_get(map, key);
  int64_t value = *out;
  wm_status status = wm_yaml_there(&node) ? wm_yaml_i64(&node, (int64_t)of->min, (int64_t)of->max, &value, err) : WM_OK;
  if (status == WM_OK) *out = (int32_t)value;
  return status;
}

wm_status config_choice(const wm_yaml_node *map, const config_key *keys, const char *key, int32_t *out, wm_error *err) {
  wm_yaml_node node = wm_yaml_get(map, key);
  return wm_yaml_there(&node) ? wm_yaml_choice(&node, find_key(keys, key)->names, out, err) : WM_OK;
}

size_t config_sections(config_section out[CONFIG_SECTIONS_MAX]) {
  out[0] = (config_section){"runtime", "", "", &wm_runtime_params_table};
  for (int i = 0; i < WM_CONFIG_SHARED; i++) {
    const wm_shared_section *const s = &wm_config_shared[i];
    out[1 + i] = (config_section){s->name, s->about, "", s->table};
    snprintf(out[1 + i].prefix, sizeof out[1 + i].prefix, "%s", s->prefix);
  }
  size_t count = 1 + WM_CONFIG_SHARED, estimators;
  const wm_estimator *const *all = wm_estimators(&estimators);
  for (size_t i = 0; i < estimators && count < CONFIG_SECTIONS_MAX; i++, count++) {
    out[count] = (config_section){all[i]->name, all[i]->about, "", &all[i]->params};
    snprintf(out[count].prefix, sizeof out[count].prefix, "%s.", all[i]->name);
  }
  const wm_detector *seen;
  for (size_t i = 0; (seen = config_detector(i)) != NULL && count < CONFIG_SECTIONS_MAX; i++, count++) {
    out[count] = (config_section){.name = seen->name, .about = seen->about, .table = &seen->params};
    snprintf(out[count].prefix, sizeof out[count].prefix, "vision.%s.", seen->name);
  }
  return count;
}

// Calls `take` with each known key, dotted from the top.
static void each_key(void (*take)(void *context, const char *key), void *context) {
  config_section sections[CONFIG_SECTIONS_MAX];
  size_t count = config_sections(sections);
  for (size_t i = 0; kConfigKeys[i].key; i++) take(context, kConfigKeys[i].key);
  for (size_t s = 0; s < count; s++)
    for (size_t i = 0; i < sections[s].table->count; i++) {
      char full[CONFIG_KEY_MAX];
      snprintf(full, sizeof full, "%s%s", sections[s].prefix, sections[s].table->params[i].key);
      take(context, full);
    }
}

// Finds the known key nearest to a wrong one: alike as a whole, else by its last part alone, which also finds a key in
// the wrong section.
typedef struct search {
  const char *wrong;
  int best;  // lower is nearer
  char found[CONFIG_KEY_MAX];
} search;

static const char *last_part(const char *key) {
  const char *dot = strrchr(key, '.');
  return dot ? dot + 1 : key;
}

static int same_section(const char *a, const char *b) {
  size_t n = strcspn(a, ".");
  return n == strcspn(b, ".") && strncmp(a, b, n) == 0;
}

static void consider_one(search *self, const char *full) {
  const char *const known[] = {full, NULL}, *const last[] = {last_part(full), NULL};
  int score = NO_LIKENESS;
  if (wm_word_nearest(self->wrong, known))
    score = wm_word_distance(self->wrong, full);
  else if (strcmp(last_part(self->wrong), last[0]) == 0 || wm_word_nearest(last_part(self->wrong), last))
    score = 10 + 2 * wm_word_distance(last_part(self->wrong), last[0]) + !same_section(self->wrong, full);
  if (score >= self->best) return;
  self->best = score;
  snprintf(self->found, sizeof self->found, "%s", full);
}

// The key and the sections that it stands in.
static void consider(void *context, const char *key) {
  char full[CONFIG_KEY_MAX];
  snprintf(full, sizeof full, "%s", key);
  for (char *dot = full; dot; dot = strrchr(full, '.')) {
    if (dot != full) *dot = '\0';
    consider_one(context, full);
  }
}

// Collects the names that may stand where the wrong key stands.
typedef struct neighbours {
  const char *wrong;
  size_t level;  // bytes of `wrong` before its last part
  size_t used;
  char names[480];  // "a, b, c"
} neighbours;

static int is_listed(const char *names, const char *name, size_t length) {
  for (const char *at = names; (at = strstr(at, name)); at += length)
    if ((at == names || at[-1] == ' ') && (at[length] == ',' || at[length] == '\0')) return 1;
  return 0;
}

static void add_neighbour(void *context, const char *key) {
  neighbours *self = context;
  char name[CONFIG_KEY_MAX];
  if (strncmp(key, self->wrong, self->level) != 0) return;
  int n = snprintf(name, sizeof name, "%.*s", (int)strcspn(key + self->level, "."), key + self->level);
  if (n <= 0 || is_listed(self->names, name, (size_t)n) || self->used + (size_t)n + 3 > sizeof self->names) return;
  self->used +=
      (size_t)snprintf(self->names + self->used, sizeof self->names - self->used, "%s%s", self->used ? ", " : "", name);
}

wm_status config_unknown(const wm_yaml_node *value, int line, wm_error *err) {
  search nearest = {.wrong = value->path, .best = NO_LIKENESS};
  each_key(consider, &nearest);
  if (nearest.best < NO_LIKENESS)
    return wm_fail(err, WM_BAD_CONFIG, "%s:%d: %s: unknown key; did you mean '%s'?", wm_yaml_file(value), line,
                   value->path, nearest.found);
  neighbours here = {.wrong = value->path, .level = (size_t)(last_part(value->path) - value->path)};
  each_key(add_neighbour, &here);
  return wm_fail(err, WM_BAD_CONFIG, "%s:%d: %s: unknown key; known here: %s", wm_yaml_file(value), line, value->path,
                 here.names);
}

// Index of the parameter, or -1.
static int find(const wm_param_table *table, const char *key) {
  for (size_t i = 0; i < table->count; i++)
    if (strcmp(table->params[i].key, key) == 0) return (int)i;
  return -1;
}

static int stands_in(const char *key, const char *group, size_t length) {
  return strncmp(key, group, length) == 0 && key[length] == '.';
}

// Whether a key of the table, or a former one, stands in this group.
static int is_group(const wm_param_table *table, const char *key) {
  size_t n = strlen(key);
  for (size_t i = 0; i < table->count; i++)
    if (stands_in(table->params[i].key, key, n)) return 1;
  for (const wm_param_old *old = table->old; old && old->key; old++)
    if (stands_in(old->key, key, n)) return 1;
  return 0;
}

// A detector's cameras stand beside its parameters.
static int is_cameras(const char *path) {
  size_t n = strlen(path), tail = strlen(".cameras");
  return strncmp(path, "vision.", 7) == 0 && n > tail && strcmp(path + n - tail, ".cameras") == 0;
}

static int is_other_key(const char *path) {
  for (size_t i = 0; kConfigKeys[i].key; i++)
    if (strcmp(kConfigKeys[i].key, path) == 0) return 1;
  return is_cameras(path);
}

static wm_status read_param(const wm_yaml_node *node, const wm_param *param, void *out, wm_error *err) {
  void *field = (char *)out + param->offset;
  double number;
  int64_t whole = 0;
  int32_t choice = 0;
  int yes = 0;
  wm_status status = WM_OK;
  switch (param->type) {
    case WM_PARAM_F64:
      status = wm_yaml_f64(node, param->min, param->max, &number, err);
      if (status == WM_OK) memcpy(field, &number, sizeof number);
      return status;
    case WM_PARAM_I32:
      status = wm_yaml_i64(node, (int64_t)param->min, (int64_t)param->max, &whole, err);
      choice = (int32_t)whole;
      break;
    case WM_PARAM_BOOL:
      status = wm_yaml_bool(node, &yes, err);
      choice = yes;
      break;
    case WM_PARAM_ENUM: status = wm_yaml_choice(node, param->names, &choice, err); break;
  }
  if (status == WM_OK) memcpy(field, &choice, sizeof choice);
  return status;
}

// A section as it is read.
typedef struct reading {
  config_filling *own;
  config_shared *shared;  // NULL: none
  char *warnings;         // WM_CONFIG_WARNINGS_MAX bytes
} reading;

static void warn(char *to, const wm_yaml_node *value, int line, const char *text) {
  size_t used = strlen(to);
  (void)snprintf(to + used, WM_CONFIG_WARNINGS_MAX - used, "%s:%d: %s: %s\n", wm_yaml_file(value), line, value->path,
                 text);
}

static void warn_if_not_read(const reading *self, const config_filling *of, const wm_yaml_node *value, int line,
                             const wm_param *param) {
  char key[CONFIG_KEY_MAX], text[200];
  const wm_estimator *reader = self->shared ? self->shared->reader : NULL;
  if (!reader || of < self->shared->of || of >= self->shared->of + WM_CONFIG_SHARED) return;
  snprintf(key, sizeof key, "%s%s", of->prefix, param->key);
  if (wm_estimator_reads(reader, key)) return;
  int used = snprintf(text, sizeof text, "estimator %s does not take it", reader->name);
  size_t count, others = 0;
  const wm_estimator *const *all = wm_estimators(&count);
  for (size_t i = 0; i < count && used > 0 && (size_t)used < sizeof text; i++)
    if (wm_estimator_reads(all[i], key))
      used += snprintf(text + used, sizeof text - (size_t)used, "%s%s", others++ ? ", " : "; these do: ", all[i]->name);
  warn(self->warnings, value, line, text);
}

static wm_status take_param(const reading *self, config_filling *to, const wm_yaml_node *value, int line, int index,
                            int is_old, wm_error *err) {
  const wm_param *param = &to->table->params[index];
  if (index >= CONFIG_PARAMS_MAX) return wm_yaml_fail(value, err, "there are more parameters than can be read");
  if (to->line[index] && (is_old || to->is_old[index]))
    return wm_yaml_fail(value, err, "'%s%s' is given on line %d, too; keep one of them", to->prefix, param->key,
                        to->line[index]);
  to->line[index] = line;
  to->is_old[index] = (char)is_old;
  warn_if_not_read(self, to, value, line, param);
  return read_param(value, param, to->out, err);
}

// Whether the row is for this key; *tail: the text in place of a `*`.
static int is_of(const wm_param_old *old, const char *key, const char **tail) {
  const size_t n = strcspn(old->key, "*");
  *tail = key + n;
  return strncmp(old->key, key, n) == 0 && (old->key[n] == '*' || key[n] == '\0');
}

// The section and the parameter of the row, -1: no parameter.
static int new_place(const reading *self, const wm_param_old *old, const char *tail, config_filling **to) {
  char key[CONFIG_KEY_MAX];
  *to = self->own;
  if (!old->new_key) return -1;
  snprintf(key, sizeof key, "%.*s%s", (int)strcspn(old->new_key, "*"), old->new_key, tail);
  if (*key != '/') return find(self->own->table, key);
  for (int i = 0; self->shared && i < WM_CONFIG_SHARED; i++) {
    *to = &self->shared->of[i];
    const size_t n = strlen((*to)->prefix);
    if (strncmp(key + 1, (*to)->prefix, n) == 0) return find((*to)->table, key + 1 + n);
  }
  return -1;
}

// A former key of the table. *known: whether there was one.
static wm_status take_old(const reading *self, const wm_yaml_node *value, int line, const char *key, int *known,
                          wm_error *err) {
  char text[400];
  for (const wm_param_old *old = self->own->table->old; old && old->key; old++) {
    const char *tail;
    config_filling *to;
    if (!is_of(old, key, &tail)) continue;
    const int index = new_place(self, old, tail, &to);
    if (index < 0 && old->new_key) continue;
    *known = 1;
    const char *about = old->about ? old->about : "";
    if (!old->new_key) {
      (void)snprintf(text, sizeof text, "is not a parameter any more and is ignored: %s", about);
      warn(self->warnings, value, line, text);
      return WM_OK;
    }
    const int kept = to == self->own || self->shared->reader;
    (void)snprintf(text, sizeof text, "is now '%s%s', and %s%s%s", to->prefix, to->table->params[index].key,
                   kept ? "read as that" : "not read of an estimator that isn't chosen", old->about ? "; " : "", about);
    warn(self->warnings, value, line, text);
    return take_param(self, to, value, line, index, 1, err);
  }
  return WM_OK;
}

static wm_status fill(const reading *self, const wm_yaml_node *map, const char *prefix, wm_error *err) {
  const wm_param_table *table = self->own->table;
  if (wm_yaml_is_list(map) || wm_yaml_is_scalar(map))  // nothing behind the colon is an empty section
    return wm_yaml_fail(map, err, "a map of parameters (KEY: VALUE) is needed");
  for (size_t i = 0; i < wm_yaml_count(map); i++) {
    const char *name;
    int line, known = 1;
    char key[128];
    wm_yaml_node value = wm_yaml_value(map, i, &name, &line);
    snprintf(key, sizeof key, "%s%s", prefix, name);
    const int index = find(table, key);
    wm_status status = WM_OK;
    if (index >= 0) {
      status = take_param(self, self->own, &value, line, index, 0, err);
    } else if (is_group(table, key)) {
      snprintf(key, sizeof key, "%s%s.", prefix, name);
      status = fill(self, &value, key, err);
    } else if (!is_other_key(value.path)) {
      known = 0;
      status = take_old(self, &value, line, key, &known, err);
    }
    if (!known) status = config_unknown(&value, line, err);
    if (status != WM_OK) return status;
  }
  return WM_OK;
}

wm_status config_fill(const wm_yaml_node *map, config_filling *self, const char *prefix, config_shared *shared,
                      char warnings[WM_CONFIG_WARNINGS_MAX], wm_error *err) {
  const reading all = {self, shared, warnings};
  return fill(&all, map, prefix, err);
}
