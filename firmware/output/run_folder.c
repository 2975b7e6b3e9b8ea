// SPDX-License-Identifier: Apache-2.0
#include "output/run_folder.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "output/csv_row.h"
#include "output/drive_evidence.h"
#include "output/event_log.h"
#include "output/json_files.h"
#include "output/new_file.h"
#include "output/saved_map.h"
#include "output/saved_pose.h"
#include "output/search_outcome_file.h"
#include "waymark/keeper.h"

typedef struct table {
  char path[WM_PATH_MAX + 32];
  FILE *file;
  int failed;  // errno of the first failure
  char buffer[1 << 16];
} table;

enum { TRAJECTORY_TUM, TRAJECTORY, PUBLISHED, INNOVATIONS, PARTICLES, HYPOTHESES, TABLE_COUNT };
static const char *const kTables[TABLE_COUNT] = {"trajectory.tum",  "trajectory.csv", "published.csv",
                                                 "innovations.csv", "particles.csv",  "hypotheses.csv"};

struct wm_run_folder {
  char dir[WM_PATH_MAX];
  int lock;  // descriptor of the folder; -1: it can't be locked
  const wm_assembly *assembly;
  table tables[TABLE_COUNT];
  int trajectory_has_head, published_has_head;
  wm_log_writer log;
  wm_row line;
  uint64_t bytes_max;     // 0: no limit
  wm_assembly continued;  // of the run, with the start of a log that begins later
  wm_estimate newest;     // published; WM_TIME_NONE: none
  int newest_floor;       // of it; -1: unknown, or there is one
  wm_bound bound;         // of the pose that is published next
  drive_evidence evidence;
};

static const char kAxes[6][3] = {"x", "y", "z", "rx", "ry", "rz"};

// ── columns that trajectory and published share ─────────────────────────────────────────────────────────────────────

static void pose_head(wm_row *line, int dof) {
  wm_row_text(line, "x_m,y_m,z_m,qx,qy,qz,qw");
  if (dof == 6) {
    for (int i = 0; i < 6; i++)
      for (int j = i; j < 6; j++) {
        wm_row_text(line, ",cov_");
        wm_row_text(line, kAxes[i]);
        wm_row_text(line, kAxes[j]);
      }
  } else {
    wm_row_text(line, ",cov_xx,cov_xy,cov_yy,cov_xt,cov_yt,cov_tt");
  }
  wm_row_text(line, ",state");
}

static void pose_columns(wm_row *line, const wm_estimate *e, void (*number)(wm_row *, double)) {
  static const uint8_t kPlanar[6][2] = {{0, 0}, {0, 1}, {1, 1}, {0, 5}, {1, 5}, {5, 5}};
  for (int i = 0; i < 3; i++) {
    number(line, e->pose_map_base.p_m[i]);
    wm_row_char(line, ',');
  }
  for (int i = 0; i < 4; i++) {
    number(line, e->pose_map_base.q_xyzw[i]);
    wm_row_char(line, ',');
  }
  if (e->dof == 6) {
    for (int i = 0; i < 6; i++)
      for (int j = i; j < 6; j++) {
        number(line, e->covariance[wm_cov_index(i, j)]);
        wm_row_char(line, ',');
      }
  } else {
    for (int i = 0; i < 6; i++) {
      number(line, e->covariance[wm_cov_index(kPlanar[i][0], kPlanar[i][1])]);
      wm_row_char(line, ',');
    }
  }
  wm_row_text(line, wm_state_name(e->state));
}

// ── rows ────────────────────────────────────────────────────────────────────────────────────────────────────────────

static wm_row *begin(wm_run_folder *self) {
  self->line.length = 0;
  return &self->line;
}

static void end(wm_run_folder *self, int which) {
  table *t = &self->tables[which];
  wm_row_char(&self->line, '\n');
  if (!t->failed && fwrite(self->line.bytes, 1, self->line.length, t->file) != self->line.length)
    t->failed = errno ? errno : EIO;
}

static void trajectory_head(wm_run_folder *self, int dof) {
  if (self->trajectory_has_head) return;
  wm_row *head = begin(self);
  wm_row_text(head, "t_ns,");
  pose_head(head, dof);
  end(self, TRAJECTORY);
  self->trajectory_has_head = 1;
}

