// SPDX-License-Identifier: Apache-2.0
// Detector `stereo` and its parts, on pictures of which everything is known.
#include <algorithm>
#include <map>
#include <set>

#include "common/eyes.hpp"
#include "sea_floor.hpp"
#include "vision/stereo/corners.hpp"
#include "vision/stereo/patch.hpp"
#include "vision/stereo/rectify.hpp"

namespace {

const sea::floor_grain kGrainOne(1);

struct picture {
  std::vector<uint8_t> grey;
  wm::grey_plane plane;
  template <class Shade>
  picture(int32_t width, int32_t height, Shade shade) : grey(static_cast<size_t>(width) * static_cast<size_t>(height)) {
    for (int32_t v = 0; v < height; v++)
      for (int32_t u = 0; u < width; u++)
        grey[static_cast<size_t>(v) * static_cast<size_t>(width) + static_cast<size_t>(u)] =
            static_cast<uint8_t>(shade(1.0 * u, 1.0 * v) + 0.5);
    plane = {grey.data(), width, height};
  }
};

double soft(double u, double v) { return 110 + 1.3 * kGrainOne.at(0.003 * u, 0.003 * v); }

TEST(a_patch_is_found_to_a_part_of_a_pixel) {
  const picture first(120, 90, [](double u, double v) { return soft(u, v); });
  for (const double du : {-0.5, -0.13, 0.0, 0.37, 1.8}) {
    const double dv = 0.3 - 0.4 * du;
    // Another brightness and contrast, too.
    const picture second(120, 90, [&](double u, double v) { return 100 + 0.8 * (soft(u - du, v - dv) - 60); });
    wm::patch_template what;
    wm::alignment found;
    TEST_ASSERT_TRUE(wm::make_template(first.plane, {60, 45}, wm::kNoWarp, &what));
    TEST_ASSERT_TRUE(wm::align(what, second.plane, {60, 45}, 4, 8, &found));
    TEST_ASSERT_DOUBLE_WITHIN(0.06, 60 + du, found.at.u);
    TEST_ASSERT_DOUBLE_WITHIN(0.06, 45 + dv, found.at.v);
    TEST_ASSERT_GREATER_THAN_DOUBLE(0.95, found.fit);
    TEST_ASSERT_LESS_THAN_DOUBLE(0.1, found.sigma_px);
  }
}

TEST(a_bent_patch_is_found_by_its_warp) {
  const picture first(160, 120, [](double u, double v) { return soft(u, v); });
  // The second picture's offset (x, y) shows the first one's (1.2 x + 0.3 y, -0.25 x + 0.9 y).
  const wm::warp2 bend = {1.2, 0.3, -0.25, 0.9};
  const picture second(160, 120, [&](double u, double v) {
    const double x = u - 80.4, y = v - 59.7;
    return soft(80 + bend.uu * x + bend.uv * y, 60 + bend.vu * x + bend.vv * y);
  });
  wm::patch_template what;
  wm::alignment found;
  TEST_ASSERT_TRUE(wm::make_template(first.plane, {80, 60}, bend, &what));
  TEST_ASSERT_TRUE(wm::align(what, second.plane, {80, 60}, 4, 8, &found));
  TEST_ASSERT_DOUBLE_WITHIN(0.06, 80.4, found.at.u);
  TEST_ASSERT_DOUBLE_WITHIN(0.06, 59.7, found.at.v);
}

TEST(no_patch_where_there_is_no_contrast) {
  const picture flat(80, 80, [](double, double) { return 90.0; });
  const picture stripes(80, 80, [](double u, double) { return 90 + 40 * std::sin(0.5 * u); });
  wm::patch_template what;
  TEST_ASSERT_FALSE(wm::make_template(flat.plane, {40, 40}, wm::kNoWarp, &what));
  TEST_ASSERT_FALSE(wm::make_template(stripes.plane, {40, 40}, wm::kNoWarp, &what));  // nothing says how high
  TEST_ASSERT_FALSE(wm::make_template(flat.plane, {NAN, 40}, wm::kNoWarp, &what));
  TEST_ASSERT_FALSE(wm::make_template(flat.plane, {1e12, 40}, wm::kNoWarp, &what));
}

TEST(slopes_of_a_surface_are_seen) {
  const picture left(160, 120, [](double u, double v) { return soft(u, v); });
  // Right: u - (20 + 0.04 (u - 80) + 0.09 (v - 60)); a pixel of it shows the left one's place by the inverse.
  const picture right(160, 120,
                      [](double u, double v) { return soft((u + 20 - 0.04 * 80 + 0.09 * (v - 60)) / 0.96, v); });
  wm::patch_template what;
  wm::alignment found;
  double slope[2];
  TEST_ASSERT_TRUE(wm::make_template(left.plane, {80, 60}, wm::kNoWarp, &what));
  TEST_ASSERT_TRUE(wm::align(what, right.plane, {60, 60}, 4, 8, &found));
  TEST_ASSERT_TRUE(wm::fit_slopes(what, right.plane, found.at, slope));
  TEST_ASSERT_DOUBLE_WITHIN(0.03, -0.04, slope[0]);
  TEST_ASSERT_DOUBLE_WITHIN(0.03, -0.09, slope[1]);
}

TEST(corners_are_spread_over_the_cells) {
  const picture half(320, 240, [](double u, double v) { return u < 160 ? 100.0 : soft(2 * u, 2 * v); });
  constexpr int32_t kCell = 20, kCells = 16 * 12;
  std::vector<uint8_t> taken(kCells, 0), work(wm::corners_bytes(320));
  std::vector<wm::corner> corners(kCells);
  taken[3 * 16 + 10] = 1;
  wm::find_corners(half.plane, kCell, 6, taken.data(), work.data(), corners.data());
  int found = 0;
  for (int32_t i = 0; i < kCells; i++) {
    const int32_t column = i % 16, row = i / 16;
    if (column < 7 || i == 3 * 16 + 10) TEST_ASSERT_EQUAL_FLOAT(0.0F, corners[static_cast<size_t>(i)].strength);
    if (!(corners[static_cast<size_t>(i)].strength > 0.0F)) continue;
    found++;
    TEST_ASSERT_EQUAL(column, corners[static_cast<size_t>(i)].u / kCell);
    TEST_ASSERT_EQUAL(row, corners[static_cast<size_t>(i)].v / kCell);
  }
  TEST_ASSERT_GREATER_THAN(80, found);
}

TEST(most_points_decide_how_the_cameras_moved) {
  const wm::pair_geometry pair = {420, 420, 321, 238.5, 0.3};
  const wm::rigid truth = {wm::matrix_of(wm::turn_by({0.01, 0.02, -0.015})), {0.03, -0.05, -0.06}};
  std::vector<wm::seen_twice> points;
  for (uint64_t i = 0; i < 60; i++) {
    const auto draw = [&](uint64_t k) { return wm_random_uniform(3, k, i); };
    const wm::vec3 place = {3 * draw(0) - 1.5, 2 * draw(1) - 1, 2 + draw(2)};
    wm::pair_pixels now;
    TEST_ASSERT_TRUE(wm::pixels_of(pair, truth * place, &now));
    if (i % 5 < 2) {  // two of five go their own ways
      now.left_u += 30 * draw(3) - 15;
      now.left_v += 30 * draw(4) + 4;
    }
    points.push_back({place, now});
  }
  wm::rigid found;
  uint8_t agrees[60];
  TEST_ASSERT_TRUE(wm::find_motion(pair, points.data(), 60, nullptr, 1.0, 7, &found, agrees));
  TEST_ASSERT_LESS_THAN_DOUBLE(1e-6, wm::length(found.t - truth.t));
  for (int i = 0; i < 60; i++) TEST_ASSERT_EQUAL(i % 5 >= 2, agrees[i]);
  TEST_ASSERT_FALSE(wm::find_motion(pair, points.data(), wm::kFewest - 1, nullptr, 1.0, 7, &found, agrees));
}

// ── the whole detector ──────────────────────────────────────────────────────────────────────────────────────────────

struct machine : wm::drawn::eyes {
  wm_rig rig;
  int32_t cameras[2] = {0, 1};
  wm_view view{&rig, cameras, nullptr, 0, nullptr, 0, nullptr, 0};
  wm::mounted_camera camera[2];
  size_t count = 0;

