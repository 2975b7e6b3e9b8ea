// SPDX-License-Identifier: Apache-2.0
// Work to count the instructions of: wm_instructions WORK [TIMES], once warm, then counted. instructions.sh counts
// inside of wm_counted; where no tool can (tests/boards/instructions.py), what more TIMES take is what one takes.
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <vector>

#include "drawn_map.h"
#include "drawn_own_map.h"
#include "drawn_picture.h"
#include "drawn_search.h"
#include "drawn_street.h"
#include "drawn_window.h"
#include "landmark_drive.h"
#include "plain_ekf.h"

// Callgrind counts inside of this function alone.
extern "C" __attribute__((noinline)) void wm_counted(const std::function<void()> *work) {
  (*work)();
  __asm__ volatile("");
}

namespace {

int times = 1;

void count(const std::function<void()> &work) {
  work();
  for (int i = 0; i < times; i++) wm_counted(&work);
}

// A prediction and a bearing of landmark_ekf. For 10 s a stated start is weighed (`start`); the rest of the drive is as
// the steps after 12 s are.
void landmark_steps(const std::vector<bench::setting> &settings, bool start) {
  bench::landmark_drive drive(settings, false);
  std::vector<bench::landmark_drive::step> steps;  // as many however often it is counted
  for (int i = 0; i < 1000; i++) steps.push_back(drive.at(i));
  size_t i = 0;
  while (!start && i < 600) {
    drive.predict(steps[i]);
    (void)drive.correct(steps[i++]);
  }
  count([&] {
    const auto &now = steps[i++ % steps.size()];
    drive.predict(now);
    (void)drive.correct(now);
  });
}

// The same of a plain EKF.
void plain_steps() {
  const bench::landmark_drive drive({}, false);
  bench::plain_ekf filter(3, 0, 1.5707963, 0.05, 0.05);
  std::vector<bench::landmark_drive::step> steps;
  for (int i = 0; i < 1000; i++) steps.push_back(drive.at(i));
  size_t i = 0;
  count([&] {
    const auto &now = steps[i++ % steps.size()];
    filter.predict(0.02, now.twist.as.twist2.v_mps, now.twist.as.twist2.w_radps, 1e-4, 1e-4);
    const wm_landmark &l = drive.landmark(now.seen.as.sighting.landmark_id);
    filter.bearing(l.p_m[0], l.p_m[1], now.seen.as.sighting.bearing_rad, 4e-4);
  });
}

void windows() {
  bench::window_at_work window;
  count([&] { (void)window.all_slopes(wm::hough_transform); });
}

}  // namespace

int main(int argc, char **argv) {
  const char *what = argc > 1 ? argv[1] : "";
  if (argc > 2) times = std::atoi(argv[2]);
  if (!std::strcmp(what, "particles_200") || !std::strcmp(what, "particles_2000")) {
    bench::cloud_at_work work(std::strlen(what) == 13 ? 200 : 2000);
    count([&] { work.weigh(); });
  } else if (!std::strcmp(what, "particle_step_200") || !std::strcmp(what, "particle_step_2000")) {
    bench::cloud_at_work work(std::strlen(what) == 17 ? 200 : 2000);
    count([&] {
      work.move();
      work.weigh();
      work.resample();
    });
  } else if (!std::strcmp(what, "landmark_step") || !std::strcmp(what, "landmark_start")) {
    landmark_steps(bench::kCalibrationStates, !std::strcmp(what, "landmark_start"));
  } else if (!std::strcmp(what, "landmark_pose")) {
    landmark_steps(bench::pose_alone(), false);
  } else if (!std::strcmp(what, "landmark_defaults")) {
    landmark_steps({}, false);
  } else if (!std::strcmp(what, "plain_step")) {
    plain_steps();
  } else if (!std::strcmp(what, "window_50x50")) {
    windows();
  } else if (!std::strcmp(what, "own_map_cycle") || !std::strcmp(what, "own_map_search")) {
    bench::own_map_at_work work(40);
    const bool all = std::strcmp(what, "own_map_cycle") != 0;
    count([&] {
      work.begin();
      while (!work.step() && all) continue;
    });
  } else if (!std::strcmp(what, "picture_rays") || !std::strcmp(what, "picture_windows")) {
    bench::edges_at_work work(std::strcmp(what, "picture_rays") != 0);
    count([&] { (void)work.look(); });
  } else if (!std::strcmp(what, "picture_lines")) {
    bench::lines_at_work work;
    count([&] { (void)work.look(); });
  } else if (!std::strcmp(what, "picture_landmarks") || !std::strcmp(what, "picture_landmarks_lost")) {
    const bench::drawn_street street;
    bench::street_at_work work(street);
    const bool lost = std::strcmp(what, "picture_landmarks") != 0;
    count([&] { (void)work.look(lost); });
  } else if (!std::strcmp(what, "edge_scans_tracking") || !std::strcmp(what, "edge_scans_searching")) {
    bench::search_at_work work(!std::strcmp(what, "edge_scans_tracking"));
    for (int i = 0; i < 100; i++) {
      work.prepare();
      work.scan();
    }
    // A hundred of them: a sweep over the map takes some.
    count([&] {
      for (int i = 0; i < 100; i++) {
        work.prepare();
        work.scan();
      }
    });
  } else {
    std::fprintf(stderr,
                 "usage: wm_instructions "
                 "landmark_step|landmark_start|landmark_pose|landmark_defaults|plain_step|particles_200|particles_2000|"
                 "particle_step_200|particle_step_2000|"
                 "window_50x50|picture_rays|picture_windows|picture_lines|picture_landmarks|picture_landmarks_lost|"
                 "edge_scans_tracking|edge_scans_searching|own_map_cycle|own_map_search [TIMES]\n");
    return 2;
  }
  return 0;
}
