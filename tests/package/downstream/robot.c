// SPDX-License-Identifier: Apache-2.0
// A robot's own program: rows of odometry and sightings from standard input, fused poses to standard output.
// cc robot.c $(pkg-config --cflags --libs waymark-session)
#include <math.h>
#include <stdio.h>
#include <waymark/waymark.h>

static void take(void *context, waymark_record kind, const void *record, size_t bytes) {
  const wm_estimate *pose = record;
  (void)context, (void)bytes;
  if (kind == WAYMARK_RECORD_FUSED)
    printf("%lld %.17g %.17g %.17g\n", (long long)pose->t_ns, pose->pose_map_base.p_m[0], pose->pose_map_base.p_m[1],
           pose->covariance[0]);
}

int main(int argc, char **argv) {
  wm_error err = {WM_BAD_USAGE, "usage: robot CONFIG SITE < ROWS"};
  waymark_session *robot = NULL;
  uint32_t motion = 0, sightings = 0;
  const waymark_options options = {
      .bytes = sizeof options, .config = argv[1], .site = argc > 2 ? argv[2] : NULL, .seed = 1, .take = take};
  if (argc != 3 || waymark_open(&options, &robot, &err) != WM_OK ||
      waymark_add_source(robot, "motion", &motion, &err) != WM_OK ||
      waymark_add_source(robot, "sightings:front", &sightings, &err) != WM_OK || waymark_start(robot, &err) != WM_OK)
    return fprintf(stderr, "%s\n", err.text), 2;
  char line[200];
  while (fgets(line, sizeof line, stdin)) {  // the robot's own loop
    long long t_ns, arrival_ns;
    double row[3] = {0, NAN, 0};  // v_mps, vy_mps, w_radps
    wm_event seen = {.kind = WM_EVENT_SIGHTING, .as.sighting = wm_sighting_without_numbers()};
    wm_sighting *s = &seen.as.sighting;
    wm_status status = WM_OK;
    if (sscanf(line, "moved %lld %lf %lf", &t_ns, &row[0], &row[2]) == 3)
      status = waymark_push_row(robot, motion, t_ns, WM_TIME_NONE, row, 3, &err);
    if (sscanf(line, "saw %lld %lld %d %lf %lf", &t_ns, &arrival_ns, &s->landmark_id, &s->bearing_rad, &s->range_m) ==
        5) {
      seen.t_ns = t_ns, seen.arrival_ns = arrival_ns;
      status = waymark_push_event(robot, sightings, &seen, sizeof seen, &err);
    }
    if (status != WM_OK) fprintf(stderr, "%s\n", err.text);  // this datum is refused; the next one is taken
  }
  return waymark_close(robot, &err) == WM_OK ? 0 : 1;
}
