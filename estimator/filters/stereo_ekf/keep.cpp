// SPDX-License-Identifier: Apache-2.0
// The own map that outlives a restart (waymark/keeper.h): key frames and calibration states with their joint
// covariance, and the points of the frames.
//
//   kept_frames_head, points of each frame (int64), own_points, means, the covariance's upper half row by row
//
// Little-endian, as all machines that are supported.
#include <cstring>

#include "filters/core/contract.hpp"
#include "filters/registry.h"
#include "filters/stereo_ekf/stereo_ekf.hpp"

namespace wm {
namespace {

constexpr uint32_t kFramesVersion = 1;
constexpr char kFramesMagic[8] = {'W', 'M', 'S', 'E', 'A', 'M', '\n', '\0'};
constexpr double kFramesRounding = 1e-6;  // of a covariance, relative to the product of its sigmas
constexpr int kFrameStates = 3 * own_map::kCorners;

struct kept_frames_head {
  char magic[8];
  uint32_t version, calibration, frames, points;
};
static_assert(sizeof(kept_frames_head) == 24, "no padding");
static_assert(sizeof(own_point) == 104, "no padding");

// Places in an image, in bytes from its beginning.
struct kept_frames_layout {
  size_t states, counts, points, means, covariance, bytes;
  explicit kept_frames_layout(const kept_frames_head &head)
      : states(head.calibration + size_t{head.frames} * kFrameStates),
        counts(sizeof(kept_frames_head)),
        points(counts + head.frames * sizeof(int64_t)),
        means(points + head.points * sizeof(own_point)),
        covariance(means + states * sizeof(double)),
        bytes(covariance + states * (states + 1) / 2 * sizeof(double)) {}
};

class kept_frames {
 public:
  explicit kept_frames(const void *image)
      : bytes_(static_cast<const uint8_t *>(image)), head_(read(image)), at_(head_) {}
  static kept_frames_head read(const void *image) {
    kept_frames_head out;
    std::memcpy(&out, image, sizeof out);
    return out;
  }
  const kept_frames_head &head() const { return head_; }
  int states() const { return static_cast<int>(at_.states); }
  int64_t points_of(size_t frame) const { return value<int64_t>(at_.counts + frame * sizeof(int64_t)); }
  own_point point(size_t i) const { return value<own_point>(at_.points + i * sizeof(own_point)); }
  double mean(int i) const { return number(at_.means, static_cast<size_t>(i)); }
  double covariance(int i, int j) const {
    const auto row = static_cast<size_t>(i < j ? i : j), column = static_cast<size_t>(i < j ? j : i);
    return number(at_.covariance, row * at_.states - row * (row + 1) / 2 + column);
  }

