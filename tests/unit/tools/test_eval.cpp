// SPDX-License-Identifier: Apache-2.0
// The figures of `waymark eval` on small made drives whose errors are known exactly.
#include <nlohmann/json.hpp>

#include "common/failure.h"
#include "common/statistics.h"
#include "common/suite.h"
#include "eval/compare.h"
#include "eval/figures.h"
#include "eval/gnss_delay.h"
#include "made.h"

using namespace wm::tools;
using made::format;
using made::stamp;

namespace {

constexpr double kPi = 3.14159265358979323846;

const made::Folder run, recording;

Figures judge(const CompareOptions &options = {}) {
  const Trajectory trajectory = load_trajectory(run.path());
  return pose_figures(compare(trajectory, load_truth(recording.path()), options), trajectory.has_covariance, false);
}

void expect(const Figures &f, const char *key, double value, double within = 1e-9) {
  TEST_ASSERT_TRUE_MESSAGE(f.at(key).is_number(), key);
  TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(within, value, f.at(key).get<double>(), key);
}

// 10 s along a line at `heading`, 1 m/s, truth at 10 Hz; the run at the same stamps, off by (along, left, turn).
void straight(double heading, double along, double left, double turn, double sigma = 0.1) {
  std::string truth = made::kTruthHeader;
  std::string poses = made::kPlanarHeader;
  for (int i = 0; i <= 100; ++i) {
    const double s = 0.1 * i;
    const double x = s * std::cos(heading);
    const double y = s * std::sin(heading);
    truth += stamp(0.1 * i) + made::pose(x, y, heading) + "\n";
    const double ex = along * std::cos(heading) - left * std::sin(heading);
    const double ey = along * std::sin(heading) + left * std::cos(heading);
    // Every other quaternion with its sign turned: the same rotation.
    poses += stamp(0.1 * i) + made::pose(x + ex, y + ey, heading + turn, i % 2 == 0 ? 1 : -1) +
             format(",%g,0,%g,0,0,%g,1\n", sigma * sigma, sigma * sigma, sigma * sigma);
  }
  recording.write("truth.csv", truth);
  run.write("trajectory.csv", poses);
}

// Half axes 0.3 and 0.1 m, the longer one turned by 30 degrees.
TEST(test_an_ellipse_has_its_axes_and_direction) {
  const Eigen::Matrix2d turn = Eigen::Rotation2Dd(kPi / 6).toRotationMatrix();
  const Eigen::Matrix2d covariance = turn * Eigen::Vector2d(0.09, 0.01).asDiagonal() * turn.transpose();
  const Ellipse is = ellipse_of(covariance);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.3, is.longer_m);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.1, is.shorter_m);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, kPi / 6, is.longer_rad);
  TEST_ASSERT_DOUBLE_IS_NAN(ellipse_of(covariance * kNan).longer_m);
}

TEST(test_constant_offset_to_the_left) {
  straight(2.0, 0, 0.2, 0);
  const Figures f = judge();
  expect(f, "distance_m", 10);
  expect(f, "duration_s", 10);
  expect(f, "poses", 101);
  expect(f, "coverage", 1);
  for (const char *key : {"position_mean_m", "position_median_m", "position_rmse_m", "position_p95_m", "position_max_m",
                          "position_end_m", "lateral_mean_m", "lateral_mean_abs_m", "lateral_max_m"})
    expect(f, key, 0.2);
  expect(f, "position_end_percent", 2);
  for (const char *key :
       {"lateral_std_m", "longitudinal_mean_m", "longitudinal_max_m", "heading_rmse_deg", "rotation_max_deg"})
    expect(f, key, 0, 1e-7);
  expect(f, "nees_mean", 4);  // (0.2 / 0.1)^2
  expect(f, "nees_inside_95", 1);
  expect(f, "anees_dof", 3);
  expect(f, "lost_count", 0);
  TEST_ASSERT_TRUE(f.at("landmark_rmse_m").is_null());
}

