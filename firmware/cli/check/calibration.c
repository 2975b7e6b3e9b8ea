// SPDX-License-Identifier: Apache-2.0
// Plausibility of a calibration. Most mistakes are a unit (mm, degrees), another size of picture, or a sign.
#include <math.h>
#include <string.h>

#include "cli/check/check.h"

#define ABOUT "calibration"
static const double kDegree = M_PI / 180;

static int is_outside(double value, double least, double most) {
  return isfinite(value) && (value < least || value > most);
}

// ── wheels ──────────────────────────────────────────────────────────────────────────────────────────────────────────

static void length_of(const char *key, double value_m, double least_m, double most_m, wm_findings *out) {
  if (is_outside(value_m, least_m, most_m))
    wm_find(out, WM_FOUND_LENGTH_IMPLAUSIBLE, WM_SEVERITY_BAD, ABOUT, "metres are meant: was it measured in mm or cm?",
            "wheels.%s: %g m is outside the range of vehicles (%g to %g m)", key, value_m, least_m, most_m);
}

static void wheels(const wm_wheels *w, wm_findings *out) {
  length_of("radius_m", w->radius_m, 0.01, 1.5, out);
  length_of("track_m", w->track_m, 0.05, 5, out);
  length_of("wheelbase_m", w->wheelbase_m, 0.05, 12, out);
  length_of("encoder_offset_m", fabs(w->encoder_offset_m), 0, 5, out);
  double way_m = 2 * M_PI * w->radius_m / w->ticks_per_turn;
  if (is_outside(way_m, 1e-7, 0.3))
    wm_find(out, WM_FOUND_GEAR_IMPLAUSIBLE, WM_SEVERITY_BAD, ABOUT,
            "ticks_per_turn is of the wheel, not of the motor: multiply by the gear's ratio once",
            "wheels.ticks_per_turn: with radius_m %g a tick would be %.3g m of way", w->radius_m, way_m);
  if (is_outside(w->steering_ratio, 1, 60))
    wm_find(out, WM_FOUND_GEAR_IMPLAUSIBLE, WM_SEVERITY_BAD, ABOUT,
            "turns of the steering wheel for one of the road wheel: 12 to 20 in cars",
            "wheels.steering_ratio: %g is not the ratio of a steering gear", w->steering_ratio);
}

// ── cameras ─────────────────────────────────────────────────────────────────────────────────────────────────────────

// Focal lengths and centre; 0 where the model has other parameters.
static int focal_and_centre(const wm_camera *c, double f[2], double centre[2]) {
  static const int kAt[WM_CAMERA_MODEL_COUNT] = {0, 0, 1, 2, -1};
  int at = kAt[c->model];
  if (at < 0) return 0;
  for (int i = 0; i < 2; i++) {
    f[i] = c->intrinsics[at + i];
    centre[i] = c->intrinsics[at + 2 + i];
  }
  return 1;
}

// Angle from the optical axis of a pixel at `radius` (in focal lengths), without distortion.
static double angle_at(const wm_camera *c, double radius) {
  return c->model == WM_CAMERA_PINHOLE_RADTAN ? atan(radius) : radius;
}

// Whether the radius in the picture grows with the angle up to the picture's side.
static int is_folded(const wm_camera *c, double side) {
  if (c->model != WM_CAMERA_EQUIDISTANT && c->model != WM_CAMERA_PINHOLE_RADTAN) return 0;
  const double *k = c->distortion;
  int is_fisheye = c->model == WM_CAMERA_EQUIDISTANT;
  double k3 = is_fisheye ? k[2] : k[4], k4 = is_fisheye ? k[3] : 0, before = 0;
  for (double x = side / 200;; x += side / 200) {
    double s = x * x, r = x * (1 + s * (k[0] + s * (k[1] + s * (k3 + s * k4))));
    if (r <= before) return 1;
    if (r >= side || x > 4 * side) return r < side;
    before = r;
  }
}