static void published_head(wm_run_folder *self, int dof) {
  if (self->published_has_head) return;
  wm_row *head = begin(self);
  wm_row_text(head, "t_ns,made_ns,fused_until_ns,");
  pose_head(head, dof);
  wm_row_text(head, ",odom_x_m,odom_y_m,odom_heading_rad,resets,lost_probability,cause");
  wm_row_text(head, ",bound_m,bound_heading_rad,usable,unusable");
  if (self->assembly->building) wm_row_text(head, ",floor,floor_percent");
  end(self, PUBLISHED);
  self->published_has_head = 1;
}

static void fused_pose(wm_run_folder *self, const wm_estimate *e) {
  trajectory_head(self, e->dof);
  wm_row *line = begin(self);
  wm_row_int(line, e->t_ns);
  wm_row_char(line, ',');
  pose_columns(line, e, wm_row_exact);
  end(self, TRAJECTORY);

  line = begin(self);
  wm_row_seconds(line, e->t_ns);
  for (int i = 0; i < 3; i++) {
    wm_row_char(line, ' ');
    wm_row_fixed(line, e->pose_map_base.p_m[i], 9);
  }
  for (int i = 0; i < 4; i++) {
    wm_row_char(line, ' ');
    wm_row_fixed(line, e->pose_map_base.q_xyzw[i], 9);
  }
  end(self, TRAJECTORY_TUM);
}

static void bound_columns(wm_row *line, const wm_bound *bound) {
  wm_row_char(line, ',');
  wm_row_short(line, bound->horizontal_m);
  wm_row_char(line, ',');
  wm_row_short(line, bound->heading_rad);
  wm_row_char(line, ',');
  wm_row_int(line, bound->usable);
  wm_row_char(line, ',');
  wm_row_int(line, bound->why);
}

static void published(wm_run_folder *self, const wm_published *p) {
  published_head(self, p->now.dof);
  wm_row *line = begin(self);
  wm_row_int(line, p->now.t_ns);
  wm_row_char(line, ',');
  wm_row_int(line, p->made_ns);
  wm_row_char(line, ',');
  wm_row_int(line, p->fused_until_ns);
  wm_row_char(line, ',');
  pose_columns(line, &p->now, wm_row_exact);
  const double odom[3] = {p->pose_odom_base.x_m, p->pose_odom_base.y_m, p->pose_odom_base.heading_rad};
  for (int i = 0; i < 3; i++) {
    wm_row_char(line, ',');
    wm_row_fixed(line, odom[i], 9);
  }
  wm_row_char(line, ',');
  wm_row_int(line, p->jumps);
  wm_row_char(line, ',');
  wm_row_short(line, p->now.lost_probability);
  wm_row_char(line, ',');
  wm_row_text(line, wm_cause_name(p->now.cause));
  bound_columns(line, &self->bound);
  if (self->assembly->building) {
    wm_row_char(line, ',');
    wm_row_text(line, wm_building_floor_name(self->assembly->building, WM_PUB_FLOOR(p->status_flags)));
    wm_row_char(line, ',');
    wm_row_int(line, WM_PUB_FLOOR_PERCENT(p->status_flags));
  }
  end(self, PUBLISHED);
}

// Positions and headings have no sensor in the calibration.
static const char *sensor_of(const wm_assembly *assembly, const wm_innovation *i) {
  const uint32_t by_sensor =
      WM_EVENT_BIT(WM_EVENT_SIGHTING) | WM_EVENT_BIT(WM_EVENT_MARKER) | WM_EVENT_BIT(WM_EVENT_LOOKED);
  if (i->source >= assembly->source_count || !(assembly->sources[i->source].kinds & by_sensor)) return "";
  return wm_assembly_sensor_name(assembly, i->sensor);
}

static void innovation(wm_run_folder *self, const wm_innovation *i) {
  wm_row *line = begin(self);
  wm_row_int(line, i->t_ns);
  wm_row_char(line, ',');
  wm_row_text(line, wm_assembly_source_name(self->assembly, i->source));
  wm_row_char(line, ',');
  wm_row_text(line, sensor_of(self->assembly, i));
  wm_row_char(line, ',');
  if (i->landmark_id >= 0) wm_row_int(line, i->landmark_id);
  wm_row_char(line, ',');
  wm_row_text(line, wm_residual_name(i->residual));
  const double numbers[5] = {i->observed, i->expected, i->variance, i->nis, i->gate};
  for (int k = 0; k < 5; k++) {
    wm_row_char(line, ',');
    wm_row_short(line, numbers[k]);
  }
  wm_row_char(line, ',');
  wm_row_text(line, wm_verdict_name(i->verdict));
  end(self, INNOVATIONS);
}

