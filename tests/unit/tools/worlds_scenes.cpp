// SPDX-License-Identifier: Apache-2.0
// The worlds as pictures: labels lie where the renderer draws what they name, the same request gives the same bytes,
// another seed or level another world. Pictures here have no noise.
#include <algorithm>
#include <map>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "common/suite.h"
#include "common/trials.h"
#include "render/render.h"
#include "simulate/route.h"
#include "worlds/world.h"

extern "C" {
#include <apriltag/apriltag.h>
#include <apriltag/tag36h11.h>
}

using namespace wm::sim;
using wm::images::Pose;
using wm::images::Vec2;
using wm::images::Vec3;
using wm::render::Image;

namespace {

std::unique_ptr<World> made(const char *name, bool hard, uint64_t seed, bool on_walls = false,
                            Markers markers = Markers::tags) {
  WorldRequest request;
  request.markers = markers;
  request.name = name;
  request.hard = hard;
  request.seed = seed;
  request.markers_on_walls = on_walls;
  wm_error err{};
  std::unique_ptr<World> world = make_world(request, &err);
  TEST_ASSERT_NOT_NULL_MESSAGE(world.get(), err.text);
  return world;
}

// The vehicle's pose over a whole run.
class Motion {
 public:
  explicit Motion(const World &world) : world_(world) {
    wm_error err{};
    if (world.vehicle != Vehicle::six)
      TEST_ASSERT_EQUAL_MESSAGE(WM_OK, Drive::plan(world.route, drive_, &err), err.text);
  }
  double duration_s() const { return world_.vehicle == Vehicle::six ? world_.path.duration_s() : drive_.duration_s(); }
  Pose at(double t_ns) const {
    if (world_.vehicle == Vehicle::six) {
      const State6 s = world_.path.at(t_ns * 1e-9);
      return wm::images::pose_xyz_rpy({s.xyz_m[0], s.xyz_m[1], s.xyz_m[2]}, s.rpy_rad[0], s.rpy_rad[1], s.rpy_rad[2]);
    }
    const State s = drive_.at(t_ns * 1e-9);
    return wm::images::pose_xyz_rpy({s.x_m, s.y_m, 0}, 0, 0, s.heading_rad);
  }
  wm::render::Shot shot(double share, uint64_t frame) const {
    wm::render::Shot s;
    s.t_ns = static_cast<int64_t>(share * duration_s() * 1e9);
    s.exposure_ns = 0;
    s.frame = frame;
    s.T_map_base = [this](double t_ns) { return at(t_ns); };
    return s;
  }

