// SPDX-License-Identifier: Apache-2.0
#include "suggest/search.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "common/failure.h"
#include "rt/forked.h"

namespace wm::suggest {
namespace {

// Nats an update. Smaller gains of the search are noise of a few hundred updates.
constexpr double kSearchGain = 5e-4;
// A change pays where it gains so much on blocks that the search has not seen, and so many standard errors.
constexpr double kChoiceGain = 1e-3, kChoiceSigmas = 1.5;
// All changes together: a difference below one per cent of the likelihood is too small to matter.
constexpr double kPromiseGain = 0.01, kPromiseSigmas = 2;
// Innovations may grow by so much at most, after gaps and before: they measure the error of the position. Less is noise
// of some hundred updates.
constexpr double kWorseRms = 1.03;
// Mean normalised difference squared of the halves, of three degrees of freedom. Half of these: both halves share the
// motion, which makes the difference small.
constexpr double kHalvesMost = 1.5;
// Shares of the way that are tried where the halves differ by more, the largest first.
constexpr double kShares[] = {1, 0.85, 0.7, 0.55, 0.4, 0.25};
// Factors of the pattern search, one after the other.
constexpr double kFactors[] = {3, 1.73, 1.32};
constexpr int kRoundsMost = 12;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

constexpr Splits kOnSearch = {true, false, false}, kOnChoice = {false, true, false}, kOnPromise = {false, false, true};

struct Sums {
  double log_sum = 0, count = 0;
};

Figure channel_gain(const Score &before, const Score &after, Channel channel, const Splits &splits, Sums &sums) {
  double count = 0, sum = 0, squares = 0, blocks = 0;
  for (size_t b = 0; b < kBlocks; b++) {
    const Likelihood &from = before.blocks[channel][b], &to = after.blocks[channel][b];
    if (!splits[b % kSplits] || from.count == 0) continue;
    count += from.count;
    sum += to.log_sum - from.log_sum;
    blocks++;
  }
  sums = {sum, count};
  if (count == 0) return {};
  const double mean = sum / count;
  for (size_t b = 0; b < kBlocks; b++) {
    const Likelihood &from = before.blocks[channel][b], &to = after.blocks[channel][b];
    if (!splits[b % kSplits] || from.count == 0) continue;
    squares += std::pow(to.log_sum - from.log_sum - mean * from.count, 2);
  }
  return {mean, blocks > 1 ? std::sqrt(squares * blocks / (blocks - 1)) / count : kInfinity};
}

struct Job {
  const Drive &drive;
  const std::vector<Parameter> &parameters;
  const std::vector<std::vector<double>> &sets;
  bool with_halves;
  const std::function<void()> &done;
};

void run_job(void *context, size_t index, void *result) {
  const Job &job = *static_cast<Job *>(context);
  for (size_t p = 0; p < job.parameters.size(); p++) *job.parameters[p].value = job.sets[index][p];
  *static_cast<Score *>(result) = job.drive.score(job.with_halves);
}

void end_job(void *context) {
  const Job &job = *static_cast<Job *>(context);
  if (job.done) job.done();
}

// Largest growth of the innovations after gaps, and before them where there are none.
double growth_of(const Score &before, const Score &after, const Splits &splits) {
  double worst = 0;
  for (const Channel channel : {kNext, kAfterGap}) {
    const std::vector<Residual> from = residuals_of(before, channel, splits), to = residuals_of(after, channel, splits);
    double log_growth = 0, count = 0;
    for (const Residual &a : from)
      for (const Residual &b : to) {
        if (a.source != b.source || a.residual != b.residual || a.rms <= 0 || b.rms <= 0) continue;
        log_growth += a.count * std::log(b.rms / a.rms);
        count += a.count;
      }
    if (count > 0) worst = std::max(worst, std::exp(log_growth / count));
  }
  return worst;
}

class Search {
 public:
  Search(const Drive &drive, const std::vector<Parameter> &parameters, const SearchOptions &options)
      : drive_(drive), parameters_(parameters), options_(options), begin_(std::chrono::steady_clock::now()) {
    for (const Parameter &p : parameters) now_.push_back(p.now);
    at_ = now_;
    planned_ = parameters.size() * 8 + 30;
  }

