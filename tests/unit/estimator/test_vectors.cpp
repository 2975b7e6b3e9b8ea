// SPDX-License-Identifier: Apache-2.0
// Wide vectors and plain ones give the same bits: elementary functions of four at once, the particles' look-ups, and
// edge_mcl and pf_edges whole, state by state.
#include <memory>
#include <vector>

#include "waymark/vectors.h"

#include "common/block.hpp"
#include "common/suite.h"
#include "filters/pf_edges/particles.hpp"
#include "math/lanes.hpp"
#include "waymark/estimator.h"
#include "waymark/random.h"

namespace {

constexpr int kWidth = 500, kHeight = 400;
constexpr double kPixel_m = 0.04;

std::vector<uint8_t> edges((size_t)kWidth *kHeight, 0);
wm_raster raster = {kWidth, kHeight, kPixel_m, -3.0, 2.0, 0.4, edges.data(), nullptr, 0};

void draw(double x0, double y0, double x1, double y1) {
  for (int i = 0; i <= 4000; i++)
    edges[(size_t)(y0 + (y1 - y0) * i / 4000) * kWidth + (size_t)(x0 + (x1 - x0) * i / 4000)] = 255;
}

struct ready_map {
  wm::edge_map map;
  block memory, layers;
  wm::score_table table;
  wm::score_field field;
  explicit ready_map(bool sum) : memory(allocate(wm::edge_map::bytes(raster))) {
    map.init(raster, memory.get());
    const double sigma[wm::kSigmaClasses] = {0.03, 0.05, 0.08, 0.12};
    wm::make_score_table(map, sigma, 0.05, sum, &table);
    layers = allocate(wm::score_field::bytes(raster));
    field.init(map, table, layers.get());
    TEST_ASSERT_TRUE(field.ready());
  }
};

void points_about(wm::scan_points *points, uint64_t stream) {
  *points = {};
  points->count = 181;
  const int ends[wm::kSigmaClasses] = {40, 90, 90, 181};
  std::memcpy(points->class_end, ends, sizeof ends);
  points->reach_m = 6.0f;
  for (int i = 0; i < points->count; i++) {
    const double range = 6 * wm_random_uniform(3, stream, (uint64_t)i),
                 angle = 3 * (wm_random_uniform(4, stream, (uint64_t)i) - 0.5);
    points->x_m[i] = (float)(range * std::cos(angle));
    points->y_m[i] = (float)(range * std::sin(angle));
  }
}

WM_KERNEL void four_at_once(const double *in, double *sine, double *cosine, double *power) {
  wm::lanes4 a, s, c, e;
  std::memcpy(&a, in, sizeof a);
  wm::sincos4(a, &s, &c);
  wm::exp4(a, &e);
  std::memcpy(sine, &s, sizeof s);
  std::memcpy(cosine, &c, sizeof c);
  std::memcpy(power, &e, sizeof e);
}
void four_plain(const double *in, double *sine, double *cosine, double *power) {
  four_at_once(in, sine, cosine, power);
}
#if WM_HAS_WIDE
WM_WIDE void four_wide(const double *in, double *sine, double *cosine, double *power) {
  four_at_once(in, sine, cosine, power);
}
#endif

TEST(elementary_functions_of_four) {
  for (uint64_t i = 0; i < 100000; i++) {
    double in[4], s[4], c[4], e[4];
    for (uint64_t k = 0; k < 4; k++) in[k] = (i % 2 ? 7 : 690) * (2 * wm_random_uniform(1, k, i) - 1);
    if (i == 0) in[0] = 0.0, in[1] = -0.0, in[2] = wm::kPi, in[3] = -wm::kHalfPi;
    for (int wide = 0; wide < 2; wide++) {
      four_plain(in, s, c, e);
#if WM_HAS_WIDE
      if (wide && wm_vectors_wide()) four_wide(in, s, c, e);
#endif
      for (int k = 0; k < 4; k++) {
        const wm::sin_cos one = wm::sincos(in[k]);
        const double power = wm::exp(in[k]);
        TEST_ASSERT_EQUAL_MEMORY(&one.sin, &s[k], sizeof(double));
        TEST_ASSERT_EQUAL_MEMORY(&one.cos, &c[k], sizeof(double));
        TEST_ASSERT_EQUAL_MEMORY(&power, &e[k], sizeof(double));
      }
    }
  }
}

// Against the look-up of single points by double arithmetic, which may fall into the next pixel; near the border and
// beyond it, too.
TEST(the_field_says_what_the_table_says) {
  for (bool sum : {false, true}) {
    const ready_map m(sum);
    wm::scan_points points;
    points_about(&points, 1);
    wm::packed_scan packed;
    m.field.pack(m.map, points, &packed);
    constexpr int kPoses = 501;
    std::vector<double> x(kPoses), y(kPoses), heading(kPoses);
    for (int i = 0; i < kPoses; i++) {
      m.map.to_map(kWidth * wm_random_uniform(5, 1, (uint64_t)i), kHeight * wm_random_uniform(5, 2, (uint64_t)i), &x[i],
                   &y[i]);
      heading[i] = 6.28 * wm_random_uniform(5, 3, (uint64_t)i) - 3.14;
    }
    std::vector<int16_t> words(6 * kPoses);
    const wm::field_poses poses = {&words[0],          &words[kPoses],     &words[2 * kPoses],
                                   &words[3 * kPoses], &words[4 * kPoses], &words[5 * kPoses]};
    std::vector<int32_t> plain(kPoses), wide(kPoses);
    wm_vectors_limit(true);
    m.field.place(m.map, packed, kPoses, x.data(), y.data(), heading.data(), poses);
    m.field.score(packed, poses, kPoses, plain.data());
    const std::vector<int16_t> placed = words;
    wm_vectors_limit(false);
    m.field.place(m.map, packed, kPoses, x.data(), y.data(), heading.data(), poses);
    m.field.score(packed, poses, kPoses, wide.data());
    TEST_ASSERT_TRUE(placed == words);
    TEST_ASSERT_TRUE(plain == wide);
    double off = 0, worst = 0, usual = 0;
    for (int i = 0; i < kPoses; i++) {
      const wm::sin_cos h = wm::sincos(heading[i]);
      const double expected = wm::kScoreUnit * wm::score(m.map, points, m.table, x[i], y[i], h.cos, h.sin);
      const double got = m.field.floor() * points.count + m.field.unit() * wide[i];
      off += (got - expected) / kPoses;
      worst = std::fmax(worst, std::fabs(got - expected));
      usual += std::fabs(expected - m.field.floor() * points.count) / kPoses;
    }
    TEST_ASSERT_LESS_THAN_DOUBLE(0.01 * usual, std::fabs(off));
    TEST_ASSERT_LESS_THAN_DOUBLE(0.25 * usual, worst);  // a few points fall into the next pixel of 4 cm
  }
}

TEST(what_lies_beyond_the_map_or_far_away_counts_nothing) {
  const ready_map m(false);
  wm::scan_points points;
  points_about(&points, 2);
  for (int i = 0; i < points.count; i++) points.x_m[i] += 900.0f;
  points.reach_m = 906.0f;
  wm::packed_scan packed;
  m.field.pack(m.map, points, &packed);
  TEST_ASSERT_EQUAL(0, packed.blocks);
  points_about(&points, 2);
  for (int i = 0; i < points.count; i++) points.x_m[i] += 60.0f;
  points.reach_m = 66.1f;
  m.field.pack(m.map, points, &packed);
  TEST_ASSERT_GREATER_THAN(0, packed.blocks);
  int16_t words[6];
  const wm::field_poses poses = {words, words + 1, words + 2, words + 3, words + 4, words + 5};
  for (double heading = -3; heading < 3; heading += 0.1) {
    double x, y;
    int32_t sum;
    m.map.to_map(250, 200, &x, &y);
    m.field.place(m.map, packed, 1, &x, &y, &heading, poses);
    m.field.score(packed, poses, 1, &sum);
    TEST_ASSERT_EQUAL_INT32(0, sum);
  }
  wm_raster large = raster;
  large.width_px = wm::score_field::kPixelsMax + 1;
  TEST_ASSERT_EQUAL(0, wm::score_field::bytes(large));
}

// The whole filter over a drive of scans, tracking and searching: every byte of its state.
void same_state(const char *estimator) {
  const wm_estimator *ops = wm_estimator_find(estimator);
  std::vector<char> params(ops->params.bytes), motion(wm_motion_params_table.bytes);
  wm_params_defaults(&ops->params, params.data());
  wm_params_defaults(&wm_motion_params_table, motion.data());
  wm_setup setup{};
  wm_rig rig;
  wm_rig_init(&rig);
  setup.rig = &rig;
  setup.map = &raster;
  setup.seed = 5;
  setup.motion = reinterpret_cast<const wm_motion_params *>(motion.data());
  setup.wheels = {NAN, NAN, NAN, NAN, NAN, NAN, 0, {}, {}};
  setup.start = {WM_TIME_NONE, {1, 6, 0}, {0, 0, 0, 1}, 0, 0.2, 0.05};
  const char *why = "";
  const size_t bytes = ops->state_bytes(params.data(), &setup, &why);
  TEST_ASSERT_GREATER_THAN_MESSAGE(0, bytes, why);
  const block states[2] = {allocate(bytes), allocate(bytes)};
  for (int plain = 0; plain < 2; plain++) {
    wm_vectors_limit(plain != 0);
    std::memset(states[plain].get(), 0, bytes);
    TEST_ASSERT_EQUAL(WM_OK, ops->init(states[plain].get(), params.data(), &setup));
    for (uint64_t i = 1; i < 100; i++) {
      wm_event e{};
      e.t_ns = wm_ns_from_seconds(0.1 * (double)i);
      e.kind = WM_EVENT_TWIST2;
      e.as.twist2 = {0.5, 0.1};
      TEST_ASSERT_EQUAL(WM_OK, ops->predict(states[plain].get(), &e));
      wm::scan_points points;
      points_about(&points, i);
      e = wm_event{};
      e.t_ns = wm_ns_from_seconds(0.1 * (double)i);
      e.kind = WM_EVENT_POINTS;
      e.as.points.camera = -1;
      e.as.points.count = (uint32_t)points.count;
      for (int k = 0; k < points.count; k++) {
        e.as.points.x_m[k] = points.x_m[k];
        e.as.points.y_m[k] = points.y_m[k];
        e.as.points.normal_rad[k] = NAN;
        e.as.points.sigma_m[k] = 0.02f;
      }
      wm_innovation record;
      size_t count = 0;
      TEST_ASSERT_EQUAL(WM_OK, ops->correct(states[plain].get(), &e, &record, 1, &count));
    }
  }
  wm_vectors_limit(false);
  TEST_ASSERT_EQUAL_MEMORY(states[0].get(), states[1].get(), bytes);
}

TEST(edge_mcl_has_the_same_state) { same_state("edge_mcl"); }
TEST(pf_edges_has_the_same_particles) { same_state("pf_edges"); }

}  // namespace

int suite_begin(int, char **) {
  draw(30, 30, 470, 60);
  draw(470, 60, 440, 380);
  draw(30, 30, 60, 370);
  draw(100, 200, 300, 250);
  return SUITE_RUNS;
}
