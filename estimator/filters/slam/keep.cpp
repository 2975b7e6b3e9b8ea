// SPDX-License-Identifier: Apache-2.0
// The map that outlives a restart (waymark/keeper.h): landmarks and calibration states with their joint covariance.
//
//   kept_head, a kept_landmark each, means, the covariance's upper half row by row
//
// States that belong to a moment are left out, which marginalizes them: velocity, stamps, time-correlated errors,
// clones and rays. Little-endian, as all machines that are supported.
#include <cstring>

#include "filters/core/contract.hpp"
#include "filters/registry.h"
#include "filters/slam/slam.hpp"

namespace wm {
namespace {

constexpr uint32_t kVersion = 1;
constexpr char kMagic[8] = {'W', 'M', 'S', 'L', 'A', 'M', '\n', '\0'};
constexpr uint32_t kWidthMax = 3;   // states of a landmark: its place, and a marker's heading
constexpr double kRounding = 1e-6;  // of a covariance, relative to the product of its sigmas
// A tracker's numbers begin anew at a restart. Landmarks known by such numbers get others, from the largest one down.
constexpr int32_t kLargestId = INT32_MAX;
// The next number of a landmark without an identity: as many are left as a drive can't have.
constexpr int32_t kNextIdMost = INT32_MAX / 2;
// Ages of a kept landmark at the first observation: far beyond the times that witnesses and returns are judged by.
// Bits of by_bearings: the map began by bearings alone; it lies in the frame of positions, and of headings.
constexpr uint32_t kByBearings = 1, kPlaced = 2, kTurned = 4;
constexpr wm_time_ns kAge_ns = 600 * WM_NS_PER_S, kUnseen_ns = 60 * WM_NS_PER_S;

struct kept_head {
  char magic[8];
  uint32_t version, robot_states, landmarks, width;
  int32_t next_id, returned;
  uint32_t rejoins, by_bearings;
  double scale_origin_m[2];
};
static_assert(sizeof(kept_head) == 56, "no padding");

struct kept_landmark {
  double z_m, mean_m[3], means;
  int32_t id, surveyed, tilt_sensor;
  uint32_t seen;
  uint8_t is_kept, revisited, level, may_be_misread, viewed_twice, unused[3];
};
static_assert(sizeof(kept_landmark) == 64, "no padding");

// The fields that a landmark_note and a kept_landmark have in common, but the identity.
template <class from_t, class to_t>
void copy_common(const from_t &from, to_t &to) {
  to.z_m = from.z_m;
  std::memcpy(to.mean_m, from.mean_m, sizeof to.mean_m);
  to.means = from.means;
  to.surveyed = from.surveyed;
  to.tilt_sensor = from.tilt_sensor;
  to.seen = from.seen;
  to.revisited = from.revisited;
  to.level = from.level;
  to.may_be_misread = from.may_be_misread;
  to.viewed_twice = from.viewed_twice;
}

// Places in an image, in bytes from its beginning.
struct kept_layout {
  size_t states, means, covariance, bytes;
  explicit kept_layout(const kept_head &head)
      : states(head.robot_states + size_t{head.landmarks} * head.width),
        means(sizeof(kept_head) + head.landmarks * sizeof(kept_landmark)),
        covariance(means + states * sizeof(double)),
        bytes(covariance + states * (states + 1) / 2 * sizeof(double)) {}
};

kept_head head_of(const void *image) {
  kept_head out;
  std::memcpy(&out, image, sizeof out);
  return out;
}

class kept_image {
 public:
  explicit kept_image(const void *image)
      : bytes_(static_cast<const uint8_t *>(image)), head_(head_of(image)), at_(head_) {}
  const kept_head &head() const { return head_; }
  int states() const { return static_cast<int>(at_.states); }
  int robot_states() const { return static_cast<int>(head_.robot_states); }
  int landmarks() const { return static_cast<int>(head_.landmarks); }
  int landmark_state(int i) const { return robot_states() + i * static_cast<int>(head_.width); }
  kept_landmark landmark(int i) const {
    kept_landmark out;
    std::memcpy(&out, bytes_ + sizeof(kept_head) + static_cast<size_t>(i) * sizeof out, sizeof out);
    return out;
  }
  double mean(int i) const { return number(at_.means, static_cast<size_t>(i)); }
  double covariance(int i, int j) const {
    const size_t row = static_cast<size_t>(i < j ? i : j), column = static_cast<size_t>(i < j ? j : i);
    return number(at_.covariance, row * at_.states - row * (row + 1) / 2 + column);
  }