  Suggestion run() {
    Suggestion out;
    start_ = score(now_);
    if (!start_.is_valid) throw tools::Failure("the estimator can't start with this run's parameters", tools::kUsage);
    climb();
    const bool found = at_ != now_;
    choose();
    out.before = start_;
    const bool chosen = at_ != now_;
    if (chosen) keep_consistent(out);
    if (found && !chosen)
      out.withdrawn = "what the search found gains nothing in parts of the drive that it did not see";
    if (at_ != now_) promise(out);
    out.values = at_;
    out.after = score(at_);
    for (size_t p = 0; p < at_.size(); p++)
      if (at_[p] != now_[p]) out.changes.push_back({p, at_[p], gain_of(score(reverted(p)), out.after, kOnPromise)});
    out.promise = gain_of(out.before, out.after, kOnPromise);
    out.drives = drives_;
    out.is_cut = is_cut_;
    return out;
  }

 private:
  using Values = std::vector<double>;

  bool over() {
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin_;
    if (took.count() > 60 * options_.minutes) is_cut_ = true;
    return is_cut_;
  }

  // Scores that are not there yet, at once.
  void need(const std::vector<Values> &sets) {
    std::vector<Values> missing;
    for (const Values &set : sets)
      if (!scores_.contains(set) && std::find(missing.begin(), missing.end(), set) == missing.end())
        missing.push_back(set);
    const std::vector<Score> found = scores_of(drive_, parameters_, missing, false, [this] { one_done(); });
    for (size_t i = 0; i < missing.size(); i++) scores_[missing[i]] = found[i];
  }

  void one_done() {
    drives_++;
    planned_ = std::max(planned_, drives_ + 5);
    if (options_.progress) options_.progress(static_cast<double>(drives_) / static_cast<double>(planned_), phase_);
  }

  const Score &score(const Values &set) {
    need({set});
    return scores_.at(set);
  }

  [[nodiscard]] Values with(size_t p, double value) const {
    Values out = at_;
    out[p] = value;
    return out;
  }
  [[nodiscard]] Values reverted(size_t p) const { return with(p, now_[p]); }

  [[nodiscard]] std::vector<size_t> changed() const {
    std::vector<size_t> out;
    for (size_t p = 0; p < at_.size(); p++)
      if (at_[p] != now_[p]) out.push_back(p);
    return out;
  }

  struct Step {
    size_t parameter;
    double value, gain;
  };

  // The best step of each parameter from here, best first. Parameters without any effect are left out from now on.
  std::vector<Step> steps(const std::vector<size_t> &active, const std::vector<size_t> &level, bool is_first) {
    std::vector<Values> sets;
    for (const size_t p : active)
      for (const double value : parameters_[p].trials(at_[p], kFactors[level[p]])) sets.push_back(with(p, value));
    need(sets);
    const Score &here = score(at_);
    std::vector<Step> out;
    for (const size_t p : active) {
      Step best{p, at_[p], -kInfinity};
      bool has_effect = false;
      for (const double value : parameters_[p].trials(at_[p], kFactors[level[p]])) {
        const Score &there = score(with(p, value));
        if (!there.is_valid) continue;
        const double gain = gain_of(here, there, kOnSearch).both.value;
        has_effect |= std::fabs(gain) > 1e-6;
        if (gain > best.gain) best = {p, value, gain};
      }
      if (is_first && !has_effect) dead_.push_back(p);
      out.push_back(best);
    }
    std::stable_sort(out.begin(), out.end(), [](const Step &a, const Step &b) { return a.gain > b.gain; });
    return out;
  }

