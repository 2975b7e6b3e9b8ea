// SPDX-License-Identifier: Apache-2.0
#include "output/saved_pose.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "output/replace_file.h"
#include "waymark/recording.h"
#include "waymark/yaml.h"

// A doubtful pose is saved with its covariance; an older one would be as wrong with a smaller covariance. The same
// holds for one that is lost: it replaces the older one, and the next run searches.
#define SIGMA_XY_MAX_M 50.0         // a less certain pose is worse than a search
#define SIGMA_HEADING_MAX_RAD M_PI  // likewise
#define SIGMA_ANY_HEADING_RAD 1.81  // pi / sqrt(3): all headings are as likely
#define GOES_ON_S 2.0               // motion at the last speed that is assumed after the save
#define DRIVES_S 10.0               // age up to which the robot may still drive

// ── writing ─────────────────────────────────────────────────────────────────────────────────────────────────────────

// The larger axis of the position's ellipse: a start has one sigma for both axes.
static double sigma_xy(const double *p) {
  double a = p[wm_cov_index(0, 0)], b = p[wm_cov_index(0, 1)], c = p[wm_cov_index(1, 1)];
  double half = 0.5 * (a - c), root = sqrt(half * half + b * b);
  return sqrt(fmax(0.5 * (a + c) + root, 0));
}

static double sigma_heading(const double *p) { return sqrt(fmax(p[wm_cov_index(5, 5)], 0)); }

int wm_saved_pose_is_one(const wm_estimate *e) {
  if (e->state == WM_STATE_SEARCHING) return 0;
  for (int i = 0; i < 3; i++)
    if (!isfinite(e->pose_map_base.p_m[i])) return 0;
  return isfinite(e->heading_rad);
}

int wm_saved_pose_is_worth_it(const wm_estimate *e) {
  if (e->state == WM_STATE_LOST || !wm_saved_pose_is_one(e)) return 0;
  return sigma_xy(e->covariance) < SIGMA_XY_MAX_M && sigma_heading(e->covariance) < SIGMA_HEADING_MAX_RAD;
}

static const char kLost[] = "lost";

static double finite_or_0(double value) { return isfinite(value) ? value : 0; }

// In single quotes, of which YAML doubles one inside.
static void quote(const char *name, char out[2 * WM_NAME_MAX + 4]) {
  size_t n = 0;
  out[n++] = '\'';
  for (size_t i = 0; i < WM_NAME_MAX && name[i]; i++) {
    if (name[i] == '\'') out[n++] = '\'';
    out[n++] = name[i];
  }
  out[n++] = '\'';
  out[n] = '\0';
}

wm_status wm_saved_pose_write(const char *path, const wm_estimate *e, const char *floor, double utc_s, wm_error *err) {
  char text[720], quoted[2 * WM_NAME_MAX + 4];
  if (floor) quote(floor, quoted);
  const double *p = e->pose_map_base.p_m, *q = e->pose_map_base.q_xyzw;
  int length = snprintf(text, sizeof text,
                        "# Where the robot was last; written and read by waymark run.\n"
                        "format: waymark-pose/1\nutc_s: %.3f\n"
                        "pose: {x_m: %.6f, y_m: %.6f, z_m: %.6f, heading_rad: %.9f, qx: %.12f, qy: %.12f, qz: %.12f, "
                        "qw: %.12f, sigma_xy_m: %.6f, sigma_heading_rad: %.6f}\n"
                        "state: %s\nspeed_mps: %.4f\nrate_radps: %.5f\n%s%s%s",
                        utc_s, p[0], p[1], p[2], e->heading_rad, q[0], q[1], q[2], q[3],
                        fmax(sigma_xy(e->covariance), 1e-6), fmax(sigma_heading(e->covariance), 1e-6),
                        wm_saved_pose_is_worth_it(e) ? "known" : kLost, finite_or_0(e->v_mps[0]),
                        finite_or_0(e->w_radps[2]), floor ? "floor: " : "", floor ? quoted : "", floor ? "\n" : "");
  const file_part part = {text, (size_t)length < sizeof text ? (size_t)length : sizeof text - 1};
  return replace_file(path, &part, 1, err);
}

// ── reading ─────────────────────────────────────────────────────────────────────────────────────────────────────────

