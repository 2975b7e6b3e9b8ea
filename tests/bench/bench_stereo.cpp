// SPDX-License-Identifier: Apache-2.0
// What a step of stereo_ekf costs: the prediction and all rows of one stereo pair, medians in microseconds, and the
// arithmetic in it as a share of what this machine can do with two lanes. Paper: 1.2 ms with known points, 15 ms with
// 30 found ones, on an Athlon 64 3200+.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <vector>

#include "timing.h"
#include "waymark/estimator.h"
#include "waymark/random.h"

namespace {

const double kAbsent = std::numeric_limits<double>::quiet_NaN();
constexpr double kFocal = 420, kBaseline_m = 0.3, kCentre[2] = {321, 238.5};

// Multiplications and additions a second, two lanes, independent sums in registers.
double peak_flops() {
  typedef double pair __attribute__((vector_size(16)));
  double best = 0;
  for (int round = 0; round < 5; round++) {
    pair a = {1, 2}, b = {3, 4}, c = {5, 6}, d = {7, 8}, e = {9, 10}, f = {11, 12}, g = {13, 14}, h = {15, 16};
    const pair factor = {1.0 - 1e-9, 1.0 - 2e-9}, step = {1e-9, 2e-9};
    constexpr int kLoops = 2000000;
    const int64_t begin = bench::now_ns();
    for (int i = 0; i < kLoops; i++) {
      a = a * factor + step, b = b * factor + step, c = c * factor + step, d = d * factor + step;
      e = e * factor + step, f = f * factor + step, g = g * factor + step, h = h * factor + step;
    }
    const int64_t end = bench::now_ns();
    const pair all = a + b + c + d + e + f + g + h;
    volatile double keep = all[0] + all[1];
    (void)keep;
    best = std::max(best, 8.0 * 4.0 * kLoops / (double)(end - begin) * 1e9);
  }
  return best;
}

struct scene {
  std::vector<wm_landmark> points;  // looked at along x from about the origin
};

scene make_scene(int count) {
  scene out;
  for (int i = 0; i < count; i++) {
    const auto draw = [i](uint64_t k) { return wm_random_uniform(3, k, (uint64_t)i); };
    const double ahead = 2.5 + 2.0 * draw(0);
    out.points.push_back(
        {i + 1, {ahead, ahead * 0.9 * (draw(1) - 0.5), ahead * 0.7 * (draw(2) - 0.5)}, 0.001, kAbsent, {}, 0});
  }
  return out;
}

// The vehicle sways by centimetres; `seen` of the points at a time, all of them in turn.
void measure(const char *title, int count, int seen, bool known, double limit_us, double peak) {
  const wm_estimator *ekf = wm_estimator_find("stereo_ekf");
  std::vector<char> motion(wm_motion_params_table.bytes), params(ekf->params.bytes);
  std::vector<char> sightings(wm_sighting_params_table.bytes);
  wm_params_defaults(&wm_sighting_params_table, sightings.data());
  wm_params_defaults(&wm_motion_params_table, motion.data());
  wm_params_defaults(&ekf->params, params.data());
  const auto set = [&](const char *key, double value) {
    for (size_t i = 0; i < ekf->params.count; i++) {
      const wm_param &p = ekf->params.params[i];
      const auto whole = (int32_t)value;
      if (std::strcmp(p.key, key) != 0) continue;
      if (p.type == WM_PARAM_F64)
        std::memcpy(&params[p.offset], &value, sizeof value);
      else
        std::memcpy(&params[p.offset], &whole, sizeof whole);
    }
  };
  set("noise.pixel_px", 0.5);
  set("increments.on", 0);  // all tracks are points of the state
  set("slam.points", known ? 0 : count);
  set("slam.keep_unseen_steps", 1000000);
  const scene world = make_scene(count);
  wm_rig rig;
  wm_rig_init(&rig);
  rig.camera_count = 2;
  rig.cameras[0].width_px = rig.cameras[1].width_px = 640;
  rig.cameras[0].height_px = rig.cameras[1].height_px = 480;
  rig.stereo = {0, 1, kBaseline_m, {kFocal, kFocal, kCentre[0], kCentre[1]}, {0.5, 0.5, 0.5, 0.5}};
  wm_setup setup{};
  setup.motion = reinterpret_cast<const wm_motion_params *>(motion.data());
  setup.sightings = reinterpret_cast<const wm_sighting_params *>(sightings.data());
  setup.wheels = {kAbsent, kAbsent, kAbsent, kAbsent, kAbsent, kAbsent, 0, {}, {}};
  setup.landmarks = world.points.data();
  setup.landmark_count = known ? world.points.size() : 0;
  setup.rig = &rig;
  setup.start = {WM_TIME_NONE, {0, 0, 0}, {0, 0, 0, 1}, 0, 0.01, 0.01};
  const char *why = "";
  const size_t bytes = ekf->state_bytes(params.data(), &setup, &why);
  if (bytes == 0) {
    std::printf("%s: %s\n", title, why);
    std::exit(1);
  }
  void *state = std::aligned_alloc(64, (bytes + 63) / 64 * 64);
  ekf->init(state, params.data(), &setup);

  std::vector<double> cost;
  size_t fused = 0, rejected = 0;
  const int steps = bench::is_short() ? 30 : known ? 20000 : 600;
  uint64_t draw = 0;
  for (int i = 0; i < steps; i++) {
    const double t = 0.1 * i, place[2] = {0.05 * sin(0.7 * t), 0.05 * (1 - cos(0.7 * t))};
    wm_event twist{};
    twist.t_ns = wm_ns_from_seconds(t);
    twist.kind = WM_EVENT_TWIST6;
    twist.as.twist6.v_mps[1] = 0.035 * cos(0.7 * t);
    twist.as.twist6.v_mps[2] = 0.035 * sin(0.7 * t);
    std::vector<wm_event> picture;
    for (int k = 0; k < (i < 10 ? count : seen); k++) {
      const wm_landmark &l = world.points[(size_t)((i * seen + k) % count)];
      const double x = -(l.p_m[1] - place[0]), y = -(l.p_m[2] - place[1]), z = l.p_m[0];
      wm_event e{};
      e.t_ns = twist.t_ns;
      e.kind = WM_EVENT_STEREO;
      e.as.stereo.id = l.id;
      const auto noise = [&draw] { return 0.5 * wm_random_normal(5, 1, draw++); };
      for (int side = 0; side < 2; side++) {
        double *px = side ? e.as.stereo.right_px : e.as.stereo.left_px;
        px[0] = kCentre[0] + kFocal * (x - side * kBaseline_m) / z + noise();
        px[1] = kCentre[1] + kFocal * y / z + noise();
      }
      picture.push_back(e);
    }
    wm_innovation records[8];
    size_t n;
    const int64_t begin = bench::now_ns();
    (void)ekf->predict(state, &twist);
    for (const wm_event &e : picture) {
      (void)ekf->correct(state, &e, records, 8, &n);
      (records[0].verdict == WM_FUSED ? fused : rejected)++;
    }
    const int64_t end = bench::now_ns();
    if (i >= 20) cost.push_back((double)(end - begin) * 1e-3);
  }
  if (rejected > fused / 50) {
    std::printf("%s: %zu of %zu rejected: not what was meant to be measured\n", title, rejected, fused);
    std::exit(1);
  }
  // Of an observation: the covariance's triangle takes 8 operations an entry, the gain 8 for each of 9 columns and row;
  // once a picture 12 an entry of the triangle.
  const double states = 6 + (known ? 0 : 3.0 * count);
  const double work = seen * (4 * states * states + 72 * states) + (known ? 0 : 6 * states * states);
  const double us = bench::median(cost);
  std::printf("%-58s %8.2f us (at most %.0f), %4.1f MFLOP, %2.0f %% of peak\n", title, us, limit_us, work * 1e-6,
              100 * work / (us * 1e-6) / peak);
  std::free(state);
}

}  // namespace

int main() {
  const double peak = peak_flops();
  std::printf("two lanes of multiply and add: %.1f GFLOP/s\n", peak * 1e-9);
  measure("4 known points", 4, 4, true, 5, peak);
  measure("30 points in the state, all seen (120 rows)", 30, 30, false, 500, peak);
  measure("100 points in the state, 30 seen", 100, 30, false, 4000, peak);
  return 0;
}
