// SPDX-License-Identifier: Apache-2.0
#include "iio_setup.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define ATTRIBUTE_MAX 256
#define BUFFER_SCANS "256"  // 0.25 s at 1 kHz: longer than a normal thread waits for a processor

static const struct {
  const char *element, *kind;
} kChannels[IIO_CHANNELS] = {
    [IIO_WX] = {"in_anglvel_x", "in_anglvel"},  [IIO_WY] = {"in_anglvel_y", "in_anglvel"},
    [IIO_WZ] = {"in_anglvel_z", "in_anglvel"},  [IIO_AX] = {"in_accel_x", "in_accel"},
    [IIO_AY] = {"in_accel_y", "in_accel"},      [IIO_AZ] = {"in_accel_z", "in_accel"},
    [IIO_TEMPERATURE] = {"in_temp", "in_temp"}, [IIO_TIMESTAMP] = {"in_timestamp", "in_timestamp"},
};

// ── attributes ──────────────────────────────────────────────────────────────────────────────────────────────────────

// The attribute's text without its line's end; 0: there is none.
static int attribute(const char *folder, const char *name, char out[ATTRIBUTE_MAX]) {
  char path[700];
  (void)snprintf(path, sizeof path, "%s/%s", folder, name);
  FILE *f = fopen(path, "re");
  if (!f) return 0;
  const int is_read = fgets(out, ATTRIBUTE_MAX, f) != NULL;
  (void)fclose(f);
  if (is_read) out[strcspn(out, "\n")] = '\0';
  return is_read;
}

static int is_attribute(const char *folder, const char *name) {
  char path[700];
  (void)snprintf(path, sizeof path, "%s/%s", folder, name);
  return access(path, F_OK) == 0;
}

// 0, or errno.
static int set(const char *folder, const char *name, const char *text) {
  char path[700];
  (void)snprintf(path, sizeof path, "%s/%s", folder, name);
  const int fd = open(path, O_WRONLY | O_TRUNC | O_CLOEXEC);
  if (fd < 0) return errno;
  const size_t length = strlen(text);
  const int failed = write(fd, text, length) == (ssize_t)length ? 0 : errno;
  (void)close(fd);
  return failed;
}

static double number_of(const char *folder, const char *name, double otherwise) {
  char text[ATTRIBUTE_MAX];
  return attribute(folder, name, text) ? strtod(text, NULL) : otherwise;
}

// Of the channel, of all of its kind, or of the device: "in_anglvel_x_scale", "in_anglvel_scale", "in_scale".
static double shared_number(const char *folder, int channel, const char *what, double otherwise) {
  char name[64];
  (void)snprintf(name, sizeof name, "in_%s", what);
  double value = number_of(folder, name, otherwise);
  (void)snprintf(name, sizeof name, "%s_%s", kChannels[channel].kind, what);
  value = number_of(folder, name, value);
  (void)snprintf(name, sizeof name, "%s_%s", kChannels[channel].element, what);
  return number_of(folder, name, value);
}

// ── finding ─────────────────────────────────────────────────────────────────────────────────────────────────────────

// Calls of a folder's entries that begin with `begins`, until one returns 1. Returns what the last one did.
static int each_entry(const char *folder, const char *begins, int (*call)(void *context, const char *entry),
                      void *context) {
  DIR *all = opendir(folder);
  if (!all) return 0;
  int is_found = 0;
  for (struct dirent *entry; !is_found && (entry = readdir(all));)
    if (strncmp(entry->d_name, begins, strlen(begins)) == 0) is_found = call(context, entry->d_name);
  (void)closedir(all);
  return is_found;
}

// A search for a device or a trigger by its name in sysfs.
typedef struct search {
  const char *folder, *wanted;
  int is_prefix;  // any name that begins so
  char entry[32], name[64];
  char others[160];  // names that are there
} search;