TEST(test_behind_and_turned_across_pi) {
  straight(kPi - 0.01, -0.3, 0, 0.05);  // truth's heading and the run's on both sides of pi
  const Figures f = judge();
  expect(f, "longitudinal_mean_m", -0.3);
  expect(f, "longitudinal_mean_abs_m", 0.3);
  expect(f, "longitudinal_max_m", 0.3);
  expect(f, "lateral_mean_abs_m", 0, 1e-9);
  expect(f, "heading_mean_deg", 0.05 * 180 / kPi, 1e-7);
  expect(f, "heading_rmse_deg", 0.05 * 180 / kPi, 1e-7);
  expect(f, "rotation_rmse_deg", 0.05 * 180 / kPi, 1e-7);
  expect(f, "nees_mean", 9 + 0.25, 1e-6);
  expect(f, "nees_inside_95", 0);  // 9.25 > 7.81
}

TEST(test_nees_uses_the_whole_covariance) {
  recording.write("truth.csv", made::kTruthHeader + ("0," + made::pose(0, 0, 0)) + "\n");
  // P = [2 1 0; 1 2 0; 0 0 1], truth minus estimate = (-1, -2, -0.5): 2 + 0.25.
  run.write("trajectory.csv", made::kPlanarHeader + ("0," + made::pose(1, 2, 0.5)) + ",2,1,2,0,0,1,tracking\n");
  expect(judge(), "nees_mean", 2.25, 1e-9);
  // Position and heading correlated, P = [1 0 0.5; 0 1 0; 0.5 0 1], the same error: (1 + 0.25 - 0.5) / 0.75 + 4. With
  // one sign wrong it would be (1 + 0.25 + 0.5) / 0.75 + 4.
  run.write("trajectory.csv", made::kPlanarHeader + ("0," + made::pose(1, 2, 0.5)) + ",1,0,1,0.5,0,1,tracking\n");
  expect(judge(), "nees_mean", 5, 1e-9);
}

TEST(test_interpolation_between_the_nearest_and_no_further) {
  // The run has poses at 0.0, 0.4, 1.0 s (a gap of 0.6 s) and 1.2 s; it is where truth is at its own stamps.
  std::string poses = made::kPlanarHeader;
  for (const double t : {0.0, 0.4, 1.0, 1.2}) poses += stamp(t) + made::pose(t, 0, t) + ",1,0,1,0,0,1,tracking\n";
  run.write("trajectory.csv", poses);
  std::string truth = made::kTruthHeader;
  // Before the first; on a pose; inside; inside of the long gap; on; inside; after the last.
  for (const double t : {-0.1, 0.0, 0.3, 0.7, 1.0, 1.1, 1.3}) truth += stamp(t) + made::pose(t, 0, t) + "\n";
  recording.write("truth.csv", truth);
  const Figures f = judge();
  expect(f, "poses", 4);
  expect(f, "coverage", 4.0 / 7.0);
  expect(f, "position_max_m", 0, 1e-9);
  expect(f, "heading_max_deg", 0, 1e-7);
}

TEST(test_a_gap_of_half_a_second_is_allowed) {
  recording.write("truth.csv", made::kTruthHeader + ("250000000," + made::pose(0, 0, 0)) + "\n");
  const auto two = [&](const char *second) {
    run.write("trajectory.csv", made::kPlanarHeader + ("0," + made::pose(-1, 0, 0)) + ",1,0,1,0,0,1,tracking\n" +
                                    second + "," + made::pose(1, 0, 0) + ",1,0,1,0,0,1,tracking\n");
  };
  two("500000000");
  expect(judge(), "position_max_m", 0);
  two("500000001");
  made::refused("", [] { judge(); });
}