 private:
  template <class item>
  item value(size_t from) const {
    item out;
    std::memcpy(&out, bytes_ + from, sizeof out);
    return out;
  }
  double number(size_t from, size_t i) const { return value<double>(from + i * sizeof(double)); }
  const uint8_t *bytes_;
  kept_frames_head head_;
  kept_frames_layout at_;
};

bool is_point(const own_point &p) {
  const double *n = p.noise;
  return finite(p.at) && finite(n[0] + n[1] + n[2] + n[3] + n[4] + n[5]) && n[0] > 0.0 && n[3] > 0.0 && n[5] > 0.0;
}

const char *fault_in_frames(const kept_frames &kept) {
  int64_t points = 0;
  for (size_t f = 0; f < kept.head().frames; f++) {
    const int64_t count = kept.points_of(f);
    if (count < 0 || count > own_map::kPointsOfFrame) return "a key frame in it has more points than one may have";
    points += count;
  }
  if (points != kept.head().points) return "its key frames have other points than it has";
  for (size_t i = 0; i < kept.head().points; i++)
    if (!is_point(kept.point(i))) return "a point in it is not finite, or has no variance";
  for (int i = 0; i < kept.states(); i++)
    if (!finite(kept.mean(i)) || !finite(kept.covariance(i, i)) || kept.covariance(i, i) < 0.0)
      return "a number in it is not finite, or a variance is negative";
  for (int i = 0; i < kept.states(); i++)
    for (int j = i + 1; j < kept.states(); j++)
      if (!(square(kept.covariance(i, j)) <=
            kept.covariance(i, i) * kept.covariance(j, j) * (1.0 + kFramesRounding) + 1e-300))
        return "a covariance in it is larger than its variances allow";
  return nullptr;
}

uint32_t calibration_states(const wm_stereo_ekf_params &params, const wm_setup &setup) {
  const wm_stereo_ekf_params used = stereo_ekf::used_params(params, setup);
  head_model models[kHeadStates];
  models_of(used, setup, models);
  int count = 0;
  for (int k = 0; k < kHeadStates; k++) {
    const bool moves = k == kMovedPlace || k == kMovedTurn || k == kVelocity || k == kRates;
    if (models[k].sigma > 0.0 && !moves) count += kHeadSpecs[k].width;
  }
  return static_cast<uint32_t>(count);
}

}  // namespace

size_t stereo_ekf::kept_bytes_max(const wm_stereo_ekf_params &params, const wm_setup &setup) {
  kept_frames_head head{};
  head.calibration = calibration_states(params, setup);
  head.frames = static_cast<uint32_t>(params.frames_max);
  if (head.frames == 0) return 0;
  head.points = head.frames * own_map::kPointsOfFrame;
  return kept_frames_layout(head).bytes;
}

// State i of an image: the calibration, then the corners of each frame in use.
int stereo_ekf::kept_state(int i, const int *frames) const {
  const int calibration = filter_.calibration_end() - filter_.calibration_begin();
  if (i < calibration) return filter_.calibration_begin() + i;
  const int corner = (i - calibration) / 3, axis = (i - calibration) % 3;
  return filter_.point_state(find_slot(corner_id(frames[corner / own_map::kCorners], corner % own_map::kCorners))) +
         axis;
}

// Points of a frame: those that left the view, and behind them those that are in it. Returns their number.
int64_t stereo_ekf::put_points(int frame, uint8_t *bytes, size_t *at, size_t capacity) const {
  int64_t count = 0;
  const auto put = [&](const own_point &point) {
    if (count == own_map::kPointsOfFrame || *at + sizeof point > capacity) return;
    std::memcpy(bytes + *at, &point, sizeof point);
    *at += sizeof point;
    count++;
  };
  own_point in_view;
  for (int i = 0; i < map_.points_of(frame); i++) put(map_.point(frame, i));
  for (int slot = 0; slot < filter_.point_count(); slot++)
    if (info_[(size_t)slot].frame == frame && map_point_of(slot, &in_view)) put(in_view);
  return count;
}

size_t stereo_ekf::keep(void *out, size_t capacity) const {
  if (!life_.tracking() || map_.frames() == 0) return 0;
  kept_frames_head head{};
  std::memcpy(head.magic, kFramesMagic, sizeof head.magic);
  head.version = kFramesVersion;
  head.calibration = static_cast<uint32_t>(filter_.calibration_end() - filter_.calibration_begin());
  int frames[kFramesMost], states[kFrameStates * kFramesMost + kHeadMax];
  for (int f = 0; f < map_.capacity(); f++)
    if (map_.is_used(f)) frames[head.frames++] = f;
  auto *bytes = static_cast<uint8_t *>(out);
  size_t at = kept_frames_layout(head).points;
  if (at > capacity) return 0;
  for (uint32_t k = 0; k < head.frames; k++) {
    const int64_t count = put_points(frames[k], bytes, &at, capacity);
    std::memcpy(bytes + kept_frames_layout(head).counts + k * sizeof count, &count, sizeof count);
    head.points += static_cast<uint32_t>(count);
  }
  const kept_frames_layout layout(head);
  if (layout.bytes > capacity) return 0;
  std::memcpy(bytes, &head, sizeof head);
  for (size_t i = 0; i < layout.states; i++) states[i] = kept_state(static_cast<int>(i), frames);
  const auto put = [&](double number) {
    std::memcpy(bytes + at, &number, sizeof number);
    at += sizeof number;
  };
  for (size_t i = 0; i < layout.states; i++)
    put(filter_.pending1(states[i]) +
        (i < head.calibration ? filter_.head(states[i]) : filter_.point_value(states[i])));
  for (size_t i = 0; i < layout.states; i++)
    for (size_t j = i; j < layout.states; j++) put(filter_.covariance(states[i], states[j]));
  return layout.bytes;
}

const char *stereo_ekf::why_not_kept(const wm_stereo_ekf_params &params, const wm_setup &setup, const void *image,
                                     size_t bytes) {
  if (bytes < sizeof(kept_frames_head)) return "it is truncated";
  const kept_frames_head head = kept_frames::read(image);
  if (std::memcmp(head.magic, kFramesMagic, sizeof head.magic) != 0) return "it is not a map of stereo_ekf";
  if (head.version != kFramesVersion) return "it has another version";
  if (head.calibration != calibration_states(params, setup))
    return "it has other calibration states than the configuration";
  if (head.frames > static_cast<uint32_t>(used_params(params, setup).frames_max))
    return "it has more key frames than slam.key_frames";
  if (head.points > head.frames * own_map::kPointsOfFrame) return "a key frame in it has more points than one may have";
  if (kept_frames_layout(head).bytes != bytes) return "it is truncated";
  return fault_in_frames(kept_frames(image));
}

void stereo_ekf::take_kept(const void *image) {
  const kept_frames kept(image);
  const auto calibration = static_cast<int>(kept.head().calibration), frames = static_cast<int>(kept.head().frames);
  int numbers[kFramesMost] = {}, states[kFrameStates * kFramesMost + kHeadMax];
  forget_map();
  filter_.remove_points();
  size_t next = 0;
  for (int f = 0; f < frames; f++) {
    numbers[f] = f;
    map_.begin(f, 0);  // the clock of the run before is unknown
    for (int c = 0; c < own_map::kCorners; c++) {
      const int mean = calibration + f * kFrameStates + 3 * c, slot = filter_.point_count();
      filter_.add_point({kept.mean(mean), kept.mean(mean + 1), kept.mean(mean + 2)}, 0.0);
      info_[(size_t)slot] = {0, 0, WM_TIME_NONE, corner_id(f, c), kOfMap, kNoFrame, {}, {}};
    }
    for (int64_t i = 0; i < kept.points_of((size_t)f); i++) (void)map_.add(f, kept.point(next++));
  }
  for (int i = 0; i < kept.states(); i++) states[i] = kept_state(i, numbers);
  for (int i = 0; i < calibration; i++) filter_.set_head(states[i], kept.mean(i));
  for (int i = 0; i < kept.states(); i++)
    for (int j = i; j < kept.states(); j++) filter_.set_covariance(states[i], states[j], kept.covariance(i, j));
  filter_.restart_transient();
  start_pose();
}

}  // namespace wm

const wm_keeper wm_stereo_ekf_keeper = wm::keeper_of<wm::stereo_ekf, wm_stereo_ekf_params>();