static int look_at(void *context, const char *entry) {
  search *self = context;
  char folder[600], name[ATTRIBUTE_MAX];
  (void)snprintf(folder, sizeof folder, "%s/%s", self->folder, entry);
  if (!attribute(folder, "name", name)) return 0;
  const size_t used = strlen(self->others);
  (void)snprintf(self->others + used, sizeof self->others - used, "%s%.40s", used ? ", " : "", name);
  const int is_it = self->is_prefix ? strncmp(name, self->wanted, strlen(self->wanted)) == 0
                                    : strcmp(name, self->wanted) == 0 || strcmp(entry, self->wanted) == 0;
  if (!is_it) return 0;
  (void)snprintf(self->entry, sizeof self->entry, "%.31s", entry);
  (void)snprintf(self->name, sizeof self->name, "%.63s", name);
  return 1;
}

static const char *find(const wm_iio_device_config *config, iio_setup *out, char *text, size_t room) {
  char devices[300];
  (void)snprintf(devices, sizeof devices, "%s/sys/bus/iio/devices", out->root);
  search wanted = {.folder = devices, .wanted = config->device};
  out->is_there = each_entry(devices, "iio:device", look_at, &wanted);
  if (!out->is_there) {
    (void)snprintf(text, room, "there is no IIO device '%s' (%s%s); `iio_info`, `dmesg | grep -i iio`", config->device,
                   wanted.others[0] ? "there are: " : "there is none", wanted.others);
    return text;
  }
  (void)snprintf(out->name, sizeof out->name, "%s", wanted.entry);
  (void)snprintf(out->folder, sizeof out->folder, "%s/%s", devices, wanted.entry);
  return NULL;
}

// ── channels ────────────────────────────────────────────────────────────────────────────────────────────────────────

static int channel_of(const char *element) {
  for (int i = 0; i < IIO_CHANNELS; i++) {
    const size_t length = strlen(kChannels[i].element);
    // "in_temp0", "in_temp_object": any temperature
    if (strcmp(element, kChannels[i].element) == 0 ||
        (i == IIO_TEMPERATURE && strncmp(element, kChannels[i].element, length) == 0))
      return i;
  }
  return -1;
}

typedef struct elements {
  const char *folder;
  int takes_all;  // those that are not switched on, too: they will be
  size_t count;
  iio_element list[IIO_ELEMENTS_MAX];
  int channel[IIO_ELEMENTS_MAX];  // by the element's index in the list before the layout; -1: another one
  char broken[80];                // an attribute that can't be read
} elements;

static int take_element(void *context, const char *entry) {
  elements *self = context;
  char name[80], element[64], text[ATTRIBUTE_MAX];
  const size_t length = strlen(entry);
  if (length < 4 || length >= sizeof element || strcmp(entry + length - 3, "_en") != 0) return 0;
  (void)snprintf(element, sizeof element, "%.*s", (int)(length - 3), entry);
  const int channel = channel_of(element);
  const int is_on = attribute(self->folder, entry, text) && text[0] == '1';
  if (!is_on && !(self->takes_all && channel >= 0)) return 0;
  if (self->count == IIO_ELEMENTS_MAX) return 0;
  iio_element *out = &self->list[self->count];
  (void)snprintf(name, sizeof name, "%s_type", element);
  if (!attribute(self->folder, name, text) || !iio_type_read(text, &out->type))
    (void)snprintf(self->broken, sizeof self->broken, "%s", name);
  (void)snprintf(name, sizeof name, "%s_index", element);
  out->index = (int)number_of(self->folder, name, -1);
  self->channel[self->count++] = channel;
  return 0;
}

