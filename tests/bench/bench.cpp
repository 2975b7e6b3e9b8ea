// SPDX-License-Identifier: Apache-2.0
// What has to be fast, as a table of works, others' libraries among them. Without a word: the median time of each, on
// this thread's own clock, and its share of the time of the row before that does the same (`of`); with
// WM_BENCH_SHORT in the environment, as the tests run it, each a few times: does it still do what is meant to be
// measured? wm_bench_works WORK [TIMES]: one of them, once warm, then counted. instructions.sh counts inside of
// wm_counted; where no tool can (tests/boards/instructions.py), what more TIMES take is what one takes.
#include <apriltag/apriltag.h>
#include <apriltag/tag36h11.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "../unit/estimator/sea_floor.hpp"
#include "common/marker_views.hpp"
#include "drawn_map.h"
#include "drawn_own_map.h"
#include "drawn_picture.h"
#include "drawn_search.h"
#include "drawn_street.h"
#include "drawn_window.h"
#include "landmark_drive.h"
#include "plain_ekf.h"
#include "rivals.h"
#include "slam_steps.h"
#include "waymark/detectors.h"

// Callgrind counts inside of this function alone.
extern "C" __attribute__((noinline)) void wm_counted(const std::function<void()> *work) {
  (*work)();
  __asm__ volatile("");
}

