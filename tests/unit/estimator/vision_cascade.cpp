// SPDX-License-Identifier: Apache-2.0
// Cascades: bright squares in a drawn fisheye picture are found where they are and as far away as they are; the files
// that the tool writes are read again; windows are judged as OpenCV's CascadeClassifier judges them.
#include <algorithm>
#include <set>
#include <string>
#include <vector>

#include "common/eyes.hpp"
#include "common/fisheye_rig.hpp"
#include "vision/cascade/params.h"
#include "waymark/cascade_file.h"
#include "waymark/internal/sensors/bearing.hpp"
#include "waymark/internal/vision/cascade/evaluate.hpp"
#include "waymark/random.h"
#ifdef WM_HAS_OPENCV
#include <opencv2/objdetect.hpp>
#endif

namespace {

constexpr uint32_t kWidth = 480, kHeight = 300;
constexpr double kSide_m = 0.6;  // of a square: a third of the window
const int32_t kCamera = 0;

wm_rig rig;
wm_view view;
wm_landmark landmark;
wm_cascade cascade;
std::unique_ptr<wm::drawn::eyes> machine;
wm_error err;

// A middle block that is brighter than all about it.
const char kBright[] =
    "<opencv_storage><cascade type_id=\"opencv-cascade-classifier\"><stageType>BOOST</stageType>"
    "<featureType>LBP</featureType><height>18</height><width>18</width><stages><_><stageThreshold>0</stageThreshold>"
    "<weakClassifiers><_><internalNodes>0 -1 0 1 0 0 0 0 0 0 0</internalNodes><leafValues>1 -1</leafValues></_>"
    "</weakClassifiers></_></stages><features><_><rect>0 0 6 6</rect></_></features></cascade></opencv_storage>";

struct Square {
  double azimuth_rad, up_m, distance_m;
};

std::vector<uint8_t> draw(const wm::mounted_camera &camera, const std::vector<Square> &squares) {
  std::vector<uint8_t> out(kWidth * kHeight, 90);
  for (uint32_t v = 0; v < kHeight; v++)
    for (uint32_t u = 0; u < kWidth; u++) {
      int inside = 0;
      for (int i = 0; i < 16; i++) {
        wm::vec3 ray;
        if (!wm::unproject(camera.optics, {u - 0.375 + 0.25 * (i % 4), v - 0.375 + 0.25 * (i / 4)}, &ray)) continue;
        const wm::vec3 d = camera.R_base_optical * ray;
        const double flat = std::hypot(d.x, d.y);
        for (const Square &s : squares)
          inside += std::fabs(std::remainder(std::atan2(d.y, d.x) - s.azimuth_rad, 2 * M_PI)) * s.distance_m <
                        0.5 * kSide_m &&
                    std::fabs(d.z / flat * s.distance_m - s.up_m) < 0.5 * kSide_m;
      }
      out[v * kWidth + u] = static_cast<uint8_t>(90 + 100 * inside / 16);
    }
  return out;
}

size_t look(const std::vector<uint8_t> &picture) {
  const wm_frame frame = wm::drawn::frame_of(picture, kWidth, kHeight, 1'000'000'000);
  return machine->look(&frame);
}

TEST(squares_are_found) {
  wm::mounted_camera camera;
  TEST_ASSERT_NULL(wm::mounted_camera_init(&camera, rig.cameras[0]));
  const std::vector<Square> squares = {{1.3, 0.9, 4}, {0.7, 1.1, 6}, {0.2, 0.8, 3}};
  const std::vector<uint8_t> picture = draw(camera, squares);
  machine->begin(view);
  const size_t count = look(picture);
  TEST_ASSERT_EQUAL(squares.size(), count);
  for (size_t i = 0; i < count; i++) {
    const wm_sighting &s = machine->events[i].as.sighting;
    TEST_ASSERT_EQUAL(WM_EVENT_SIGHTING, machine->events[i].kind);
    TEST_ASSERT_EQUAL(-1, s.landmark_id);
    TEST_ASSERT_TRUE(i == 0 || machine->events[i - 1].t_ns <= machine->events[i].t_ns);
    int same = 0;
    for (const Square &q : squares) {
      const wm::vec3 base = {q.distance_m * std::cos(q.azimuth_rad), q.distance_m * std::sin(q.azimuth_rad), q.up_m};
      const wm::vec3 ray = wm::transposed_times(camera.R_base_optical, base);
      wm::pixel at;
      TEST_ASSERT_TRUE(wm::project(camera.optics, ray, &at));
      const double off = s.bearing_rad - wm::sensor_bearing(camera, false, ray);
      if (std::fabs(off) > 3 * s.bearing_sigma_rad) continue;
      same++;
      TEST_ASSERT_DOUBLE_WITHIN(3 * s.elevation_sigma_rad, wm::sensor_elevation(camera, false, ray), s.elevation_rad);
      TEST_ASSERT_DOUBLE_WITHIN(3 * s.range_sigma_m, std::hypot(q.distance_m, q.up_m), s.range_m);
      const double t_s = 1 + 0.03 * (at.v - 149.5) / 299;
      TEST_ASSERT_INT64_WITHIN(1'000'000, static_cast<int64_t>(1e9 * t_s), machine->events[i].t_ns);
    }
    TEST_ASSERT_EQUAL(1, same);
  }
  TEST_ASSERT_EQUAL(0, look(draw(camera, {})));
  // Below what the map has: not looked at.
  TEST_ASSERT_EQUAL(0, look(draw(camera, {{0.7, -1.5, 4}})));
}

TEST(what_is_missing_is_told) {
  view.cascade_count = 0;
  machine->expect_refused(view, "classes");
  view.cascade_count = 1;
  view.landmark_count = 0;
  machine->expect_refused(view, "landmarks.csv");
}

#ifdef WM_HAS_OPENCV

// A cascade of chance of which some windows pass every stage, so that all of it is looked at.
std::string chance_cascade(uint64_t seed, bool lbp) {
  uint64_t drawn = 0;
  const auto whole = [&](int from, int to) {
    return from + static_cast<int>((to - from + 1) * wm_random_uniform(seed, 9, drawn++));
  };
  const int features = 12, side = 20;
  std::string s =
      "<?xml version=\"1.0\"?>\n<opencv_storage>\n<cascade type_id=\"opencv-cascade-classifier\">\n"
      "<stageType>BOOST</stageType>\n<featureType>";
  s += lbp ? "LBP" : "HAAR";
  s += "</featureType>\n<height>20</height>\n<width>20</width>\n<stageParams><boostType>GAB</boostType><maxDepth>2</"
       "maxDepth>"
       "<maxWeakCount>4</maxWeakCount></stageParams>\n<featureParams><maxCatCount>" +
       std::string(lbp ? "256" : "0") +
       "</maxCatCount><featSize>1</featSize></featureParams>\n<stageNum>3</stageNum>\n<stages>\n";
  for (int stage = 0; stage < 3; stage++) {
    s += "<_>\n<maxWeakCount>4</maxWeakCount>\n<stageThreshold>-0.2</stageThreshold>\n<weakClassifiers>\n";
    for (int tree = 0; tree < 4; tree++) {
      const int nodes = whole(1, 2);
      s += "<_>\n<internalNodes>\n";
      for (int n = 0; n < nodes; n++) {
        // Two nodes: the first leads to the second on one side.
        s += n == 1 ? " -1 -2 " : nodes == 2 ? "1 0 " : "0 -1 ";
        s += std::to_string(whole(0, features - 1));
        if (!lbp) s += " " + std::to_string(0.001 * whole(-60, 60));
        for (int k = 0; lbp && k < 8; k++) s += " " + std::to_string(whole(-2000000000, 2000000000));
      }
      s += "</internalNodes>\n<leafValues>\n";
      for (int n = 0; n <= nodes; n++) s += (n > 0 ? " " : "") + std::to_string(0.01 * whole(-100, 100));
      s += "</leafValues></_>\n";
    }
    s += "</weakClassifiers></_>\n";
  }
  s += "</stages>\n<features>\n";
  for (int f = 0; f < features; f++) {
    if (lbp) {
      const int w = whole(1, 6), h = whole(1, 6);
      s += "<_>\n<rect>\n" + std::to_string(whole(0, side - 3 * w)) + " " + std::to_string(whole(0, side - 3 * h)) +
           " " + std::to_string(w) + " " + std::to_string(h) + "</rect></_>\n";
    } else {
      const int w = 2 * whole(1, 9), h = whole(2, 19), x = whole(0, side - w), y = whole(0, side - h);
      const std::string tail = " " + std::to_string(h);
      s += "<_>\n<rects>\n<_>\n" + std::to_string(x) + " " + std::to_string(y) + " " + std::to_string(w) + tail +
           " -1.</_>\n<_>\n" + std::to_string(x) + " " + std::to_string(y) + " " + std::to_string(w / 2) + tail +
           " 2.</_></rects>\n<tilted>0</tilted></_>\n";
    }
  }
  return s + "</features></cascade>\n</opencv_storage>\n";
}

// Where both find something, at the fineness of the picture itself, on every second pixel as OpenCV goes.
void compare_with_opencv(const std::string &text, int *hits) {
  constexpr int kW = 120, kH = 90;
  cv::Mat grey(kH, kW, CV_8U);
  std::vector<uint32_t> sums((kW + 1) * (kH + 1)), squares(sums.size());
  for (int y = 0; y < kH; y++)
    for (int x = 0; x < kW; x++) {
      const double soft = 120 + 60 * std::sin(0.2 * x + 0.05 * y) + 40 * std::sin(0.31 * y);
      const auto value = static_cast<uint8_t>(soft + 20 * wm_random_uniform(3, 1, static_cast<uint64_t>(y * kW + x)));
      grey.at<uint8_t>(y, x) = value;
      const auto at = [](int row, int column) { return static_cast<size_t>(row * (kW + 1) + column); };
      sums[at(y + 1, x + 1)] = sums[at(y, x + 1)] + sums[at(y + 1, x)] - sums[at(y, x)] + value;
      squares[at(y + 1, x + 1)] = squares[at(y, x + 1)] + squares[at(y + 1, x)] - squares[at(y, x)] + value * value;
    }
  cv::CascadeClassifier theirs;
  const cv::FileStorage storage(text, cv::FileStorage::READ | cv::FileStorage::MEMORY | cv::FileStorage::FORMAT_XML);
  TEST_ASSERT_TRUE(theirs.read(storage.getFirstTopLevelNode()));
  wm_cascade ours;
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_cascade_parse(text.data(), text.size(), "chance.xml", &ours, &err), err.text);
  const int w = static_cast<int>(ours.width_px), h = static_cast<int>(ours.height_px);
  std::vector<cv::Rect> found;
  theirs.detectMultiScale(grey, found, 1.1, 0, 0, {w, h}, {w, h});
  std::set<std::pair<int, int>> expected, seen;
  for (const cv::Rect &r : found) expected.insert({r.x, r.y});
  for (int y = 0; y <= kH - h; y += 2)
    for (int x = 0; x <= kW - w; x += 2) {
      double surplus;
      const int passed = wm::stages_passed(ours, {sums.data(), squares.data(), kW + 1}, x, y, &surplus);
      if (passed == static_cast<int>(ours.stage_count)) seen.insert({x, y});
      if (passed == 0) x += 2;  // OpenCV leaves out the next one
    }
  wm_cascade_free(&ours);
  *hits += static_cast<int>(expected.size());
  TEST_ASSERT_TRUE(seen == expected);
}

TEST(as_opencv_judges) {
  for (const bool lbp : {true, false}) {
    int hits = 0;
    for (uint64_t seed = 1; seed <= 12; seed++) compare_with_opencv(chance_cascade(seed, lbp), &hits);
    TEST_ASSERT_GREATER_THAN(500, hits);
  }
}

#else

TEST(as_opencv_judges) { TEST_IGNORE_MESSAGE("libopencv-objdetect-dev wasn't there when this was built"); }

#endif

// The cascades that Debian's opencv-data has: all are read, but those with tilted features and of OpenCV 1.
TEST(files_of_opencv) {
  int read = 0, refused = 0;
  for (const char *name :
       {"lbpcascades/lbpcascade_frontalface.xml", "lbpcascades/lbpcascade_profileface.xml",
        "haarcascades/haarcascade_frontalface_default.xml", "haarcascades/haarcascade_frontalface_alt2.xml",
        "haarcascades/haarcascade_frontalface_alt_tree.xml", "haarcascades/haarcascade_upperbody.xml",
        "haarcascades/haarcascade_licence_plate_rus_16stages.xml"}) {
    wm_cascade one;
    const wm_status status = wm_cascade_load((std::string("/usr/share/opencv4/") + name).c_str(), &one, &err);
    if (status == WM_NOT_FOUND) TEST_IGNORE_MESSAGE("opencv-data isn't installed");
    read += status == WM_OK;
    refused += status == WM_BAD_CONFIG && (std::strstr(err.text, "tilted") || std::strstr(err.text, "OpenCV 1"));
    wm_cascade_free(&one);
  }
  TEST_ASSERT_EQUAL(5, read);
  TEST_ASSERT_EQUAL(2, refused);
}

}  // namespace

void setUp() {
  rig = wm::drawn::rig_of({wm::drawn::fisheye(kWidth, kHeight, 160, {{0, 0, 1.4}, {0.02, -0.07, 0.8}})});
  rig.cameras[0].readout_ns = 30'000'000;
  landmark = {7, {4, 0, 2.4}, 0.02, static_cast<double>(NAN), {0, 0, 0}, 0};
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_cascade_parse(kBright, sizeof kBright - 1, "bright.xml", &cascade, &err),
                            err.text);
  cascade.height_m = 3 * kSide_m;
  view = {&rig, &kCamera, &landmark, 1, nullptr, 0, &cascade, 1};
  machine = std::make_unique<wm::drawn::eyes>("cascade");
}
void tearDown() { wm_cascade_free(&cascade); }
