// SPDX-License-Identifier: Apache-2.0
#include "live/record.h"

#include <errno.h>
#include <inttypes.h>
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <time.h>
#include <unistd.h>

#include <wm_version.h>
#include "live/copy_map.h"
#include "live/lcm_sightings.h"
#include "live/robot.h"
#include "live/row_source.h"
#include "output/avi_writer.h"
#include "output/csv_row.h"
#include "output/new_file.h"
#include "rt/clock.h"
#include "waymark/event_fields.h"
#include "waymark/text.h"
#include "waymark/yaml.h"

#define LOOK_EVERY_MS 100           // for the end of the recording and the disk's free space
#define COPIES_EVERY_MS 10          // an IMU of 1 kHz fills 10 of the 256 places
#define SYNC_EVERY_NS WM_NS_PER_S   // a power cut loses the last second at most
#define FILE_BYTES_MAX (16u << 20)  // of a configuration, DBC or calibration
// A disk that blocks for a quarter of a second at 30 Hz loses no picture.
static const wm_frame_wishes kEveryPicture = {.waiting_max = 8, .wait_ms = WM_DEVICE_WAIT_MS, .wants_raw = 1};

typedef struct recorder recorder;

// One device, its thread and its files.
typedef struct stream {
  recorder *all;
  pthread_t thread;
  int started;
  wm_can_listener *can;
  wm_frame_source *camera;
  wm_source *rows;    // a device that gives rows
  wm_source *shared;  // such a device that only the run may read
  wm_source *sightings;
  char name[WM_NAME_MAX];
  FILE *data, *stamps;
  char data_path[WM_PATH_MAX + 80], stamps_path[WM_PATH_MAX + 80];
  uint64_t pictures;
  uint8_t said_device;
  uint32_t said_news;
} stream;

struct recorder {
  const wm_config *config;
  const wm_record_options *options;
  wm_recording *robot;
  stream streams[WM_CAN_DEVICES_MAX + WM_ROW_DEVICES_MAX + 1 + WM_CAMERA_DEVICES_MAX];
  size_t stream_count;
  FILE *can_log;  // of all interfaces, in the order of arrival: a line is one fwrite, which locks the file
  atomic_int stop;
  _Atomic uint64_t bytes, frames, rows, pictures, lost;
  _Atomic int failed;  // errno of the first write error
  char failed_path[WM_PATH_MAX + 80];
};

static void say(const recorder *self, const char *name, const char *text) {
  char line[300];
  if (!self->options->say || !text[0]) return;
  (void)snprintf(line, sizeof line, "%s: %s", name, text);
  self->options->say(self->options->say_context, line);
}

static void fail(recorder *self, const char *path, int reason) {
  int none = 0;
  if (atomic_compare_exchange_strong(&self->failed, &none, reason ? reason : EIO))
    (void)snprintf(self->failed_path, sizeof self->failed_path, "%s", path);
  atomic_store(&self->stop, 1);
}

// ── a thread a device ───────────────────────────────────────────────────────────────────────────────────────────────

static void take_frame(stream *self, const wm_can_frame *frame) {
  char line[256];
  recorder *all = self->all;
  size_t length = wm_candump_write(frame, line, sizeof line);
  size_t written = fwrite(line, 1, length, all->can_log);
  if (written != length) fail(all, self->data_path, errno);
  atomic_fetch_add(&all->bytes, length);
  atomic_fetch_add(&all->frames, 1);
}

static void write_row(stream *self, wm_row *line) {
  wm_row_char(line, '\n');
  if (fwrite(line->bytes, 1, line->length, self->data) != line->length) fail(self->all, self->data_path, errno);
  atomic_fetch_add(&self->all->bytes, line->length);
}

// The columns of the recording's stream, all of them.
static void begin_table(stream *self, const wm_stream *kind) {
  wm_row line = {.length = 0};
  wm_row_text(&line, "t_ns,arrival_ns");
  for (size_t i = 0; wm_stream_number(kind, i); i++) {
    wm_row_char(&line, ',');
    wm_row_text(&line, wm_stream_number(kind, i));
  }
  write_row(self, &line);
}

