// SPDX-License-Identifier: Apache-2.0
// The report: what it says in words, that it draws no peak away, that it is one page with nothing beside it.
#include <memory>

#include "common/failure.h"
#include "common/suite.h"
#include "made.h"
#include "report/axes.h"
#include "report/data.h"
#include "report/edges.h"
#include "report/page.h"
#include "report/picture.h"
#include "report/side_views.h"
#include "report/words.h"
extern "C" {
#include "output/event_log.h"
}

using namespace wm::tools;
using made::format;
using made::stamp;

namespace {

void says(const std::string &expected, const std::string &said) {
  TEST_ASSERT_EQUAL_STRING(expected.c_str(), said.c_str());
}

bool has(const std::string &text, const std::string &part) { return text.find(part) != std::string::npos; }

TEST(test_numbers_in_words) {
  says("3.2\u202fmm", length_text(0.0032));
  says("1.4\u202fcm", length_text(0.0142));
  says("82\u202fcm", length_text(0.8213));
  says("12.3\u202fm", length_text(12.34));
  says("1.01\u202fkm", length_text(1011));
  says("–", length_text(NAN));
  says("59.9\u202fs", duration_text(59.91));
  says("10\u202fmin 30\u202fs", duration_text(630.4));
  says("2\u202fh 5\u202fmin", duration_text(7500));
  says("94\u202f%", percent_text(0.9412));
  says("0.4\u202f%", percent_text(0.004));
  says("31\u202f302", count_text(31302));
  says("0", fixed(-0.0001, 0));
  says("−0.5", number_text(-0.5, 1));
  says("a&lt;b&gt; &amp; &quot;c&quot;", escape("a<b> & \"c\""));
}

TEST(test_ticks_are_round) {
  const auto ticks = round_ticks(-0.31, 1.0, 4);
  TEST_ASSERT_EQUAL(3, ticks.size());
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.0, ticks[0]);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.5, ticks[1]);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 120, time_ticks(0, 630, 8)[1]);
}

TEST(test_no_peak_is_lost) {
  // 100 000 points, one of them high: the path must reach it.
  std::vector<double> x;
  std::vector<double> v;
  for (int i = 0; i < 100000; ++i) {
    x.push_back(i * 0.001);
    v.push_back(i == 54321 ? 9.0 : 0.0);
  }
  Panel panel({0, 100}, {-10, 10});
  panel.line(x, v, "value", 1);
  const std::string html = panel.html({});
  TEST_ASSERT_TRUE(has(html, " 500V50L"));  // from 0 in the middle to (10 - 9) / 20 of the height
  TEST_ASSERT_LESS_THAN(30000, html.size());
}

size_t count(const std::string &text, const std::string &part) {
  size_t n = 0;
  for (size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) n++;
  return n;
}

TEST(test_a_drive_in_space_has_two_sides) {
  ReportData data{};
  for (int i = 0; i <= 50; i++) {
    Pose pose;
    pose.t_ns = i * INT64_C(100000000);
    pose.p_m = {0.1 * i, std::sin(0.1 * i), 2.0};
    pose.covariance(0, 0) = pose.covariance(1, 1) = 0.01;
    pose.covariance(2, 2) = 0.04;
    data.trajectory.poses.push_back(pose);
  }
  data.estimated_landmarks.push_back({7, {2, 1, 0.5}, Eigen::Matrix2d::Zero(), NAN});
  says("", side_views(data, 1));  // it stays in its plane
  for (size_t i = 0; i < data.trajectory.poses.size(); i++)
    data.trajectory.poses[i].p_m.z() += 0.02 * static_cast<double>(i);
  const std::string html = side_views(data, 1);
  TEST_ASSERT_EQUAL(2, count(html, "<svg"));
  TEST_ASSERT_EQUAL(2, count(html, "class=\"estimate\""));
  TEST_ASSERT_EQUAL(2, count(html, "class=\"guess\""));
  TEST_ASSERT_EQUAL(0, count(html, "class=\"truth\""));
  TEST_ASSERT_GREATER_THAN(40, count(html, "class=\"ellipse\""));
  TEST_ASSERT_EQUAL(0, count(html, "nan"));
}

TEST(test_a_gap_is_a_gap) {
  Panel panel({0, 10}, {0, 1});
  panel.line({1, 2, 8, 9}, {0.5, 0.5, 0.5, 0.5}, "value", 3);
  const std::string html = panel.html({});
  TEST_ASSERT_TRUE(has(html, "M100 500"));
  TEST_ASSERT_TRUE(has(html, "M800 500"));
}