  explicit machine(bool fisheye = false) : eyes("stereo") {
    sea::make_rig(&rig, fisheye);
    begin(view);
    for (int i = 0; i < 2; i++) TEST_ASSERT_NULL(wm::mounted_camera_init(&camera[i], rig.cameras[i]));
  }
  machine(const machine &) = delete;
  machine &operator=(const machine &) = delete;

  void look(const std::vector<uint8_t> &left, const std::vector<uint8_t> &right, double t_s) {
    const auto t_ns = static_cast<wm_time_ns>(t_s * 1e9);
    const wm_frame frames[2] = {wm::drawn::frame_of(left, 640, 480, t_ns),
                                wm::drawn::frame_of(right, 640, 480, t_ns, 1)};
    count = eyes::look(frames);
  }
  void render(const sea::view_of_floor &seen, uint64_t number, std::vector<uint8_t> *left,
              std::vector<uint8_t> *right) {
    sea::render(seen, camera[0], 2 * number, left);
    sea::render(seen, camera[1], 2 * number + 1, right);
  }
};

const wm::pair_geometry kPair = {420, 420, 321, 238.5, 0.3};

// Where the ray of a rectified pixel of the left camera meets the floor, in map.
wm::vec3 on_floor(const machine &m, const wm::rigid &map_base, const double px[2]) {
  const wm::mat3 R = map_base.R * m.camera[0].R_base_optical;
  const wm::vec3 eye = map_base * m.camera[0].centre_m;
  const wm::vec3 ray = R * wm::vec3{(px[0] - kPair.cu) / kPair.fu, (px[1] - kPair.cv) / kPair.fv, 1};
  return eye + (-eye.z / ray.z) * ray;
}

double part(std::vector<double> v, double share) {
  std::sort(v.begin(), v.end());
  return v[static_cast<size_t>(share * static_cast<double>(v.size() - 1))];
}

struct course {
  std::vector<double> disparity_off_px, row_off_px, place_off_m;
  size_t told = 0, pictures = 0, tracks = 0, longest = 0;
  double covered = 0;
};

course swim(machine *m, int pictures, double gain, const std::vector<sea::particle> *particles = nullptr) {
  course out;
  std::map<int32_t, wm::vec3> first;
  std::map<int32_t, size_t> length;
  std::vector<uint8_t> left, right;
  for (int k = 0; k < pictures; k++) {
    sea::view_of_floor seen(kGrainOne);
    seen.map_base = sea::swim(0.125 * k);
    seen.gain = gain;
    if (particles)
      for (sea::particle p : *particles) {
        p.place = p.place + (0.125 * k) * wm::vec3{0.05, -0.2, 0.02};  // they drift
        seen.particles.push_back(p);
      }
    m->render(seen, static_cast<uint64_t>(k), &left, &right);
    m->look(left, right, 10 + 0.125 * k);
    if (k < 2) continue;
    out.pictures++;
    out.told += m->count;
    std::set<int> cells;
    for (size_t i = 0; i < m->count; i++) {
      const wm_stereo &s = m->events[i].as.stereo;
      cells.insert(static_cast<int>(s.left_px[0] / 80) + 8 * static_cast<int>(s.left_px[1] / 80));
      const wm::vec3 place = on_floor(*m, seen.map_base, s.left_px);
      wm::pair_pixels exact;
      const wm::vec3 in_camera = wm::transposed_times(seen.map_base.R * m->camera[0].R_base_optical,
                                                      place - seen.map_base * m->camera[0].centre_m);
      TEST_ASSERT_TRUE(wm::pixels_of(kPair, in_camera, &exact));
      out.disparity_off_px.push_back(std::fabs(exact.right_u - s.right_px[0]));
      out.row_off_px.push_back(std::fabs(s.left_px[1] - s.right_px[1]));
      if (first.count(s.id))
        out.place_off_m.push_back(wm::length(place - first[s.id]));
      else
        first[s.id] = place;
      out.longest = std::max(out.longest, ++length[s.id]);
    }
    out.covered += static_cast<double>(cells.size()) / 48;
  }
  out.tracks = first.size();
  out.covered /= static_cast<double>(out.pictures);
  return out;
}

void check(const course &c, double disparity_px) {
  TEST_ASSERT_GREATER_THAN(60, c.told / c.pictures);
  TEST_ASSERT_GREATER_THAN_DOUBLE(0.6, c.covered);
  TEST_ASSERT_LESS_THAN_DOUBLE(disparity_px, part(c.disparity_off_px, 0.5));
  TEST_ASSERT_LESS_THAN_DOUBLE(4 * disparity_px, part(c.disparity_off_px, 0.95));
  TEST_ASSERT_LESS_THAN_DOUBLE(disparity_px, part(c.row_off_px, 0.5));
  TEST_ASSERT_LESS_THAN_DOUBLE(0.002, part(c.place_off_m, 0.5));  // a pixel is 6 to 20 mm of floor
  TEST_ASSERT_LESS_THAN_DOUBLE(0.015, part(c.place_off_m, 0.95));
  TEST_ASSERT_GREATER_THAN(12, c.longest);
}

TEST(points_stay_where_they_are_in_the_world) {
  machine m;
  check(swim(&m, 16, 1.0), 0.08);
}

TEST(a_fisheye_pair_gives_rectified_pixels) {
  machine m(true);
  check(swim(&m, 16, 1.0), 0.1);
}

TEST(haze_costs_accuracy_not_truth) {
  machine m;
  const course c = swim(&m, 16, 0.45);
  TEST_ASSERT_GREATER_THAN(40, c.told / c.pictures);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.2, part(c.disparity_off_px, 0.5));
  TEST_ASSERT_LESS_THAN_DOUBLE(0.04, part(c.place_off_m, 0.95));
}

