// SPDX-License-Identifier: Apache-2.0
// The own map of stereo_ekf: points that left the view are found again under another number by how they look, and the
// map outlives a restart.
#include <map>
#include <vector>
#include "stereo_scene.hpp"
#include "waymark/keeper.h"

namespace {

constexpr double kTurn_radps = 0.3;

struct mapping : scene {
  const wm_keeper *keeper = wm_keeper_of(ekf);
  std::map<int32_t, int32_t> tracks;  // of the points in view, by their places in `points`
  int32_t next_track = 1 << 30;

  mapping() : scene(400) {
    map.clear();
    set("slam.points", 100);
    set("slam.keep_unseen_steps", 5);
    set("slam.keep_outside_s", 0);
    set("slam.key_frames", 40);
  }
  // The pair sees what is in view. A point that comes into view is another track.
  void look() {
    std::map<int32_t, int32_t> now;
    for (size_t i = 0; i < points.size(); i++) {
      double px[4];
      if (!pixels(points[i], px)) continue;
      const auto key = static_cast<int32_t>(i);
      now[key] = tracks.contains(key) ? tracks[key] : next_track++;
      for (double &value : px) value += 0.5 * noise();
      wm_event e = seen(points[i], px);
      e.as.stereo.id = now[key];
      for (uint64_t k = 0; k < 2; k++) {
        uint32_t bits[4];
        wm_random_block(17, k, i, bits);
        std::memcpy(e.as.stereo.appearance + 2 * k, bits, sizeof bits);
      }
      TEST_ASSERT_EQUAL(WM_OK, take(e));
    }
    tracks = now;
  }
  // Turns on a small circle, ten pictures a second.
  void turn_round(double turns) {
    const double w = kTurn_radps;
    for (int i = 0; i < turns * kTwoPi / (0.1 * w); i++) {
      look();
      swim(0.1, {0.1, 0, 0}, {0, 0, w});
    }
  }
  std::vector<char> image() const {
    std::vector<char> out(keeper->bytes_max(params.data(), &setup));
    out.resize(keeper->keep(state, out.data(), out.size()));
    return out;
  }
};

TEST(test_what_is_no_map_is_refused) {
  mapping s;
  s.begin();
  s.turn_round(1.2);
  const std::vector<char> whole = s.image();
  const auto why_not = [&](const std::vector<char> &image) {
    return s.keeper->why_not(s.params.data(), &s.setup, image.data(), image.size());
  };
  TEST_ASSERT_NULL(why_not(whole));
  for (size_t cut = 0; cut < whole.size(); cut += 101)
    TEST_ASSERT_NOT_NULL(why_not({whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(cut)}));
  for (size_t at = 0; at < 12; at++) {  // its name and version
    std::vector<char> other = whole;
    other[at] = static_cast<char>(~other[at]);
    TEST_ASSERT_NOT_NULL(why_not(other));
  }
  std::vector<char> small(whole.size() - 1);
  TEST_ASSERT_EQUAL(0, s.keeper->keep(s.state, small.data(), small.size()));
}

}  // namespace