static void begin_row(wm_row *line, wm_time_ns t_ns, wm_time_ns arrival_ns) {
  *line = (wm_row){.length = 0};
  wm_row_int(line, t_ns);
  wm_row_char(line, ',');
  wm_row_int(line, arrival_ns);
}

static void end_row(stream *self, wm_row *line) {
  write_row(self, line);
  atomic_fetch_add(&self->all->rows, 1);
}

static void take_row(stream *self, const wm_stream *kind, const wm_stream_row *row) {
  wm_row line;
  begin_row(&line, row->t_ns, row->arrival_ns);
  for (size_t i = 0; wm_stream_number(kind, i); i++) {
    wm_row_char(&line, ',');
    wm_row_exact(&line, row->number[i]);
  }
  end_row(self, &line);
}

// Number `index` of a sighting, or NULL behind the last.
static const wm_event_field *sighting_number(size_t index) {
  size_t count;
  const wm_event_field *fields = wm_event_fields(WM_EVENT_SIGHTING, &count);
  for (size_t i = 0; i < count; i++)
    if (fields[i].type == WM_FIELD_F64 && index-- == 0) return &fields[i];
  return NULL;
}

static void begin_sightings(stream *self) {
  const wm_event_field *field;
  wm_row line = {.length = 0};
  wm_row_text(&line, "t_ns,arrival_ns,sensor,id");
  for (size_t i = 0; (field = sighting_number(i)); i++) {
    wm_row_char(&line, ',');
    wm_row_text(&line, field->name);
  }
  write_row(self, &line);
}

static void take_sighting(stream *self, wm_event *event) {
  size_t count;
  const wm_sensor *sensors = wm_site_sensors(wm_recording_site(self->all->robot), &count);
  const wm_event_field *field;
  wm_sighting *s = &event->as.sighting;
  // A row has both or none: senders before NaN meant absent give 0 without a sigma.
  if (isnan(s->elevation_sigma_rad)) s->elevation_rad = (double)NAN;
  wm_row line;
  begin_row(&line, event->t_ns, event->arrival_ns);
  wm_row_char(&line, ',');
  wm_row_text(&line, sensors[s->sensor].name);
  wm_row_char(&line, ',');
  wm_row_int(&line, s->landmark_id);
  for (size_t i = 0; (field = sighting_number(i)); i++) {
    double value;
    memcpy(&value, (const char *)event + field->offset, sizeof value);
    wm_row_char(&line, ',');
    wm_row_exact(&line, value);
  }
  end_row(self, &line);
}

// Rows that the run reads: the recorder takes copies of them.
static void take_copies(stream *self, wm_source_counts *counts) {
  const struct timespec pause = {.tv_nsec = (long)COPIES_EVERY_MS * 1000000};
  wm_stream_row row;
  while (row_source_copy(self->shared, &row, &counts->overflows)) take_row(self, row_source_stream(self->shared), &row);
  (void)nanosleep(&pause, NULL);
}

static int begin_video(stream *self, const wm_camera_raw *raw, const wm_frame *frame) {
  if (fputs("frame,t_ns,exposure_ns,arrival_ns\n", self->stamps) < 0) return errno;
  return avi_begin(self->data, raw->is_jpeg ? "MJPG" : "Y800", frame->width_px, frame->height_px, raw->rate_hz);
}