static void intrinsics(const wm_camera *c, wm_findings *out) {
  double f[2], centre[2], size[2] = {c->width_px, c->height_px};
  if (c->width_px == 0 || !focal_and_centre(c, f, centre)) return;
  const char *another = "calibrate in the size that the camera sends (or scale all four by the ratio of the sizes)";
  if (f[0] / f[1] < 0.8 || f[0] / f[1] > 1.25)
    wm_find(out, WM_FOUND_CAMERA_IMPLAUSIBLE, WM_SEVERITY_BAD, ABOUT,
            "both are pixels; they differ by the pixels' shape alone, which is square",
            "cameras.%s.intrinsics: fx %g and fy %g", c->name, f[0], f[1]);
  for (int i = 0; i < 2; i++)
    if (fabs(centre[i] - size[i] / 2) > size[i] / 4) {
      wm_find(out, WM_FOUND_CAMERA_IMPLAUSIBLE, WM_SEVERITY_BAD, ABOUT, another,
              "cameras.%s.intrinsics: the centre (%g, %g) is far from the middle of %u x %u pixels", c->name, centre[0],
              centre[1], c->width_px, c->height_px);
      break;
    }
  double side = size[0] / 2 / f[0], degrees = 2 * angle_at(c, side) / kDegree;
  double most = c->model == WM_CAMERA_PINHOLE_RADTAN ? 150 : 300;
  if (c->model > WM_CAMERA_PINHOLE_RADTAN) return;
  if (degrees < 8 || degrees > most)
    wm_find(out, WM_FOUND_CAMERA_IMPLAUSIBLE, WM_SEVERITY_BAD, ABOUT,
            "focal lengths are pixels of a picture of this size",
            "cameras.%s.intrinsics: with fx %g the picture would be %.1f degrees wide", c->name, f[0], degrees);
  else if (is_folded(c, side))
    wm_find(out, WM_FOUND_CAMERA_IMPLAUSIBLE, WM_SEVERITY_BAD, ABOUT,
            "look at the order of the coefficients, and whether they are of this model",
            "cameras.%s.distortion: the picture would fold back within itself", c->name);
}

static void shutter(const wm_camera *c, wm_findings *out) {
  if ((c->readout_ns > 0 && c->readout_ns < 10000) || c->readout_ns > 200 * WM_NS_PER_MS)
    wm_find(out, WM_FOUND_CAMERA_IMPLAUSIBLE, WM_SEVERITY_BAD, ABOUT,
            "nanoseconds are meant: 10 to 40 ms (10000000 to 40000000) is usual, 0 is global",
            "cameras.%s.readout_ns: %lld ns from the first row to the last", c->name, (long long)c->readout_ns);
}

static void mounting(const char *kind, const char *name, const wm_mounting *m, wm_findings *out) {
  double far_m = sqrt(m->xyz_m[0] * m->xyz_m[0] + m->xyz_m[1] * m->xyz_m[1] + m->xyz_m[2] * m->xyz_m[2]);
  if (far_m > 25)
    wm_find(out, WM_FOUND_LENGTH_IMPLAUSIBLE, WM_SEVERITY_BAD, ABOUT, "metres are meant: was it measured in mm or cm?",
            "%s.%s.mounting.xyz_m: %.4g m from base_link", kind, name, far_m);
}

static int looks_for_edges(const wm_config *config) {
  for (size_t i = 0; i < config->vision_count; i++)
    if (strcmp(config->vision[i].detector->name, "edges") == 0) return 1;
  return 0;
}

// Edges on the floor are detected from above the floor.
static void sees_the_floor(const wm_camera *c, wm_findings *out) {
  double f[2], centre[2];
  if (c->mounting.xyz_m[2] <= 0.02) {
    wm_find(out, WM_FOUND_CAMERA_IMPLAUSIBLE, WM_SEVERITY_BAD, ABOUT,
            "xyz_m's third number is the height above the floor",
            "cameras.%s.mounting.xyz_m: the camera is at or under the floor (z %g m), on which edges are detected",
            c->name, c->mounting.xyz_m[2]);
    return;
  }
  if (c->width_px == 0 || c->model > WM_CAMERA_PINHOLE_RADTAN || !focal_and_centre(c, f, centre)) return;
  double down_rad = asin(sin(c->mounting.rpy_rad[1]));
  double half_rad = angle_at(c, hypot(c->width_px / 2.0 / f[0], c->height_px / 2.0 / f[1]));
  if (down_rad + half_rad < 0)
    wm_find(out, WM_FOUND_CAMERA_IMPLAUSIBLE, WM_SEVERITY_BAD, ABOUT,
            "a positive pitch (rpy's second number) looks down",
            "cameras.%s.mounting: the camera points up by %.0f degrees; the floor is never in view", c->name,
            -down_rad / kDegree);
}

// ── sensors and pairs ───────────────────────────────────────────────────────────────────────────────────────────────