TEST(particles_are_not_told) {
  machine m;
  std::vector<sea::particle> particles;
  for (uint64_t i = 0; i < 40; i++)
    particles.push_back({{0.8 + 3 * wm_random_uniform(5, 1, i), 3 * wm_random_uniform(5, 2, i) - 1.5,
                          0.6 + 1.2 * wm_random_uniform(5, 3, i)},
                         0.02});
  const course c = swim(&m, 16, 1.0, &particles);
  TEST_ASSERT_GREATER_THAN(50, c.told / c.pictures);
  // Were particles told, points would be metres of floor from where they began.
  TEST_ASSERT_LESS_THAN_DOUBLE(0.03, part(c.place_off_m, 0.97));
  TEST_ASSERT_LESS_THAN_DOUBLE(0.6, part(c.disparity_off_px, 0.97));
}

TEST(what_makes_no_sense_gives_nothing) {
  const std::vector<uint8_t> black(640 * 480, 0), white(640 * 480, 255);
  sea::view_of_floor seen(kGrainOne);
  std::vector<uint8_t> left, right, late_left, late_right;
  const std::vector<uint8_t> *pairs[][2] = {
      {&black, &black}, {&white, &white}, {&left, &black}, {&white, &right}, {&right, &left}};
  for (const auto &pair : pairs) {
    machine m;
    for (int k = 0; k < 4; k++) {
      seen.map_base = sea::swim(0.125 * k);
      m.render(seen, static_cast<uint64_t>(k), &left, &right);
      m.look(*pair[0], *pair[1], 0.125 * k);
      TEST_ASSERT_EQUAL(0, m.count);
    }
  }
  // Left and right from times that are far apart: hardly a point survives the rows and the consensus.
  machine m;
  for (int k = 0; k < 6; k++) {
    seen.map_base = sea::swim(0.125 * k);
    m.render(seen, static_cast<uint64_t>(k), &left, &right);
    seen.map_base = sea::swim(0.125 * k + 0.6);
    m.render(seen, static_cast<uint64_t>(k), &late_left, &late_right);
    m.look(left, late_right, 0.125 * k);
    TEST_ASSERT_LESS_THAN(10, m.count);
  }
}