TEST(test_six_degrees_of_freedom) {
  // Truth turned by 90 degrees about z; the estimate is R_true Exp(-r) with r = 0.2 rad about the body's x.
  const double h = std::sqrt(0.5);
  recording.write("truth.csv", made::kTruthHeader + format("0,1,2,3,0,0,%.15g,%.15g\n", h, h));
  const Eigen::Quaterniond truth(h, 0, 0, h);
  const Eigen::Quaterniond estimate = truth * Eigen::Quaterniond(Eigen::AngleAxisd(-0.2, Eigen::Vector3d::UnitX()));
  std::string header = "t_ns,x_m,y_m,z_m,qx,qy,qz,qw";
  std::string covariance;
  const char *axes[] = {"x", "y", "z", "rx", "ry", "rz"};
  const double variance[] = {1, 1, 1, 0.01, 0.04, 0.04};
  for (int i = 0; i < 6; ++i)
    for (int j = i; j < 6; ++j) {
      header += format(",cov_%s%s", axes[i], axes[j]);
      covariance += i == j ? format(",%g", variance[i]) : ",0";
    }
  run.write("trajectory.csv", header + ",state\n" +
                                  format("0,1,2,3.5,%.15g,%.15g,%.15g,%.15g", -estimate.x(), -estimate.y(),
                                         -estimate.z(), -estimate.w()) +
                                  covariance + ",tracking\n");
  const Figures f = judge();
  expect(f, "position_rmse_m", 0.5);  // in z: it counts in space
  expect(f, "rotation_rmse_deg", 0.2 * 180 / kPi, 1e-7);
  expect(f, "heading_rmse_deg", 0, 1e-6);
  expect(f, "anees_dof", 6);
  // 0.25 from z; the rotation is about the BODY's x, whose variance is 0.01.
  expect(f, "nees_mean", 0.25 + 4, 1e-6);
}

TEST(test_height_does_not_count_in_the_plane) {
  recording.write("truth.csv", std::string(made::kTruthHeader) + "0,0,0,7,0,0,0,1\n100000000,1,0,9,0,0,0,1\n");
  run.write("trajectory.csv", made::kPlanarHeader + ("0," + made::pose(0, 0, 0)) + ",1,0,1,0,0,1,tracking\n100000000," +
                                  made::pose(1, 0.1, 0) + ",1,0,1,0,0,1,tracking\n");
  const Figures f = judge();
  expect(f, "distance_m", 1);
  expect(f, "position_max_m", 0.1);
}

TEST(test_truth_without_orientation) {
  straight(0, 0, 0.2, 0);
  std::string truth = made::kTruthHeader;
  for (int i = 0; i <= 100; ++i) truth += stamp(0.1 * i) + format("%g,0,0,,,,\n", 0.1 * i);
  recording.write("truth.csv", truth);
  const Figures f = judge();
  expect(f, "position_rmse_m", 0.2);
  expect(f, "anees_dof", 2);
  expect(f, "nees_mean", 4);
  for (const char *key : {"longitudinal_mean_m", "lateral_max_m", "heading_rmse_deg", "rotation_max_deg"})
    TEST_ASSERT_TRUE_MESSAGE(f.at(key).is_null(), key);
}

TEST(test_truth_of_another_point_of_the_robot) {
  straight(0.7, 0, 0, 0);
  // Truth's point is 1 m ahead of base_link and 0.5 m to its left.
  std::string truth = made::kTruthHeader;
  for (int i = 0; i <= 100; ++i) {
    const double x = (0.1 * i + 1) * std::cos(0.7) - 0.5 * std::sin(0.7);
    const double y = (0.1 * i + 1) * std::sin(0.7) + 0.5 * std::cos(0.7);
    truth += stamp(0.1 * i) + made::pose(x, y, 0.7) + "\n";
  }
  recording.write("truth.csv", truth);
  CompareOptions options;
  options.truth_offset_m = {1, 0.5, 0};
  expect(judge(options), "position_max_m", 0, 1e-9);
  expect(judge(), "position_rmse_m", std::sqrt(1.25), 1e-9);
}