 private:
  const World &world_;
  Drive drive_;
};

Image picture(const World &world, const wm::images::Camera &camera, const wm::render::Shot &shot, int samples) {
  wm::render::Quality quality;
  quality.samples = samples;
  std::string error;
  const auto renderer = wm::render::Renderer::make(world.scene, camera, quality, 7, false, error);
  TEST_ASSERT_NOT_NULL_MESSAGE(renderer.get(), error.c_str());
  Image image;
  renderer->render(shot, image);
  return image;
}

std::vector<std::vector<double>> numbers(const std::string &rows) {
  std::vector<std::vector<double>> out;
  std::istringstream lines(rows);
  for (std::string line; std::getline(lines, line);) {
    std::vector<double> row;
    std::istringstream cells(line);
    for (std::string cell; std::getline(cells, cell, ',');) row.push_back(std::stod(cell));
    out.push_back(row);
  }
  return out;
}

double value(const Image &image, double u, double v) {
  const int x = std::clamp(static_cast<int>(std::floor(u)), 0, image.width - 2);
  const int y = std::clamp(static_cast<int>(std::floor(v)), 0, image.height - 2);
  const double a = std::clamp(u - x, 0.0, 1.0), b = std::clamp(v - y, 0.0, 1.0);
  const auto at = [&](int i, int j) {
    return static_cast<double>(
        image.values[static_cast<size_t>(j) * static_cast<size_t>(image.width) + static_cast<size_t>(i)]);
  };
  return (1 - b) * ((1 - a) * at(x, y) + a * at(x + 1, y)) + b * ((1 - a) * at(x, y + 1) + a * at(x + 1, y + 1));
}

// Where the picture is steepest across (u, v) along the direction, within 2 px; false where it is nearly even.
bool edge_offset(const Image &image, double u, double v, double du, double dv, double &offset, double least) {
  double best = 0, low = 1e9, high = -1e9;
  for (double s = -3; s <= 3; s += 0.5) {
    low = std::min(low, value(image, u + s * du, v + s * dv));
    high = std::max(high, value(image, u + s * du, v + s * dv));
  }
  if (high - low < least) return false;
  // The middle of the step: the mean place of its slope, about the steepest place.
  for (double s = -2; s <= 2; s += 0.05) {
    const double slope = std::fabs(value(image, u + (s + 0.5) * du, v + (s + 0.5) * dv) -
                                   value(image, u + (s - 0.5) * du, v + (s - 0.5) * dv));
    if (slope > best) best = slope, offset = s;
  }
  double weight = 0, sum = 0;
  const double centre = offset;
  for (double s = centre - 1; s <= centre + 1; s += 0.05) {
    const double slope = std::fabs(value(image, u + (s + 0.25) * du, v + (s + 0.25) * dv) -
                                   value(image, u + (s - 0.25) * du, v + (s - 0.25) * dv));
    weight += slope, sum += slope * s;
  }
  offset = sum / weight;
  return std::fabs(centre) < 1.95;
}

TEST(corridor_labels_lie_on_edges_of_the_picture) {
  const auto world = made("corridor", false, 2);
  const Motion motion(*world);
  const wm::images::Camera &camera = world->cameras[0].camera;
  std::vector<double> offsets;
  size_t points = 0;
  const double shares[] = {0.05, 0.52, 0.17, 0.71, 0.33, 0.9};
  for (uint64_t k = 0; k < wm_trials(6, 2); k++) {
    const double share = shares[k];
    const wm::render::Shot shot = motion.shot(share, 5);
    const Image image = picture(*world, camera, shot, 16);
    std::string text;
    world->label(world->labels[0], 0, camera, shot, text);
    const auto rows = numbers(text);
    TEST_ASSERT_GREATER_THAN(40, rows.size());
    for (size_t i = 1; i + 1 < rows.size(); i++) {
      const auto &a = rows[i - 1], &p = rows[i], &b = rows[i + 1];
      if (a[1] != p[1] || b[1] != p[1]) continue;
      const double du = b[2] - a[2], dv = b[3] - a[3], length = std::hypot(du, dv);
      if (length < 4 || p[2] < 5 || p[3] < 5 || p[2] > camera.width - 6 || p[3] > camera.height - 6) continue;
      // Not at corners.
      if (std::fabs((p[2] - a[2]) * dv - (p[3] - a[3]) * du) / length > 0.3) continue;
      points++;
      double offset = 0;
      if (edge_offset(image, p[2], p[3], -dv / length, du / length, offset, 0.04)) offsets.push_back(offset);
    }
    // Each label, looked at through its pixel, is the foot of a wall.
    for (const auto &row : rows) {
      Vec3 direction;
      TEST_ASSERT_TRUE(wm::images::unproject(camera, {row[2], row[3]}, direction));
      const Pose T = motion.at(static_cast<double>(shot.t_ns)) * wm::images::T_base_optical(camera);
      const Vec3 ray = T.linear() * direction;
      const Point foot{T.translation().x() - ray.x() * T.translation().z() / ray.z(),
                       T.translation().y() - ray.y() * T.translation().z() / ray.z()};
      double nearest = 1e9;
      for (const Face &f : world->plan.faces)
        if (f.bottom_m <= 0 && f.mapped) nearest = std::min(nearest, distance_m(foot, f));
      TEST_ASSERT_LESS_THAN_DOUBLE(0.02, nearest);
    }
  }
  TEST_ASSERT_GREATER_THAN(points / 2, offsets.size());
  double mean = 0;
  for (double &o : offsets) mean += o / static_cast<double>(offsets.size()), o = std::fabs(o);
  std::sort(offsets.begin(), offsets.end());
  const double median = offsets[offsets.size() / 2], p90 = offsets[offsets.size() * 9 / 10];
  std::printf("corridor: %zu of %zu label points at an edge, mean %.3f px, median |.| %.3f, p90 %.3f px\n",
              offsets.size(), points, mean, median, p90);
  TEST_ASSERT_DOUBLE_WITHIN(0.15, 0, mean);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.15, median);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.5, p90);
}

