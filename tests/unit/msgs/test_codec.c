// SPDX-License-Identifier: Apache-2.0
#include "common/suite.h"
#include "waymark/bytes.h"
#include "waymark/codec.h"
#include "waymark/event_fields.h"

static const size_t kBytes[] = {
    [WM_FIELD_F64] = sizeof(double), [WM_FIELD_I64] = 8, [WM_FIELD_U64] = 8, [WM_FIELD_I32] = 4, [WM_FIELD_U16] = 2};

static uint64_t random_state = 42;
static uint64_t random_bits(void) {
  random_state += UINT64_C(0x9e3779b97f4a7c15);
  uint64_t z = random_state;
  z = (z ^ (z >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
  z = (z ^ (z >> 27)) * UINT64_C(0x94d049bb133111eb);
  return z ^ (z >> 31);
}
static double random_f64(void) { return ((double)(random_bits() >> 11) * 0x1p-53 - 0.5) * 1e3; }

// Any number, also those that a wrong type or sign would lose.
static void fill_field(wm_event *e, const wm_event_field *field) {
  static const double kSpecial[] = {NAN, INFINITY, -0.0, 1e-300};
  char *at = (char *)e + field->offset;
  for (unsigned i = 0; i < field->count; i++) {
    const uint64_t bits = random_bits();
    const double number = bits % 8 < 4 ? kSpecial[bits % 4] : random_f64();
    const int32_t edges[] = {INT32_MIN, -1, INT32_MAX, (int32_t)bits};
    switch ((wm_field_type)field->type) {
      case WM_FIELD_F64: memcpy(at + i * sizeof number, &number, sizeof number); break;
      case WM_FIELD_I64:
      case WM_FIELD_U64: memcpy(at + i * sizeof bits, &bits, sizeof bits); break;
      case WM_FIELD_I32: memcpy(at, &edges[bits % 4], sizeof edges[0]); break;
      case WM_FIELD_U16: memcpy(at, &bits, sizeof(uint16_t)); break;
    }
  }
}

static void fill(wm_event *e, unsigned kind) {
  memset(e, 0, sizeof *e);
  e->kind = (uint8_t)kind;
  e->t_ns = (wm_time_ns)random_bits();
  e->arrival_ns = (wm_time_ns)random_bits();
  e->seq = (uint32_t)random_bits();
  e->source = (uint16_t)random_bits();
  size_t count;
  const wm_event_field *fields = wm_event_fields(kind, &count);
  for (size_t i = 0; i < count; i++) fill_field(e, &fields[i]);
  if (kind == WM_EVENT_QUANTITIES) {
    e->as.quantities.count = (uint8_t)(random_bits() % (WM_QUANTITIES_MAX + 1));
    e->as.quantities.doubt = WM_DOUBT_FROZEN_COUNTER;
    e->as.quantities.lost_before = 65535;
    for (int i = 0; i < e->as.quantities.count; i++) {
      e->as.quantities.id[i] = (uint8_t)(random_bits() % WM_Q_COUNT);
      e->as.quantities.value[i] = random_f64();
    }
  }
  if (kind == WM_EVENT_POINTS) {
    e->as.points.count = (uint32_t)(random_bits() % (WM_POINTS_MAX + 1));
    e->as.points.dropped = 7;
    e->as.points.camera = -1;
    for (uint32_t i = 0; i < e->as.points.count; i++) {
      e->as.points.x_m[i] = (float)random_f64();
      e->as.points.y_m[i] = (float)random_f64();
      e->as.points.normal_rad[i] = (float)random_f64();
      e->as.points.sigma_m[i] = (float)random_f64();
    }
  }
}

// A member that has no row would be lost in the event log: bytes without a field are padding.
TEST(fields_cover_their_structs) {
  const wm_event *none = NULL;
  const size_t sizes[WM_EVENT_KIND_COUNT] = {
      [WM_EVENT_TWIST2] = sizeof none->as.twist2,       [WM_EVENT_TWIST6] = sizeof none->as.twist6,
      [WM_EVENT_INCREMENT] = sizeof none->as.increment, [WM_EVENT_SIGHTING] = sizeof none->as.sighting,
      [WM_EVENT_POSITION] = sizeof none->as.position,   [WM_EVENT_HEADING] = sizeof none->as.heading,
      [WM_EVENT_MARKER] = sizeof none->as.marker,       [WM_EVENT_STEREO] = sizeof none->as.stereo,
      [WM_EVENT_LOOKED] = sizeof none->as.looked,       [WM_EVENT_SET_POSE] = sizeof none->as.set_pose,
      [WM_EVENT_SET_FLOOR] = sizeof none->as.set_floor};
  for (unsigned kind = 1; kind < WM_EVENT_KIND_COUNT; kind++) {
    size_t count, covered = 0, widest = 1;
    const wm_event_field *fields = wm_event_fields(kind, &count);
    if (sizes[kind] == 0) continue;
    for (size_t i = 0; i < count; i++) {
      covered += kBytes[fields[i].type] * fields[i].count;
      if (kBytes[fields[i].type] > widest) widest = kBytes[fields[i].type];
      TEST_ASSERT_LESS_OR_EQUAL_MESSAGE(WM_EVENT_VERSION, fields[i].since, fields[i].name);
    }
    const size_t with_padding = (covered + widest - 1) / widest * widest;
    TEST_ASSERT_EQUAL_MESSAGE(sizes[kind], with_padding, wm_event_kind_name(kind));
  }
}

TEST(a_sighting_without_numbers_has_none) {
  wm_event event = {.as.sighting = wm_sighting_without_numbers()};
  size_t count;
  const wm_event_field *fields = wm_event_fields(WM_EVENT_SIGHTING, &count);
  for (size_t i = 0; i < count; i++) {
    double number;
    if (fields[i].type != WM_FIELD_F64) continue;
    memcpy(&number, (const char *)&event + fields[i].offset, sizeof number);
    TEST_ASSERT_TRUE_MESSAGE(isnan(number), fields[i].name);
  }
  TEST_ASSERT_EQUAL(-1, event.as.sighting.landmark_id);
}

TEST(every_event_comes_back_as_it_was) {
  for (int round = 0; round < 200; round++)
    for (unsigned kind = 1; kind < WM_EVENT_KIND_COUNT; kind++) {
      wm_event in, out;
      fill(&in, kind);
      uint8_t bytes[WM_EVENT_ENCODED_MAX], again[WM_EVENT_ENCODED_MAX];
      size_t length = wm_event_encode(&in, bytes, sizeof bytes), used;
      TEST_ASSERT_GREATER_THAN(0, length);
      memset(&out, 0xA5, sizeof out);
      TEST_ASSERT_EQUAL(WM_OK, wm_event_decode(bytes, length, &out, &used));
      TEST_ASSERT_EQUAL(length, used);
      TEST_ASSERT_EQUAL(length, wm_event_encode(&out, again, sizeof again));
      TEST_ASSERT_EQUAL_MEMORY_MESSAGE(bytes, again, length, wm_event_kind_name(kind));
      if (kind != WM_EVENT_POINTS) TEST_ASSERT_EQUAL_MEMORY(&in, &out, WM_EVENT_SMALL_BYTES);
    }
}

// Changes one bit of each number of each field in turn.
TEST(the_hash_of_an_event_sees_its_fields_and_its_stamp_alone) {
  static wm_event event, other;
  for (unsigned kind = 1; kind < WM_EVENT_KIND_COUNT; kind++) {
    fill(&event, kind);
    const uint64_t hash = wm_event_hash(&event);
    other = event;
    other.arrival_ns++;
    other.seq++;
    other.source++;
    TEST_ASSERT_EQUAL_HEX64(hash, wm_event_hash(&other));
    other.t_ns++;
    TEST_ASSERT_TRUE(hash != wm_event_hash(&other));
    size_t count;
    const wm_event_field *fields = wm_event_fields(kind, &count);
    for (size_t i = 0; i < count; i++)
      for (size_t k = 0; k < fields[i].count; k++) {
        other = event;
        ((char *)&other)[fields[i].offset + k * kBytes[fields[i].type]] ^= 1;
        TEST_ASSERT_TRUE_MESSAGE(hash != wm_event_hash(&other), fields[i].name);
      }
  }
  fill(&event, WM_EVENT_SIGHTING);
  other = event;
  other.kind = WM_EVENT_LOOKED;  // has the same first field
  TEST_ASSERT_TRUE(wm_event_hash(&event) != wm_event_hash(&other));
}

// Lists count up to their length, and no further.
TEST(the_hash_of_a_list_sees_each_of_its_numbers) {
  static wm_event event, other;
  memset(&event, 0, sizeof event);
  event.kind = WM_EVENT_QUANTITIES;
  event.as.quantities.count = 2;
  uint64_t hash = wm_event_hash(&event);
  for (int what = 0; what < 6; what++) {
    other = event;
    wm_quantities *q = &other.as.quantities;
    if (what == 0) q->id[1] = 1;
    if (what == 1) q->value[1] = 1;
    if (what == 2) q->doubt = 1;
    if (what == 3) q->lost_before = 1;
    if (what == 4) q->count = 1;
    if (what == 5) q->value[2] = 1, q->id[2] = 1;
    TEST_ASSERT_EQUAL_MESSAGE(what == 5, hash == wm_event_hash(&other), "quantities");
  }
  event.kind = WM_EVENT_POINTS;
  event.as.points.count = 2;
  hash = wm_event_hash(&event);
  for (int what = 0; what < 8; what++) {
    other = event;
    wm_points *p = &other.as.points;
    if (what == 0) p->x_m[1] = 1;
    if (what == 1) p->y_m[1] = 1;
    if (what == 2) p->normal_rad[1] = 1;
    if (what == 3) p->sigma_m[1] = 1;
    if (what == 4) p->dropped = 1;
    if (what == 5) p->camera = 1;
    if (what == 6) p->count = 1;
    if (what == 7) p->x_m[2] = 1;
    TEST_ASSERT_EQUAL_MESSAGE(what == 7, hash == wm_event_hash(&other), "points");
  }
}

TEST(a_cut_event_is_refused_at_every_length) {
  for (unsigned kind = 1; kind < WM_EVENT_KIND_COUNT; kind++) {
    wm_event in, out;
    fill(&in, kind);
    uint8_t bytes[WM_EVENT_ENCODED_MAX];
    size_t length = wm_event_encode(&in, bytes, sizeof bytes), used;
    for (size_t cut = 0; cut < length; cut++) {
      TEST_ASSERT_EQUAL(WM_BAD_DATA, wm_event_decode(bytes, cut, &out, &used));
      TEST_ASSERT_LESS_OR_EQUAL(cut, used);
      TEST_ASSERT_EQUAL(0, wm_event_encode(&in, bytes, cut));
      wm_event_encode(&in, bytes, sizeof bytes);
    }
  }
}

TEST(noise_never_gives_an_event_with_indices_out_of_bounds) {
  size_t good = 0;
  for (int round = 0; round < 20000; round++) {
    uint8_t bytes[128];
    for (size_t i = 0; i < sizeof bytes; i++) bytes[i] = (uint8_t)random_bits();
    bytes[0] = (uint8_t)(WM_EVENT_VERSION_OLDEST + random_bits() % (WM_EVENT_VERSION - WM_EVENT_VERSION_OLDEST + 1));
    bytes[1] = (uint8_t)(random_bits() % (WM_EVENT_KIND_COUNT + 2));
    if (round % 2) bytes[24] = (uint8_t)(random_bits() % 10);  // a count that may be good
    wm_event out;
    size_t used;
    if (wm_event_decode(bytes, sizeof bytes, &out, &used) != WM_OK) continue;
    good++;
    TEST_ASSERT_LESS_THAN(WM_EVENT_KIND_COUNT, out.kind);
    if (out.kind == WM_EVENT_QUANTITIES) {
      TEST_ASSERT_LESS_OR_EQUAL(WM_QUANTITIES_MAX, out.as.quantities.count);
      for (int i = 0; i < out.as.quantities.count; i++) TEST_ASSERT_LESS_THAN(WM_Q_COUNT, out.as.quantities.id[i]);
    }
    if (out.kind == WM_EVENT_POINTS) TEST_ASSERT_LESS_OR_EQUAL(WM_POINTS_MAX, out.as.points.count);
  }
  TEST_ASSERT_GREATER_THAN(1000, good);
}

TEST(another_version_is_refused) {
  wm_event in, out;
  fill(&in, WM_EVENT_TWIST2);
  uint8_t bytes[WM_EVENT_ENCODED_MAX];
  size_t length = wm_event_encode(&in, bytes, sizeof bytes), used;
  bytes[0]++;
  TEST_ASSERT_EQUAL(WM_BAD_DATA, wm_event_decode(bytes, length, &out, &used));
}

// Bytes of a sighting's numbers that came after `version` of the codec.
static size_t sighting_bytes_after(uint8_t version) {
  size_t count, bytes = 0;
  const wm_event_field *fields = wm_event_fields(WM_EVENT_SIGHTING, &count);
  for (size_t i = 0; i < count; i++) bytes += fields[i].since > version ? sizeof(double) : 0;
  return bytes;
}

// Event logs from before sightings had elevations.
TEST(a_version_without_elevation_is_read) {
  wm_event in, out;
  fill(&in, WM_EVENT_SIGHTING);
  uint8_t bytes[WM_EVENT_ENCODED_MAX];
  size_t length = wm_event_encode(&in, bytes, sizeof bytes), used;
  bytes[0] = 3;
  const size_t later = sighting_bytes_after(3);
  TEST_ASSERT_GREATER_OR_EQUAL(16, later);
  TEST_ASSERT_EQUAL(WM_OK, wm_event_decode(bytes, length - later, &out, &used));
  TEST_ASSERT_EQUAL(length - later, used);
  TEST_ASSERT_EQUAL_DOUBLE(in.as.sighting.bearing_rad, out.as.sighting.bearing_rad);
  TEST_ASSERT_FALSE(wm_sighting_has_elevation(&out.as.sighting));
  bytes[0] = 2;
  TEST_ASSERT_EQUAL(WM_BAD_DATA, wm_event_decode(bytes, length, &out, &used));
}

// Event logs from before NaN stood for every absent number.
TEST(zeros_that_stood_for_absent_numbers_become_nan) {
  wm_event in = {.kind = WM_EVENT_SIGHTING}, out;
  uint8_t bytes[WM_EVENT_ENCODED_MAX];
  size_t length = wm_event_encode(&in, bytes, sizeof bytes), used;
  TEST_ASSERT_EQUAL(WM_OK, wm_event_decode(bytes, length, &out, &used));
  TEST_ASSERT_EQUAL_DOUBLE(0, out.as.sighting.elevation_sigma_rad);  // today a zero is a zero
  bytes[0] = 4;
  TEST_ASSERT_EQUAL(WM_OK, wm_event_decode(bytes, length, &out, &used));
  TEST_ASSERT_DOUBLE_IS_NAN(out.as.sighting.elevation_sigma_rad);
  TEST_ASSERT_FALSE(wm_sighting_has_elevation(&out.as.sighting));
  TEST_ASSERT_EQUAL_DOUBLE(0, out.as.sighting.bearing_rad);

  in = (wm_event){.kind = WM_EVENT_MARKER, .as.marker = {.yaw_sigma_rad = 0.25}};
  length = wm_event_encode(&in, bytes, sizeof bytes);
  bytes[0] = 4;
  TEST_ASSERT_EQUAL(WM_OK, wm_event_decode(bytes, length, &out, &used));
  TEST_ASSERT_DOUBLE_IS_NAN(out.as.marker.along_sigma_m);
  TEST_ASSERT_DOUBLE_IS_NAN(out.as.marker.bloom_px);
  TEST_ASSERT_EQUAL_DOUBLE(0.25, out.as.marker.yaw_sigma_rad);
  TEST_ASSERT_EQUAL_DOUBLE(0, out.as.marker.yaw_rad);
}

TEST(a_number_is_read_from_the_version_on_it_came_with) {
  wm_event in, out;
  uint8_t bytes[WM_EVENT_ENCODED_MAX];
  size_t used;
  fill(&in, WM_EVENT_SIGHTING);
  in.as.sighting.elevation_rad = 0.25;
  in.as.sighting.elevation_sigma_rad = 0.5;
  const size_t length = wm_event_encode(&in, bytes, sizeof bytes) - sighting_bytes_after(4);
  bytes[0] = 4;
  TEST_ASSERT_EQUAL(WM_OK, wm_event_decode(bytes, length, &out, &used));
  TEST_ASSERT_EQUAL(length, used);
  TEST_ASSERT_EQUAL_DOUBLE(0.25, out.as.sighting.elevation_rad);
  TEST_ASSERT_EQUAL_DOUBLE(0.5, out.as.sighting.elevation_sigma_rad);
}

TEST(bytes_are_little_endian_on_every_machine) {
  wm_event e = {
      .t_ns = 0x0102030405060708, .arrival_ns = -1, .seq = 0x11223344, .source = 0x5566, .kind = WM_EVENT_LOOKED};
  e.as.looked.sensor = 0x7788;
  uint8_t bytes[64];
  static const char kWanted[] =
      "\x66\x55\x44\x33\x22\x11\x08\x07\x06\x05\x04\x03\x02\x01\xff\xff\xff\xff\xff\xff\xff\xff\x88\x77";
  TEST_ASSERT_EQUAL(2 + sizeof kWanted - 1, wm_event_encode(&e, bytes, sizeof bytes));
  TEST_ASSERT_EQUAL(WM_EVENT_VERSION, bytes[0]);
  TEST_ASSERT_EQUAL(WM_EVENT_LOOKED, bytes[1]);
  TEST_ASSERT_EQUAL_MEMORY(kWanted, bytes + 2, sizeof kWanted - 1);
}

TEST(a_published_pose_comes_back) {
  wm_published in = {.made_ns = 5, .fused_until_ns = -3, .jumps = 2, .status_flags = 7, .utc_uncertainty_ns = -1}, out;
  for (int i = 0; i < 36; i++) in.now.covariance[i] = random_f64();
  in.now.pose_map_base.q_xyzw[3] = 1;
  in.now.dof = 3;
  in.last_jump_m = random_f64();
  in.now.lost_probability = 0.25;
  uint8_t bytes[WM_PUBLISHED_ENCODED_MAX], again[WM_PUBLISHED_ENCODED_MAX];
  size_t length = wm_published_encode(&in, bytes, sizeof bytes), used;
  TEST_ASSERT_GREATER_THAN(400, length);
  TEST_ASSERT_EQUAL(WM_OK, wm_published_decode(bytes, length, &out, &used));
  TEST_ASSERT_EQUAL(length, wm_published_encode(&out, again, sizeof again));
  TEST_ASSERT_EQUAL_MEMORY(bytes, again, length);
  TEST_ASSERT_EQUAL(WM_BAD_DATA, wm_published_decode(bytes, length - 1, &out, &used));
  TEST_ASSERT_EQUAL(0, wm_published_encode(&in, bytes, length - 1));
}

// The version before had no probability behind the estimate's state.
TEST(a_published_pose_of_the_version_before_is_read) {
  wm_published in = {.made_ns = 5, .jumps = 2}, out;
  in.now.state = WM_STATE_LOST;
  in.now.lost_probability = 0.25;
  uint8_t bytes[WM_PUBLISHED_ENCODED_MAX];
  size_t length = wm_published_encode(&in, bytes, sizeof bytes), used;
  const size_t estimate = 1 + 8 + 8 * (3 + 4 + 1 + 36 + 3 + 3) + 4 + 1 + 1;
  memmove(bytes + estimate, bytes + estimate + 8, length - estimate - 8);
  bytes[0] = 1;
  TEST_ASSERT_EQUAL(WM_OK, wm_published_decode(bytes, length - 8, &out, &used));
  TEST_ASSERT_EQUAL(length - 8, used);
  TEST_ASSERT_DOUBLE_IS_NAN(out.now.lost_probability);
  TEST_ASSERT_EQUAL(WM_STATE_LOST, out.now.state);
  TEST_ASSERT_EQUAL_INT64(5, out.made_ns);
  TEST_ASSERT_EQUAL(2, out.jumps);
}

TEST(an_innovation_comes_back_and_unknown_verdicts_do_not) {
  wm_innovation in = {.t_ns = 1,
                      .source = 2,
                      .sensor = 3,
                      .landmark_id = -1,
                      .residual = WM_RESIDUAL_RANGE,
                      .verdict = WM_REJECTED_GATE,
                      .observed = 1.5,
                      .nis = 7,
                      .gate = 6.6,
                      .gate_dof = 1},
                out;
  uint8_t bytes[WM_INNOVATION_ENCODED_MAX];
  size_t length = wm_innovation_encode(&in, bytes, sizeof bytes), used;
  TEST_ASSERT_EQUAL(WM_OK, wm_innovation_decode(bytes, length, &out, &used));
  TEST_ASSERT_EQUAL(WM_REJECTED_GATE, out.verdict);
  TEST_ASSERT_EQUAL_DOUBLE(1.5, out.observed);
  in.verdict = WM_VERDICT_COUNT;
  wm_innovation_encode(&in, bytes, sizeof bytes);
  TEST_ASSERT_EQUAL(WM_BAD_DATA, wm_innovation_decode(bytes, length, &out, &used));
}

TEST(a_setup_comes_back) {
  uint8_t bytes[2048];
  size_t used;
  wm_wheels wheels = {.radius_m = 0.1, .track_m = NAN, .steering_table_count = 3, .actuator_m = {1, 2, 3}}, wheels2;
  size_t length = wm_wheels_encode(&wheels, bytes, sizeof bytes);
  TEST_ASSERT_EQUAL(WM_OK, wm_wheels_decode(bytes, length, &wheels2, &used));
  TEST_ASSERT_EQUAL_MEMORY(&wheels, &wheels2, sizeof wheels);
  bytes[49] = 65;  // more rows than a table has
  TEST_ASSERT_EQUAL(WM_BAD_DATA, wm_wheels_decode(bytes, length, &wheels2, &used));

  wm_sensor sensor = {.name = "laser", .mounting = {{1, 2, 3}, {4, 5, 6}}, .max_range_m = INFINITY}, sensor2;
  length = wm_sensor_encode(&sensor, bytes, sizeof bytes);
  TEST_ASSERT_EQUAL(WM_OK, wm_sensor_decode(bytes, length, &sensor2, &used));
  TEST_ASSERT_EQUAL_STRING("laser", sensor2.name);
  TEST_ASSERT_EQUAL_DOUBLE(6, sensor2.mounting.rpy_rad[2]);

  wm_start start = {.t_ns = WM_TIME_NONE, .heading_rad = NAN, .sigma_xy_m = 0.05}, start2;
  length = wm_start_encode(&start, bytes, sizeof bytes);
  TEST_ASSERT_EQUAL(WM_OK, wm_start_decode(bytes, length, &start2, &used));
  TEST_ASSERT_EQUAL_MEMORY(&start, &start2, sizeof start);
}

TEST(a_rig_comes_back_and_a_cut_one_is_refused) {
  wm_rig rig, back;
  wm_rig_init(&rig);
  rig.camera_count = 2;
  for (int c = 0; c < 2; c++) {
    wm_camera *camera = &rig.cameras[c];
    camera->name[0] = c == 0 ? 'l' : 'r';
    camera->model = WM_CAMERA_OMNI;
    camera->width_px = 640;
    camera->height_px = 480;
    camera->intrinsics_count = 5;
    camera->distortion_count = 4;
    for (int i = 0; i < 5; i++) camera->intrinsics[i] = random_f64();
    for (int i = 0; i < 4; i++) camera->distortion[i] = random_f64();
    camera->readout_ns = 33;
    camera->mounting.rpy_rad[2] = 0.5;
  }
  rig.stereo.left = 0;
  rig.stereo.right = 1;
  rig.marker_size_m = 0.2;
  rig.antenna_m[0] = 0.4, rig.antenna_m[1] = -0.1, rig.antenna_m[2] = 1.5;
  uint8_t bytes[WM_RIG_ENCODED_MAX], again[WM_RIG_ENCODED_MAX];
  size_t used, count = wm_rig_encode(&rig, bytes, sizeof bytes);
  TEST_ASSERT_GREATER_THAN(0, count);
  TEST_ASSERT_EQUAL(WM_OK, wm_rig_decode(bytes, count, &back, &used));
  TEST_ASSERT_EQUAL(count, used);
  TEST_ASSERT_EQUAL(count, wm_rig_encode(&back, again, sizeof again));
  TEST_ASSERT_EQUAL_MEMORY(bytes, again, count);
  TEST_ASSERT_EQUAL(1, wm_rig_find_camera(&back, "r"));
  TEST_ASSERT_EQUAL(-1, wm_rig_find_camera(&back, "x"));
  for (size_t cut = 0; cut < count; cut++) TEST_ASSERT_EQUAL(WM_BAD_DATA, wm_rig_decode(bytes, cut, &back, &used));
  bytes[0] = 1;  // version 1 had no antenna at its end
  TEST_ASSERT_EQUAL(WM_OK, wm_rig_decode(bytes, count - sizeof rig.antenna_m, &back, &used));
  TEST_ASSERT_EQUAL_DOUBLE(0.2, back.marker_size_m);
  TEST_ASSERT_DOUBLE_IS_NAN(back.antenna_m[0]);
  rig.stereo.right = 2;  // no such camera
  count = wm_rig_encode(&rig, bytes, sizeof bytes);
  TEST_ASSERT_EQUAL(WM_BAD_DATA, wm_rig_decode(bytes, count, &back, &used));
}

// Of a rig of which nothing is known no number is given, and no camera belongs to the pair.
TEST(a_rig_of_which_nothing_is_known_has_no_numbers) {
  wm_rig rig;
  memset(&rig, 0x55, sizeof rig);
  wm_rig_init(&rig);
  TEST_ASSERT_EQUAL(0, rig.camera_count);
  TEST_ASSERT_EQUAL(-1, rig.stereo.left);
  TEST_ASSERT_EQUAL(-1, rig.stereo.right);
  TEST_ASSERT_EQUAL_STRING("", rig.marker_family);
  TEST_ASSERT_DOUBLE_IS_NAN(rig.stereo.baseline_m);
  TEST_ASSERT_DOUBLE_IS_NAN(rig.marker_size_m);
  for (int i = 0; i < 4; i++) {
    TEST_ASSERT_DOUBLE_IS_NAN(rig.stereo.rectified_px[i]);
    TEST_ASSERT_DOUBLE_IS_NAN(rig.stereo.sigma_px[i]);
  }
  for (int i = 0; i < 3; i++) {
    TEST_ASSERT_DOUBLE_IS_NAN(rig.twist6_sigma_v_mps[i]);
    TEST_ASSERT_DOUBLE_IS_NAN(rig.twist6_sigma_w_radps[i]);
  }
}

// Each model of a camera, none beside them, and names that fill their room.
TEST(cameras_of_a_rig_have_a_model_and_a_name) {
  wm_rig rig, back;
  uint8_t bytes[WM_RIG_ENCODED_MAX];
  size_t used;
  wm_rig_init(&rig);
  rig.camera_count = 2;
  for (int model = -1; model <= WM_CAMERA_MODEL_COUNT; model++) {
    rig.cameras[1].model = model;
    const size_t count = wm_rig_encode(&rig, bytes, sizeof bytes);
    const int is_one = model >= 0 && model < WM_CAMERA_MODEL_COUNT;
    TEST_ASSERT_EQUAL(is_one ? WM_OK : WM_BAD_DATA, wm_rig_decode(bytes, count, &back, &used));
    if (is_one) TEST_ASSERT_EQUAL(model, back.cameras[1].model);
  }
  rig.cameras[1].model = WM_CAMERA_OMNI;
  memset(rig.cameras[0].name, 'n', WM_NAME_MAX);
  memset(rig.marker_family, 'f', WM_NAME_MAX);
  TEST_ASSERT_EQUAL(WM_OK, wm_rig_decode(bytes, wm_rig_encode(&rig, bytes, sizeof bytes), &back, &used));
  TEST_ASSERT_EQUAL(WM_NAME_MAX - 1, strnlen(back.cameras[0].name, WM_NAME_MAX));
  TEST_ASSERT_EQUAL(WM_NAME_MAX - 1, strnlen(back.marker_family, WM_NAME_MAX));
}

TEST(absent_numbers_of_a_landmark_are_nan_and_keep_the_hash_of_older_logs) {
  wm_landmark in = {
      .id = 3, .p_m = {1, 2, 3}, .sigma_m = NAN, .yaw_rad = NAN, .cov_m2 = {NAN, NAN, NAN}, .yaw_sigma_rad = NAN};
  wm_landmark zeros = in, out;
  zeros.sigma_m = zeros.cov_m2[0] = zeros.cov_m2[1] = zeros.cov_m2[2] = zeros.yaw_sigma_rad = 0.0;
  uint8_t bytes[128];
  size_t used, length = wm_landmark_encode(&zeros, bytes, sizeof bytes);
  TEST_ASSERT_EQUAL(WM_OK, wm_landmark_decode(bytes, length, &out, &used));
  TEST_ASSERT_EQUAL_DOUBLE(0, out.yaw_sigma_rad);  // today a zero is a zero
  bytes[0] = 2;
  TEST_ASSERT_EQUAL(WM_OK, wm_landmark_decode(bytes, length, &out, &used));
  TEST_ASSERT_DOUBLE_IS_NAN(out.sigma_m);
  TEST_ASSERT_DOUBLE_IS_NAN(out.cov_m2[0]);
  TEST_ASSERT_DOUBLE_IS_NAN(out.cov_m2[1]);
  TEST_ASSERT_DOUBLE_IS_NAN(out.cov_m2[2]);
  TEST_ASSERT_DOUBLE_IS_NAN(out.yaw_sigma_rad);
  TEST_ASSERT_EQUAL_UINT64(wm_landmarks_hash(&zeros, 1), wm_landmarks_hash(&in, 1));
  TEST_ASSERT_EQUAL_UINT64(wm_hash(WM_HASH_START, bytes, length), wm_landmarks_hash(&in, 1));
  bytes[0] = 1;
  TEST_ASSERT_EQUAL(WM_BAD_DATA, wm_landmark_decode(bytes, length, &out, &used));
}

// The same bytes give the same landmark to the last byte of its memory, whatever was there before.
TEST(a_landmark_overwrites_all_of_its_memory) {
  const wm_landmark in = {
      .id = 3, .p_m = {1, 2, 3}, .sigma_m = 4, .yaw_rad = 5, .cov_m2 = {6, 7, 8}, .yaw_sigma_rad = 9};
  wm_landmark once, again;
  uint8_t bytes[128];
  size_t used;
  const size_t length = wm_landmark_encode(&in, bytes, sizeof bytes);
  memset(&once, 0x55, sizeof once);
  memset(&again, 0xAA, sizeof again);
  TEST_ASSERT_EQUAL(WM_OK, wm_landmark_decode(bytes, length, &once, &used));
  TEST_ASSERT_EQUAL(WM_OK, wm_landmark_decode(bytes, length, &again, &used));
  TEST_ASSERT_EQUAL_MEMORY(&once, &again, sizeof once);
  TEST_ASSERT_EQUAL(3, once.id);
  for (int i = 0; i < 3; i++) TEST_ASSERT_EQUAL_DOUBLE(1 + i, once.p_m[i]);
  TEST_ASSERT_EQUAL_DOUBLE(4, once.sigma_m);
  TEST_ASSERT_EQUAL_DOUBLE(5, once.yaw_rad);
  for (int i = 0; i < 3; i++) TEST_ASSERT_EQUAL_DOUBLE(6 + i, once.cov_m2[i]);
  TEST_ASSERT_EQUAL_DOUBLE(9, once.yaw_sigma_rad);
}

TEST(the_hash_of_a_map_sees_every_number_and_the_order) {
  wm_landmark map[2] = {{.id = 1, .p_m = {1, 2, 0}, .sigma_m = 0.01, .yaw_rad = NAN},
                        {.id = 2, .p_m = {3, 4, 0}, .sigma_m = 0.01, .yaw_rad = NAN}};
  uint64_t hash = wm_landmarks_hash(map, 2);
  wm_landmark swapped[2] = {map[1], map[0]};
  TEST_ASSERT_TRUE(hash != wm_landmarks_hash(swapped, 2));
  TEST_ASSERT_TRUE(hash != wm_landmarks_hash(map, 1));
  map[1].p_m[1] = nextafter(4, 5);
  TEST_ASSERT_TRUE(hash != wm_landmarks_hash(map, 2));
}