// Off by 1 m between the given seconds, else 0.
void off_between(double from, double to, double turn = 0) {
  std::string truth = made::kTruthHeader;
  std::string poses = made::kPlanarHeader;
  for (int i = 0; i <= 100; ++i) {
    const bool off = 0.1 * i >= from - 1e-9 && 0.1 * i <= to + 1e-9;
    truth += stamp(0.1 * i) + made::pose(0, 0, 0) + "\n";
    poses += stamp(0.1 * i) + made::pose(off && turn == 0 ? 1 : 0, 0, off ? turn : 0) + ",1,0,1,0,0,1,tracking\n";
  }
  recording.write("truth.csv", truth);
  run.write("trajectory.csv", poses);
}

TEST(test_lost) {
  off_between(2, 4);  // 2 s is not longer than 2 s
  expect(judge(), "lost_count", 0);
  off_between(2, 4.1);
  expect(judge(), "lost_count", 1);
  expect(judge(), "lost_s", 2.1);
  off_between(9.5, 10);  // at the end
  expect(judge(), "lost_count", 1);
  expect(judge(), "lost_s", 0.5);
  off_between(3, 6, 16 * kPi / 180);
  expect(judge(), "lost_count", 1);
  off_between(3, 6, 14 * kPi / 180);
  expect(judge(), "lost_count", 0);
  // Standing still: no way, so no percentage of it.
  TEST_ASSERT_TRUE(judge().at("position_end_percent").is_null());
}

TEST(test_a_part_of_the_drive) {
  off_between(4, 5);
  CompareOptions options;
  options.from_s = 6;
  expect(judge(options), "position_max_m", 0);
  expect(judge(options), "poses", 41);
  options.from_s = 4;
  options.to_s = 5;
  expect(judge(options), "position_mean_m", 1);
}

TEST(test_alignment_undoes_what_it_may_undo) {
  // A bent path in space, moved by a known similarity.
  std::vector<Eigen::Vector3d> from;
  for (int i = 0; i < 20; ++i) from.emplace_back(0.3 * i, std::sin(0.5 * i), 0.1 * i * i / 20);
  const Eigen::Matrix3d yaw = Eigen::AngleAxisd(2.5, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const Eigen::Matrix3d tilt = yaw * Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitX()).toRotationMatrix();
  const auto moved = [&](double scale, const Eigen::Matrix3d &R, const Eigen::Vector3d &t) {
    std::vector<Eigen::Vector3d> out;
    for (const auto &p : from) out.push_back(scale * (R * p) + t);
    return out;
  };
  const Similarity planar = align(from, moved(1, yaw, {3, -4, 0}), Alignment::kSe2);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0, (planar.R - yaw).norm());
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0, (planar.t - Eigen::Vector3d(3, -4, 0)).norm());
  const Similarity scaled = align(from, moved(1.7, yaw, {3, -4, 0}), Alignment::kSim2);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 1.7, scaled.scale);
  const Similarity space = align(from, moved(1, tilt, {3, -4, 5}), Alignment::kSe3);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0, (space.R - tilt).norm());
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0, (space.t - Eigen::Vector3d(3, -4, 5)).norm());
}

TEST(test_alignment_keeps_nees) {
  // Turning the map turns the covariance with it: NEES of a run does not depend on the axes that it is told in.
  Pose pose;
  pose.covariance.diagonal() << 1, 4, 9, 0.1, 0.2, 0.3;
  Similarity turn;
  turn.R = Eigen::AngleAxisd(kPi / 2, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const Pose turned = turn(pose);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 4, turned.covariance(0, 0));
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 1, turned.covariance(1, 1));
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.3, turned.covariance(5, 5));
}

TEST(test_a_covariance_that_is_none_is_not_inside) {
  straight(0, 0, 0, 0, 0.0);  // sigma 0
  const Figures f = judge();
  expect(f, "nees_inside_95", 0);
  expect(f, "covariances_not_positive", 101);
  TEST_ASSERT_TRUE(f.at("nees_mean").is_null());
}

