// SPDX-License-Identifier: Apache-2.0
#include "map/train_cascade.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <random>

#include "common/failure.h"
#include "map/train_samples.h"
#include "waymark/internal/image/pyramid.hpp"
#include "waymark/internal/math/elementary.hpp"
#include "waymark/internal/vision/cascade/evaluate.hpp"

namespace wm::tools {
namespace {

constexpr double kTilt_rad = 0.021;  // as the detector's default has it
constexpr int kFewWindows = 150;     // so few windows left that are taken for it: trained enough

// The same numbers on every machine, which std's distributions don't promise.
class Chance {
 public:
  explicit Chance(uint64_t seed) : engine_(seed) {}
  double uniform() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }
  double uniform(double from, double to) { return from + (to - from) * uniform(); }

 private:
  std::mt19937_64 engine_;
};

// A picture's pyramid and panorama, one at a time for each camera.
class Eye {
 public:
  Eye(const mounted_camera &camera, const wm_cascade &cascade, double low_m, double high_m, double size_min_px)
      : camera_(camera), band_(band_of(cascade, low_m, high_m)) {
    const auto width = static_cast<int32_t>(camera.width_px), height = static_cast<int32_t>(camera.height_px);
    levels_.resize(pyramid_bytes(width, height));
    row_.resize(camera.width_px);
    pyramid_lay(&picture_, width, height, levels_.data());
    round_.need(band_.above + cascade.height_px, cascade.height_px - band_.below);
    round_.plan(camera, kTilt_rad, size_min_px / cascade.height_px);
    around_.resize(round_.bytes() + 64);
    auto *memory = around_.data();
    memory += (64 - reinterpret_cast<uintptr_t>(memory) % 64) % 64;
    round_.make(camera, memory);
  }

  void take(const std::vector<uint8_t> &grey) {
    wm_frame frame{};
    frame.width_px = frame.stride_bytes = camera_.width_px;
    frame.height_px = camera_.height_px;
    frame.grey = grey.data();
    pyramid_take(&picture_, frame, row_.data());
  }
  void look_around() { round_.take(picture_); }
  const panorama &round() const { return round_; }
  const window_band &band() const { return band_; }
  double finest_rad() const { return round_.cylinders[0].step_rad; }

  // A window about a direction, as the panorama would have it at this fineness. False where the picture ends.
  bool window(double azimuth_rad, double tangent, double step_rad, int width, int height, WindowSums *out) const {
    int level = 0;
    while (level + 1 < kLevels && (2 << level) * finest_px_rad() < 1.1 * step_rad) level++;
    const grey_plane &plane = picture_.level[level];
    const double scale = 1.0 / (1 << level);
    out->assign(static_cast<size_t>(width + 1) * static_cast<size_t>(height + 1), 0);
    for (int y = 0; y < height; y++) {
      uint32_t sum = 0;
      for (int x = 0; x < width; x++) {
        const sin_cos a = sincos(azimuth_rad - (x - 0.5 * (width - 1)) * step_rad);
        pixel at;
        if (!project(
                camera_.optics,
                transposed_times(camera_.R_base_optical, {a.cos, a.sin, tangent - (y - 0.5 * (height - 1)) * step_rad}),
                &at))
          return false;
        const double u = at.u * scale, v = at.v * scale;
        if (!(u >= 0 && v >= 0 && u < plane.width - 1.1 && v < plane.height - 1.1)) return false;
        const int iu = static_cast<int>(u), iv = static_cast<int>(v);
        const double fu = u - iu, fv = v - iv;
        const uint8_t *p = plane.grey + static_cast<ptrdiff_t>(iv) * plane.width + iu;
        const double grey =
            (1 - fv) * ((1 - fu) * p[0] + fu * p[1]) + fv * ((1 - fu) * p[plane.width] + fu * p[plane.width + 1]);
        sum += static_cast<uint32_t>(grey + 0.5);
        const ptrdiff_t i = static_cast<ptrdiff_t>(y + 1) * (width + 1) + x + 1;
        (*out)[static_cast<size_t>(i)] = (*out)[static_cast<size_t>(i - width - 1)] + sum;
      }
    }
    return true;
  }