  // Steps that gain are taken together, as many of the best as gain most.
  bool take(const std::vector<Step> &steps) {
    const auto good = static_cast<size_t>(
        std::count_if(steps.begin(), steps.end(), [](const Step &s) { return s.gain > kSearchGain; }));
    if (good == 0) return false;
    std::vector<Values> sets;
    Values set = at_;
    for (size_t i = 0; i < good; i++) {
      set[steps[i].parameter] = steps[i].value;
      if (i == 0 || i == 1 || i + 1 == good || i + 1 == (good + 1) / 2) sets.push_back(set);
    }
    need(sets);
    const Score here = score(at_);
    double most = kSearchGain;
    const Values from = at_;
    for (const Values &candidate : sets) {
      const Score &there = score(candidate);
      const double gain = there.is_valid ? gain_of(here, there, kOnSearch).both.value : -kInfinity;
      if (gain > most) {
        most = gain;
        at_ = candidate;
      }
    }
    return at_ != from;
  }

  // Pattern search [Hooke1961] over the logarithms, all parameters of a round at once.
  void climb() {
    phase_ = "search";
    std::vector<size_t> active(parameters_.size()), level(parameters_.size(), 0);
    for (size_t p = 0; p < active.size(); p++) active[p] = p;
    for (int round = 0; round < kRoundsMost && !active.empty() && !over(); round++) {
      const Values from = at_;
      const std::vector<Step> found = steps(active, level, round == 0);
      const bool moved = take(found);
      std::erase_if(active, [&](size_t p) { return std::find(dead_.begin(), dead_.end(), p) != dead_.end(); });
      for (const Step &step : found)  // a step that gains is tried again, at its size, until the others are taken
        if (at_[step.parameter] == from[step.parameter] && (!moved || step.gain <= kSearchGain))
          level[step.parameter]++;
      std::erase_if(active, [&](size_t p) { return level[p] >= std::size(kFactors); });
    }
  }

  // Changes that do not pay on the second split are taken back, the worst first.
  void choose() {
    phase_ = "choice";
    for (std::vector<size_t> all = changed(); !all.empty(); all = changed()) {
      std::vector<Values> sets{at_};
      for (const size_t p : all) sets.push_back(reverted(p));
      need(sets);
      double worst = 0;
      size_t which = SIZE_MAX;
      for (const size_t p : all) {
        const Gain gain = gain_of(score(reverted(p)), score(at_), kOnChoice);
        const double spare = std::min(gain.both.value - std::max(kChoiceGain, kChoiceSigmas * gain.both.sigma),
                                      gain.has_gap ? gain.of[kAfterGap].value + gain.of[kAfterGap].sigma : kInfinity);
        if (spare >= worst) continue;
        worst = spare;
        which = p;
      }
      if (which == SIZE_MAX) which = grows(all);
      if (which == SIZE_MAX) return;
      at_ = reverted(which);
    }
  }

  // The change without which the innovations shrink most, where they have grown.
  size_t grows(const std::vector<size_t> &all) {
    if (growth_of(start_, score(at_), kOnChoice) <= kWorseRms) return SIZE_MAX;
    size_t which = all.front();
    double least = kInfinity;
    for (const size_t p : all) {
      const double growth = growth_of(start_, score(reverted(p)), kOnChoice);
      if (growth >= least) continue;
      least = growth;
      which = p;
    }
    return which;
  }

  // Likelihood does not see errors that last: fewer of them are found where half of the landmarks contradict the other
  // half. As much of the way is kept as leaves the two in agreement, or as much as it was.
  void keep_consistent(Suggestion &out) {
    phase_ = "consistency";
    std::vector<Values> sets{now_};
    for (const double share : kShares) {
      Values set = now_;
      for (size_t p = 0; p < set.size(); p++)
        if (at_[p] != now_[p]) set[p] = parameters_[p].between(at_[p], share);
      sets.push_back(set);
    }
    const std::vector<Score> all = scores_of(drive_, parameters_, sets, true, [this] { one_done(); });
    const auto mean = [](const Score &of) { return of.halves.nees_sum / std::max(1.0, of.halves.count); };
    const double most = std::max(kHalvesMost, mean(all[0]));
    at_ = now_;
    out.share = 0;
    for (size_t i = 1; i < sets.size() && out.share == 0; i++) {
      if (!all[i].is_valid || mean(all[i]) > most || all[i].halves.count < 0.9 * all[0].halves.count) continue;
      at_ = sets[i];
      out.share = kShares[i - 1];
      out.halves_before = mean(all[0]);
      out.halves_after = mean(all[i]);
    }
    if (out.share == 0)
      out.withdrawn = "poses from one half of the landmarks would contradict those from the other half";
  }