TEST(test_landmarks_by_id_and_by_place) {
  Comparison comparison;
  const auto at = [](int64_t id, double x, double y, double yaw) {
    return Landmark{id, {x, y, 0}, Eigen::Matrix2d::Zero(), yaw};
  };
  const std::vector<Landmark> truth{at(1, 0, 0, 0), at(2, 5, 0, 0), at(3, 0, 5, 0)};
  Figures f;
  add_landmark_figures({at(1, 0.3, 0, 0.1), at(2, 5, 0.4, -0.1)}, truth, comparison, true, &f);
  expect(f, "landmarks_found", 2);
  expect(f, "landmarks_total", 3);
  expect(f, "landmark_rmse_m", std::sqrt((0.09 + 0.16) / 2));
  expect(f, "landmark_heading_rmse_deg", 0.1 * 180 / kPi, 1e-7);
  expect(f, "landmark_max_m", 0.4);
  TEST_ASSERT_TRUE(f["landmark_rmse_own_fit_m"].is_null());  // two landmarks have no shape
  TEST_ASSERT_EQUAL_STRING("id", f["landmarks_matched_by"].get<std::string>().c_str());
  add_landmark_figures({at(1, 1, 2, 0), at(2, 1, 7, 0), at(3, -4, 2, 0)}, truth, comparison, true,
                       &f);  // turned and moved
  expect(f, "landmark_rmse_own_fit_m", 0);
  // Ids of its own: the one beyond 0.5 m is not found, of two near one landmark the nearer.
  add_landmark_figures({at(101, 0.3, 0, NAN), at(102, 0.1, 0, NAN), at(103, 5, 0.6, NAN)}, truth, comparison, true, &f);
  expect(f, "landmarks_found", 1);
  expect(f, "landmark_rmse_m", 0.1);
  TEST_ASSERT_EQUAL_STRING("place", f["landmarks_matched_by"].get<std::string>().c_str());
  TEST_ASSERT_TRUE(f["landmark_heading_rmse_deg"].is_null());
}

// Numbers that the filter gave out itself, some of which are truth's ids by chance.
TEST(test_landmarks_whose_ids_are_the_filters_own) {
  Comparison comparison;
  std::vector<Landmark> truth, estimate, distorted;
  for (int i = 0; i < 10; i++) {
    const auto at = [](int64_t id, double x, double y) {
      return Landmark{id, {x, y, 0}, Eigen::Matrix2d::Zero(), NAN};
    };
    const int row = i / 4;
    const double x = 3.0 * (i % 4), y = 4.0 * row;
    truth.push_back(at(i, x, y));
    estimate.push_back(at((7 * i + 3) % 10, x + 0.1, y));
    distorted.push_back(at(i, x + 0.2 * y, y + 0.15 * x));  // up to 2 m off
  }
  Figures f;
  add_landmark_figures(estimate, truth, comparison, true, &f);
  TEST_ASSERT_EQUAL_STRING("place", f["landmarks_matched_by"].get<std::string>().c_str());
  expect(f, "landmarks_found", 10);
  expect(f, "landmark_rmse_m", 0.1);
  add_landmark_figures(distorted, truth, comparison, true, &f);  // a bad map with truth's identities
  TEST_ASSERT_EQUAL_STRING("id", f["landmarks_matched_by"].get<std::string>().c_str());
  expect(f, "landmarks_found", 10);
  add_landmark_figures(distorted, truth, comparison, false, &f);  // the same of a recording without any
  TEST_ASSERT_EQUAL_STRING("place", f["landmarks_matched_by"].get<std::string>().c_str());
}