 private:
  double finest_px_rad() const { return pixel_rad_; }

  const mounted_camera &camera_;
  window_band band_;
  pyramid picture_{};
  panorama round_{};
  std::vector<uint8_t> levels_, around_;
  std::vector<uint16_t> row_;

 public:
  double pixel_rad_ = 0;  // of the picture's middle
};

class Trainer {
 public:
  Trainer(const TrainCascade &a, Samples &samples)
      : a_(a),
        samples_(samples),
        height_m_(a.size_m[1] * (1 + 2 * a.margin)),
        cascade_(static_cast<int>(std::lround(a.rows_px * a.size_m[0] / a.size_m[1])), a.rows_px),
        chance_(a.seed) {
    cascade_.flatten(&flat_);
    flat_.view.height_m = height_m_;
    for (const auto &camera : samples.cameras) {
      eyes_.emplace_back(*camera, flat_.view, samples.low_m - 0.1, samples.high_m + 0.1, a.size_min_px);
      eyes_.back().pixel_rad_ = eyes_.back().finest_rad() * a.rows_px / a.size_min_px;
    }
  }

  void run() {
    find_things();
    std::printf("%zu windows of the class in %zu pictures\n", things_.size(), samples_.pictures.size());
    if (things_.size() < 200)
      throw Failure("fewer than 200 windows show the class: more recordings, or a smaller --size-min are needed");
    for (int stage = 0; stage < a_.stages; stage++) {
      find_others();
      if (static_cast<int>(others_.size()) < kFewWindows) {
        std::printf("%zu windows are still taken for it in all pictures: enough\n", others_.size());
        break;
      }
      const size_t fresh = others_.size();
      train_stage(things_, others_, {}, &cascade_);
      cascade_.flatten(&flat_);
      flat_.view.height_m = height_m_;
      const Stage &made = cascade_.stages.back();
      std::printf(
          "stage %2d: %2zu stumps keep %.4f of the class and %.3f of %zu other windows (one of %.0f looked at)\n",
          stage + 1, made.stumps.size(), made.kept, made.passed, fresh, looked_at_ / static_cast<double>(fresh));
      std::fflush(stdout);
    }
    char about[200];
    std::snprintf(about, sizeof about,
                  "waymark map train-cascade: landmarks of %g x %g m; a window shows %.4g m of height", a_.size_m[0],
                  a_.size_m[1], height_m_);
    write_cascade(cascade_, about, a_.out);
    std::printf("%s: {file: %s, height_m: %.4g}\n", a_.out.c_str(), a_.out.c_str(), height_m_);
  }

 private:
  Eye &eye_of(const LabelledPicture &picture) {
    for (size_t i = 0; i < samples_.cameras.size(); i++)
      if (samples_.cameras[i].get() == picture.camera) return eyes_[i];
    return eyes_[0];
  }

  // A window's angle for a pixel at that distance.
  double step_at(double distance_m) const { return height_m_ / distance_m / a_.rows_px; }

  void find_things() {
    constexpr double kScale = 0.13, kShift_px = 0.6;  // a cylinder's fineness and columns are not just so
    size_t there = 0;
    for (const LabelledPicture &p : samples_.pictures)
      for (const Place &place : p.places) there += place.is_labelled;
    const double each = static_cast<double>(a_.things) / static_cast<double>(std::max<size_t>(1, there));
    for (const LabelledPicture &p : samples_.pictures) {
      Eye &eye = eye_of(p);
      eye.take(p.grey);
      for (const Place &place : p.places) {
        if (!place.is_labelled || step_at(place.distance_m) < eye.finest_rad()) continue;
        double copies = each;
        for (; copies > 0; copies -= 1) {
          if (copies < 1 && chance_.uniform() > copies) break;
          const double step = step_at(place.distance_m) * std::exp(chance_.uniform(-kScale, kScale));
          WindowSums sums;
          if (eye.window(place.azimuth_rad + chance_.uniform(-kShift_px, kShift_px) * step,
                         place.tangent + chance_.uniform(-kShift_px, kShift_px) * step, step, cascade_.width_px,
                         cascade_.height_px, &sums))
            things_.push_back(std::move(sums));
        }
      }
    }
  }