 private:
  double number(size_t from, size_t i) const {
    double out;
    std::memcpy(&out, bytes_ + from + i * sizeof out, sizeof out);
    return out;
  }
  const uint8_t *bytes_;
  kept_head head_;
  kept_layout at_;
};

const char *fault_in_numbers(const kept_image &kept) {
  for (int i = 0; i < kept.states(); i++)
    if (!finite(kept.mean(i)) || !finite(kept.covariance(i, i)) || kept.covariance(i, i) < 0.0)
      return "a number in it is not finite, or a variance is negative";
  for (int i = 0; i < kept.states(); i++)
    for (int j = i + 1; j < kept.states(); j++)
      if (!(square(kept.covariance(i, j)) <=
            kept.covariance(i, i) * kept.covariance(j, j) * (1.0 + kRounding) + 1e-300))
        return "a covariance in it is larger than its variances allow";
  for (int i = 0; i < kept.landmarks(); i++) {
    const kept_landmark l = kept.landmark(i);
    if (!finite(l.z_m + l.mean_m[0] + l.mean_m[1] + l.mean_m[2] + l.means)) return "a landmark in it is not finite";
  }
  return nullptr;
}

class image_writer {
 public:
  explicit image_writer(void *out) : at_(static_cast<uint8_t *>(out)) {}
  void put(const void *bytes, size_t count) {
    std::memcpy(at_, bytes, count);
    at_ += count;
  }
  void put(const double *numbers, int count) {
    put(static_cast<const void *>(numbers), (size_t)count * sizeof(double));
  }