const made::Folder run, recording;

std::string page_of() { return report_page(load_report_data(run.path(), recording.path())); }

// A drive of 10 s with a sighting, a run of it, and everything that a run may write.
void make() {
  run.clear(), recording.clear();
  std::string truth = made::kTruthHeader;
  std::string poses = made::kPlanarHeader;
  for (int i = 0; i <= 100; ++i) {
    truth += stamp(0.1 * i) + made::pose(0.1 * i, 0, 0) + "\n";
    poses += stamp(0.1 * i) + made::pose(0.1 * i, 0.05, 0) + ",0.01,0,0.01,0,0,0.01," + (i < 60 ? "tracking" : "lost") +
             "\n";
  }
  recording.write("recording.yaml", "format: waymark-recording/1\nname: a <made> drive\n");
  recording.write("truth.csv", truth);
  recording.write("landmarks.csv", "id,x_m,y_m,z_m,sigma_m\n7,5,2,0,0.01\n");
  recording.write("sightings.csv", "t_ns,sensor,id,bearing_rad,range_m\n1000000000,eye,7,0.4,4.4\n");
  recording.write("calibration.yaml", "sensors: {eye: {mounting: {xyz_m: [0.2, 0, 0], rpy_deg: [0, 0, 90]}}}\n");
  run.write("trajectory.csv", poses);
  run.write("innovations.csv",
            "t_ns,source,sensor,landmark,residual,observed,expected,variance,nis,gate,gate_dof,verdict\n"
            "1000000000,sightings:eye,eye,7,bearing,0.41,0.4,0.01,0.01,10.8,1,fused\n"
            "2000000000,sightings:eye,eye,7,bearing,3.1,0.4,0.01,729,10.8,1,gate\n");
  run.write("health.json",
            R"({"state":"lost","sources":{"sightings:eye":{"received":2,"fused":1,"rejected":{"gate":1},"late":4}},
                "motion_health":["encoder_left_dead"],"stale":["gnss"],
                "calibration":{"eye.yaw_rad":{"value":0.0803,"sigma":0.0007}}})");
  run.write("timing.json", R"({"predict":{"count":100,"p50_us":0.4,"p90_us":0.5,"p99_us":1,"p999_us":2,"max_us":31},
                               "allocations_after_start":0,"deadlines_missed":2,"deadlines_total":500})");
}

TEST(test_page_says_what_happened) {
  make();
  const std::string page = page_of();
  for (const char *words :
       {"a &lt;made&gt; drive", "<em>10.0\u202fm</em>", "<em>5.0\u202fcm</em>", "It was LOST for <em>4", "Errors",
        "Bearing of sightings by eye", "1 too far from what was expected", "eye: yaw", "<b>4.601</b> ± 0.040",
        "2 of 500", "left wheel’s encoder stood still", "gnss had fallen silent", "slowest 31 µs",
        "lost: what it saw contradicted its pose, being mended (40"})
    TEST_ASSERT_TRUE_MESSAGE(has(page, words), words);
  if (has(page, "nan")) TEST_FAIL_MESSAGE(page.substr(page.find("nan") - 60, 80).c_str());
  TEST_ASSERT_FALSE(has(page, "<made>"));
  // Nothing is fetched from anywhere.
  for (const char *outside : {"http:", "https:", "src=", "@import", "url(//"})
    TEST_ASSERT_FALSE_MESSAGE(has(page, outside), outside);
}

TEST(test_page_without_truth_and_without_recording) {
  make();
  std::filesystem::remove(recording.path() / "truth.csv");
  const std::string page = page_of();
  TEST_ASSERT_TRUE(has(page, "There is no truth to compare it with"));
  TEST_ASSERT_TRUE(has(page, "Uncertainty"));
  TEST_ASSERT_FALSE(has(page, "Errors"));
  const std::string alone = report_page(load_report_data(run.path(), ""));
  TEST_ASSERT_TRUE(has(alone, "Path"));
  // A trajectory and nothing else.
  for (const char *file : {"innovations.csv", "health.json", "timing.json", "trajectory.csv"})
    std::filesystem::remove(run.path() / file);
  run.write("trajectory.tum", "0 0 0 0 0 0 0 1\n1 1 0 0 0 0 0 1\n");
  const std::string bare = report_page(load_report_data(run.path(), ""));
  TEST_ASSERT_TRUE(has(bare, "Path"));
  TEST_ASSERT_FALSE(has(bare, "Observations"));
  if (has(bare, "nan")) TEST_FAIL_MESSAGE(bare.substr(bare.find("nan") - 60, 80).c_str());
}