static void particles(wm_run_folder *self, const wm_particle_set *set) {
  for (uint32_t i = 0; i < set->count; i++) {
    const wm_particle *p = &set->particles[i];
    const double numbers[4] = {p->x_m, p->y_m, p->heading_rad, p->weight};
    wm_row *line = begin(self);
    wm_row_int(line, set->t_ns);
    for (int k = 0; k < 4; k++) {
      wm_row_char(line, ',');
      wm_row_short(line, numbers[k]);
    }
    end(self, PARTICLES);
  }
}

static void hypotheses(wm_run_folder *self, const wm_hypothesis_set *set) {
  for (uint64_t i = 0; i < set->count; i++) {
    const wm_hypothesis *h = &set->places[i];
    const double *c = h->covariance;
    const double numbers[10] = {h->x_m, h->y_m, h->heading_rad, c[0], c[1], c[2], c[3], c[4], c[5], h->weight};
    wm_row *line = begin(self);
    wm_row_int(line, set->t_ns);
    for (int k = 0; k < 10; k++) {
      wm_row_char(line, ',');
      wm_row_short(line, numbers[k]);
    }
    end(self, HYPOTHESES);
  }
}

static void put(void *context, wm_output_kind kind, const void *record, size_t bytes) {
  (void)bytes;
  wm_run_folder *self = context;
  evidence_put(&self->evidence, kind, record);
  switch (kind) {
    case WM_OUTPUT_EVENT: wm_log_write_event(&self->log, record); break;
    case WM_OUTPUT_POSE: fused_pose(self, record); break;
    case WM_OUTPUT_INNOVATION: innovation(self, record); break;
    case WM_OUTPUT_PUBLISHED:
      self->newest = ((const wm_published *)record)->now;
      self->newest_floor = wm_published_floor(record);
      published(self, record);
      break;
    case WM_OUTPUT_BOUND: self->bound = *(const wm_bound *)record; break;
    case WM_OUTPUT_PARTICLES: particles(self, record); break;
    case WM_OUTPUT_HYPOTHESES: hypotheses(self, record); break;
    case WM_OUTPUT_HEALTH: break;  // written once, at the end
  }
}

wm_output wm_run_folder_output(wm_run_folder *self) { return (wm_output){.put = put, .context = self}; }

void wm_run_folder_gap(wm_run_folder *self, uint64_t missing_events) { wm_log_write_gap(&self->log, missing_events); }

// ── open and close ──────────────────────────────────────────────────────────────────────────────────────────────────

static wm_status make_dir(const char *dir, wm_error *err) {
  char path[WM_PATH_MAX];
  size_t length = strlen(dir);
  if (length >= sizeof path) return wm_fail(err, WM_BAD_USAGE, "%s: the path is too long", dir);
  memcpy(path, dir, length + 1);
  for (char *slash = path + 1; *slash; slash++) {
    if (*slash != '/') continue;
    *slash = '\0';
    (void)mkdir(path, 0777);  // a failure shows at the first file
    *slash = '/';
  }
  struct stat there;
  if (mkdir(path, 0777) != 0 && errno != EEXIST)
    return wm_fail(err, WM_IO, "%s: the folder cannot be created: %s", dir, strerror(errno));
  if (stat(path, &there) != 0 || !S_ISDIR(there.st_mode))
    return wm_fail(err, WM_IO, "%s: there is a file of this name; choose another --out", dir);
  return WM_OK;
}

static wm_status open_table(wm_run_folder *self, int which, wm_error *err) {
  table *t = &self->tables[which];
  if (which == PARTICLES && !self->assembly->config->estimator->particles) return WM_OK;
  if (which == HYPOTHESES && !self->assembly->config->estimator->hypotheses) return WM_OK;
  t->file = new_file(t->path);
  if (!t->file) return wm_fail(err, WM_IO, "%s: can't be written: %s", t->path, strerror(errno));
  setvbuf(t->file, t->buffer, _IOFBF, sizeof t->buffer);
  return WM_OK;
}