// An outside judge: AprilTag's own detector, whose pixel centres lie at +0.5. Its corners run counter-clockwise from
// the lower left one; the recordings' upper left corner (ArUco's) is its lower right one.
TEST(office_labels_are_what_apriltag_finds) {
  // The detector looks into its family when it is destroyed: the family goes last.
  std::unique_ptr<apriltag_family_t, decltype(&tag36h11_destroy)> family(tag36h11_create(), tag36h11_destroy);
  std::unique_ptr<apriltag_detector_t, decltype(&apriltag_detector_destroy)> detector(apriltag_detector_create(),
                                                                                      apriltag_detector_destroy);
  apriltag_detector_add_family(detector.get(), family.get());
  detector->quad_decimate = 1;
  const bool places[] = {true, false};
  for (uint64_t nth = 0; nth < wm_trials(2, 1); nth++) {
    const bool on_walls = places[nth];
    const auto world = made("office", false, 4, on_walls);
    TEST_ASSERT_GREATER_OR_EQUAL(12, world->truth.size());
    const Motion motion(*world);
    const wm::images::Camera &camera = world->cameras[0].camera;
    int labelled = 0, found = 0, strange = 0;
    double worst = 0;
    for (double share = 0.02; share < 0.34; share += 0.035) {
      const wm::render::Shot shot = motion.shot(share, 3);
      const Image image = picture(*world, camera, shot, 8);
      std::vector<uint8_t> bytes;
      for (const float v : image.values)
        bytes.push_back(static_cast<uint8_t>(std::clamp(255 * std::sqrt(v), 0.f, 255.f)));
      image_u8_t view{image.width, image.height, image.width, bytes.data()};
      std::string text;
      world->label(world->labels[0], 0, camera, shot, text);
      const auto rows = numbers(text);
      labelled += static_cast<int>(rows.size());
      zarray_t *detections = apriltag_detector_detect(detector.get(), &view);
      for (int i = 0; i < zarray_size(detections); i++) {
        apriltag_detection_t *d = nullptr;
        zarray_get(detections, i, &d);
        const auto row = std::find_if(rows.begin(), rows.end(), [&](const auto &r) { return r[1] == d->id; });
        if (row == rows.end()) {
          // At the rim of the picture, or far away: it must hang in this room all the same.
          strange +=
              std::none_of(world->truth.begin(), world->truth.end(), [&](const auto &t) { return t.id == d->id; });
          continue;
        }
        found++;
        for (int k = 0; k < 4; k++)  // ours: upper left, upper right, lower right, lower left
          worst = std::max(worst, std::hypot(d->p[(5 - k) % 4][0] - 0.5 - (*row)[static_cast<size_t>(2 + 2 * k)],
                                             d->p[(5 - k) % 4][1] - 0.5 - (*row)[static_cast<size_t>(3 + 2 * k)]));
      }
      apriltag_detections_destroy(detections);
    }
    std::printf("office, markers on the %s: %d labelled, %d of them found, corners within %.2f px\n",
                on_walls ? "walls" : "ceiling", labelled, found, worst);
    TEST_ASSERT_TRUE(labelled > 10);
    TEST_ASSERT_GREATER_OR_EQUAL(labelled * (on_walls ? 7 : 9) / 10, found);
    TEST_ASSERT_EQUAL(0, strange);
    TEST_ASSERT_LESS_THAN_DOUBLE(1.0, worst);
  }
}