static const char *read_channels(iio_setup *out, int takes_all, char *text, size_t room) {
  char folder[500];
  (void)snprintf(folder, sizeof folder, "%s/scan_elements", out->folder);
  elements found = {.folder = folder, .takes_all = takes_all};
  (void)each_entry(folder, "in_", take_element, &found);
  if (found.broken[0]) {
    (void)snprintf(text, room, "%s: scan_elements/%s can't be used", out->name, found.broken);
    return text;
  }
  iio_element sorted[IIO_ELEMENTS_MAX];
  memcpy(sorted, found.list, sizeof sorted);
  out->scan_bytes = iio_layout(sorted, found.count);
  for (size_t i = 0; i < found.count; i++) {
    if (found.channel[i] < 0) continue;
    iio_channel *channel = &out->channels[found.channel[i]];
    channel->is_there = 1;
    for (size_t k = 0; k < found.count; k++)
      if (sorted[k].index == found.list[i].index) channel->element = sorted[k];
    channel->scale = shared_number(out->folder, found.channel[i], "scale", 1.0);
    channel->offset = shared_number(out->folder, found.channel[i], "offset", 0.0);
  }
  const int is_whole = out->channels[IIO_WX].is_there && out->channels[IIO_WY].is_there &&
                       out->channels[IIO_WZ].is_there && out->channels[IIO_TIMESTAMP].is_there;
  if (is_whole && out->scan_bytes > 0) return NULL;
  (void)snprintf(text, room, "%s: its buffer has no in_anglvel_x, _y, _z and in_timestamp: no gyro with stamps%s",
                 out->name, takes_all ? "" : "; it runs already: `echo 0 > buffer/enable`, and all are taken");
  return text;
}