static void take_picture(stream *self, const wm_frame *frame) {
  wm_camera_raw raw;
  recorder *all = self->all;
  self->camera->ops->raw(self->camera, &raw);
  if (raw.is_jpeg && !raw.data) return;  // no memory for the JPEG
  int failed = self->pictures > 0 ? 0 : begin_video(self, &raw, frame);
  if (!failed && raw.is_jpeg) failed = avi_picture(self->data, raw.data, raw.bytes, 1, 0);
  if (!failed && !raw.is_jpeg)
    failed = avi_picture(self->data, frame->grey, frame->width_px, frame->height_px, frame->stride_bytes);
  // The picture before its stamp: a power cut may leave a picture without a stamp, never a stamp without its picture.
  if (!failed && fprintf(self->stamps, "%" PRIu64 ",%" PRId64 ",%" PRId64 ",%" PRId64 "\n", self->pictures, frame->t_ns,
                         frame->exposure_ns, frame->arrival_ns) < 0)
    failed = errno;
  if (failed) fail(all, self->data_path, failed);
  self->pictures++;
  atomic_fetch_add(&all->pictures, 1);
  atomic_fetch_add(&all->bytes, raw.is_jpeg ? raw.bytes : (uint64_t)frame->width_px * frame->height_px);
}

static void say_warning(void *context, wm_note note, const char *text) {
  const wm_record_options *options = ((const recorder *)context)->options;
  (void)note;
  if (options->say) options->say(options->say_context, text);
}

static void say_device(stream *self, const wm_source_counts *counts) {
  if (counts->device == self->said_device && counts->news == self->said_news) return;
  self->said_device = counts->device;
  self->said_news = counts->news;
  say(self->all, self->name, counts->device_note);
}

// Waits for the next datum of the device, writes it, and fills its counts.
static void record_next(stream *self, wm_source_counts *counts) {
  wm_error err;
  wm_event event;
  if (self->can) {
    wm_can_frame frame;
    if (wm_can_listener_next(self->can, &frame, &err) == WM_OK) take_frame(self, &frame);
    *counts = *wm_can_listener_counted(self->can);
    counts->lost = counts->malformed = 0;  // absent signals are no loss of the recording
  } else if (self->shared) {
    take_copies(self, counts);
  } else if (self->rows) {
    if (self->rows->ops->next(self->rows, &event, &err) == WM_OK)
      take_row(self, row_source_stream(self->rows), row_source_row(self->rows));
    *counts = self->rows->counts;
  } else if (self->sightings) {
    if (self->sightings->ops->next(self->sightings, &event, &err) == WM_OK) take_sighting(self, &event);
    *counts = self->sightings->counts;
  } else {
    wm_frame frame;
    if (self->camera->ops->next(self->camera, &frame, &err) == WM_OK) take_picture(self, &frame);
    self->camera->ops->counts(self->camera, counts);
  }
}

static void *record_stream(void *argument) {
  stream *self = argument;
  uint64_t lost = 0;
  wm_source_counts counts = {0};
  while (!atomic_load(&self->all->stop)) {
    record_next(self, &counts);
    say_device(self, &counts);
    uint64_t lost_now = counts.lost + counts.overflows + counts.malformed;
    atomic_fetch_add(&self->all->lost, lost_now - lost);
    lost = lost_now;
  }
  return NULL;
}

// ── beginning ───────────────────────────────────────────────────────────────────────────────────────────────────────

static wm_status write_text(recorder *self, const char *name, const char *text, size_t length, wm_error *err) {
  char path[WM_PATH_MAX + 80];
  (void)snprintf(path, sizeof path, "%s/%s", self->options->out_dir, name);
  FILE *f = new_file(path);
  int failed = f ? 0 : errno;
  if (f && fwrite(text, 1, length, f) != length) failed = errno;
  if (f && (fflush(f) != 0 || fsync(fileno(f)) != 0)) failed = errno;
  if (f && fclose(f) != 0 && !failed) failed = errno;
  return failed ? wm_fail(err, WM_IO, "%s: can't be written: %s", path, strerror(failed)) : WM_OK;
}

static wm_status copy_file(recorder *self, const char *from, const char *name, wm_error *err) {
  char *text;
  size_t length;
  if (!from[0]) return WM_OK;
  wm_status status = wm_text_read_file(from, FILE_BYTES_MAX, &text, &length, err);
  if (status != WM_OK) return status;
  status = write_text(self, name, text, length, err);
  free(text);
  return status;
}