TEST(test_statistics) {
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 2.5, percentile({4, 1, 3, 2}, 50));
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 3.85, percentile({4, 1, 3, 2}, 95));
  // Published tables (Abramowitz and Stegun 26.8).
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 3.841458820694124, chi2_quantile(0.95, 1));
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 5.991464547107979, chi2_quantile(0.95, 2));
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 7.814727903251179, chi2_quantile(0.95, 3));
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 12.591587243743977, chi2_quantile(0.95, 6));
  TEST_ASSERT_DOUBLE_WITHIN(1e-6, 124.3421134, chi2_quantile(0.95, 100));
}

void refuses(const std::string &trajectory, const std::string &said) {
  run.write("trajectory.csv", trajectory);
  made::refused(said, [] { load_trajectory(run.path()); });
}

TEST(test_errors_say_where) {
  const std::string header = made::kPlanarHeader;
  refuses("", "trajectory.csv: is empty");
  refuses(header, "has no pose in it");
  refuses("t_ns,x_m\n0,1\n", "trajectory.csv:1: no column 'y_m'");
  refuses(header + "0,1\n", "trajectory.csv:2: 2 fields, but the header has 15");
  refuses(header + "0,one,0,0,0,0,0,1,1,0,1,0,0,1,tracking\n", "trajectory.csv:2: x_m: 'one' is not a number");
  refuses(header + "1.5,1,0,0,0,0,0,1,1,0,1,0,0,1,tracking\n", "trajectory.csv:2: t_ns: '1.5' is not a whole number");
  refuses(header + "2,1,0,0,0,0,0,1,1,0,1,0,0,1,tracking\n1,1,0,0,0,0,0,1,1,0,1,0,0,1,tracking\n",
          "trajectory.csv:3: t_ns: time runs back");
}

TEST(test_tum_serves_where_there_is_no_csv) {
  recording.write("truth.csv", made::kTruthHeader + ("123456789," + made::pose(1, 2, 0)) + "\n");
  run.write("trajectory.tum", "# t x y z q\n0.123456789 1 2.25 0 0 0 0 1\n");
  const Figures f = judge();
  expect(f, "position_max_m", 0.25);
  TEST_ASSERT_TRUE(f.at("nees_mean").is_null());
  TEST_ASSERT_TRUE(f.at("nees_inside_95").is_null());
  TEST_ASSERT_TRUE(f.at("anees_dof").is_null());
}

const std::string kPublishedHeader =
    "t_ns,made_ns,fused_until_ns,x_m,y_m,z_m,qx,qy,qz,qw,cov_xx,cov_xy,cov_yy,cov_xt,cov_yt,cov_tt,state,"
    "odom_x_m,odom_y_m,odom_heading_rad,resets\n";

std::string sent(int64_t t_ms, double age_ms, double x, double odom_x, int resets) {
  const int64_t t_ns = t_ms * 1'000'000, made_ns = t_ns + std::llround(age_ms * 1e6), fused_ns = t_ns - 100'000'000;
  return std::to_string(t_ns) + "," + std::to_string(made_ns) + "," + std::to_string(fused_ns) + "," +
         made::pose(x, 0, 0) + format(",1,0,1,0,0,1,tracking,%g,0,0,%d\n", odom_x, resets);
}