static const char *read_matrix(const iio_setup *setup, const char *kind, double out[9], char *text, size_t room) {
  static const double kNone[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  static const char *const kNames[] = {"%s_mount_matrix", "in_mount_matrix", "mount_matrix"};
  char name[64], value[ATTRIBUTE_MAX];
  memcpy(out, kNone, sizeof kNone);
  for (size_t i = 0; i < sizeof kNames / sizeof kNames[0]; i++) {
    if (i == 0)
      (void)snprintf(name, sizeof name, "%s_mount_matrix", kind);
    else
      (void)snprintf(name, sizeof name, "%s", kNames[i]);
    if (!attribute(setup->folder, name, value)) continue;
    const char *why = iio_matrix_read(value, out);
    if (!why) return NULL;
    (void)snprintf(text, room, "%s: %s %s (%.60s); correct the device tree", setup->name, name, why, value);
    return text;
  }
  return NULL;
}

static clockid_t clock_of(const char *folder) {
  static const struct {
    const char *name;
    clockid_t clock;
  } kClocks[] = {{"monotonic", CLOCK_MONOTONIC},
                 {"monotonic_coarse", CLOCK_MONOTONIC},
                 {"monotonic_raw", CLOCK_MONOTONIC_RAW},
                 {"boottime", CLOCK_BOOTTIME},
                 {"tai", CLOCK_TAI}};
  char text[ATTRIBUTE_MAX];
  if (!attribute(folder, "current_timestamp_clock", text)) return CLOCK_REALTIME;  // the kernel's default
  for (size_t i = 0; i < sizeof kClocks / sizeof kClocks[0]; i++)
    if (strcmp(text, kClocks[i].name) == 0) return kClocks[i].clock;
  return CLOCK_REALTIME;
}

// ── setting up ──────────────────────────────────────────────────────────────────────────────────────────────────────

static const char *refused(const iio_setup *setup, const char *what, int reason, char *text, size_t room) {
  const int is_right = reason == EACCES || reason == EPERM || reason == EROFS;
  (void)snprintf(text, room, "%s: %s can't be set: %s%s", setup->name, what, strerror(reason),
                 is_right ? "; as root before the run: waymark stamps CONFIG" : "");
  return text;
}

// Of a device that captures by triggers: the one that is named, or its own.
static const char *set_trigger(const wm_iio_device_config *config, const iio_setup *setup, char *text, size_t room) {
  char devices[300], prefix[80], now[ATTRIBUTE_MAX] = "";
  if (!is_attribute(setup->folder, "trigger/current_trigger")) return NULL;
  (void)attribute(setup->folder, "trigger/current_trigger", now);
  if (!config->trigger[0] && now[0]) return NULL;
  (void)snprintf(devices, sizeof devices, "%s/sys/bus/iio/devices", setup->root);
  (void)attribute(setup->folder, "name", now);
  (void)snprintf(prefix, sizeof prefix, "%.60s-", now);
  search wanted = {.folder = devices, .wanted = config->trigger, .is_prefix = 0};
  if (!config->trigger[0]) wanted = (search){.folder = devices, .wanted = prefix, .is_prefix = 1};
  if (!each_entry(devices, "trigger", look_at, &wanted)) {
    (void)snprintf(text, room, "%s: no trigger '%s' (%s%s): `trigger:` names one; modprobe iio-trig-hrtimer has one",
                   setup->name, wanted.wanted, wanted.others[0] ? "there are: " : "there is none", wanted.others);
    return text;
  }
  const int failed = set(setup->folder, "trigger/current_trigger", wanted.name);
  return failed ? refused(setup, "trigger/current_trigger", failed, text, room) : NULL;
}

static const char *set_rate(const wm_iio_device_config *config, const iio_setup *setup, char *text, size_t room) {
  static const char *const kNames[] = {"sampling_frequency", "in_anglvel_sampling_frequency",
                                       "in_accel_sampling_frequency"};
  char rate[32];
  if (config->rate_hz <= 0) return NULL;
  (void)snprintf(rate, sizeof rate, "%g", config->rate_hz);
  for (size_t i = 0; i < sizeof kNames / sizeof kNames[0]; i++) {
    if (!is_attribute(setup->folder, kNames[i])) continue;
    const int failed = set(setup->folder, kNames[i], rate);
    if (failed) return refused(setup, kNames[i], failed, text, room);
  }
  return NULL;
}

static const char *start(const wm_iio_device_config *config, const iio_setup *setup, char *text, size_t room) {
  const char *why = set_rate(config, setup, text, room);
  // Where the clock can't be chosen its stamps are those of the wall clock.
  if (!why && is_attribute(setup->folder, "current_timestamp_clock"))
    (void)set(setup->folder, "current_timestamp_clock", "monotonic");
  for (int i = 0; !why && i < IIO_CHANNELS; i++) {
    char name[80];
    if (!setup->channels[i].is_there || i == IIO_TEMPERATURE) continue;
    (void)snprintf(name, sizeof name, "scan_elements/%s_en", kChannels[i].element);
    const int failed = set(setup->folder, name, "1");
    if (failed) why = refused(setup, name, failed, text, room);
  }
  if (!why) why = set_trigger(config, setup, text, room);
  if (why) return why;
  (void)set(setup->folder, "buffer/length", BUFFER_SCANS);  // the driver's own, where it is fixed
  const int failed = set(setup->folder, "buffer/enable", "1");
  return failed ? refused(setup, "buffer/enable", failed, text, room) : NULL;
}

const char *iio_setup_read(const wm_iio_device_config *config, const char *root, int changes, iio_setup *out,
                           char *text, size_t room) {
  char enabled[ATTRIBUTE_MAX];
  *out = (iio_setup){.root = root};
  const char *why = find(config, out, text, room);
  if (why) return why;
  if (!is_attribute(out->folder, "buffer/enable")) {
    (void)snprintf(text, room,
                   "%s (%s) has no buffer: no interrupt or trigger in its driver or device tree, and single readings "
                   "have no stamps",
                   out->name, config->device);
    return text;
  }
  out->is_ready = attribute(out->folder, "buffer/enable", enabled) && enabled[0] == '1';
  if (!out->is_ready && changes) {
    why = read_channels(out, 1, text, room);
    if (!why) why = start(config, out, text, room);
    if (why) return why;
    memset(out->channels, 0, sizeof out->channels);
    out->is_ready = 1;
  }
  why = read_channels(out, !out->is_ready, text, room);
  if (!why) why = read_matrix(out, "in_anglvel", out->gyro_to_board, text, room);
  if (!why) why = read_matrix(out, "in_accel", out->acceleration_to_board, text, room);
  out->clock = clock_of(out->folder);
  return why;
}

const char *wm_iio_prepare(const wm_iio_device_config *config, const char *root, int *is_there, char *text,
                           size_t room) {
  iio_setup setup;
  const char *why = iio_setup_read(config, root, 1, &setup, text, room);
  *is_there = setup.is_there;
  return why;
}

const char *wm_iio_inspect(const wm_iio_device_config *config, const char *root, int *is_there, int *is_ready,
                           char *text, size_t room) {
  iio_setup setup;
  const char *why = iio_setup_read(config, root, 0, &setup, text, room);
  *is_there = setup.is_there;
  *is_ready = setup.is_ready;
  return why;
}