TEST(test_odd_files_are_survived_or_refused_with_words) {
  make();
  run.write("health.json", R"({"sources":[1,2],"calibration":{"a":1}})");
  run.write("timing.json", R"({"predict":{"p50_us":null},"deadlines_missed":"many"})");
  TEST_ASSERT_TRUE(has(page_of(), "Path"));
  run.write("health.json", "{");
  made::refused("health.json: is not JSON", [] { load_report_data(run.path(), recording.path()); });
}

TEST(test_lines_of_sight_start_at_the_sensor) {
  make();
  const ReportData data = load_report_data(run.path(), recording.path());
  const Picture picture = draw_picture(data, true);
  TEST_ASSERT_TRUE(picture.sight_lines);
  // The sensor is 0.2 m ahead of (1.0, 0.05).
  const auto at = [&picture](double x, double y) {
    return fixed((x - picture.left_top_m.x()) * picture.scale, 1) + " " +
           fixed(40 + (picture.left_top_m.y() - y) * picture.scale, 1);
  };
  TEST_ASSERT_TRUE(has(picture.svg, "M" + at(1.2, 0.05) + "L" + at(5, 2)));
}

TEST(test_a_small_pgm_becomes_a_png) {
  std::filesystem::create_directory(recording.path() / "map");
  recording.write("map/map.yaml", "image: m.pgm\nresolution: 0.5\norigin: [-1, -2, 0]\n");
  recording.write("map/m.pgm", std::string("P5\n# made\n3 2\n255\n") + std::string("\x00\xff\x7f\xff\x00\xff", 6));
  std::vector<std::string> notes;
  const auto raster = load_raster(recording.path(), &notes);
  TEST_ASSERT_TRUE(raster.has_value());
  TEST_ASSERT_EQUAL(3, raster->width);
  TEST_ASSERT_EQUAL(2, raster->height);
  TEST_ASSERT_TRUE(raster->png.starts_with("\x89PNG"));
  recording.write("map/m.pgm", "P5\n3 2\n255\nxx");
  made::refused("cut short", [&] { load_raster(recording.path(), &notes); });
}

// A run's event log with one point of camera 0, 0.5 m ahead and 0.5 m to the right, after 5 s.
void log_a_point() {
  const auto log = std::make_unique<wm_log_writer>();
  const auto config = std::make_unique<wm_config>();
  const auto assembly = std::make_unique<wm_assembly>();
  wm_estimator estimator{};
  estimator.name = "edge_mcl";
  config->estimator = &estimator;
  char text[] = "format: waymark-config/1\n";
  config->text = text;
  config->text_length = std::strlen(text);
  assembly->config = config.get();
  assembly->calibration_text = "";
  assembly->source_count = 1;
  wm_error error{};
  TEST_ASSERT_EQUAL(WM_OK, wm_log_create(log.get(), (run.path() / "events.wmlog").c_str(), assembly.get(), &error));
  wm_event event{};
  event.t_ns = 5'000'000'000;
  event.kind = WM_EVENT_POINTS;
  event.as.points.count = 1;
  event.as.points.x_m[0] = 0.5f;
  event.as.points.y_m[0] = -0.5f;
  wm_log_write_event(log.get(), &event);
  TEST_ASSERT_EQUAL(WM_OK, wm_log_close(log.get(), &error));
}

// Cells of 0.05 m, 100 x 100; `set` says which are white.
template <class Set>
std::string layer(const Set &set) {
  std::string pgm = "P5\n100 100\n255\n";
  for (int row = 0; row < 100; row++)
    for (int column = 0; column < 100; column++) pgm += set(column, row) ? '\xff' : '\0';
  return pgm;
}