// A speed that changes, so that a delay is no shift; a fifth of the positions is far off.
TEST(test_the_delay_of_a_receiver) {
  Trajectory driven;
  std::vector<Pose> gnss;
  const auto x_at = [](double t) { return 5 * t + 4 * std::sin(0.7 * t); };
  for (int i = 0; i <= 1000; ++i) {
    Pose p;
    p.t_ns = i * INT64_C(20'000'000);
    p.p_m.x() = x_at(0.02 * i);
    driven.poses.push_back(p);
    if (i % 20 != 0 || i < 100) continue;
    p.oriented = false;
    p.p_m = {x_at(0.02 * i - 0.37), i % 100 == 0 ? 30.0 : 0.0, 0};
    gnss.push_back(p);
  }
  CompareOptions options;
  options.against_gnss = true;
  const GnssDelay found = find_gnss_delay(driven, gnss, options);
  TEST_ASSERT_DOUBLE_WITHIN(0.0051, 0.37, found.delay_s);
  TEST_ASSERT_GREATER_THAN_DOUBLE(1, found.rms_before_m);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.05, found.rms_m);
  const Comparison after = compare(driven, without_delay(gnss, found.delay_s), options);
  TEST_ASSERT_DOUBLE_WITHIN(0.05, 0, after.samples[1].error_m.x());
  for (Pose &p : driven.poses) p.p_m.setZero();
  for (Pose &p : gnss) p.p_m = {1, 0, 0};
  TEST_ASSERT_EQUAL_STRING("--take-out-delay: the robot hardly moves: the receiver's delay is not observable",
                           made::why_of([&] { (void)find_gnss_delay(driven, gnss, options); }).c_str());
}

TEST(test_published) {
  // 1 m/s at 50 Hz. At 200 ms map jumps by 0.5 m and says so; at 300 ms by 0.3 m and doesn't.
  std::string text = kPublishedHeader;
  for (int i = 0; i < 20; ++i) {
    const double odom = 0.02 * i;
    const double map = odom + (i >= 10 ? 0.5 : 0) + (i >= 15 ? 0.3 : 0);
    text += sent(20 * i, i == 7 ? 4 : 2, map, odom, i >= 10 ? 2 : 1);
  }
  run.write("published.csv", text);
  Figures f;
  add_published_figures(load_published(run.path()), &f);
  expect(f, "published", 20);
  expect(f, "age_median_ms", 2);
  expect(f, "age_max_ms", 4);
  expect(f, "age_p99_ms", 2 + 2 * (0.99 * 19 - 18));
  expect(f, "predicted_ahead_median_ms", 100);
  expect(f, "resets", 1);
  expect(f, "jumps", 2);
  expect(f, "jumps_unannounced", 1);
  expect(f, "jump_max_m", 0.5);
  expect(f, "odom_step_max_m", 0.02);
  expect(f, "odom_speed_max_mps", 1);
  TEST_ASSERT_TRUE(f["t_strictly_rising"].get<bool>());

  run.write("published.csv", kPublishedHeader + sent(20, 1, 0, 0, 1) + sent(20, 1, 0, 0, 1));
  const Published twice = load_published(run.path());
  TEST_ASSERT_FALSE(twice.strictly_rising);
  TEST_ASSERT_EQUAL(1, twice.trajectory.poses.size());

  // A run of before the column had its name.
  std::string older = kPublishedHeader;
  older.replace(older.find("made_ns"), 7, "sent_ns");
  run.write("published.csv", older + sent(20, 3, 0, 0, 1));
  TEST_ASSERT_EQUAL_INT64(23'000'000, load_published(run.path()).rows.at(0).made_ns);
}

TEST(test_sightings_of_known_landmarks) {
  off_between(5, 10);  // right up to 4.9 s, 1 m off from 5 s
  const Comparison comparison = compare(load_trajectory(run.path()), load_truth(recording.path()), {});
  const std::vector<Landmark> known{{7, {0, 0, 0}, Eigen::Matrix2d::Zero(), NAN}};
  Figures f;
  add_sighting_figures(comparison, {{1'000'000'000, "s", 7, 0, 1}, {8'000'000'000, "s", 9, 0, 1}}, known, &f);
  expect(f, "position_rmse_landmark_seen_m", 0);  // 1 to 3 s; 9 is no known landmark
  add_sighting_figures(comparison, {{8'000'000'000, "s", 7, 0, 1}}, known, &f);
  expect(f, "position_rmse_landmark_seen_m", 1);
  add_sighting_figures(comparison, {}, known, &f);
  TEST_ASSERT_TRUE(f["position_rmse_landmark_seen_m"].is_null());
}

}  // namespace

void setUp(void) { run.clear(), recording.clear(); }