// With the floor's origin, which the recording has from nowhere else.
static wm_status copy_calibration(recorder *self, wm_error *err) {
  const wm_recording_overrides *files = &self->config->overrides;
  char *text, *with_origin = NULL, origin[96];
  size_t length;
  if (!files->has_origin || !files->calibration[0]) return copy_file(self, files->calibration, "calibration.yaml", err);
  (void)snprintf(origin, sizeof origin, "[%.9f, %.9f, %.3f]", files->origin[0], files->origin[1], files->origin[2]);
  wm_status status = wm_text_read_file(files->calibration, FILE_BYTES_MAX, &text, &length, err);
  if (status != WM_OK) return status;
  status = wm_yaml_edit(text, length, "gnss.origin", origin, "", &with_origin, &length, err);
  if (status == WM_OK) status = write_text(self, "calibration.yaml", with_origin, length, err);
  free(with_origin);
  free(text);
  return status;
}

typedef struct bus_files {
  char dbc[WM_CAN_IFACE_MAX + 20], signals[WM_CAN_IFACE_MAX + 20];
} bus_files;

// The first bus has the file names of a recording with one bus.
static bus_files files_of(const wm_config *config, size_t bus) {
  bus_files out;
  const char *interface = config->devices.can[bus].interface;
  (void)snprintf(out.dbc, sizeof out.dbc, "%s.dbc", bus ? interface : "vehicle");
  (void)snprintf(out.signals, sizeof out.signals, "%s-signals.yaml", bus ? interface : "can");
  return out;
}

#define CHANGES_MAX (6 + 2 * WM_CAN_DEVICES_MAX)

// Keys of the configuration and their file names in the recording.
static size_t changes_of(const wm_config *config, const wm_yaml *doc, bus_files buses[WM_CAN_DEVICES_MAX],
                         wm_yaml_change out[CHANGES_MAX]) {
  const struct {
    const char *key, *name;
  } files[] = {{"calibration", "calibration.yaml"},
               {"landmarks", "landmarks.csv"},
               {"map", "map/map.yaml"},
               {"site", NULL},
               {"dbc", config->devices.can_count > 1 ? NULL : "vehicle.dbc"},
               {"can_signals", config->devices.can_count > 1 ? NULL : "can-signals.yaml"}};
  wm_yaml_node root = wm_yaml_root(doc);
  size_t count = 0;
  for (size_t i = 0; i < sizeof files / sizeof files[0]; i++) {
    wm_yaml_node named = wm_yaml_get(&root, files[i].key);
    if (!wm_yaml_there(&named)) continue;
    (void)snprintf(out[count].path, sizeof out[count].path, "%s", files[i].key);
    out[count++].text = files[i].name;
  }
  for (size_t i = 0; i < config->devices.can_count; i++) {
    buses[i] = files_of(config, i);
    (void)snprintf(out[count].path, sizeof out[count].path, "devices.can[%zu].dbc", i);
    out[count++].text = buses[i].dbc;
    (void)snprintf(out[count].path, sizeof out[count].path, "devices.can[%zu].can_signals", i);
    out[count++].text = buses[i].signals;
  }
  return count;
}

// The configuration with the recording's own file names: it replays anywhere.
static wm_status write_config(recorder *self, wm_error *err) {
  const wm_config *config = self->config;
  wm_yaml_change changes[CHANGES_MAX];
  bus_files buses[WM_CAN_DEVICES_MAX];
  wm_yaml *doc;
  char *text = NULL;
  size_t length = 0;
  wm_status status = wm_yaml_parse(config->text, config->text_length, config->path, &doc, err);
  if (status != WM_OK) return status;
  FILE *f = open_memstream(&text, &length);
  if (!f) status = wm_fail(err, WM_IO, "%s: no memory for the configuration", self->options->out_dir);
  if (f) status = wm_yaml_write(doc, changes, changes_of(config, doc, buses, changes), f, err);
  if (f && fclose(f) != 0 && status == WM_OK)
    status = wm_fail(err, WM_IO, "%s: no memory for the configuration", self->options->out_dir);
  if (status == WM_OK) status = write_text(self, "config.yaml", text, length, err);
  free(text);
  wm_yaml_free(doc);
  return status;
}