static void sensor(const wm_sensor *s, wm_findings *out) {
  if (s->bearing_sigma_rad > 0.5)
    wm_find(out, WM_FOUND_NOISE_IMPLAUSIBLE, WM_SEVERITY_BAD, ABOUT,
            "radians are meant; bearing_sigma_deg takes degrees",
            "sensors.%s.bearing_sigma_rad: %g rad are %.0f degrees", s->name, s->bearing_sigma_rad,
            s->bearing_sigma_rad / kDegree);
  if (s->range_sigma_m > 20)
    wm_find(out, WM_FOUND_NOISE_IMPLAUSIBLE, WM_SEVERITY_BAD, ABOUT, "metres are meant: was it measured in mm or cm?",
            "sensors.%s.range_sigma_m: %g m is too large to be of use", s->name, s->range_sigma_m);
  if (s->max_range_m < 0.2)
    wm_find(out, WM_FOUND_NOISE_IMPLAUSIBLE, WM_SEVERITY_BAD, ABOUT,
            "metres are meant; leave it out where there is no limit",
            "sensors.%s.max_range_m: beyond %g m nothing would be taken", s->name, s->max_range_m);
}

static void stereo(const wm_rig *rig, wm_findings *out) {
  const wm_stereo_pair *pair = &rig->stereo;
  if (pair->left < 0 || pair->right < 0) return;
  const wm_camera *l = &rig->cameras[pair->left];
  const wm_camera *r = &rig->cameras[pair->right];
  double d[3], far_m = 0;
  for (int i = 0; i < 3; i++) {
    d[i] = r->mounting.xyz_m[i] - l->mounting.xyz_m[i];
    far_m += d[i] * d[i];
  }
  far_m = sqrt(far_m);
  if (pair->left == pair->right)
    wm_find(out, WM_FOUND_STEREO_IMPLAUSIBLE, WM_SEVERITY_BAD, ABOUT, "name two cameras",
            "stereo: left and right are the same camera");
  else if (isfinite(pair->baseline_m) && fabs(pair->baseline_m - far_m) > 0.005 + 0.05 * far_m)
    wm_find(out, WM_FOUND_LENGTH_IMPLAUSIBLE, WM_SEVERITY_BAD, ABOUT,
            "one of the two is wrong; a calibration of the pair gives both",
            "stereo.baseline_m: %g, but the mountings of %s and %s are %.4f m apart", pair->baseline_m, l->name,
            r->name, far_m);
  // The left camera's y axis (to its left) in base_link: the second column of Rz(yaw) Ry(pitch) Rx(roll).
  const double *a = l->mounting.rpy_rad;
  double y[3] = {cos(a[2]) * sin(a[1]) * sin(a[0]) - sin(a[2]) * cos(a[0]),
                 sin(a[2]) * sin(a[1]) * sin(a[0]) + cos(a[2]) * cos(a[0]), cos(a[1]) * sin(a[0])};
  if (y[0] * d[0] + y[1] * d[1] + y[2] * d[2] > 0.2 * far_m)
    wm_find(out, WM_FOUND_STEREO_IMPLAUSIBLE, WM_SEVERITY_BAD, ABOUT,
            "swap stereo.left and stereo.right, or correct the mountings",
            "stereo: by the mountings the right camera, %s, is to the left of %s", r->name, l->name);
}

void check_calibration(const wm_assembly *assembly, wm_findings *out) {
  const wm_setup *setup = &assembly->setup;
  const wm_rig *rig = setup->rig;
  wheels(&setup->wheels, out);
  for (uint32_t i = 0; i < rig->camera_count; i++) {
    const wm_camera *c = &rig->cameras[i];
    intrinsics(c, out);
    shutter(c, out);
    mounting("cameras", c->name, &c->mounting, out);
    if (looks_for_edges(assembly->config)) sees_the_floor(c, out);
  }
  for (size_t i = 0; i < setup->sensor_count; i++) {
    sensor(&setup->sensors[i], out);
    if (wm_rig_find_camera(rig, setup->sensors[i].name) < 0)
      mounting("sensors", setup->sensors[i].name, &setup->sensors[i].mounting, out);
  }
  stereo(rig, out);
  if (rig->marker_size_m > 2)
    wm_find(out, WM_FOUND_LENGTH_IMPLAUSIBLE, WM_SEVERITY_BAD, ABOUT, "metres are meant: was it measured in mm or cm?",
            "markers.size_m: %g m is not a plausible edge of a marker's black square", rig->marker_size_m);
}