static void write_heads(wm_run_folder *self) {
  wm_row_text(begin(self), "t_ns,source,sensor,landmark,residual,observed,expected,variance,nis,gate,verdict");
  end(self, INNOVATIONS);
  if (self->tables[PARTICLES].file) {
    wm_row_text(begin(self), "t_ns,x_m,y_m,heading_rad,weight");
    end(self, PARTICLES);
  }
  if (self->tables[HYPOTHESES].file) {
    wm_row_text(begin(self), "t_ns,x_m,y_m,heading_rad,cov_xx,cov_xy,cov_yy,cov_xt,cov_yt,cov_tt,weight");
    end(self, HYPOTHESES);
  }
}

// Two writers would destroy each other's files. Where the file system has no locks, nobody is kept out.
static wm_status lock_dir(wm_run_folder *self, wm_error *err) {
  self->lock = open(self->dir, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (self->lock < 0 || flock(self->lock, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK) return WM_OK;
  return wm_fail(err, WM_BAD_USAGE, "%s: another run writes to this folder: choose another one", self->dir);
}

wm_status wm_run_folder_open(const char *dir, const wm_assembly *assembly, wm_run_folder **out, wm_error *err) {
  *out = NULL;
  wm_status status = make_dir(dir, err);
  if (status != WM_OK) return status;
  wm_run_folder *self = calloc(1, sizeof *self);
  if (!self) return wm_fail(err, WM_IO, "%s: no memory", dir);
  (void)snprintf(self->dir, sizeof self->dir, "%s", dir);
  self->assembly = assembly;
  self->newest.t_ns = WM_TIME_NONE;
  for (int i = 0; i < TABLE_COUNT; i++)
    (void)snprintf(self->tables[i].path, sizeof self->tables[i].path, "%s/%s", dir, kTables[i]);
  status = lock_dir(self, err);
  for (int i = 0; i < TABLE_COUNT && status == WM_OK; i++) status = open_table(self, i, err);
  if (status == WM_OK) {
    char path[WM_PATH_MAX + 32];
    (void)snprintf(path, sizeof path, "%s/events.wmlog", dir);
    status = wm_log_create(&self->log, path, assembly, err);
  }
  if (status != WM_OK) {
    (void)wm_run_folder_close(self, NULL);
    return status;
  }
  write_heads(self);
  *out = self;
  return WM_OK;
}

// ── a limit of their size ───────────────────────────────────────────────────────────────────────────────────────────

void wm_run_folder_limit(wm_run_folder *self, uint64_t bytes) { self->bytes_max = bytes; }

static uint64_t size_of(FILE *file) {
  const off_t at = file ? ftello(file) : 0;
  return at > 0 ? (uint64_t)at : 0;
}

// "DIR/trajectory.csv" becomes "DIR/trajectory.1.csv".
static int put_aside(const char *path) {
  char aside[WM_PATH_MAX + 40];
  const char *dot = strrchr(path, '.');
  (void)snprintf(aside, sizeof aside, "%.*s.1%s", (int)(dot - path), path, dot);
  return rename(path, aside) == 0 ? 0 : errno;
}

static wm_status begin_table_again(wm_run_folder *self, int which, wm_error *err) {
  table *t = &self->tables[which];
  if (!t->file) return WM_OK;
  int failed = fclose(t->file) != 0 ? errno : put_aside(t->path);
  t->file = NULL;
  wm_status status = failed ? wm_fail(err, WM_IO, "%s: can't be put aside: %s", t->path, strerror(failed))
                            : open_table(self, which, err);
  if (status != WM_OK) t->failed = failed ? failed : EIO;  // nothing is written from here on
  return status;
}

// Begins at the newest pose, as a log of the black box.
static wm_status begin_log_again(wm_run_folder *self, wm_error *err) {
  char path[WM_PATH_MAX + 32];
  (void)snprintf(path, sizeof path, "%s/events.wmlog", self->dir);
  wm_status status = wm_log_close(&self->log, err);
  if (status != WM_OK) return status;
  const int failed = put_aside(path);
  self->log.failed = EIO;  // nothing is written until it has begun again
  if (failed) return wm_fail(err, WM_IO, "%s: can't be put aside: %s", path, strerror(failed));
  self->continued = *self->assembly;
  self->continued.kept = NULL;
  if (self->newest.t_ns != WM_TIME_NONE) {
    wm_start_from_estimate(&self->newest, self->continued.setup.motion, 0, &self->continued.setup.start);
    self->continued.start_floor = self->newest_floor;
  }
  status = wm_log_create(&self->log, path, &self->continued, err);
  if (status != WM_OK) self->log.failed = EIO;
  return status;
}

static wm_status keep_limit(wm_run_folder *self, wm_error *err) {
  uint64_t bytes = size_of(self->log.file);
  for (int i = 0; i < TABLE_COUNT; i++) bytes += size_of(self->tables[i].file);
  if (self->bytes_max == 0 || bytes < self->bytes_max / 2) return WM_OK;
  wm_status status = begin_log_again(self, err);
  for (int i = 0; i < TABLE_COUNT && status == WM_OK; i++) status = begin_table_again(self, i, err);
  if (status != WM_OK) return status;
  self->trajectory_has_head = self->published_has_head = 0;
  write_heads(self);
  return WM_OK;
}

wm_status wm_run_folder_flush(wm_run_folder *self, wm_error *err) {
  wm_log_flush(&self->log);
  if (self->log.failed)
    return wm_fail(err, WM_IO, "%s/events.wmlog: can't be written on: %s", self->dir, strerror(self->log.failed));
  for (int i = 0; i < TABLE_COUNT; i++) {
    table *t = &self->tables[i];
    if (!t->file) continue;
    if (fflush(t->file) != 0 && !t->failed) t->failed = errno ? errno : EIO;
    if (t->failed) return wm_fail(err, WM_IO, "%s: can't be written on: %s", t->path, strerror(t->failed));
  }
  return keep_limit(self, err);
}

wm_status wm_run_folder_health(wm_run_folder *self, const wm_health *health, wm_findings *found, wm_error *err) {
  const uint64_t due = evidence_due(&self->evidence, self->assembly->config->runtime.publish_rate_hz);
  evidence_judge(&self->evidence, self->assembly, health, due, found);
  wm_health_findings(health, found);
  wm_status status = wm_write_search_outcomes(self->dir, self->assembly->vision, err);
  return status == WM_OK ? wm_write_health_json(self->dir, self->assembly, health, found, err) : status;
}

wm_status wm_run_folder_timing(wm_run_folder *self, const wm_timing *timing, wm_error *err) {
  return wm_write_timing_json(self->dir, timing, err);
}

static wm_status write_joint_map(const char *dir, const wm_assembly *assembly, const void *state, wm_error *err) {
  const wm_config *config = assembly->config;
  const wm_setup *setup = &assembly->setup;
  const wm_keeper *keeper = wm_keeper_of(config->estimator);
  const size_t capacity = keeper ? keeper->bytes_max(config->estimator_params, setup) : 0;
  if (capacity == 0 || capacity > WM_SAVED_MAP_BYTES_MAX) return WM_OK;
  void *image = malloc(capacity);
  if (!image) return wm_fail(err, WM_IO, "%s: no memory for the map", dir);
  const size_t bytes = keeper->keep(state, image, capacity);
  char path[WM_PATH_MAX + 32];
  (void)snprintf(path, sizeof path, "%s/map-estimate.wmmap", dir);
  const wm_map_identity identity = wm_map_identity_of(config, setup);
  const wm_status status = bytes > 0 ? wm_saved_map_write(path, &identity, 0.0, image, bytes, err) : WM_OK;
  free(image);
  return status;
}

wm_status wm_run_folder_map(wm_run_folder *self, const void *state, wm_error *err) {
  const wm_status status = wm_write_map(self->dir, self->assembly->config->estimator, state, err);
  return status == WM_OK ? write_joint_map(self->dir, self->assembly, state, err) : status;
}

wm_status wm_run_folder_close(wm_run_folder *self, wm_error *err) {
  if (!self) return WM_OK;
  if (self->tables[TRAJECTORY].file) trajectory_head(self, 3);  // a run without a pose leaves a table without rows
  if (self->tables[PUBLISHED].file) published_head(self, 3);
  wm_status status = wm_log_close(&self->log, err);
  for (int i = 0; i < TABLE_COUNT; i++) {
    table *t = &self->tables[i];
    if (!t->file) continue;
    if (fclose(t->file) != 0 && !t->failed) t->failed = errno;
    if (t->failed && status == WM_OK)
      status = wm_fail(err, WM_IO, "%s: could not be written completely: %s", t->path, strerror(t->failed));
  }
  if (self->lock >= 0) (void)close(self->lock);
  free(self);
  return status;
}
