// SPDX-License-Identifier: Apache-2.0
// Lines that were lost and return under another number: two landmarks that are one line are merged. Constants were
// chosen on hall-a; not swept.
#include <utility>

#include "filters/slam/slam.hpp"

namespace wm {
namespace {

constexpr double kSame_m = 0.02;     // sigma of one line's place, seen from elsewhere: an edge has a width
constexpr double kMerged_m = 0.1;    // sigma of their measured difference, wide: one pair in many is wrong after all
constexpr double kNear_m = 2.0;      // farther apart no two are compared
constexpr double kGate_nis = 9.21;   // 99 % of chi2 with two degrees of freedom
constexpr double kSure_m2 = 0.01;    // variance of their difference below which no second pair must agree
constexpr double kUnsure_m2 = 0.25;  // variance above which nothing is decided

double nis_of(const double d[2], const double s[2][2]) {
  return (s[1][1] * d[0] * d[0] - 2.0 * s[0][1] * d[0] * d[1] + s[0][0] * d[1] * d[1]) /
         (s[0][0] * s[1][1] - s[0][1] * s[1][0]);
}

}  // namespace

bool slam::may_be_one(int fresh, int lost) const {
  const landmark_note &f = note(fresh), &l = note(lost);
  if (fresh == lost || f.seen < kMergeSeen || l.seen < kMergeSeen || l.last_ns >= f.first_ns) return false;
  const int a = joint_.landmark_state(fresh), b = joint_.landmark_state(lost);
  return std::fabs(joint_.value(a) - joint_.value(b)) < kNear_m &&
         std::fabs(joint_.value(a + 1) - joint_.value(b + 1)) < kNear_m;
}

// Covariance of one pair's difference with another's.
void slam::covariance_of_pairs(const landmark_pair &p, const landmark_pair &q, double out[2][2]) const {
  for (int k = 0; k < 2; k++)
    for (int l = 0; l < 2; l++)
      out[k][l] = joint_.covariance(p.fresh + k, q.fresh + l) - joint_.covariance(p.fresh + k, q.lost + l) -
                  joint_.covariance(p.lost + k, q.fresh + l) + joint_.covariance(p.lost + k, q.lost + l);
}

slam::landmark_pair slam::pair_of(int fresh, int lost) const {
  landmark_pair out{joint_.landmark_state(fresh), joint_.landmark_state(lost), {}, {}};
  for (int k = 0; k < 2; k++) out.apart[k] = joint_.value(out.fresh + k) - joint_.value(out.lost + k);
  covariance_of_pairs(out, out, out.s);
  for (int k = 0; k < 2; k++) out.s[k][k] += square(kSame_m);
  return out;
}

// Whether another pair agrees with this one much better than by chance: joint compatibility of two pairs [Neira2001].
bool slam::is_compatible_with_another(const landmark_pair &p) const {
  const double determinant = p.s[0][0] * p.s[1][1] - p.s[0][1] * p.s[1][0];
  const double inverse[2][2] = {{p.s[1][1] / determinant, -p.s[0][1] / determinant},
                                {-p.s[1][0] / determinant, p.s[0][0] / determinant}};
  for (int f = 0; f < joint_.landmarks(); f++)
    for (int l = 0; l < joint_.landmarks(); l++) {
      if (joint_.landmark_state(f) == p.fresh || joint_.landmark_state(l) == p.lost || !may_be_one(f, l)) continue;
      const landmark_pair q = pair_of(f, l);
      double cross[2][2], gain[2][2], d[2], s[2][2];
      covariance_of_pairs(q, p, cross);
      for (int i = 0; i < 2; i++)
        for (int j = 0; j < 2; j++) gain[i][j] = cross[i][0] * inverse[0][j] + cross[i][1] * inverse[1][j];
      for (int i = 0; i < 2; i++) {
        d[i] = q.apart[i] - gain[i][0] * p.apart[0] - gain[i][1] * p.apart[1];
        for (int j = 0; j < 2; j++) s[i][j] = q.s[i][j] - gain[i][0] * cross[j][0] - gain[i][1] * cross[j][1];
      }
      if (s[0][0] + s[1][1] < kSure_m2 && nis_of(d, s) < kGate_nis) return true;
    }
  return false;
}

// Two landmarks of which one was lost before the other was first seen, at one place within their covariance, and no
// third one near: their difference is measured to be nothing, and the old one goes on under the new one's number.
void slam::merge_if_one(int fresh) {
  int best = -1;
  double least = 1e300, second = 1e300;
  for (int l = 0; l < joint_.landmarks(); l++) {
    if (!may_be_one(fresh, l)) continue;
    const landmark_pair p = pair_of(fresh, l);
    const double nis = nis_of(p.apart, p.s);
    if (nis < least) {
      second = least;
      least = nis;
      best = l;
    } else if (nis < second) {
      second = nis;
    }
  }
  if (best < 0 || !(least < kGate_nis) || !(second > least + kGate_nis)) return;
  const landmark_pair p = pair_of(fresh, best);
  const double unsure = p.s[0][0] + p.s[1][1];
  if (unsure > kUnsure_m2 || (unsure > kSure_m2 && !is_compatible_with_another(p))) return;
  joint_row rows[2];
  double noise[2], difference[2];
  for (int k = 0; k < 2; k++) {
    rows[k].add(p.fresh + k, 1.0);
    rows[k].add(p.lost + k, -1.0);
    noise[k] = square(kMerged_m);
    difference[k] = -p.apart[k];
  }
  innovation block = joint_.prepare(rows, difference, noise, 2);
  if (!joint_.fuse(std::move(block), nullptr, joint_state::scope::all)) return;
  landmark_note &kept = note(best);
  const landmark_note gone = note(fresh);
  kept.id = gone.id;
  kept.seen += gone.seen;
  kept.last_ns = gone.last_ns;
  kept.sensor = gone.sensor;
  kept.misfits = gone.misfits;
  joint_.remove_landmark(fresh);
  note(fresh) = note(joint_.landmarks());
  counts_.merged++;
}

}  // namespace wm