TEST(it_bears_a_camera_that_is_stuck_and_a_clock_that_runs_back) {
  machine m;
  std::vector<uint8_t> left, right;
  std::set<int32_t> before;
  for (int k = 0; k < 5; k++) {
    sea::view_of_floor seen(kGrainOne);
    seen.map_base = sea::swim(0.125 * k);
    m.render(seen, static_cast<uint64_t>(k), &left, &right);
    m.look(left, right, 0.125 * k);
    if (k == 3) {
      for (size_t i = 0; i < m.count; i++) before.insert(m.events[i].as.stereo.id);
      m.look(left, right, 0.125 * k + 0.06);  // the same picture again
      TEST_ASSERT_EQUAL(0, m.count);
    }
  }
  size_t same = 0;
  for (size_t i = 0; i < m.count; i++) same += before.count(m.events[i].as.stereo.id);
  TEST_ASSERT_GREATER_THAN(before.size() / 2, same);
  m.look(left, right, -100);
  TEST_ASSERT_EQUAL(0, m.count);
  m.look(left, right, 1e9);
  TEST_ASSERT_EQUAL(0, m.count);
}

TEST(a_pair_that_is_mounted_the_wrong_way_round_is_told) {
  machine m;
  std::swap(m.rig.cameras[0].mounting, m.rig.cameras[1].mounting);
  m.expect_refused(m.view, "swapped");
}

}  // namespace