  bool shows_one(const LabelledPicture &p, double azimuth_rad, double tangent, double width) const {
    return std::any_of(p.places.begin(), p.places.end(), [&](const Place &place) {
      const double size = std::max(width, step_at(place.distance_m) * cascade_.width_px);
      return std::fabs(std::remainder(place.azimuth_rad - azimuth_rad, 2 * M_PI)) < 0.5 * size &&
             std::fabs(place.tangent - tangent) < 0.5 * size;
    });
  }

  // Windows that all stages so far let through; those of a stage before that still are among them stay.
  void find_others() {
    constexpr int kOfPicture = 40;
    std::erase_if(others_, [&](const WindowSums &sums) {
      double surplus;
      return stages_passed(flat_.view, {sums.data(), nullptr, cascade_.width_px + 1}, 0, 0, &surplus) <
             static_cast<int>(flat_.view.stage_count);
    });
    looked_at_ = 0;
    std::vector<size_t> order(samples_.pictures.size());
    for (size_t i = 0; i < order.size(); i++) order[i] = i;
    for (size_t i = order.size(); i > 1; i--)
      std::swap(order[i - 1], order[static_cast<size_t>(chance_.uniform() * static_cast<double>(i))]);
    for (const size_t at : order) {
      if (static_cast<int>(others_.size()) >= a_.others) return;
      const LabelledPicture &p = samples_.pictures[at];
      Eye &eye = eye_of(p);
      eye.take(p.grey);
      eye.look_around();
      std::vector<WindowSums> found;
      size_t seen = 0;
      for (const cylinder &c : eye.round().cylinders) find_in(p, c, eye.band(), &found, &seen, kOfPicture);
      std::move(found.begin(), found.end(), std::back_inserter(others_));
    }
  }

  // Each window that is taken for it has the same chance to be among the picture's `most`.
  void find_in(const LabelledPicture &p, const cylinder &c, const window_band &band, std::vector<WindowSums> *found,
               size_t *seen, size_t most) {
    const int width = cascade_.width_px, height = cascade_.height_px;
    const integral sums = {c.sums, c.squares, c.columns + 1};
    int first, last;
    rows_of(flat_.view, band, c, kTilt_rad, &first, &last);
    for (int y = first; y <= last; y++)
      for (int x = 0; x + width <= c.columns; x++) {
        looked_at_ += 1;
        double surplus;
        if (stages_passed(flat_.view, sums, x, y, &surplus) < static_cast<int>(flat_.view.stage_count)) continue;
        if (!c.is_seen(x, y) || !c.is_seen(x + width - 1, y) || !c.is_seen(x, y + height - 1) ||
            !c.is_seen(x + width - 1, y + height - 1) ||
            shows_one(p, c.left_rad - (x + 0.5 * (width - 1)) * c.step_rad,
                      (c.horizon - y - 0.5 * (height - 1)) * c.step_rad, width * c.step_rad))
          continue;
        const auto at = static_cast<size_t>(chance_.uniform() * static_cast<double>(++*seen));
        if (found->size() == most && at >= most) continue;
        WindowSums window;
        for (int row = 0; row <= height; row++)
          for (int column = 0; column <= width; column++) {
            const uint32_t *q = c.sums + static_cast<ptrdiff_t>(y) * (c.columns + 1) + x;
            const uint32_t *r = q + static_cast<ptrdiff_t>(row) * (c.columns + 1);
            window.push_back(r[column] - r[0] - q[column] + q[0]);
          }
        if (found->size() < most)
          found->push_back(std::move(window));
        else
          (*found)[at] = std::move(window);
      }
  }

  const TrainCascade &a_;
  Samples &samples_;
  double height_m_;
  TrainedCascade cascade_;
  TrainedCascade::Flat flat_;
  Chance chance_;
  std::vector<Eye> eyes_;
  std::vector<WindowSums> things_, others_;
  double looked_at_ = 0;
};

}  // namespace

void train_cascade(const TrainCascade &a) {
  Samples samples = load_samples(a);
  Trainer(a, samples).run();
}

}  // namespace wm::tools