 private:
  uint8_t *at_;
};

}  // namespace

size_t slam::kept_bytes_max(const wm_slam_params &params, const wm_setup &setup) {
  kept_head head{};
  head.robot_states = static_cast<uint32_t>(lasting_states(params, setup));
  head.landmarks = static_cast<uint32_t>(params.landmark_capacity);
  head.width = kWidthMax;
  return kept_layout(head).bytes;
}

size_t slam::keep(void *out, size_t capacity) const {
  if (!life_.tracking() || map_is_held()) return 0;
  const int robot = rollback_.to(), width = joint_.layout().landmark_width, first = joint_.landmark_state(0);
  const int places = joint_.landmarks() * width;
  kept_head head{};
  std::memcpy(head.magic, kMagic, sizeof head.magic);
  head.version = kVersion;
  head.robot_states = static_cast<uint32_t>(robot);
  head.landmarks = static_cast<uint32_t>(joint_.landmarks());
  head.width = static_cast<uint32_t>(width);
  head.next_id = next_id_;
  head.returned = returned_;
  head.rejoins = rejoins_;
  head.by_bearings = by_bearings_ ? kByBearings : 0u;
  if (is_placed_) head.by_bearings |= kPlaced;
  if (is_turned_) head.by_bearings |= kTurned;
  std::memcpy(head.scale_origin_m, joint_.scale_origin_m(), sizeof head.scale_origin_m);
  const kept_layout layout(head);
  if (layout.bytes > capacity) return 0;
  image_writer to(out);
  to.put(&head, sizeof head);
  for (int i = 0; i < joint_.landmarks(); i++) {
    const landmark_note &n = note(i);
    kept_landmark one{};
    copy_common(n, one);
    one.id = n.id;
    one.is_kept = is_confirmed(n) && !is_member(n);
    to.put(&one, sizeof one);
  }
  to.put(joint_.values(), robot);
  to.put(joint_.values() + first, places);
  for (int i = 0; i < robot; i++) {
    to.put(joint_.covariance_row(i) + i, robot - i);
    to.put(joint_.covariance_row(i) + first, places);
  }
  for (int i = first; i < first + places; i++) to.put(joint_.covariance_row(i) + i, first + places - i);
  return layout.bytes;
}

const char *slam::why_not_kept(const wm_slam_params &params, const wm_setup &setup, const void *image, size_t bytes) {
  if (bytes < sizeof(kept_head)) return "it is truncated";
  const kept_head head = head_of(image);
  if (std::memcmp(head.magic, kMagic, sizeof head.magic) != 0) return "it is not a map of slam";
  if (head.version != kVersion) return "it has another version";
  if (head.robot_states != static_cast<uint32_t>(lasting_states(params, setup)))
    return "it has other calibration states than the configuration";
  if (head.width < 2 || head.width > kWidthMax || head.landmarks > static_cast<uint32_t>(params.landmark_capacity))
    return "it has more landmarks than slam.landmarks.capacity";
  if (kept_layout(head).bytes != bytes) return "it is truncated";
  if (head.next_id < 0 || head.next_id > kNextIdMost) return "its numbers of landmarks are used up";
  return fault_in_numbers(kept_image(image));
}

void slam::take_kept(const void *image) {
  const kept_image kept(image);
  const kept_head &head = kept.head();
  if (head.width == 3) take_headings();
  while (joint_.landmarks() > 0) joint_.remove_landmark(joint_.landmarks() - 1);
  for (int i = 0; i < kept.robot_states(); i++) {
    if (joint_.is_velocity(i)) continue;
    joint_.set_value(i, kept.mean(i));
    for (int j = i; j < kept.robot_states(); j++)
      if (!joint_.is_velocity(j)) joint_.set_covariance(i, j, kept.covariance(i, j));
  }
  rejoins_ = head.rejoins != 0;
  by_bearings_ = (head.by_bearings & kByBearings) != 0;
  is_placed_ |= (head.by_bearings & kPlaced) != 0;
  is_turned_ |= (head.by_bearings & kTurned) != 0;
  returned_ = head.returned;
  next_id_ = head.next_id;
  for (int from = 0; from < kept.landmarks(); from++) take_kept_landmark(image, from);
  is_kept_ = true;
  joint_.take_kept(head.scale_origin_m);
  follow_scale();
  rollback_.begin(joint_, rollback_.from(), rollback_.to());
  place_in_kept();
}

// Joins landmark `from` of the image behind the others, with its covariance to all that joined before.
void slam::take_kept_landmark(const void *image, int from) {
  const kept_image kept(image);
  const kept_landmark l = kept.landmark(from);
  if (!l.is_kept) return;
  const int width = static_cast<int>(kept.head().width), source = kept.landmark_state(from);
  const joint_row rows[3] = {};
  const double noise[3][3] = {{0, 0, 0}, {0, 0, 0}, {0, 0, square(kPi)}};  // of a heading that the image lacks
  const double place[3] = {kept.mean(source), kept.mean(source + 1), width == 3 ? kept.mean(source + 2) : 0.0};
  const int landmark = joint_.add_landmark(rows, noise, place), own = joint_.landmark_state(landmark);
  for (int k = 0; k < width; k++) {
    for (int j = 0; j < kept.robot_states(); j++)
      if (!joint_.is_velocity(j)) joint_.set_covariance(own + k, j, kept.covariance(source + k, j));
    int before = 0;
    for (int other = 0; other <= from; other++) {
      if (!kept.landmark(other).is_kept) continue;
      for (int m = 0; m < width; m++)
        joint_.set_covariance(own + k, joint_.landmark_state(before) + m,
                              kept.covariance(source + k, kept.landmark_state(other) + m));
      before++;
    }
  }
  landmark_note &n = note(landmark);
  n = note_of(rejoins_ ? kLargestId - landmark : l.id, -1, WM_TIME_NONE);
  copy_common(l, n);
}

// The start's sigmas are what the robot may have been moved by. Its pose keeps the covariance with the map.
void slam::place_in_kept() {
  const wm_start &start = setup_->start;
  const bool known = finite(start.p_m[0]) && finite(start.p_m[1]) && finite(start.heading_rad);
  if (known) {
    const double xy = square(given_or_default(start.sigma_xy_m));
    const double added[3][3] = {{xy, 0, 0}, {0, xy, 0}, {0, 0, square(given_or_default(start.sigma_heading_rad))}};
    joint_.shift_pose({start.p_m[0], start.p_m[1], start.heading_rad}, added);
  }
  life_.begin(known || !params_.recover);
  begin_evidence(rejoins_ ? kOwnFramePrior : kStartWrong);
}

// The first observation after a restart: the clock of the run before is unknown.
void slam::age_kept(wm_time_ns t_ns) {
  is_kept_ = false;
  for (int i = 0; i < joint_.landmarks(); i++) {
    note(i).first_ns = t_ns - kAge_ns;
    note(i).last_ns = t_ns - kUnseen_ns;
  }
}

}  // namespace wm

const wm_keeper wm_slam_keeper = wm::keeper_of<wm::slam, wm_slam_params>();
