// SPDX-License-Identifier: Apache-2.0
#include "eval/print.h"

#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

namespace wm::tools {
namespace {

// A number in at most 8 columns, "-" where there is none.
std::string cell(const Figures &f, const char *key, int decimals, const char *suffix = "") {
  if (!f.contains(key) || !f[key].is_number()) return "-";
  char text[48];
  std::snprintf(text, sizeof text, "%.*f%s", decimals, f[key].get<double>(), suffix);
  return text;
}

std::string row(const std::string &name, std::initializer_list<std::string> cells) {
  char text[32];
  std::snprintf(text, sizeof text, "  %-20s", name.c_str());
  std::string line = text;
  for (const std::string &value : cells) {
    std::snprintf(text, sizeof text, "%10s", value.c_str());
    line += text;
  }
  return line + "\n";
}

std::string percent(const Figures &f, const char *key) {
  if (!f.contains(key) || !f[key].is_number()) return "-";
  char text[32];
  std::snprintf(text, sizeof text, "%.1f %%", 100 * f[key].get<double>());
  return text;
}

}  // namespace

std::string figures_table(const Figures &f, const std::string &title, const std::string &against) {
  std::string out = title + " against " + against + ": " + cell(f, "distance_m", 1, " m") + " in " +
                    cell(f, "duration_s", 1, " s") + ", a pose at " + percent(f, "coverage") + " of the stamps\n\n";
  out += row("", {"mean", "|mean|", "std", "rms", "median", "p95", "max", "end"});
  out += row("position m",
             {cell(f, "position_mean_m", 4), "", "", cell(f, "position_rmse_m", 4), cell(f, "position_median_m", 4),
              cell(f, "position_p95_m", 4), cell(f, "position_max_m", 4), cell(f, "position_end_m", 4)});
  for (const std::string name : {"longitudinal", "lateral"})
    out += row(name + " m", {cell(f, (name + "_mean_m").c_str(), 4), cell(f, (name + "_mean_abs_m").c_str(), 4),
                             cell(f, (name + "_std_m").c_str(), 4), "", "", "", cell(f, (name + "_max_m").c_str(), 4)});
  out += row("heading deg", {cell(f, "heading_mean_deg", 3), cell(f, "heading_mean_abs_deg", 3), "",
                             cell(f, "heading_rmse_deg", 3), "", "", cell(f, "heading_max_deg", 3)});
  out += row("rotation deg", {"", "", "", cell(f, "rotation_rmse_deg", 3), "", "", cell(f, "rotation_max_deg", 3)});
  if (f.contains("truth_left_out") && f["truth_left_out"] > 0)
    out += "\n  left out: " + cell(f, "truth_left_out", 0) + " rows of " + against + ".csv without a position\n";
  out += "\n  end error " + cell(f, "position_end_percent", 3, " %") + " of the way; lost " + cell(f, "lost_count", 0) +
         " times, " + cell(f, "lost_s", 1, " s") + "\n";
  if (f["anees_dof"].is_number())
    out += "  consistency (NEES): inside the 95 % region at " + percent(f, "nees_inside_95") + " of the stamps, mean " +
           cell(f, "nees_mean", 2) + " (" + cell(f, "anees_dof", 0) + " expected); longest beyond 3.5 sigma " +
           cell(f, "beyond_3_5_sigma_longest_s", 1, " s") + "\n";
  if (f.contains("gnss_delay_s"))
    out += "  the receiver's positions are late by " + cell(f, "gnss_delay_s", 2, " s") +
           ", which is taken out here: rms of the nearest 80 % " + cell(f, "gnss_delay_rms_before_m", 3, " m") +
           " with, " + cell(f, "gnss_delay_rms_m", 3, " m") + " without\n";
  if (f["position_rmse_landmark_seen_m"].is_number())
    out += "  position rms where a landmark was seen within 2 s: " + cell(f, "position_rmse_landmark_seen_m", 4, " m") +
           "\n";
  if (f["landmarks_total"].is_number())
    out += "  landmarks: " + cell(f, "landmarks_found", 0) + " of " + cell(f, "landmarks_total", 0) +
           " found (matched by " + f["landmarks_matched_by"].get<std::string>() + "), rms " +
           cell(f, "landmark_rmse_m", 3, " m") + ", largest " + cell(f, "landmark_max_m", 3, " m") +
           ", map aligned to the true one " + cell(f, "landmark_rmse_own_fit_m", 3, " m") + ", heading " +
           cell(f, "landmark_heading_rmse_deg", 2, " deg") + "\n";
  if (f.contains("published"))
    out += "  published: " + cell(f, "published", 0) + " poses, t_ns " +
           (f["t_strictly_rising"].get<bool>() ? "rises strictly" : "DOES NOT ALWAYS RISE") + ", age p99 " +
           cell(f, "age_p99_ms", 2, " ms") + ", resets " + cell(f, "resets", 0) + ", jumps " + cell(f, "jumps", 0) +
           " (" + cell(f, "jumps_unannounced", 0) + " unannounced, largest " + cell(f, "jump_max_m", 3, " m") +
           "), largest odom step " + cell(f, "odom_step_max_m", 3, " m") + "\n";
  return out;
}

}  // namespace wm::tools