namespace {

// Set up, it gives what is done once; true: it did what is meant to be measured.
using once = std::function<bool()>;

// The drive's steps, made before they are measured, and where in them the work is.
struct drive_steps {
  std::vector<bench::landmark_drive::step> all;
  size_t next = 0;
};

std::shared_ptr<drive_steps> steps_of(const bench::landmark_drive &drive) {
  const auto out = std::make_shared<drive_steps>();
  for (int i = 0; i < 2000; i++) out->all.push_back(drive.at(i));
  return out;
}

// A prediction and a bearing of landmark_ekf. For 10 s a stated start is weighed (`start`); the rest of the drive is as
// the steps after 12 s are. At its end another drive begins.
once landmark_steps(const std::vector<bench::setting> &settings, bool start) {
  using drive = bench::landmark_drive;
  const auto begun = [=](drive_steps *steps) {
    auto out = std::make_shared<drive>(settings, false);
    for (steps->next = 0; !start && steps->next < 600; steps->next++) {
      out->predict(steps->all[steps->next]);
      (void)out->correct(steps->all[steps->next]);
    }
    return out;
  };
  const auto steps = steps_of(drive(settings, false));
  std::shared_ptr<drive> now = begun(steps.get());
  const size_t end = start ? 500 : steps->all.size();
  return [=]() mutable {
    if (steps->next == end) now = begun(steps.get());
    const auto &step = steps->all[steps->next++];
    now->predict(step);
    return now->correct(step);
  };
}

// The same of a plain EKF.
once plain_steps() {
  const auto drive = std::make_shared<bench::landmark_drive>(std::vector<bench::setting>{}, false);
  const auto filter = std::make_shared<bench::plain_ekf>(3, 0, 1.5707963, 0.05, 0.05);
  const auto steps = steps_of(*drive);
  return [=] {
    if (steps->next == steps->all.size()) {
      steps->next = 0;
      *filter = bench::plain_ekf(3, 0, 1.5707963, 0.05, 0.05);
    }
    const auto &now = steps->all[steps->next++];
    filter->predict(0.02, now.twist.as.twist2.v_mps, now.twist.as.twist2.w_radps, 1e-4, 1e-4);
    const wm_landmark &l = drive->landmark(now.seen.as.sighting.landmark_id);
    filter->bearing(l.p_m[0], l.p_m[1], now.seen.as.sighting.bearing_rad, 4e-4);
    return std::fabs(std::hypot(filter->x_m(), filter->y_m()) - 3) < 0.05;  // on its circle
  };
}

once particles(int count, bool whole) {
  const auto work = std::make_shared<bench::cloud_at_work>(count);
  return [=] {
    if (whole) work->move();
    work->weigh();
    if (whole) work->resample();
    return true;
  };
}

once own_map(bool all) {
  const auto work = std::make_shared<bench::own_map_at_work>(40);
  return [=] {
    work->begin();
    while (!work->step() && all) continue;
    return true;
  };
}

once edges(int mode) {
  const auto work = std::make_shared<bench::edges_at_work>(mode);
  return [=] { return work->look() > 0; };
}

once landmarks(bool lost) {
  const auto street = std::make_shared<bench::drawn_street>();
  const auto work = std::make_shared<bench::street_at_work>(*street);
  return [=] { return street && work->look(lost) > 0; };
}

// A hundred of them: a sweep over the map takes some.
once edge_scans(bool told) {
  const auto work = std::make_shared<bench::search_at_work>(told);
  const auto scans = [=] {
    for (int i = 0; i < 100; i++) {
      work->prepare();
      work->scan();
    }
    return true;
  };
  scans();
  return scans;
}

// A picture of 640 x 480 with a coded marker in an office's clutter.
once marker(const wm_detector *detector, const char *family, const wm::views::Ink &ink) {
  const auto view = std::make_shared<wm::views::View>(wm::views::draw_view(0, 0.4));
  const auto grey = std::make_shared<std::vector<uint8_t>>(take_picture(*view, ink));
  const auto rig = std::make_shared<wm_rig>();
  wm_rig_init(rig.get());
  rig->camera_count = 1;
  rig->cameras[0] = view->camera;
  (void)std::snprintf(rig->marker_family, sizeof rig->marker_family, "%s", family);
  rig->marker_size_m = view->size_m;
  static constexpr int32_t kCamera = 0;
  const auto work = std::make_shared<bench::detector_at_work>(
      detector, wm_view{rig.get(), &kCamera, nullptr, 0, nullptr, 0, nullptr, 0});
  return [=] {
    const wm_frame frame = wm::views::frame_of(*grey, view->camera);
    return rig && work->look(&frame) > 0;
  };
}

// What is made of the AprilTag library's own picture of a tag.
once of_tag(once (*make)(const wm::views::Ink &)) {
  apriltag_family_t *family = tag36h11_create();
  image_u8_t *image = apriltag_to_image(family, 7);
  const once work = make([image](double x, double y) {
    const int i = static_cast<int>(std::floor((0.5 - x) * 8 + 1)), j = static_cast<int>(std::floor((0.5 - y) * 8 + 1));
    if (i < 0 || j < 0 || i >= image->width || j >= image->height) return -1;
    return image->buf[j * image->stride + i] ? 0 : 1;
  });
  std::free(image->buf);
  std::free(image);
  tag36h11_destroy(family);
  return work;
}

once tag(const wm::views::Ink &ink) {
  size_t count;
  const wm_detector *const *library = wm_library_detectors(&count);
  return marker(*std::find_if(library, library + count,
                              [](const wm_detector *d) { return std::strcmp(d->name, "apriltag") == 0; }),
                "tag36h11", ink);
}

template <int kDecimate>
once tag_by_library(const wm::views::Ink &ink) {
  const wm::views::View view = wm::views::draw_view(0, 0.4);
  return bench::library_search(take_picture(view, ink), static_cast<int>(view.camera.width_px),
                               static_cast<int>(view.camera.height_px), kDecimate);
}

// A pair of 640x480 pictures to followed points, while a vehicle swims over a sea floor.
once points() {
  const auto rig = std::make_shared<wm_rig>();
  sea::make_rig(rig.get(), false);
  static constexpr int32_t kCameras[2] = {0, 1};
  const auto work = std::make_shared<bench::detector_at_work>(
      wm_detector_find("stereo"), wm_view{rig.get(), kCameras, nullptr, 0, nullptr, 0, nullptr, 0});
  constexpr int kPictures = 4;  // there and back
  const auto pictures = std::make_shared<std::vector<std::vector<uint8_t>>>(2 * kPictures);
  const sea::floor_grain grain(1);
  for (size_t k = 0; k < pictures->size(); k++) {
    sea::view_of_floor seen(grain);
    seen.map_base = sea::swim(0.125 * static_cast<double>(k / 2));
    wm::mounted_camera eye;
    wm::mounted_camera_init(&eye, rig->cameras[k % 2]);
    sea::render(seen, eye, k, &(*pictures)[k]);
  }
  return [=, k = 0]() mutable {
    const int at = k % (2 * kPictures - 2), picture = at < kPictures ? at : 2 * kPictures - 2 - at;
    wm_frame frames[2];
    for (int i = 0; i < 2; i++)
      frames[i] =
          bench::frame_of((*pictures)[static_cast<size_t>(2 * picture + i)], 640, 480, i, INT64_C(125000000) * k);
    const bool is_first = k++ == 0;  // it begins the tracks
    return rig && (work->look(frames) > 0 || is_first);
  };
}

once window() {
  const auto work = std::make_shared<bench::window_at_work>();
  return [=] {
    (void)work->all_slopes(wm::hough_transform);
    return true;
  };
}

once lines() {
  const auto work = std::make_shared<bench::lines_at_work>();
  return [=, looks = 0]() mutable { return work->look() > 0 || looks++ < 3; };  // a line is told when it was followed
}

once slam(int known) {
  const auto steps = std::make_shared<bench::slam_steps>(known);
  return [=] { return steps->step(); };
}

const struct {
  const char *name;
  once (*make)();
  const char *of = nullptr;
} kWorks[] = {
    {"plain_step", plain_steps},
    {"landmark_pose", [] { return landmark_steps(bench::pose_alone(), false); }, "plain_step"},
    {"landmark_defaults", [] { return landmark_steps({}, false); }, "plain_step"},
#ifdef WM_HAS_MRPT
    {"mrpt_particles_200", [] { return bench::mrpt_weights(200); }},
    {"mrpt_particles_2000", [] { return bench::mrpt_weights(2000); }},
#endif
#ifdef WM_HAS_OPENCV
    {"opencv_window_50x50", bench::opencv_lines},
#endif
    {"library_tag", [] { return of_tag(tag_by_library<1>); }},
    {"library_tag_half", [] { return of_tag(tag_by_library<2>); }},
    {"landmark_step", [] { return landmark_steps(bench::kCalibrationStates, false); }},
    {"landmark_start", [] { return landmark_steps(bench::kCalibrationStates, true); }},
    {"slam_step_30", [] { return slam(30); }},
    {"slam_step_250", [] { return slam(250); }},
    {"particles_200", [] { return particles(200, false); }, "mrpt_particles_200"},
    {"particles_2000", [] { return particles(2000, false); }, "mrpt_particles_2000"},
    {"particle_step_200", [] { return particles(200, true); }},
    {"particle_step_2000", [] { return particles(2000, true); }},
    {"edge_scans_tracking", [] { return edge_scans(true); }},
    {"edge_scans_searching", [] { return edge_scans(false); }},
    {"own_map_cycle", [] { return own_map(false); }},
    {"own_map_search", [] { return own_map(true); }},
    {"window_50x50", window, "opencv_window_50x50"},
    {"picture_rays", [] { return edges(0); }},
    {"picture_windows", [] { return edges(1); }},
    {"picture_lines", lines},
    {"picture_landmarks", [] { return landmarks(false); }},
    {"picture_landmarks_lost", [] { return landmarks(true); }},
    {"picture_points", points},
    {"picture_mr", [] { return marker(wm_detector_find("mr"), "mr", wm::views::mr_ink(7)); }},
    {"picture_tag", [] { return of_tag(tag); }, "library_tag"},
};

double thread_us() {
  timespec now;
  (void)clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) * 1e6 + static_cast<double>(now.tv_nsec) * 1e-3;
}