static wm_status read_root(const wm_yaml_node *root, wm_saved_pose *out, wm_error *err) {
  char format[64], state[16] = "";
  wm_yaml_node version = wm_yaml_get(root, "format"), utc = wm_yaml_get(root, "utc_s"),
               pose = wm_yaml_get(root, "pose"), speed = wm_yaml_get(root, "speed_mps"),
               rate = wm_yaml_get(root, "rate_radps"), known = wm_yaml_get(root, "state"),
               floor = wm_yaml_get(root, "floor");
  if (!wm_yaml_is_map(root) || !wm_yaml_there(&version) || !wm_yaml_there(&utc) || !wm_yaml_there(&pose))
    return wm_yaml_fail(root, err, "is not a saved pose (format, utc_s, pose)");
  wm_status status = wm_yaml_string(&version, format, sizeof format, err);
  if (status == WM_OK && strcmp(format, "waymark-pose/1") != 0)
    return wm_yaml_fail(&version, err, "'%s' is not a format that this program reads; it reads waymark-pose/1", format);
  if (status == WM_OK) status = wm_yaml_f64(&utc, -1e12, 1e12, &out->utc_s, err);
  if (status == WM_OK) status = wm_start_read(&pose, &out->start, err);
  if (status == WM_OK && wm_yaml_there(&speed)) status = wm_yaml_f64(&speed, -1000, 1000, &out->speed_mps, err);
  if (status == WM_OK && wm_yaml_there(&rate)) status = wm_yaml_f64(&rate, -1000, 1000, &out->rate_radps, err);
  if (status == WM_OK && wm_yaml_there(&known)) status = wm_yaml_string(&known, state, sizeof state, err);
  out->has_floor = wm_yaml_there(&floor);
  if (status == WM_OK && out->has_floor) status = wm_yaml_string(&floor, out->floor, sizeof out->floor, err);
  out->is_lost = strcmp(state, kLost) == 0;
  out->start.t_ns = WM_TIME_NONE;
  if (status == WM_OK && !isfinite(out->start.p_m[0] + out->start.p_m[1] + out->start.heading_rad))
    return wm_yaml_fail(&pose, err, "x_m, y_m or heading_rad is missing");
  return status;
}

wm_status wm_saved_pose_read(const char *path, wm_saved_pose *out, wm_error *err) {
  wm_yaml *doc;
  memset(out, 0, sizeof *out);
  if (access(path, F_OK) != 0) return wm_fail(err, WM_NOT_FOUND, "%s: is not there", path);
  wm_status status = wm_yaml_load(path, &doc, err);
  if (status != WM_OK) return status;
  wm_yaml_node root = wm_yaml_root(doc);
  status = read_root(&root, out, err);
  wm_yaml_free(doc);
  return status;
}

// Continued along the arc of the last motion.
static void go_on(wm_start *start, double way_m, double turn_rad) {
  double middle = start->heading_rad + 0.5 * turn_rad, half = 0.5 * turn_rad;
  double s = sin(half), c = cos(half), *q = start->q_xyzw, x = q[0], y = q[1], z = q[2], w = q[3];
  start->p_m[0] += way_m * cos(middle);
  start->p_m[1] += way_m * sin(middle);
  start->heading_rad = remainder(start->heading_rad + turn_rad, 2 * M_PI);
  // Turned about the map's z axis.
  q[0] = c * x - s * y;
  q[1] = c * y + s * x;
  q[2] = c * z + s * w;
  q[3] = c * w - s * z;
}

static double together(double a, double b, double c, double d) { return sqrt(a * a + b * b + c * c + d * d); }

// A clock that went back (a board without a battery before its time is set) gives no age.
int wm_saved_pose_start(const wm_saved_pose *saved, double utc_s, double max_age_s, double moved_m, double moved_rad,
                        const wm_motion_params *motion, wm_start *out) {
  double age_s = utc_s - saved->utc_s;
  if (age_s > max_age_s || saved->is_lost) return 0;
  *out = saved->start;
  int drives = age_s >= 0 && age_s <= DRIVES_S;
  double on_s = drives ? fmin(age_s, GOES_ON_S) : 0, blind_s = drives ? age_s : GOES_ON_S;
  double unseen_m, unseen_rad;
  wm_motion_unseen(motion, drives ? age_s : 0, &unseen_m, &unseen_rad);
  go_on(out, saved->speed_mps * on_s, saved->rate_radps * on_s);
  out->sigma_xy_m = together(out->sigma_xy_m, moved_m, saved->speed_mps * blind_s, unseen_m);
  out->sigma_heading_rad =
      fmin(together(out->sigma_heading_rad, moved_rad, saved->rate_radps * blind_s, unseen_rad), SIGMA_ANY_HEADING_RAD);
  return 1;
}

void wm_start_from_estimate(const wm_estimate *e, const wm_motion_params *motion, double blind_s, wm_start *out) {
  double speed_mps = sqrt(e->v_mps[0] * e->v_mps[0] + e->v_mps[1] * e->v_mps[1]);
  double xy = sigma_xy(e->covariance), heading = sigma_heading(e->covariance);
  double blind_m = speed_mps * blind_s, blind_rad = fabs(e->w_radps[2]) * blind_s, unseen_m, unseen_rad;
  wm_motion_unseen(motion, blind_s, &unseen_m, &unseen_rad);
  wm_start_init(out);
  memcpy(out->p_m, e->pose_map_base.p_m, sizeof out->p_m);
  memcpy(out->q_xyzw, e->pose_map_base.q_xyzw, sizeof out->q_xyzw);
  out->heading_rad = e->heading_rad;
  out->sigma_xy_m = together(xy, blind_m, unseen_m, 0);
  out->sigma_heading_rad = together(heading, blind_rad, unseen_rad, 0);
}
