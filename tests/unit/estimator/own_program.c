// SPDX-License-Identifier: Apache-2.0
// A program with a filter in itself: the installed headers alone, no configuration file, no number filled in that is
// not known.
#include "waymark/own_program.h"
#include "common/suite.h"

TEST(parameters_by_key) {
  const wm_estimator *ekf = wm_estimator_find("landmark_ekf");
  void *params = malloc(ekf->params.bytes);
  wm_params_defaults(&ekf->params, params);
  double value = 0;
  for (size_t i = 0; i < ekf->params.count; i++) {
    const wm_param *p = &ekf->params.params[i];
    TEST_ASSERT_NULL_MESSAGE(wm_params_set(&ekf->params, params, p->key, p->max), p->key);
    if (p->type != WM_PARAM_F64) continue;
    memcpy(&value, (char *)params + p->offset, sizeof value);
    TEST_ASSERT_EQUAL_DOUBLE(p->max, value);
    TEST_ASSERT_EQUAL_STRING("the value is outside of the parameter's range",
                             wm_params_set(&ekf->params, params, p->key, (double)NAN));
  }
  TEST_ASSERT_EQUAL_STRING("there is no parameter of this key", wm_params_set(&ekf->params, params, "sigma", 1));
  free(params);
  void *motion = malloc(wm_motion_params_table.bytes);
  wm_params_defaults(&wm_motion_params_table, motion);
  TEST_ASSERT_NULL(wm_params_set_name(&wm_motion_params_table, motion, "model", "speed_yaw_rate"));
  TEST_ASSERT_EQUAL_STRING("the parameter has no value of this name",
                           wm_params_set_name(&wm_motion_params_table, motion, "model", "wings"));
  TEST_ASSERT_EQUAL_STRING("the parameter is a whole number",
                           wm_params_set(&wm_motion_params_table, motion, "model", 0.5));
  free(motion);
}

// Straight on at 1 m/s from 0.3 m beside the start that it was given; a landmark ahead on the left.
TEST(a_drive) {
  const wm_estimator *ekf = wm_estimator_find("landmark_ekf");
  wm_motion_params *motion = malloc(wm_motion_params_table.bytes);
  wm_sighting_params *sightings = malloc(wm_sighting_params_table.bytes);
  void *params = malloc(ekf->params.bytes);
  wm_params_defaults(&wm_motion_params_table, motion);
  wm_params_defaults(&wm_sighting_params_table, sightings);
  wm_params_defaults(&ekf->params, params);
  wm_sensor eye;
  wm_landmark landmarks[2];
  wm_setup setup;
  wm_sensor_init(&eye, "eye");
  eye.bearing_sigma_rad = 0.01;
  eye.range_sigma_m = 0.05;
  for (int i = 0; i < 2; i++) {
    wm_landmark_init(&landmarks[i], i);
    landmarks[i].p_m[0] = 8;
    landmarks[i].p_m[1] = i ? -4 : 3;
    landmarks[i].p_m[2] = 0;
    landmarks[i].sigma_m = 0.01;
  }
  wm_setup_init(&setup);
  setup.motion = motion;
  setup.sightings = sightings;
  setup.sensors = &eye;
  setup.sensor_count = 1;
  setup.landmarks = landmarks;
  setup.landmark_count = 2;
  setup.start.p_m[0] = setup.start.p_m[1] = setup.start.heading_rad = 0;
  setup.start.sigma_xy_m = 0.5;
  const char *why = NULL;
  const size_t bytes = ekf->state_bytes(params, &setup, &why);
  TEST_ASSERT_TRUE_MESSAGE(bytes > 0, why ? why : "");
  void *state = aligned_alloc(64, (bytes + 63) / 64 * 64);
  TEST_ASSERT_EQUAL(WM_OK, ekf->init(state, params, &setup));
  wm_event event;
  wm_innovation rows[WM_INNOVATIONS_PER_EVENT_MAX];
  size_t count;
  for (int i = 0; i < 200; i++) {
    memset(&event, 0, sizeof event);
    event.kind = WM_EVENT_TWIST2;
    event.t_ns = event.arrival_ns = i * INT64_C(20000000);
    event.as.twist2.v_mps = 1;
    TEST_ASSERT_EQUAL(WM_OK, ekf->predict(state, &event));
    if (i % 5) continue;
    const wm_landmark *l = &landmarks[i / 5 % 2];
    event.kind = WM_EVENT_SIGHTING;
    const double dx = l->p_m[0] - 0.02 * i, dy = l->p_m[1] - 0.3;
    event.as.sighting = wm_sighting_without_numbers();
    event.as.sighting.landmark_id = l->id;
    event.as.sighting.bearing_rad = atan2(dy, dx);
    event.as.sighting.range_m = sqrt(dx * dx + dy * dy);
    TEST_ASSERT_EQUAL(WM_OK, ekf->correct(state, &event, rows, WM_INNOVATIONS_PER_EVENT_MAX, &count));
  }
  wm_estimate now;
  ekf->estimate(state, &now);
  TEST_ASSERT_DOUBLE_WITHIN(0.05, 0.02 * 199, now.pose_map_base.p_m[0]);
  TEST_ASSERT_DOUBLE_WITHIN(0.05, 0.3, now.pose_map_base.p_m[1]);
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, now.state);
  free(state);
  free(params);
  free(sightings);
  free(motion);
}
