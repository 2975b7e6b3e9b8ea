// SPDX-License-Identifier: Apache-2.0
#include "eval/compare.h"

#include <cmath>
#include <cstdio>
#include <limits>

#include "common/failure.h"
#include "common/linear.h"
#include "common/statistics.h"

namespace wm::tools {
namespace {

// e^T P^-1 e; NaN where P is not positive definite.
template <int N>
double normalised_square(const Eigen::Matrix<double, N, 1> &error, const Eigen::Matrix<double, N, N> &covariance) {
  if (!covariance.allFinite()) return kNan;
  const Eigen::LLT<Eigen::Matrix<double, N, N>> factor(covariance);
  if (factor.info() != Eigen::Success) return kNan;
  Eigen::Matrix<double, N, 1> whitened;
  whitened = error;
  factor.matrixL().solveInPlace(whitened);  // in one expression gcc 12 warns on 32-bit ARM of what isn't so
  return whitened.squaredNorm();
}

double nees_of(const Sample &sample, bool planar) {
  const Matrix6 &P = sample.estimate.covariance;
  const Eigen::Vector3d missing = -sample.error_m;  // truth minus estimate
  const bool oriented = sample.estimate.oriented && sample.truth.oriented;
  if (planar && !oriented) return normalised_square<2>(missing.head<2>(), P.topLeftCorner<2, 2>());
  if (!oriented) return normalised_square<3>(missing, P.topLeftCorner<3, 3>());
  if (planar) {
    const Eigen::Array3i of{0, 1, 5};
    return normalised_square<3>({missing.x(), missing.y(), -sample.heading_error_rad}, P(of, of));
  }
  Eigen::Matrix<double, 6, 1> error;
  error << missing, sample.rotation_rad;
  return normalised_square<6>(error, P);
}

Sample sample_of(const Pose &estimate, const Pose &truth, bool planar) {
  Sample s{.estimate = estimate,
           .truth = truth,
           .error_m = estimate.p_m - truth.p_m,
           .along_m = kNan,
           .across_m = kNan,
           .heading_error_rad = kNan,
           .rotation_rad = Eigen::Vector3d::Constant(kNan),
           .nees = kNan};
  if (planar) s.error_m.z() = 0;
  if (truth.oriented) {
    const double heading = heading_rad(truth.q);
    s.along_m = std::cos(heading) * s.error_m.x() + std::sin(heading) * s.error_m.y();
    s.across_m = -std::sin(heading) * s.error_m.x() + std::cos(heading) * s.error_m.y();
    if (estimate.oriented) {
      s.heading_error_rad = wrap(heading_rad(estimate.q) - heading);
      s.rotation_rad = rotation_vector(estimate.q.conjugate() * truth.q);
    }
  }
  return s;
}

std::string seconds(int64_t t_ns) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3f s", static_cast<double>(t_ns) * 1e-9);
  return text;
}

std::string nothing_to_compare(const Trajectory &run, const std::vector<Pose> &truth, size_t in_part) {
  return "nothing to compare: the run's " + std::to_string(run.poses.size()) + " poses go from " +
         seconds(run.poses.front().t_ns) + " to " + seconds(run.poses.back().t_ns) + ", truth's " +
         std::to_string(truth.size()) + " from " + seconds(truth.front().t_ns) + " to " + seconds(truth.back().t_ns) +
         ", " + std::to_string(in_part) + " of them in the part asked for; is RUN a run of REC?";
}

}  // namespace

Pose Similarity::operator()(const Pose &pose) const {
  Pose out = pose;
  out.p_m = scale * (R * pose.p_m) + t;
  out.q = (Eigen::Quaterniond(R) * pose.q).normalized();
  // Position is in map axes, which turn and stretch; rotation is in the body's, which don't.
  Matrix6 J = Matrix6::Identity();
  J.topLeftCorner<3, 3>() = scale * R;
  out.covariance = J * pose.covariance * J.transpose();
  return out;
}

