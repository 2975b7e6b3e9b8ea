// SPDX-License-Identifier: Apache-2.0
#include "map/merge.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/failure.h"
#include "common/statistics.h"
#include "common/text.h"

namespace wm::tools {
namespace {

constexpr double kGate = 0.9999;  // one good drive of ten thousand is left out
constexpr double kWidest = 9;     // filters' sigmas may be three times too small on a real floor; beyond is an error
constexpr size_t kSeeds = 5;      // drives that are tried as the first one: an outlying one is none of the others'
constexpr int kRounds = 30;       // of leaving out and taking in
constexpr double kFarOut = 2;     // times the gate: left out together, else the worst alone

struct Merge {
  std::vector<Measured> all;
  std::vector<Merged> landmarks;
  std::vector<bool> is_used, was_left_out;
  size_t reference = 0;
  FusedMap map;
  std::vector<size_t> used;  // in the order of map.chi2
  [[nodiscard]] int count() const { return static_cast<int>(landmarks.size()); }
};

double gate(int dof) { return chi2_quantile(kGate, dof); }

double widening(const std::vector<double> &ratios) {
  return ratios.empty() ? 1 : std::clamp(percentile(ratios, 50), 1.0, kWidest);
}

// How the others fit the map of one drive alone.
std::vector<Fit> fits_to(const Merge &m, size_t one) {
  const FusedMap map = alone(m.all[one], m.count());
  std::vector<Fit> out;
  for (const Measured &drive : m.all) out.push_back(fit(drive, map));
  return out;
}

double typical(const std::vector<Fit> &fits, size_t self) {
  std::vector<double> ratios;
  for (size_t k = 0; k < fits.size(); k++)
    if (k != self) ratios.push_back(fits[k].dof > 0 ? fits[k].chi2 / fits[k].dof : std::numeric_limits<double>::max());
  return percentile(ratios, 50);
}

// The drive that most others fit, of those with the most landmarks; the surveyed map where there is one.
size_t choose_reference(const Merge &m, bool is_surveyed, std::vector<Fit> *fits) {
  std::vector<size_t> order(m.all.size());
  for (size_t k = 0; k < order.size(); k++) order[k] = k;
  std::stable_sort(order.begin(), order.end(),
                   [&](size_t a, size_t b) { return m.all[a].landmark.size() > m.all[b].landmark.size(); });
  if (is_surveyed) order.assign(1, 0);
  size_t best = order.front();
  double best_ratio = 0;
  for (size_t i = 0; i < std::min(order.size(), kSeeds); i++) {
    const std::vector<Fit> tried = fits_to(m, order[i]);
    const double ratio = typical(tried, order[i]);
    if (i == 0 || ratio < best_ratio) best = order[i], best_ratio = ratio, *fits = tried;
  }
  return best;
}

void begin(const std::vector<Fit> &fits, Merge *m) {
  std::vector<double> ratios;
  for (size_t k = 0; k < fits.size(); k++)
    if (k != m->reference && fits[k].dof > 0) ratios.push_back(fits[k].chi2 / fits[k].dof);
  const double widened = widening(ratios);
  for (size_t k = 0; k < fits.size(); k++) {
    m->is_used[k] = k == m->reference || (fits[k].dof > 0 && fits[k].chi2 <= widened * gate(fits[k].dof));
    if (!m->all[k].is_fixed && m->is_used[k] && k != m->reference) m->all[k].frame = fits[k].frame;
  }
  m->all[m->reference].is_fixed = true;
}

void fuse_used(Merge *m) {
  std::vector<Measured *> drives;
  m->used.clear();
  for (size_t k = 0; k < m->all.size(); k++)
    if (m->is_used[k]) m->used.push_back(k), drives.push_back(&m->all[k]);
  m->map = fuse(drives, m->count());
}

double widening_of(const Merge &m) {
  std::vector<double> ratios;
  for (size_t i = 0; i < m.used.size(); i++)
    if (m.map.dof[i] > 0) ratios.push_back(m.map.chi2[i] / m.map.dof[i]);
  return widening(ratios);
}

// Leaves out what does not fit the others; false where all fit.
bool leave_out(double widened, Merge *m) {
  double worst = 1;
  for (size_t i = 0; i < m->used.size(); i++)
    if (m->map.dof[i] > 0) worst = std::max(worst, m->map.chi2[i] / (widened * gate(m->map.dof[i])));
  if (worst <= 1) return false;
  for (size_t i = 0; i < m->used.size(); i++) {
    const size_t k = m->used[i];
    const double ratio = m->map.dof[i] > 0 ? m->map.chi2[i] / (widened * gate(m->map.dof[i])) : 0;
    if (k != m->reference && (ratio > kFarOut || ratio == worst)) m->is_used[k] = false, m->was_left_out[k] = true;
  }
  return true;
}

bool take_in(double widened, Merge *m) {
  bool is_more = false;
  for (size_t k = 0; k < m->all.size(); k++) {
    if (m->is_used[k] || m->was_left_out[k]) continue;
    const Fit found = fit(m->all[k], m->map);
    if (found.dof == 0 || found.chi2 > widened * gate(found.dof)) continue;
    m->all[k].frame = found.frame;
    m->is_used[k] = is_more = true;
  }
  return is_more;
}

DriveVerdict verdict(const Merge &m, size_t k, double widened) {
  DriveVerdict out{m.all[k].map->name, m.is_used[k], static_cast<int>(m.all[k].landmark.size()), 0, 0, 0, ""};
  const Fit found = fit(m.all[k], m.map);
  out.shared = found.shared;
  out.chi2 = found.chi2, out.dof = found.dof;
  for (size_t i = 0; i < m.used.size(); i++)
    if (m.used[i] == k) out.chi2 = m.map.chi2[i], out.dof = m.map.dof[i];
  if (out.is_used) return out;
  if (found.dof == 0)
    out.why_not = text("shares %d landmarks with the others: it can't be laid over them", found.shared);
  else
    out.why_not = text(
        "does not fit the others: chi-square %.0f of %d, %.0f is allowed. Another building, a wrong "
        "calibration, or landmarks that were moved",
        out.chi2, out.dof, widened * gate(out.dof));
  return out;
}

void associate(const std::vector<const DriveMap *> &maps, const MergeOptions &options, Merge *m) {
  std::vector<KnownPlace> places;
  for (const DriveMap *map : maps) {
    m->all.push_back(measured(*map));
    Measured &drive = m->all.back();
    drive.is_fixed = options.one_frame;
    if (!options.by_place && map->has_identities) {
      associate_by_id(*map, &m->landmarks, &drive.landmark);
      if (places.empty()) places = places_known(*map, drive.landmark);
      continue;
    }
    associate_by_place(*map, &places, &m->landmarks, &drive.landmark);
  }
}

}  // namespace

MergeResult merge_maps(const std::vector<DriveMap> &drives, const DriveMap *surveyed, const MergeOptions &options,
                       const std::function<void(const std::string &)> &progress) {
  std::vector<const DriveMap *> maps;
  if (surveyed != nullptr) maps.push_back(surveyed);
  for (const DriveMap &drive : drives) maps.push_back(&drive);
  Merge m;
  associate(maps, options, &m);
  m.is_used.assign(maps.size(), false);
  m.was_left_out = m.is_used;
  std::vector<Fit> fits;
  m.reference = choose_reference(m, surveyed != nullptr, &fits);
  begin(fits, &m);
  double widened = 1;
  for (int round = 1; round <= kRounds; round++) {
    fuse_used(&m);
    widened = widening_of(m);
    progress(text("round %d: %zu of %zu drives fit, chi-square %.2f of what they expect", round, m.used.size(),
                  m.all.size(), widened));
    if (leave_out(widened, &m)) continue;
    if (!take_in(widened, &m)) break;
  }
  MergeResult out{m.landmarks, m.map, widened, {}};
  for (size_t k = 0; k < m.all.size(); k++) out.drives.push_back(verdict(m, k, widened));
  if (m.used.size() < 2 && m.all.size() > 1)
    throw Failure("no two of the drives fit each other: " + out.drives.back().name + ": " + out.drives.back().why_not);
  for (const size_t k : m.used)
    for (size_t j = 0; j < m.all[k].landmark.size(); j++) {
      Merged &one = out.landmarks[static_cast<size_t>(m.all[k].landmark[j])];
      const DriveMap::Landmark &l = m.all[k].map->landmarks[j];
      one.z_sum_m += l.seen * l.z_m, one.z_weight += l.seen;
      one.drives++;
    }
  out.map.covariance *= widened;
  return out;
}

}  // namespace wm::tools