static wm_status copy_buses(recorder *self, wm_error *err) {
  const wm_devices_config *devices = &self->config->devices;
  wm_status status = WM_OK;
  for (size_t i = 0; status == WM_OK && i < devices->can_count; i++) {
    const bus_files files = files_of(self->config, i);
    status = copy_file(self, devices->can[i].dbc, files.dbc, err);
    if (status == WM_OK) status = copy_file(self, devices->can[i].can_signals, files.signals, err);
  }
  return status;
}

// recording.yaml first: from then on the folder is a valid recording.
static wm_status write_about(recorder *self, wm_error *err) {
  char text[2048];
  const wm_config *config = self->config;
  int used = snprintf(
      text, sizeof text,
      "format: waymark-recording/1\nname: recorded\nsource: waymark record %s\nvehicle: {kind: robot}\n", WM_VERSION);
  if (config->devices.can_count > 0) used += snprintf(text + used, sizeof text - (size_t)used, "can:\n");
  for (size_t i = 0; i < config->devices.can_count; i++) {
    const bus_files files = files_of(config, i);
    used += snprintf(text + used, sizeof text - (size_t)used, "  - {interface: \"%s\", dbc: \"%s\", signals: \"%s\"}\n",
                     config->devices.can[i].interface, files.dbc, files.signals);
  }
  // No list of streams: the files that are there are read, also after a power cut.
  wm_status status = write_text(self, "recording.yaml", text, (size_t)used, err);
  if (status == WM_OK) status = write_config(self, err);
  if (status == WM_OK) status = copy_calibration(self, err);
  if (status == WM_OK) status = copy_file(self, config->overrides.landmarks, "landmarks.csv", err);
  if (status == WM_OK && config->overrides.map[0])
    status = copy_map(config->overrides.map, self->options->out_dir, err);
  return status == WM_OK ? copy_buses(self, err) : status;
}

static wm_status make_folder(const char *path, wm_error *err) {
  if (mkdir(path, 0777) == 0 || errno == EEXIST) return WM_OK;
  return wm_fail(err, WM_IO, "%s: can't be created: %s", path, strerror(errno));
}

static wm_status open_can(recorder *self, wm_error *err) {
  const wm_devices_config *devices = &self->config->devices;
  char path[WM_PATH_MAX + 80];
  if (devices->can_count == 0) return WM_OK;
  (void)snprintf(path, sizeof path, "%s/can.log", self->options->out_dir);
  self->can_log = new_file(path);
  if (!self->can_log) return wm_fail(err, WM_IO, "%s: can't be written: %s", path, strerror(errno));
  for (size_t i = 0; i < devices->can_count; i++) {
    stream *s = &self->streams[self->stream_count];
    s->all = self;
    (void)snprintf(s->name, sizeof s->name, "%s", devices->can[i].interface);
    (void)snprintf(s->data_path, sizeof s->data_path, "%s", path);
    wm_status status = wm_can_listener_open(devices->can[i].interface, &s->can, err);
    if (status != WM_OK) return status;
    self->stream_count++;
  }
  return WM_OK;
}

static wm_status open_table(stream *self, const char *name, const char *file, wm_error *err) {
  (void)snprintf(self->name, sizeof self->name, "%s", name);
  (void)snprintf(self->data_path, sizeof self->data_path, "%s/%s", self->all->options->out_dir, file);
  self->data = new_file(self->data_path);
  return self->data ? WM_OK : wm_fail(err, WM_IO, "%s: can't be written: %s", self->data_path, strerror(errno));
}

// The run's source of this stream, where only one program may read its device.
static wm_source *run_reads(recorder *self, const wm_source *mine) {
  size_t count;
  if (!self->options->robot || !row_source_is_exclusive(mine)) return NULL;
  wm_source *const *sources = wm_recording_sources(self->robot, &count);
  for (size_t i = 0; i < count; i++)
    if (row_source_stream(sources[i]) == row_source_stream(mine)) return sources[i];
  return NULL;
}