TEST(test_edges_are_drawn_where_they_are_seen) {
  make();
  log_a_point();
  run.write("particles.csv", "t_ns,x_m,y_m,heading_rad,weight\n5000000000,4.5,0.25,0,1\n");
  // A camera that looks straight down from 1 m: its picture's top is ahead.
  recording.write("calibration.yaml",
                  "cameras: {front: {model: equidistant, size: [640, 480], intrinsics: [300, 300, 320, 240],\n"
                  "  distortion: [0, 0, 0, 0], mounting: {xyz_m: [0, 0, 1], rpy_deg: [0, 90, 0]}}}\n");
  // An edge at (5.5, 0.05), half a metre ahead of the pose after 5 s; another at (6, 0.05), behind a wall.
  std::filesystem::create_directory(recording.path() / "map");
  recording.write("map/map.yaml",
                  "image: edges.pgm\nresolution: 0.05\norigin: [2.975, -2.475, 0]\nnegate: 0\noccupied_thresh: 0.65\n"
                  "free_thresh: 0.196\nlayers: {edges: edges.pgm, drivable: drivable.pgm}\n");
  recording.write("map/edges.pgm",
                  layer([](int column, int row) { return row == 49 && (column == 50 || column == 60); }));
  recording.write("map/drivable.pgm", layer([](int column, int) { return column < 53 || column > 56; }));

  ReportData data = load_report_data(run.path(), recording.path());
  data.frames.push_back({"front", 5'000'000'000, 640, 480, "", {}});
  data.frames.front().grey.assign(640 * 480, 90);  // the floor; bright where the edge ahead is
  data.frames.front().grey[(240 - 139) * 640 + 320] = 255;
  load_edges(run.path(), recording.path(), &data);
  for (const std::string &note : data.notes) TEST_FAIL_MESSAGE(note.c_str());
  const ReportFrame &frame = data.frames.front();
  TEST_ASSERT_EQUAL(1, frame.edges_seen.size());
  const double seen_px = 300 * std::atan(std::sqrt(0.5)) * std::sqrt(0.5);
  TEST_ASSERT_DOUBLE_WITHIN(0.01, 320 + seen_px, frame.edges_seen[0].x());
  TEST_ASSERT_DOUBLE_WITHIN(0.01, 240 - seen_px, frame.edges_seen[0].y());
  TEST_ASSERT_EQUAL(1, frame.edges_mapped.size());
  TEST_ASSERT_DOUBLE_WITHIN(0.01, 320, frame.edges_mapped[0].x());
  TEST_ASSERT_DOUBLE_WITHIN(0.01, 240 - 300 * std::atan(0.5), frame.edges_mapped[0].y());
  TEST_ASSERT_TRUE(has(frames_section(data), "class=\"edge-seen\" d=\"M451 109h0\""));
  // From above: half a metre ahead is 25 px above the camera's foot point, in the middle of what it sees.
  TEST_ASSERT_EQUAL(1, frame.floor.edges_mapped.size());
  const auto foot = frame.floor.pixel({0, 0});
  TEST_ASSERT_TRUE(foot.has_value());
  TEST_ASSERT_DOUBLE_WITHIN(0.01, 25, foot->y() - frame.floor.edges_mapped[0].y());
  TEST_ASSERT_DOUBLE_WITHIN(0.01, foot->x(), frame.floor.edges_mapped[0].x());
  TEST_ASSERT_DOUBLE_WITHIN(1, 0.5 * frame.floor.width_px, foot->x());
  TEST_ASSERT_FALSE(frame.floor.pixel({100, 0}).has_value());
  TEST_ASSERT_TRUE(has(frames_section(data), "from above: ahead is up"));

  const Picture picture = draw_picture(data, false);
  TEST_ASSERT_TRUE(has(picture.svg, "<image class=\"edges\" width=\"" + fixed(5 * picture.scale, 2)));
  const std::string particle = "M" + fixed((4.5 - picture.left_top_m.x()) * picture.scale, 1) + " " +
                               fixed((picture.left_top_m.y() - 0.25) * picture.scale, 1) + "h0";
  TEST_ASSERT_TRUE(has(picture.svg, "<path class=\"cloud\" d=\"" + particle + "\"/>"));

  // Without edge points in the log the page is as it was.
  std::filesystem::remove(run.path() / "events.wmlog");
  const std::string page = page_of();
  TEST_ASSERT_FALSE(has(page, "class=\"edges\"") || has(page, "class=\"cloud\""));
  // A log that is none is told, and costs nothing else.
  run.write("events.wmlog", "no log");
  TEST_ASSERT_TRUE(has(page_of(), "Edges are not shown: "));
}

// Adds a camera with a picture at each of these times of the drive.
void film(const std::vector<double> &times_s) {
  std::filesystem::create_directories(recording.path() / "video/front");
  recording.write("motion.csv", "t_ns,v_mps,w_radps\n0,1,0\n");
  recording.write("calibration.yaml",
                  "cameras: {front: {model: equidistant, size: [32, 16], intrinsics: [20, 20, 16, 8]}}\n");
  std::string rows = "frame,t_ns,exposure_ns\n";
  for (size_t i = 0; i < times_s.size(); i++) {
    const auto grey = static_cast<uint8_t>(20 + i);  // the same twice would be a camera that is stuck
    recording.write(format("video/front/%06zu.jpg", i), grey_jpeg(std::vector<uint8_t>(32 * 16, grey), 32, 16));
    rows += format("%zu,", i) + stamp(times_s[i]) + "5000000\n";
  }
  recording.write("video/front.csv", rows);
}

std::vector<double> every(double period_s, double from_s, double to_s) {
  std::vector<double> out;
  for (int i = 0; from_s + i * period_s < to_s + 1e-6; i++) out.push_back(from_s + i * period_s);
  return out;
}

// "0.1 0.4 ..." of the pictures that the report shows of the drive of 10 s, and what it says of them.
void shows(const std::vector<double> &film_s, const std::string &times, const std::string &note) {
  make();
  film(film_s);
  const ReportData data = load_report_data(run.path(), recording.path());
  std::string shown;
  for (const ReportFrame &frame : data.frames) shown += (shown.empty() ? "" : " ") + fixed(data.seconds(frame.t_ns), 1);
  says(times, shown);
  TEST_ASSERT_EQUAL(note.empty() ? 0 : 1, data.film_notes.size());
  if (!note.empty()) says(note, data.film_notes[0]);
  const std::string section = frames_section(data);
  TEST_ASSERT_EQUAL(data.frames.size(), count(section, "<figure"));
  TEST_ASSERT_TRUE(has(section, note.empty() ? "Pictures" : "<p class=\"note\">" + note + "</p>"));
}

TEST(test_pictures_are_of_what_the_camera_filmed) {
  shows(every(0.1, 0, 10), "1.2 3.7 6.2 8.7", "");
  // Silent before an eighth of the drive, silent until late in it, or both.
  shows(every(0.1, 0, 1), "0.1 0.4 0.6 0.9",
        "Camera front has pictures only from 0.0 s to 1.0 s; the drive lasted 10.0 s.");
  shows(every(0.1, 6, 10), "6.5 7.5 8.5 9.5",
        "Camera front has pictures only from 6.0 s to 10.0 s; the drive lasted 10.0 s.");
  shows(every(0.1, 3, 5), "3.2 3.7 4.2 4.7",
        "Camera front has pictures only from 3.0 s to 5.0 s; the drive lasted 10.0 s.");
  // Each picture once, also where there are few, or none for a while.
  shows({4}, "4.0", "Camera front has one picture only, at 4.0 s; the drive lasted 10.0 s.");
  shows({0, 0.1, 0.2, 9.8, 9.9}, "0.2 9.8", "");
  // A little apart is usual, and a slow camera is no silent one.
  shows(every(0.1, 0.4, 9.7), "1.6 3.9 6.2 8.5", "");
  shows(every(1.5, 1.5, 9), "3.0 4.5 6.0 7.5", "");
}

TEST(test_why_there_are_no_pictures_is_said) {
  shows(every(0.1, 12, 13), "",
        "Camera front has no pictures of the drive: its own are from 12.0 s to 13.0 s; the drive lasted 10.0 s.");
  shows({}, "", "No pictures of front: its video is empty");
  // What else was filmed is left out: a replay of a part of a recording.
  shows(every(0.4, -4.8, 15), "1.2 3.6 6.4 8.8", "");

  make();
  film(every(0.1, 0, 10));
  for (int i = 0; i <= 100; i++) recording.write(format("video/front/%06d.jpg", i), format("no JPEG %d", i));
  const std::string page = page_of();
  TEST_ASSERT_TRUE(has(page, "No pictures of front: " + (recording.path() / "video/front: frame ").string()));
  std::filesystem::remove(recording.path() / "video/front.csv");
  TEST_ASSERT_TRUE(has(page_of(), "front.csv: is not there"));
}

}  // namespace