// Nobody hangs a print where the robot's camera never sees it whole.
TEST(office_prints_come_whole_into_view) {
  struct Room {
    bool hard, on_walls;
    Markers markers;
  };
  const Room rooms[] = {{false, true, Markers::both}, {false, false, Markers::mr}, {true, true, Markers::mr}};
  for (uint64_t k = 0; k < wm_trials(3, 1); k++) {
    const Room room = rooms[k];
    const auto world = made("office", room.hard, 1, room.on_walls, room.markers);
    const Motion motion(*world);
    std::map<int, int> whole;
    const int pictures = static_cast<int>(motion.duration_s() * world->cameras[0].rate_hz);
    for (int i = 0; i < pictures; i++) {
      std::string text;
      world->label(world->labels[0], 0, world->cameras[0].camera, motion.shot(static_cast<double>(i) / pictures, 0),
                   text);
      for (const auto &row : numbers(text)) whole[static_cast<int>(row[1])]++;
    }
    TEST_ASSERT_GREATER_OR_EQUAL(9, world->truth.size());
    int least = pictures;
    for (const auto &t : world->truth) least = std::min(least, whole[t.id]);
    std::printf("office%s, %zu markers on the %s: each is whole in %d and more of %d pictures\n",
                room.hard ? ", hard" : "", world->truth.size(), room.on_walls ? "walls" : "ceiling", least, pictures);
    TEST_ASSERT_TRUE(least >= 10);  // persons that walk past may hide one for a while
  }
}

TEST(hall_labels_point_at_upright_edges) {
  const auto world = made("hall", false, 3);
  const Motion motion(*world);
  const wm::images::Camera &camera = world->cameras[0].camera;
  TEST_ASSERT_GREATER_OR_EQUAL(30, world->lines.size());
  size_t labelled = 0, contrast = 0;
  std::vector<double> offsets;
  for (const double share : {0.03, 0.2, 0.41}) {
    const wm::render::Shot shot = motion.shot(share, 3);
    const Image image = picture(*world, camera, shot, 16);
    std::string text;
    world->label(world->labels[0], 0, camera, shot, text);
    const auto rows = numbers(text);
    TEST_ASSERT_GREATER_OR_EQUAL(15, rows.size());
    TEST_ASSERT_LESS_OR_EQUAL(world->lines.size(), rows.size());
    const Pose T = motion.at(static_cast<double>(shot.t_ns));
    for (const auto &row : rows) {
      labelled++;
      const World::Line &line = world->lines[static_cast<size_t>(row[1])];
      const Vec3 d = T.inverse() * line.head - camera.T_base_camera.translation();
      TEST_ASSERT_DOUBLE_WITHIN(1e-5, std::atan2(d.y(), d.x()), row[2]);
      // Near its upper end the picture has an edge along the radius.
      Vec2 high, lower;
      const Vec3 a = line.foot + 0.95 * (line.head - line.foot), b = line.foot + 0.9 * (line.head - line.foot);
      TEST_ASSERT_TRUE(wm::render::project_shot(camera, shot, a, high));
      TEST_ASSERT_TRUE(wm::render::project_shot(camera, shot, b, lower));
      const Vec2 along = (high - lower).normalized();
      double offset = 0;
      if (edge_offset(image, high.x(), high.y(), -along.y(), along.x(), offset, 0.02))
        contrast++, offsets.push_back(std::fabs(offset));
    }
  }
  std::sort(offsets.begin(), offsets.end());
  TEST_ASSERT_TRUE(contrast > labelled / 3);
  std::printf("hall: %zu lines labelled, %zu with contrast, median |.| %.3f px\n", labelled, contrast,
              offsets[offsets.size() / 2]);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.3, offsets[offsets.size() / 2]);
}

