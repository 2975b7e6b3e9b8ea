// SPDX-License-Identifier: Apache-2.0
#include "suggest/print.h"

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>

#include "waymark/pose.h"

namespace wm::suggest {
namespace {

constexpr Splits kAll = {true, true, true}, kPromiseAlone = {false, false, true};
// A state is not observable where its sigma keeps so much of its prior's; its prior is wrong beyond so many sigmas.
constexpr double kUnobserved = 0.95, kBeyondSigmas = 3;

__attribute__((format(printf, 2, 3))) void add(std::string &to, const char *format, ...) {
  char line[400];
  va_list arguments;
  va_start(arguments, format);
  (void)std::vsnprintf(line, sizeof line, format, arguments);
  va_end(arguments);
  to += line;
}

const char *unit_of(unsigned residual) {
  switch (residual) {
    case WM_RESIDUAL_BEARING:
    case WM_RESIDUAL_HEADING:
    case WM_RESIDUAL_ELEVATION: return "rad";
    case WM_RESIDUAL_PIXEL: return "px";
    default: return "m";
  }
}

struct Note {
  std::string state, text;
};

// States of the drive's end that a prior does not fit.
std::vector<Note> notes_of(const Score &score) {
  std::vector<Note> out;
  for (size_t i = 0; i < score.states; i++) {
    const wm_calibration_value &from = score.begin[i], &to = score.end[i];
    if (std::string(from.name) != to.name || !(from.sigma > 0) || !(to.sigma > 0)) continue;
    std::string text;
    const double moved = std::fabs(to.value - from.value);
    if (moved > kBeyondSigmas * from.sigma && moved > kBeyondSigmas * to.sigma)
      add(text, "ends at %.4g +- %.2g, %.1f of its prior's sigmas from %.4g: calibration.yaml should have this value",
          to.value, to.sigma, moved / from.sigma, from.value);
    else if (to.sigma > kUnobserved * from.sigma)
      add(text, "is not observable in this drive: its sigma stays at its prior's (%.2g); it may be off", from.sigma);
    if (!text.empty()) out.push_back({to.name, text});
  }
  return out;
}

void add_gain(std::string &out, const char *what, const Figure &gain) {
  add(out, "%-44s %6.3f times as likely  (%+.4f +- %.4f nats)\n", what, std::exp(gain.value), gain.value, gain.sigma);
}

void add_fits(std::string &out, const Occasion &occasion, const Score &before, const Score &after,
              const Splits &splits) {
  for (const Channel channel : {kNext, kAfterGap}) {
    const std::vector<Residual> from = residuals_of(before, channel, splits), to = residuals_of(after, channel, splits);
    if (from.empty()) continue;
    if (channel == kNext)
      add(out, "\n%-34s %17s %17s %17s\n", "innovations", "NIS (1 is right)", "root mean square", "refused, %");
    else
      add(out, "after %.1f s of motion alone\n", occasion.drive.gap_s());
    for (const Residual &a : from)
      for (const Residual &b : to) {
        if (a.source != b.source || a.residual != b.residual) continue;
        std::string name = occasion.drive.head().sources[a.source].name;
        name += std::string(" ") + wm_residual_name(a.residual) + ", " + unit_of(a.residual);
        add(out, "  %-32s %7.2f -> %6.2f %7.3g -> %6.3g %7.1f -> %6.1f\n", name.c_str(), a.nis, b.nis, a.rms, b.rms,
            100 * a.refused, 100 * b.refused);
      }
  }
}

void add_halves(std::string &out, double before, double after) {
  add(out,
      "two filters with half of the landmarks each: difference of the poses %.2f -> %.2f (below 3: no contradiction)\n",
      before, after);
}

double mean_of(const Halves &halves) { return halves.nees_sum / std::max(1.0, halves.count); }

nlohmann::json json_of(const Figure &figure) {
  return {{"nats", figure.value}, {"sigma", figure.sigma}, {"times_as_likely", std::exp(figure.value)}};
}

nlohmann::json json_of(const Gain &gain) {
  nlohmann::json out{{"both", json_of(gain.both)}, {"next", json_of(gain.of[kNext])}};
  if (gain.has_gap) out["after_gap"] = json_of(gain.of[kAfterGap]);
  return out;
}

nlohmann::json fits_json(const Occasion &occasion, const Score &before, const Score &after, const Splits &splits) {
  nlohmann::json out = nlohmann::json::array();
  for (const Channel channel : {kNext, kAfterGap})
    for (const Residual &a : residuals_of(before, channel, splits))
      for (const Residual &b : residuals_of(after, channel, splits))
        if (a.source == b.source && a.residual == b.residual)
          out.push_back({{"source", occasion.drive.head().sources[a.source].name},
                         {"residual", wm_residual_name(a.residual)},
                         {"after_gap", channel == kAfterGap},
                         {"nis", {a.nis, b.nis}},
                         {"rms", {a.rms, b.rms}},
                         {"refused", {a.refused, b.refused}}});
  return out;
}

nlohmann::json occasion_json(const Occasion &occasion) {
  return {{"config", occasion.config},
          {"recording", occasion.recording},
          {"estimator", occasion.estimator},
          {"scored_s", occasion.drive.scored_s()},
          {"gap_s", occasion.drive.gap_s()},
          {"updates", occasion.drive.updates(kNext)},
          {"updates_after_gaps", occasion.drive.updates(kAfterGap)}};
}

}  // namespace

std::string comment_of(const Parameter &parameter, const Change &change) {
  std::string out;
  add(out, "before: %g; gain of it alone %+.4f nats an update", parameter.now, change.gain.both.value);
  return out;
}

std::string head_of(const Occasion &occasion, const Suggestion &suggestion) {
  std::string out;
  add(out, "# Made by `waymark suggest` from %s\n# and %.0f s of %s (%zu updates), without truth.\n",
      occasion.config.c_str(), occasion.drive.scored_s(), occasion.recording.c_str(), occasion.drive.updates(kNext));
  const Gain &promise = suggestion.promise;
  add(out, "# Promise, measured on a third of the drive that was kept for it: each observation is %.3f times as likely",
      std::exp(promise.of[kNext].value));
  if (promise.has_gap)
    add(out, ",\n# and %.3f times after %.1f s of motion alone", std::exp(promise.of[kAfterGap].value),
        occasion.drive.gap_s());
  return out +
         ".\n# Try it on another drive before you keep it: waymark suggest CONFIG RECORDING --against THIS_FILE\n";
}

std::string text_of(const Occasion &occasion, const Suggestion &suggestion) {
  std::string out;
  add(out, "%s, %.1f s: %zu updates, and %zu after gaps of %.1f s; %zu drives\n", occasion.recording.c_str(),
      occasion.drive.scored_s(), occasion.drive.updates(kNext), occasion.drive.updates(kAfterGap),
      occasion.drive.gap_s(), suggestion.drives);
  if (suggestion.is_cut) out += "the time was over before the search had ended: --minutes gives it more\n";
  if (suggestion.changes.empty()) {
    out += "nothing to gain";
    if (!suggestion.withdrawn.empty()) out += ": " + suggestion.withdrawn;
    out += "\n";
  } else {
    add(out, "\n%-44s %10s %10s   %s\n", "parameter", "now", "suggested", "gain of it alone, nats an update");
    for (const Change &change : suggestion.changes) {
      const Parameter &p = occasion.parameters[change.parameter];
      add(out, "%-44s %10.4g %10.4g   %+.4f +- %.4f\n", p.name().c_str(), p.now, change.value, change.gain.both.value,
          change.gain.both.sigma);
    }
    out += "\nAll together, on a third of the drive that neither search nor choice has seen:\n";
    add_gain(out, "an observation, predicted from all before it", suggestion.promise.of[kNext]);
    if (suggestion.promise.has_gap)
      add_gain(out, "after a gap, predicted by motion alone", suggestion.promise.of[kAfterGap]);
  }
  add_fits(out, occasion, suggestion.before, suggestion.after, suggestion.changes.empty() ? kAll : kPromiseAlone);
  if (!suggestion.changes.empty()) add_halves(out, suggestion.halves_before, suggestion.halves_after);
  if (!suggestion.changes.empty() && suggestion.share < 1)
    add(out, "%.0f %% of the way to the largest likelihood: with more of it the halves would contradict each other\n",
        100 * suggestion.share);
  const std::vector<Note> notes = notes_of(suggestion.after);
  if (!notes.empty()) out += "\n";
  for (const Note &note : notes) add(out, "note  %s %s\n", note.state.c_str(), note.text.c_str());
  return out;
}

nlohmann::json json_of(const Occasion &occasion, const Suggestion &suggestion) {
  nlohmann::json out = occasion_json(occasion);
  out["drives"] = suggestion.drives;
  out["is_cut"] = suggestion.is_cut;
  out["withdrawn"] = suggestion.withdrawn;
  out["share"] = suggestion.share;
  out["halves"] = {suggestion.halves_before, suggestion.halves_after};
  out["changes"] = nlohmann::json::array();
  for (const Change &change : suggestion.changes) {
    const Parameter &p = occasion.parameters[change.parameter];
    out["changes"].push_back(
        {{"parameter", p.name()}, {"now", p.now}, {"suggested", change.value}, {"gain", json_of(change.gain)}});
  }
  out["promise"] = json_of(suggestion.promise);
  out["fits"] =
      fits_json(occasion, suggestion.before, suggestion.after, suggestion.changes.empty() ? kAll : kPromiseAlone);
  out["notes"] = nlohmann::json::array();
  for (const Note &note : notes_of(suggestion.after))
    out["notes"].push_back({{"state", note.state}, {"text", note.text}});
  return out;
}

std::string comparison_text(const Occasion &occasion, const std::string &other, const Score &before,
                            const Score &after) {
  std::string out;
  add(out, "%s, %.1f s: %s against %s\n", occasion.recording.c_str(), occasion.drive.scored_s(), other.c_str(),
      occasion.config.c_str());
  const Gain gain = gain_of(before, after, kAll);
  add_gain(out, "an observation, predicted from all before it", gain.of[kNext]);
  if (gain.has_gap) add_gain(out, "after a gap, predicted by motion alone", gain.of[kAfterGap]);
  add_fits(out, occasion, before, after, kAll);
  add_halves(out, mean_of(before.halves), mean_of(after.halves));
  return out;
}

nlohmann::json comparison_json(const Occasion &occasion, const Score &before, const Score &after) {
  nlohmann::json out = occasion_json(occasion);
  out["gain"] = json_of(gain_of(before, after, kAll));
  out["halves"] = {mean_of(before.halves), mean_of(after.halves)};
  out["fits"] = fits_json(occasion, before, after, kAll);
  return out;
}

}  // namespace wm::suggest