Similarity align(const std::vector<Eigen::Vector3d> &from, const std::vector<Eigen::Vector3d> &to, Alignment kind) {
  Similarity out;
  if (kind == Alignment::kNone) return out;
  const bool planar = kind != Alignment::kSe3;
  const auto n = static_cast<Eigen::Index>(from.size());
  Eigen::Matrix3Xd a(3, n);
  Eigen::Matrix3Xd b(3, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    a.col(i) = from[static_cast<size_t>(i)];
    b.col(i) = to[static_cast<size_t>(i)];
  }
  const Eigen::Vector3d a_mean = a.rowwise().mean();
  const Eigen::Vector3d b_mean = b.rowwise().mean();
  a.colwise() -= a_mean;
  b.colwise() -= b_mean;
  if (planar) a.row(2).setZero(), b.row(2).setZero();
  if (n < 2 || a.norm() < 1e-9 || b.norm() < 1e-9)
    throw Failure("--align: the poses are all at one place: the rotation is not observable");

  const Eigen::Matrix3d moment = b * a.transpose();
  if (planar) {
    const double angle = std::atan2(moment(1, 0) - moment(0, 1), moment(0, 0) + moment(1, 1));
    out.R = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  } else {
    const Svd3 svd = svd_of(moment);
    Eigen::Matrix3d S = Eigen::Matrix3d::Identity();
    if ((svd.U * svd.V.transpose()).determinant() < 0) S(2, 2) = -1;  // no mirror
    out.R = svd.U * S * svd.V.transpose();
  }
  if (kind == Alignment::kSim2) {
    out.scale = (out.R * a).cwiseProduct(b).sum() / a.squaredNorm();
    if (!(out.scale > 0)) throw Failure("--align sim2: the run's path is opposite to truth; no positive scale fits");
  }
  out.t = b_mean - out.scale * (out.R * a_mean);
  if (planar) out.t.z() = 0;
  return out;
}

Comparison compare(const Trajectory &run, const std::vector<Pose> &truth, const CompareOptions &options) {
  Comparison out;
  out.planar = run.planar;
  out.start_ns = run.poses.front().t_ns;
  std::vector<std::pair<Pose, Pose>> pairs;  // estimate, truth
  for (const Pose &at : truth) {
    const double since_start_s = static_cast<double>(at.t_ns - out.start_ns) * 1e-9;
    if (options.from_s && since_start_s < *options.from_s) continue;
    if (options.to_s && since_start_s > *options.to_s) continue;
    Pose of_base = at;
    if (at.oriented) of_base.p_m -= at.q * options.truth_offset_m;
    out.truth.push_back(of_base);
    auto pose = pose_at(run.poses, at.t_ns, kMaxGapNs);
    if (!pose) continue;
    // Without truth's heading it is the estimate that is carried to truth's point, by its own.
    if (!at.oriented && pose->oriented) pose->p_m += pose->q * options.truth_offset_m;
    pairs.emplace_back(*pose, of_base);
  }
  out.stamps = out.truth.size();
  if (pairs.empty()) throw Failure(nothing_to_compare(run, truth, out.stamps));

  std::vector<Eigen::Vector3d> from;
  std::vector<Eigen::Vector3d> to;
  for (const auto &[estimate, true_pose] : pairs) {
    from.push_back(estimate.p_m);
    to.push_back(true_pose.p_m);
  }
  out.alignment = align(from, to, options.align);

  bool all_oriented = true;
  for (const auto &[estimate, true_pose] : pairs) {
    Sample sample = sample_of(out.alignment(estimate), true_pose, run.planar);
    all_oriented = all_oriented && std::isfinite(sample.heading_error_rad);
    if (run.has_covariance && !options.against_gnss) {
      sample.nees = nees_of(sample, run.planar);
      if (std::isnan(sample.nees)) ++out.covariances_not_positive;
    }
    out.samples.push_back(sample);
  }
  out.nees_dof = all_oriented ? (run.planar ? 3 : 6) : (run.planar ? 2 : 3);
  return out;
}

}  // namespace wm::tools