// The median of as many samples as fit into half a second, at least 11, us. A sample is as many calls as take 30 us, so
// that the clock's own time doesn't count. NaN: of twenty calls more than one did something else.
double median_us(const char *name, const once &work) {
  constexpr size_t kLeast = 11;
  constexpr double kSample_us = 30;
  const double most_us = std::getenv("WM_BENCH_SHORT") ? 0 : 5e5;
  std::vector<double> each;
  size_t calls = 0, others = 0, at_once = 1;
  double sum_us = 0;
  while (each.size() < kLeast || sum_us < most_us) {
    const double begin = thread_us();
    for (size_t i = 0; i < at_once; i++) others += !work();
    const double took_us = thread_us() - begin;
    calls += at_once;
    sum_us += took_us;
    each.push_back(took_us / static_cast<double>(at_once));
    if (took_us < kSample_us) {
      at_once *= 2;
      each.clear();
    }
  }
  if (20 * others > calls) {
    std::printf("%s: %zu of %zu did not do what is meant to be measured\n", name, others, calls);
    return NAN;
  }
  std::nth_element(each.begin(), each.begin() + static_cast<std::ptrdiff_t>(each.size() / 2), each.end());
  return each[each.size() / 2];
}

// Prints the time of each, and its ratio to the row that does the same. False: one did something else.
bool measure_all() {
  bool works = true;
  std::map<std::string, double> all_us;
  for (const auto &[name, make, of] : kWorks) {
    const double us = all_us[name] = median_us(name, make());
    works = works && !std::isnan(us);
    const auto other = of ? all_us.find(of) : all_us.end();
    std::printf("%-24s %12.2f us", name, us);
    if (other != all_us.end()) std::printf("  %.3g of %s", us / other->second, of);
    std::printf("\n");
  }
  return works;
}

}  // namespace

int main(int argc, char **argv) {
  if (argc < 2) return !measure_all();
  const auto *row = std::find_if(std::begin(kWorks), std::end(kWorks),
                                 [&](const auto &one) { return std::strcmp(argv[1], one.name) == 0; });
  if (row == std::end(kWorks)) {
    std::fprintf(stderr, "wm_bench_works: there is no work '%s'\n", argv[1]);
    return 2;
  }
  const once work = row->make();
  const std::function<void()> counted = [&] { (void)work(); };
  counted();
  for (int i = 0; i < (argc > 2 ? std::atoi(argv[2]) : 1); i++) wm_counted(&counted);
  return 0;
}