static wm_status open_rows(recorder *self, wm_error *err) {
  wm_source *sources[WM_ROW_DEVICES_MAX];
  size_t count;
  wm_status status = row_sources_open(self->config, wm_recording_site(self->robot), sources, &count, err);
  for (size_t i = 0; i < count; i++) {
    stream *s = &self->streams[self->stream_count++];
    const wm_stream *kind = row_source_stream(sources[i]);
    s->all = self;
    s->rows = sources[i];
    s->shared = run_reads(self, sources[i]);
    if (status == WM_OK) status = open_table(s, wm_stream_name(kind), wm_stream_file(kind), err);
    if (status == WM_OK) begin_table(s, kind);
  }
  return status;
}

static wm_status open_sightings(recorder *self, wm_error *err) {
  const wm_config *config = self->config;
  if (!config->devices.sightings_by_lcm) return WM_OK;
  size_t sensor_count;
  const wm_sensor *sensors = wm_site_sensors(wm_recording_site(self->robot), &sensor_count);
  stream *s = &self->streams[self->stream_count];
  s->all = self;
  wm_status status =
      lcm_sightings_open(config->lcm_url, config->channel_prefix, sensors, sensor_count, NULL, &s->sightings, err);
  if (status != WM_OK) return status;
  self->stream_count++;
  status = open_table(s, "sightings", "sightings.csv", err);
  if (status != WM_OK) return status;
  begin_sightings(s);
  return WM_OK;
}

static wm_status open_cameras(recorder *self, wm_error *err) {
  const wm_devices_config *devices = &self->config->devices;
  char folder[WM_PATH_MAX + 8];
  if (devices->camera_count == 0) return WM_OK;
  (void)snprintf(folder, sizeof folder, "%s/video", self->options->out_dir);
  wm_status status = make_folder(folder, err);
  wm_pictures *pictures = wm_recording_pictures(self->robot);
  for (size_t i = 0; status == WM_OK && i < devices->camera_count; i++) {
    const wm_rig *rig = wm_site_rig(wm_recording_site(self->robot));
    int index = wm_rig_find_camera(rig, devices->cameras[i].name);
    stream *s = &self->streams[self->stream_count];
    s->all = self;
    (void)snprintf(s->name, sizeof s->name, "%s", devices->cameras[i].name);
    (void)snprintf(s->data_path, sizeof s->data_path, "%s/%s.avi", folder, devices->cameras[i].name);
    (void)snprintf(s->stamps_path, sizeof s->stamps_path, "%s/%s.csv", folder, devices->cameras[i].name);
    status = pictures->ops->open(pictures, &rig->cameras[index], index, &kEveryPicture, &s->camera, err);
    if (status != WM_OK) return status;
    self->stream_count++;
    s->data = new_file(s->data_path);
    s->stamps = new_file(s->stamps_path);
    if (!s->data || !s->stamps) return wm_fail(err, WM_IO, "%s: can't be written: %s", s->data_path, strerror(errno));
  }
  return status == WM_OK ? pictures->ops->start(pictures, err) : status;
}

// ── while it records ────────────────────────────────────────────────────────────────────────────────────────────────

static void sync_file(recorder *self, FILE *f, const char *path) {
  if (f && (fflush(f) != 0 || fdatasync(fileno(f)) != 0)) fail(self, path, errno);
}

// Flushes, so that a power cut loses the last second at most.
static void sync_all(recorder *self) {
  sync_file(self, self->can_log, "can.log");
  for (size_t i = 0; i < self->stream_count; i++) {
    sync_file(self, self->streams[i].data, self->streams[i].data_path);
    sync_file(self, self->streams[i].stamps, self->streams[i].stamps_path);
  }
}

static int is_full(const recorder *self) {
  const wm_record_options *o = self->options;
  struct statvfs disk;
  if (o->bytes_max > 0 && atomic_load(&self->bytes) >= o->bytes_max) return 1;
  return statvfs(o->out_dir, &disk) == 0 && (uint64_t)disk.f_bavail * disk.f_frsize < o->bytes_free_min;
}

