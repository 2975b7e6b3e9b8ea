// SPDX-License-Identifier: Apache-2.0
#include "common/run_folder.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <sstream>

#include "common/csv.h"
#include "common/failure.h"
#include "waymark/pose.h"

namespace wm::tools {
namespace {

namespace fs = std::filesystem;
using Column = std::optional<size_t>;

// Where a file of poses keeps what belongs to a pose.
struct PoseColumns {
  size_t t_ns, x, y;
  Column z, qx, qy, qz, qw, state;
  std::array<Column, 36> covariance{};  // of the 6x6, row by row
  bool planar = true;
  bool has_covariance = false;
};

PoseColumns find_columns(const Csv &csv) {
  PoseColumns at{csv.need("t_ns"), csv.need("x_m"), csv.need("y_m"), csv.find("z_m"),  csv.find("qx"),
                 csv.find("qy"),   csv.find("qz"),  csv.find("qw"),  csv.find("state")};
  const auto put = [&](size_t i, size_t j, const std::string &name) {
    at.covariance[6 * i + j] = at.covariance[6 * j + i] = csv.find(name);
    if (at.covariance[6 * i + j]) at.has_covariance = true;
  };
  // Planar names have t for the heading; names for six degrees of freedom have rx, ry, rz (or, as some write, digits).
  if (csv.find("cov_tt")) {
    put(0, 0, "cov_xx"), put(0, 1, "cov_xy"), put(1, 1, "cov_yy");
    put(0, 5, "cov_xt"), put(1, 5, "cov_yt"), put(5, 5, "cov_tt");
    return at;
  }
  static constexpr std::array<const char *, 6> kAxes{"x", "y", "z", "rx", "ry", "rz"};
  const bool digits = csv.find("cov_00").has_value();
  for (size_t i = 0; i < 6; ++i)
    for (size_t j = i; j < 6; ++j)
      put(i, j, digits ? "cov_" + std::to_string(i) + std::to_string(j) : std::string("cov_") + kAxes[i] + kAxes[j]);
  if (at.has_covariance) {
    at.planar = false;
    return at;
  }
  // No covariance at all: in the plane is what never leaves it.
  for (size_t row = 0; row < csv.rows() && at.planar; ++row)
    for (const Column column : {at.z, at.qx, at.qy})
      if (const double value = csv.number(row, column); std::isfinite(value) && value != 0) at.planar = false;
  return at;
}

int read_state(const Csv &csv, size_t row, Column column) {
  if (!column) return -1;
  const std::string_view text = csv.text(row, *column);
  for (unsigned state = WM_STATE_SEARCHING; state < WM_STATE_COUNT; ++state)
    if (text == wm_state_name(state)) return static_cast<int>(state);
  int state = -1;
  const auto [end, problem] = std::from_chars(text.data(), text.data() + text.size(), state);
  return problem == std::errc() && end == text.data() + text.size() ? state : -1;
}

// False where the row has no position.
bool read_pose(const Csv &csv, size_t row, const PoseColumns &at, Pose *pose) {
  pose->t_ns = csv.integer(row, at.t_ns);
  pose->p_m = {csv.number(row, at.x), csv.number(row, at.y), csv.number(row, at.z)};
  if (std::isnan(pose->p_m.z())) pose->p_m.z() = 0;
  if (!pose->p_m.allFinite()) return false;
  const Eigen::Vector4d q{csv.number(row, at.qx), csv.number(row, at.qy), csv.number(row, at.qz),
                          csv.number(row, at.qw)};
  pose->oriented = q.allFinite() && q.norm() > 0.5;
  if (pose->oriented) pose->q = Eigen::Quaterniond(q).normalized();
  for (size_t k = 0; k < 36; ++k) {
    const double value = csv.number(row, at.covariance[k]);
    pose->covariance(static_cast<int>(k / 6), static_cast<int>(k % 6)) = at.covariance[k] ? value : 0;
  }
  pose->state = read_state(csv, row, at.state);
  return true;
}

Trajectory load_csv(const fs::path &file) {
  const Csv csv = Csv::load(file);
  const PoseColumns at = find_columns(csv);
  Trajectory out{{}, at.planar, at.has_covariance};
  out.poses.reserve(csv.rows());
  for (size_t row = 0; row < csv.rows(); ++row) {
    Pose pose;
    if (!read_pose(csv, row, at, &pose)) continue;
    if (!out.poses.empty() && pose.t_ns < out.poses.back().t_ns)
      throw Failure(csv.where(row, at.t_ns) + ": time runs back, from " + std::to_string(out.poses.back().t_ns) +
                    " to " + std::to_string(pose.t_ns));
    if (!out.poses.empty() && pose.t_ns == out.poses.back().t_ns) out.poses.pop_back();
    out.poses.push_back(pose);
  }
  return out;
}

// `t x y z qx qy qz qw` in seconds and metres, as evo and others write it; lines of # are comments.
Trajectory load_tum(const fs::path &file) {
  constexpr long double kLatest_s = 4e9L;  // its nanoseconds fit into 64 bits
  std::ifstream in(file);
  Trajectory out;
  std::string line;
  for (size_t number = 1; std::getline(in, line); ++number) {
    const std::string at = file.string() + ":" + std::to_string(number) + ": ";
    if (number == 1 && line.starts_with("\xEF\xBB\xBF")) line.erase(0, 3);
    const size_t begin = line.find_first_not_of(" \t\r");
    if (begin == std::string::npos || line[begin] == '#') continue;
    std::istringstream fields(line);
    long double t_s = 0;
    Pose pose;
    Eigen::Vector4d q;
    std::string rest;
    if (!(fields >> t_s >> pose.p_m.x() >> pose.p_m.y() >> pose.p_m.z() >> q[0] >> q[1] >> q[2] >> q[3]) ||
        q.norm() < 0.5 || fields >> rest)
      throw Failure(at + "not a pose; 't x y z qx qy qz qw' is expected, parted by blanks");
    if (std::fabs(t_s) > kLatest_s)
      throw Failure(at + "its time is beyond 4e9 s; seconds are expected: are these milliseconds or nanoseconds?");
    pose.t_ns = std::llroundl(t_s * 1e9L);
    pose.q = Eigen::Quaterniond(q).normalized();
    if (pose.p_m.z() != 0 || q[0] != 0 || q[1] != 0) out.planar = false;
    if (!out.poses.empty() && pose.t_ns < out.poses.back().t_ns) throw Failure(at + "time runs back");
    if (!out.poses.empty() && pose.t_ns == out.poses.back().t_ns) out.poses.pop_back();
    out.poses.push_back(pose);
  }
  return out;
}

}  // namespace

Trajectory load_trajectory(const fs::path &run) {
  if (!fs::is_directory(run))
    throw Failure(run.string() + ": is not a folder; RUN is what `waymark replay --out RUN` wrote", kUsage);
  const bool csv = fs::exists(run / "trajectory.csv");
  const fs::path file = run / (csv ? "trajectory.csv" : "trajectory.tum");
  if (!fs::exists(file))
    throw Failure(run.string() +
                  ": has neither trajectory.csv nor trajectory.tum; RUN is what `waymark replay --out RUN` wrote");
  Trajectory out = csv ? load_csv(file) : load_tum(file);
  if (out.poses.empty()) throw Failure(file.string() + ": has no pose in it; see the run's health.json");
  return out;
}

Trajectory load_reference(const fs::path &run) {
  if (!fs::exists(run / "reference.csv"))
    throw Failure((run / "reference.csv").string() + ": is not there; waymark replay --reference writes it");
  Trajectory out = load_csv(run / "reference.csv");
  out.planar = true;
  out.has_covariance = false;
  if (out.poses.empty()) throw Failure((run / "reference.csv").string() + ": has no pose in it");
  return out;
}

Published load_published(const fs::path &run) {
  if (!fs::is_directory(run))
    throw Failure(run.string() + ": is not a folder; RUN is what `waymark replay --out RUN` wrote", kUsage);
  const Csv csv = Csv::load(run / "published.csv");
  const PoseColumns at = find_columns(csv);
  const Column older = csv.find("sent_ns");  // the name that made_ns had
  const size_t made = older ? *older : csv.need("made_ns");
  const size_t until = csv.need("fused_until_ns");
  const std::array<Column, 3> odom{csv.find("odom_x_m"), csv.find("odom_y_m"), csv.find("odom_heading_rad")};
  const Column resets = csv.find("resets");
  const Column jumps = csv.find("jumps");
  Published out;
  out.trajectory.planar = at.planar;
  out.trajectory.has_covariance = at.has_covariance;
  for (size_t row = 0; row < csv.rows(); ++row) {
    PublishedRow sentence{};
    if (!read_pose(csv, row, at, &sentence.pose)) continue;
    sentence.t_ns = sentence.pose.t_ns;
    sentence.made_ns = csv.integer(row, made);
    sentence.fused_until_ns = csv.integer(row, until);
    for (int i = 0; i < 3; ++i) sentence.odom[i] = csv.number(row, odom[static_cast<size_t>(i)]);
    sentence.resets = resets ? csv.integer(row, *resets) : 0;
    sentence.announced = sentence.resets + (jumps ? csv.integer(row, *jumps) : 0);
    if (!out.rows.empty() && sentence.t_ns <= out.rows.back().t_ns) out.strictly_rising = false;
    out.rows.push_back(sentence);
    out.trajectory.poses.push_back(sentence.pose);
  }
  if (out.rows.empty()) throw Failure((run / "published.csv").string() + ": has no pose in it");
  auto &poses = out.trajectory.poses;
  std::stable_sort(poses.begin(), poses.end(), [](const Pose &a, const Pose &b) { return a.t_ns < b.t_ns; });
  // Of equal stamps the last counts: what a listener has then.
  const auto first =
      std::unique(poses.rbegin(), poses.rend(), [](const Pose &a, const Pose &b) { return a.t_ns == b.t_ns; });
  poses.erase(poses.begin(), first.base());
  return out;
}

std::vector<Landmark> load_landmarks(const fs::path &file) {
  const Csv csv = Csv::load(file);
  const size_t id = csv.need("id");
  const size_t x = csv.need("x_m");
  const size_t y = csv.need("y_m");
  const Column z = csv.find("z_m");
  const Column yaw = csv.find("yaw_rad");
  const Column sigma = csv.find("sigma_m");
  const std::array<Column, 3> cov{csv.find("cov_xx"), csv.find("cov_xy"), csv.find("cov_yy")};
  std::vector<Landmark> out;
  for (size_t row = 0; row < csv.rows(); ++row) {
    Landmark landmark{csv.text(row, id).empty() ? -1 : csv.integer(row, id),
                      {csv.number(row, x), csv.number(row, y), csv.number(row, z)},
                      Eigen::Matrix2d::Zero(),
                      csv.number(row, yaw)};
    if (std::isnan(landmark.p_m.z())) landmark.p_m.z() = 0;
    if (!landmark.p_m.allFinite()) continue;
    if (cov[0] && cov[1] && cov[2]) {
      const double xy = csv.number(row, cov[1]);
      landmark.covariance_xy << csv.number(row, cov[0]), xy, xy, csv.number(row, cov[2]);
    } else if (const double s = csv.number(row, sigma); std::isfinite(s)) {
      landmark.covariance_xy = s * s * Eigen::Matrix2d::Identity();
    }
    out.push_back(landmark);
  }
  return out;
}

}  // namespace wm::tools