int differ(const wm_stereo &a, const wm_stereo &b) {
  int bits = 0;
  for (int i = 0; i < 4; i++) bits += __builtin_popcountll(a.appearance[i] ^ b.appearance[i]);
  return bits;
}

// GIVEN another drive over the same floor, 8 cm beside, 10 % higher and turned by 20 degrees WHEN the most alike point
// is taken where it is clearly the most alike THEN most of those are the same point of the floor.
TEST(a_point_looks_alike_from_another_pose) {
  machine before, again;
  std::vector<uint8_t> left, right;
  std::vector<wm_stereo> known;
  std::vector<wm::vec3> places;
  size_t taken = 0, right_ones = 0, there = 0;
  for (int k = 0; k < 4; k++) {
    sea::view_of_floor seen(kGrainOne);
    seen.map_base = sea::swim(0.125 * k);
    before.render(seen, static_cast<uint64_t>(k), &left, &right);
    before.look(left, right, 10 + 0.125 * k);
    if (k < 3) continue;
    for (size_t i = 0; i < before.count; i++) {
      known.push_back(before.events[i].as.stereo);
      places.push_back(on_floor(before, seen.map_base, known.back().left_px));
    }
  }
  for (int k = 0; k < 4; k++) {
    sea::view_of_floor seen(kGrainOne);
    seen.seed = 99;
    seen.map_base = sea::swim(0.125 * k);
    const wm::vec3 middle = seen.map_base.t;
    const wm::mat3 turned = wm::matrix_of(wm::turn_by({0, 0, 0.35}));
    seen.map_base.R = turned * seen.map_base.R;
    seen.map_base.t = middle + wm::vec3{0.08, 0.0, 0.1 * middle.z};
    again.render(seen, 1000 + static_cast<uint64_t>(k), &left, &right);
    again.look(left, right, 50 + 0.125 * k);
    if (k < 3) continue;
    for (size_t i = 0; i < again.count; i++) {
      const wm_stereo &s = again.events[i].as.stereo;
      const wm::vec3 place = on_floor(again, seen.map_base, s.left_px);
      int best = 256, second = 256;
      size_t found = 0;
      double nearest_m = 1e9;
      for (size_t j = 0; j < known.size(); j++) {
        const int bits = differ(s, known[j]);
        if (bits < best)
          second = best, best = bits, found = j;
        else if (bits < second)
          second = bits;
        nearest_m = std::min(nearest_m, wm::length(places[j] - place));
      }
      there += nearest_m < 0.02;
      if ((s.appearance[0] | s.appearance[1] | s.appearance[2] | s.appearance[3]) == 0) continue;
      if (best > 64 || best >= 0.7 * second) continue;
      taken++;
      right_ones += wm::length(places[found] - place) < 0.03;
    }
  }
  std::printf("of %zu points that are there %zu are found, of %zu taken %zu\n", there, right_ones, taken, right_ones);
  TEST_ASSERT_GREATER_THAN(12, right_ones);
  TEST_ASSERT_GREATER_THAN_DOUBLE(0.6 * static_cast<double>(taken), static_cast<double>(right_ones));
}