static void wait_for_end(recorder *self, wm_record_report *report) {
  wm_time_ns begin_ns = wm_monotonic_ns(), next_sync_ns = begin_ns + SYNC_EVERY_NS;
  wm_time_ns end_ns =
      self->options->duration_s > 0 ? begin_ns + wm_ns_from_seconds(self->options->duration_s) : INT64_MAX;
  while (!atomic_load(&self->stop)) {
    struct timespec pause = {.tv_nsec = (long)LOOK_EVERY_MS * 1000000};
    (void)nanosleep(&pause, NULL);
    wm_time_ns now_ns = wm_monotonic_ns();
    if (now_ns >= end_ns || (self->options->stop && atomic_load(self->options->stop))) atomic_store(&self->stop, 1);
    if (is_full(self)) {
      report->is_full = 1;
      say(self, "record", "its space is used up; the recording ends here and is complete");
      atomic_store(&self->stop, 1);
    }
    if (now_ns < next_sync_ns) continue;
    sync_all(self);
    next_sync_ns = now_ns + SYNC_EVERY_NS;
  }
}

static void close_all(recorder *self) {
  for (size_t i = 0; i < self->stream_count; i++) {
    stream *s = &self->streams[i];
    if (s->started) (void)pthread_join(s->thread, NULL);
  }
  sync_all(self);
  for (size_t i = 0; i < self->stream_count; i++) {
    stream *s = &self->streams[i];
    wm_can_listener_close(s->can);
    if (s->camera) s->camera->ops->close(s->camera);
    if (s->rows) s->rows->ops->close(s->rows);
    if (s->sightings) s->sightings->ops->close(s->sightings);
    if (s->data && fclose(s->data) != 0) fail(self, s->data_path, errno);
    if (s->stamps && fclose(s->stamps) != 0) fail(self, s->stamps_path, errno);
  }
  if (self->can_log && fclose(self->can_log) != 0) fail(self, "can.log", errno);
  if (!self->options->robot) wm_recording_close(self->robot);
}

wm_status wm_record(const wm_config *config, const wm_record_options *options, wm_record_report *report,
                    wm_error *err) {
  memset(report, 0, sizeof *report);
  if (wm_devices_count(&config->devices) == 0)
    return wm_fail(err, WM_BAD_CONFIG, "%s: devices: is missing: there is nothing to record", config->path);
  recorder *self = calloc(1, sizeof *self);
  if (!self) return wm_fail(err, WM_IO, "no memory to record");
  self->config = config;
  self->options = options;
  wm_status status = WM_OK;
  self->robot = options->robot;
  if (!self->robot) status = wm_robot_open_site(config, say_warning, self, &self->robot, err);
  if (status == WM_OK) status = make_folder(options->out_dir, err);
  if (status == WM_OK) status = write_about(self, err);
  if (status == WM_OK) status = open_can(self, err);
  if (status == WM_OK) status = open_rows(self, err);
  if (status == WM_OK) status = open_sightings(self, err);
  if (status == WM_OK) status = open_cameras(self, err);
  for (size_t i = 0; status == WM_OK && i < self->stream_count; i++) {
    int failed = pthread_create(&self->streams[i].thread, NULL, record_stream, &self->streams[i]);
    self->streams[i].started = !failed;
    if (failed) status = wm_fail(err, WM_IO, "the recorder's thread can't be started: %s", strerror(failed));
  }
  if (status != WM_OK) atomic_store(&self->stop, 1);
  if (status == WM_OK) wait_for_end(self, report);
  close_all(self);
  report->frames = self->frames;
  report->rows = self->rows;
  report->pictures = self->pictures;
  report->bytes = self->bytes;
  report->lost = self->lost;
  if (status == WM_OK && self->failed)
    status = wm_fail(err, WM_IO, "%s: can't be written: %s; the files are valid up to there", self->failed_path,
                     strerror(self->failed));
  free(self);
  return status;
}
