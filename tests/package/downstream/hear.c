// SPDX-License-Identifier: Apache-2.0
// Hears poses and says where the robot is: hear [COUNT [LCM_URL]]. Ends after COUNT poses (default: never), exit code 1
// where none came for ten seconds.
#include <lcm/lcm.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <waymark/lcm_messages.h>

static long heard;

static void on_pose(const lcm_recv_buf_t *message, const char *channel, void *context) {
  wm_published pose;
  (void)context;
  const char *wrong = wm_lcm_read_pose(message->data, message->data_size, &pose);
  if (wrong) {
    fprintf(stderr, "%s: %s\n", channel, wrong);
    return;
  }
  const double *p = pose.now.pose_map_base.p_m, *q = pose.now.pose_map_base.q_xyzw;
  double heading = atan2(2 * (q[3] * q[2] + q[0] * q[1]), 1 - 2 * (q[1] * q[1] + q[2] * q[2]));
  printf("x %.3f m, y %.3f m, heading %.4f rad, sigma %.3f m, %s\n", p[0], p[1], heading,
         sqrt(pose.now.covariance[wm_cov_index(0, 0)] + pose.now.covariance[wm_cov_index(1, 1)]),
         wm_state_name(pose.now.state));
  heard++;
}

int main(int argc, char **argv) {
  long count = argc > 1 ? strtol(argv[1], NULL, 10) : 0;
  lcm_t *lcm = lcm_create(argc > 2 ? argv[2] : NULL);
  if (!lcm) return 1;
  lcm_subscribe(lcm, "WAYMARK_POSE", on_pose, NULL);
  while (count <= 0 || heard < count)
    if (lcm_handle_timeout(lcm, 10000) <= 0) {
      fprintf(stderr, "no pose for ten seconds\n");
      lcm_destroy(lcm);
      return 1;
    }
  lcm_destroy(lcm);
  return 0;
}