// What a label's pixel shows, by a ray of its own.
TEST(labels_of_signs_and_beacons_show_them) {
  for (const char *name : {"crossing", "seabed"}) {
    const auto world = made(name, false, 1);
    const Motion motion(*world);
    size_t labelled = 0;
    TEST_ASSERT_GREATER_OR_EQUAL(12, world->truth.size());
    TEST_ASSERT_TRUE(world->landmarks_known);
    for (double share = 0.05; share < 1; share += 0.06)
      for (size_t k = 0; k < world->cameras.size(); k++) {
        wm::images::Camera camera = world->cameras[k].camera;
        camera.readout_ns = 20000000;  // a rolling shutter moves what is seen
        const wm::render::Shot shot = motion.shot(share, 3);
        std::string text;
        world->label(world->labels[0], k, camera, shot, text);
        for (const auto &row : numbers(text)) {
          TEST_ASSERT_EQUAL(static_cast<int>(k), static_cast<int>(row[1]));
          Vec3 direction;
          TEST_ASSERT_TRUE(wm::images::unproject(camera, {row[3], row[4]}, direction));
          const double t_ns = static_cast<double>(shot.t_ns) + wm::images::row_offset_ns(camera, row[4]);
          const Pose T = motion.at(t_ns) * wm::images::T_base_optical(camera);
          const Vec3 ray = T.linear() * direction;
          const wm::render::Hit hit = world->scene.cast(T.translation(), ray);
          TEST_ASSERT_TRUE(hit.there);
          const Vec3 place = world->truth[static_cast<size_t>(row[2]) - 1].p;
          TEST_ASSERT_LESS_THAN_DOUBLE((world->panels.empty() ? 0.15 : 0.03), (hit.point - place).norm());
          TEST_ASSERT_LESS_THAN_DOUBLE(0.002, (place - T.translation()).cross(ray).norm());
          labelled++;
        }
      }
    std::printf("%s: %zu labels, each shows what it names\n", name, labelled);
    TEST_ASSERT_TRUE(labelled > 15);
  }
}

TEST(requests_repeat_and_differ) {
  wm::images::Camera small;
  const char *const names[] = {"corridor", "seabed", "office", "hall"};
  for (uint64_t k = 0; k < wm_trials(4, 2); k++) {
    const char *name = names[k];
    std::vector<std::vector<float>> pictures;
    std::vector<std::string> labels;
    const std::pair<bool, uint64_t> requests[] = {{false, 21}, {false, 21}, {true, 22}};
    for (const auto &[hard, seed] : requests) {
      const auto world = made(name, hard, seed);
      const Motion motion(*world);
      small = world->cameras[0].camera;
      const wm::render::Shot shot = motion.shot(0.3, 9);
      pictures.push_back(picture(*world, small, shot, 1).values);
      labels.emplace_back();
      world->label(world->labels[0], 0, small, shot, labels.back());
    }
    TEST_ASSERT_TRUE_MESSAGE(pictures[0] == pictures[1], name);
    TEST_ASSERT_TRUE_MESSAGE(labels[0] == labels[1], name);
    TEST_ASSERT_FALSE_MESSAGE(pictures[0] == pictures[2], name);
    const auto mean = [](const std::vector<float> &v) {
      double sum = 0;
      for (const float x : v) sum += static_cast<double>(x);
      return sum / static_cast<double>(v.size());
    };
    TEST_ASSERT_TRUE_MESSAGE(mean(pictures[2]) < 0.8 * mean(pictures[0]), name);  // dimmer
  }
}

TEST(what_is_none_is_refused) {
  WorldRequest request;
  wm_error err{};
  request.name = "castle";
  TEST_ASSERT_NULL(make_world(request, &err).get());
  TEST_ASSERT_EQUAL(WM_BAD_CONFIG, err.status);
  request.name = "corridor";
  request.plan = Plan{};
  TEST_ASSERT_NULL(make_world(request, &err).get());
}

}  // namespace
