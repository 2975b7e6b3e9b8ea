// SPDX-License-Identifier: Apache-2.0
#include "init/log_evidence.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <limits>
#include <map>
#include <optional>

#include "init/can_log.h"

namespace wm::init {
namespace {

constexpr double kBin_s = 0.2;           // values are compared as means over this; a frame comes every 10 to 100 ms
constexpr size_t kBinsMax = 500'000;     // 28 hours
constexpr double kMoves_r = 0.8;         // two measurements of one motion correlate above this
constexpr double kContradicts_r = 0.3;   // below this they are not of one motion
constexpr double kTurns_r = 0.5;         // of turn rates, which are small against their steps and noise
constexpr double kSlopeOff = 0.15;       // relative: wheels' radii and speedometers are a few per cent off
constexpr double kMovedLeast_mps = 0.5;  // standard deviation of a speed, from which on its slope is worth something
constexpr double kTurnedLeast_radps = 0.02;  // the same of a turn rate

// Means over bins of kBin_s; kNone: no sample.
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
using Series = std::vector<double>;

struct Samples {
  Series sum, weight;
  uint64_t frames = 0;
  std::optional<uint64_t> first_raw, last_raw;
  bool moves = false;
  double unwrapped = 0;  // of counts
  double last_gear = 0;
  bool has_gear = false, gear_known = false;
};

std::string text(const char *format, double a, double b = 0) __attribute__((format(printf, 1, 0)));
std::string text(const char *format, double a, double b) {
  char out[160];
  std::snprintf(out, sizeof out, format, a, b);
  return out;
}

bool is_ticks(unsigned q) { return q == WM_Q_WHEEL_TICKS_LEFT || q == WM_Q_WHEEL_TICKS_RIGHT; }
bool is_speed(unsigned q) { return q >= WM_Q_WHEEL_SPEED_FRONT_LEFT && q <= WM_Q_VEHICLE_SPEED; }

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Correlation, slope of b over a (total least squares would need both noises; the regression of b on a suffices for a
// factor), and the standard deviation of a, over bins that both have.
struct Agreement {
  double r = 0, slope = 0, sigma_a = 0, sigma_b = 0;
  size_t bins = 0;
};
Agreement agree(const Series &a, const Series &b) {
  Agreement out;
  double sa = 0, sb = 0, saa = 0, sbb = 0, sab = 0;
  for (size_t i = 0; i < std::min(a.size(), b.size()); i++) {
    if (std::isnan(a[i]) || std::isnan(b[i])) continue;
    out.bins++;
    sa += a[i];
    sb += b[i];
  }
  if (out.bins < 10) return out;
  const auto n = static_cast<double>(out.bins);
  for (size_t i = 0; i < std::min(a.size(), b.size()); i++) {
    if (std::isnan(a[i]) || std::isnan(b[i])) continue;
    const double da = a[i] - sa / n, db = b[i] - sb / n;
    saa += da * da;
    sbb += db * db;
    sab += da * db;
  }
  out.sigma_a = std::sqrt(saa / n);
  out.sigma_b = std::sqrt(sbb / n);
  if (saa > 0 && sbb > 0) {
    out.r = sab / std::sqrt(saa * sbb);
    out.slope = sab / saa;
  }
  return out;
}

Series combined(const Series &a, const Series &b, double of_a, double of_b) {
  Series out(std::min(a.size(), b.size()));
  for (size_t i = 0; i < out.size(); i++) out[i] = of_a * a[i] + of_b * b[i];
  return out;
}

class Weigher {
 public:
  Weigher(const Dbc &dbc, std::vector<Candidate> &candidates) : dbc_(dbc), all_(candidates) {
    for (const Candidate &one : all_) {
      const wm_can_match &match = dbc_.signals[one.signal].match;
      auto place = std::find_if(bound_.begin(), bound_.end(), [&](const Bound &b) {
        return b.match.id == match.id && b.match.is_extended == match.is_extended;
      });
      if (place == bound_.end()) place = bound_.insert(place, Bound{match, "", {}});
      std::vector<size_t> &list = place->signals;
      if (std::find(list.begin(), list.end(), one.signal) == list.end()) list.push_back(one.signal);
    }
  }

  LogFacts weigh(const std::filesystem::path &log) {
    read(log);
    presence();
    for (Candidate &one : all_) series_of(one);
    speeds();
    ticks();
    turns();
    gears();
    return facts_;
  }

 private:
  struct Bound {
    wm_can_match match;
    std::string sender;  // bus and J1939 source address of the first frame; others are passed over
    std::vector<size_t> signals;
  };

  void read(const std::filesystem::path &path) {
    survey_ = survey_log(path);
    facts_.notes = each_frame(path, facts_.malformed, [&](const wm_can_frame &frame) {
      if (facts_.frames++ == 0) start_ns_ = frame.t_ns;
      take(frame);
    });
  }

  void take(const wm_can_frame &frame) {
    const double t_s = static_cast<double>(frame.t_ns - start_ns_) * 1e-9;
    if (t_s < 0 || t_s / kBin_s >= static_cast<double>(kBinsMax)) return;
    facts_.seconds = std::max(facts_.seconds, t_s);
    for (Bound &one : bound_) {
      if (!wm_can_matches(&one.match, frame.id, frame.is_extended)) continue;
      const std::string sender = frame.iface + (":" + std::to_string(frame.id & 0xFFU));
      if (one.sender.empty()) one.sender = sender;
      if (one.sender != sender) continue;
      for (const size_t signal : one.signals) {
        double value = 0;
        uint64_t raw = 0;
        if (init_signal_value(dbc_.file.get(), signal, &frame, &value, &raw) == 0) continue;
        sample(samples_[signal], dbc_.signals[signal], signal, static_cast<size_t>(t_s / kBin_s), value, raw);
      }
    }
  }

  void sample(Samples &s, const init_signal &signal, size_t index, size_t bin, double value, uint64_t raw) {
    s.frames++;
    if (!s.first_raw) s.first_raw = raw;
    s.moves |= raw != *s.first_raw;
    if (s.last_raw && signal.bits < 64) {  // the shorter way round, as the decoder goes on
      const double cycle = std::ldexp(1.0, static_cast<int>(signal.bits));
      double step = static_cast<double>(raw) - static_cast<double>(*s.last_raw);
      step -= cycle * std::round(step / cycle);
      s.unwrapped += step;
    }
    s.last_raw = raw;
    s.has_gear = true;
    s.gear_known |= init_signal_gear(dbc_.file.get(), index, raw, &s.last_gear) != 0;
    if (s.sum.size() <= bin) {
      s.sum.resize(bin + 1, 0);
      s.weight.resize(bin + 1, 0);
      counts_[index].resize(bin + 1, kNone);
    }
    s.sum[bin] += value;
    s.weight[bin] += 1;
    counts_[index][bin] = s.unwrapped;
  }

  // What the log has in the place of a message: the id with its other width, or of the same PGN.
  [[nodiscard]] std::string instead(const wm_can_match &match) const {
    const wm_can_seen *near = wm_can_survey_nearest(survey_.get(), match.id, match.is_extended);
    if (near == nullptr) return "";
    return ", but " + std::to_string(near->frames) + " of " + id_text(near->id, near->is_extended != 0) +
           (near->is_extended != 0 ? " (29 bits)" : " (11 bits)");
  }

  // Absent and constant signals.
  void presence() {
    for (Candidate &one : all_) {
      if (one.refused.starts_with("it does not fit")) continue;
      const auto place = samples_.find(one.signal);
      if (place == samples_.end()) {
        one.refused = "no frame of it is in the log" + instead(dbc_.signals[one.signal].match);
        continue;
      }
      const Samples &s = place->second;
      const double hz = facts_.seconds > 0 ? static_cast<double>(s.frames) / facts_.seconds : 0;
      one.reasons.push_back(text("%.3g frames/s in the log", hz));
      one.score += 1 + (hz >= 9 ? 0.5 : 0);  // slower than 10 Hz is for a display
      const bool place_or_gear = one.quantity == WM_Q_GEAR || one.quantity >= WM_CAN_LATITUDE;
      if (!s.moves && !place_or_gear) one.refused = "it is constant in the log";
    }
  }

  // In SI, by the DBC's unit; of counts ticks/s.
  void series_of(const Candidate &one) {
    const auto place = samples_.find(one.signal);
    if (place == samples_.end()) return;
    Series &out = series_[one.signal];
    if (is_ticks(one.quantity)) {
      const Series &counts = counts_[one.signal];
      out.assign(counts.size(), kNone);
      for (size_t i = 1; i < counts.size(); i++) out[i] = (counts[i] - counts[i - 1]) / kBin_s;
      return;
    }
    const Samples &s = place->second;
    out.assign(s.sum.size(), kNone);
    for (size_t i = 0; i < out.size(); i++)
      if (s.weight[i] > 0) out[i] = s.sum[i] / s.weight[i] * dbc_.signals[one.signal].si;
  }

  [[nodiscard]] Candidate *best(unsigned quantity) {
    Candidate *out = nullptr;
    for (Candidate &one : all_)
      if (one.quantity == quantity && one.refused.empty() && (out == nullptr || one.score > out->score)) out = &one;
    return out;
  }
  [[nodiscard]] const Series &series(const Candidate &one) { return series_[one.signal]; }

  // The median of the best wheel speeds (else of all speeds with a unit), per bin: what most have is right.
  Series reference_speed(const Candidate *without) {
    std::vector<const Series *> parts;
    for (unsigned q = WM_Q_WHEEL_SPEED_FRONT_LEFT; q <= WM_Q_VEHICLE_SPEED; q++) {
      const Candidate *one = best(q);
      if (one != nullptr && one != without) parts.push_back(&series(*one));
    }
    Series out;
    if (parts.empty()) return out;
    for (const Series *part : parts) out.resize(std::max(out.size(), part->size()), kNone);
    for (size_t i = 0; i < out.size(); i++) {
      std::vector<double> here;
      for (const Series *part : parts)
        if (i < part->size() && !std::isnan((*part)[i])) here.push_back((*part)[i]);
      if (!here.empty()) out[i] = median(here);
    }
    return out;
  }

  void speeds() {
    for (Candidate &one : all_) {
      if (!is_speed(one.quantity)) continue;
      const bool no_unit = one.refused == "it has no unit";
      if (!one.refused.empty() && !no_unit) continue;
      const Agreement with = agree(reference_speed(&one), series(one));
      if (with.bins == 0 || with.sigma_a < kMovedLeast_mps) continue;  // nothing to compare with
      if (std::abs(with.r) < kMoves_r && one.quantity == WM_Q_VEHICLE_SPEED && with.r > kContradicts_r) one.score -= 2;
      if (std::abs(with.r) < kContradicts_r) {
        one.refused = text("it does not move with the other speeds (correlation %.2f)", with.r);
        continue;
      }
      one.reasons.push_back(text("correlation with the other speeds %.3f, %.3g times as large", with.r, with.slope));
      one.score += std::abs(with.r);
      if (with.r < -kMoves_r) {
        one.scale = -1;
        one.reasons.emplace_back("of the other sign");
      }
      unit_by_slope(one, std::abs(with.slope), no_unit, with.r);
    }
  }

  // The unit with which the speed is as large as the others.
  static void unit_by_slope(Candidate &one, double slope, bool no_unit, double r) {
    static const std::pair<const char *, double> kUnits[] = {
        {"m/s", 1}, {"km/h", 3.6}, {"mph", 1 / 0.44704}, {"cm/s", 100}, {"mm/s", 1000}};
    if (!no_unit || std::abs(r) < kMoves_r) return;
    for (const auto &[unit, size] : kUnits)
      if (std::abs(slope / size - 1) < kSlopeOff) {
        one.unit = unit;
        one.refused.clear();
        one.reasons.push_back("the unit by the other speeds");
        return;
      }
  }

  void ticks() {
    Candidate *left = best(WM_Q_WHEEL_TICKS_LEFT), *right = best(WM_Q_WHEEL_TICKS_RIGHT);
    if (left == nullptr || right == nullptr) return;
    const Agreement both = agree(series(*left), series(*right));
    const std::string reason = text("the two wheels' counts correlate by %.3f", both.r);
    left->reasons.push_back(reason);
    right->reasons.push_back(reason);
    if (both.r < -kMoves_r) {
      right->scale = -1;
      right->reasons.emplace_back("the motors are mirrored: one of both counts backwards; check which");
    }
  }

  // Right wheel minus left one, m/s: positive in a turn to the left.
  Series wheel_difference() {
    const std::pair<unsigned, unsigned> kPairs[] = {{WM_Q_WHEEL_SPEED_REAR_LEFT, WM_Q_WHEEL_SPEED_REAR_RIGHT},
                                                    {WM_Q_WHEEL_SPEED_FRONT_LEFT, WM_Q_WHEEL_SPEED_FRONT_RIGHT},
                                                    {WM_Q_WHEEL_TICKS_LEFT, WM_Q_WHEEL_TICKS_RIGHT}};
    for (const auto &[l, r] : kPairs) {
      const Candidate *left = best(l), *right = best(r);
      if (left == nullptr || right == nullptr) continue;
      difference_is_ticks_ = is_ticks(l);
      return combined(series(*right), series(*left), right->scale, -left->scale);
    }
    return {};
  }

  void turns() {
    const Series difference = wheel_difference(), speed = reference_speed(nullptr);
    for (Candidate &one : all_) {
      if (!one.refused.empty()) continue;
      Series own = series(one);
      if (one.quantity == WM_Q_STEERING_WHEEL || one.quantity == WM_Q_ROAD_WHEEL) {
        for (size_t i = 0; i < own.size(); i++) own[i] *= i < speed.size() ? speed[i] : kNone;
      } else if (one.quantity != WM_Q_YAW_RATE) {
        continue;
      }
      const Agreement with = agree(difference, own);
      if (with.bins == 0) continue;
      if (std::abs(with.r) < kTurns_r) {
        one.reasons.push_back(
            text("the log has too few turns to check its sign (correlation with the wheels' difference %.2f)", with.r));
        continue;
      }
      one.reasons.push_back(text("correlation with right minus left wheel %.3f", with.r));
      one.score += std::abs(with.r);
      if (with.r < 0) {
        one.scale = -1;
        one.reasons.emplace_back("positive to the right: turned round");
      }
      if (one.quantity == WM_Q_YAW_RATE && !difference_is_ticks_ && with.sigma_b > kTurnedLeast_radps)
        facts_.track_m =
            with.r * with.r / std::abs(with.slope);  // inverse regression: the difference is the noisier one
    }
  }

  void gears() {
    for (Candidate &one : all_) {
      if (one.quantity != WM_Q_GEAR || !one.refused.empty()) continue;
      const Samples &s = samples_[one.signal];
      if (!s.gear_known)
        one.refused = "none of its values in the log has a gear's name";
      else if (!s.moves && !(s.last_gear > 0))
        one.refused = "it is constant in the log, and not a gear that drives";
      else if (!s.moves)
        one.reasons.emplace_back("forwards all the time in the log");
    }
  }

  const Dbc &dbc_;
  std::vector<Candidate> &all_;
  std::vector<Bound> bound_;
  std::unique_ptr<wm_can_survey> survey_;
  std::map<size_t, Samples> samples_;
  std::map<size_t, Series> counts_, series_;
  LogFacts facts_;
  int64_t start_ns_ = 0;
  bool difference_is_ticks_ = false;
};

}  // namespace

LogFacts weigh_by_log(const Dbc &dbc, const std::filesystem::path &log, std::vector<Candidate> &candidates) {
  LogFacts out = Weigher(dbc, candidates).weigh(log);
  std::stable_sort(candidates.begin(), candidates.end(), [](const Candidate &a, const Candidate &b) {
    return a.quantity != b.quantity ? a.quantity < b.quantity : a.score > b.score;
  });
  return out;
}

}  // namespace wm::init