  // The third split decides about all of them together.
  void promise(Suggestion &out) {
    const Gain gain = gain_of(start_, score(at_), kOnPromise);
    const double growth = growth_of(start_, score(at_), kOnPromise);
    if (gain.both.value < std::max(kPromiseGain, kPromiseSigmas * gain.both.sigma))
      out.withdrawn = "the gain on parts of the drive that were kept for its proof is too small or by chance";
    else if (gain.has_gap && gain.of[kAfterGap].value < -gain.of[kAfterGap].sigma)
      out.withdrawn = "poses after gaps of the observations would be less honest";
    else if (growth > kWorseRms)
      out.withdrawn = "innovations would grow";
    if (!out.withdrawn.empty()) at_ = now_;
  }

  const Drive &drive_;
  const std::vector<Parameter> &parameters_;
  const SearchOptions &options_;
  std::chrono::steady_clock::time_point begin_;
  Values now_, at_;
  Score start_;
  std::map<Values, Score> scores_;
  std::vector<size_t> dead_;
  size_t drives_ = 0, planned_ = 0;
  bool is_cut_ = false;
  std::string phase_;
};

}  // namespace

Gain gain_of(const Score &before, const Score &after, const Splits &splits) {
  Gain out;
  Sums next, gap;
  out.of[kNext] = channel_gain(before, after, kNext, splits, next);
  out.of[kAfterGap] = channel_gain(before, after, kAfterGap, splits, gap);
  out.has_gap = gap.count > 0;
  out.both = out.of[kNext];
  if (!out.has_gap) return out;
  out.both.value = 0.5 * (out.of[kNext].value + out.of[kAfterGap].value);
  out.both.sigma = 0.5 * (out.of[kNext].sigma + out.of[kAfterGap].sigma);  // correlated: not by squares
  return out;
}

std::vector<Residual> residuals_of(const Score &score, Channel channel, const Splits &splits) {
  std::vector<Residual> out;
  for (size_t s = 0; s < WM_SOURCES_MAX; s++)
    for (size_t r = 0; r < WM_RESIDUAL_COUNT; r++) {
      Fit sum;
      for (size_t k = 0; k < kSplits; k++) {
        if (!splits[k]) continue;
        const Fit &fit = score.fits[k][channel][s][r];
        sum.count += fit.count;
        sum.refused += fit.refused;
        sum.nis_sum += fit.nis_sum;
        sum.square_sum += fit.square_sum;
      }
      if (sum.count == 0) continue;
      out.push_back({static_cast<uint16_t>(s), static_cast<uint8_t>(r), sum.count,
                     std::sqrt(sum.square_sum / sum.count), sum.refused / sum.count,
                     sum.nis_sum / std::max(1.0, sum.count - sum.refused)});
    }
  return out;
}

std::vector<Score> scores_of(const Drive &drive, const std::vector<Parameter> &parameters,
                             const std::vector<std::vector<double>> &sets, bool with_halves,
                             const std::function<void()> &done) {
  std::vector<Score> out(sets.size());
  Job job{drive, parameters, sets, with_halves, done};
  const wm_forked work{&job, run_job, sizeof(Score), end_job};
  wm_forked_run(&work, sets.size(), out.data());
  return out;
}

Suggestion search(const Drive &drive, const std::vector<Parameter> &parameters, const SearchOptions &options) {
  return Search(drive, parameters, options).run();
}

}  // namespace wm::suggest
