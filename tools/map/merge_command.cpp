// SPDX-License-Identifier: Apache-2.0
#include "map/merge_command.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "common/failure.h"
#include "common/program.h"
#include "common/text.h"
#include "map/npy.h"
#include "map/site.h"
#include "map/versions.h"
#include "output/replace_file.h"

namespace wm::tools {
namespace {

namespace fs = std::filesystem;
constexpr double kTold_s = 1;  // between two lines of progress

// Lines on the standard error, also on a pipe, once the work takes longer.
class Progress {
 public:
  void tell(const std::string &line) {
    const auto now = std::chrono::steady_clock::now();
    if (std::chrono::duration<double>(now - told_).count() < kTold_s) return;
    told_ = now;
    std::fprintf(stderr, "merge: %s\n", line.c_str());
  }

 private:
  std::chrono::steady_clock::time_point told_ = std::chrono::steady_clock::now();
};

void write(const fs::path &path, const std::string &bytes) {
  wm_error error{};
  const file_part part{bytes.data(), bytes.size()};
  need_ok(replace_file(path.c_str(), &part, 1, &error), error);
}

// Drives whose map can't be read are named with the others that are left out.
std::vector<DriveMap> read_all(const std::vector<std::string> &names, Progress *progress,
                               std::vector<DriveVerdict> *unread) {
  std::vector<DriveMap> out;
  for (const std::string &name : names) {
    try {
      out.push_back(read_drive_map(name));
    } catch (const Failure &failure) {
      if (names.size() == 1) throw;
      unread->push_back({name, false, 0, 0, 0, 0, failure.what()});
    }
    progress->tell(text("%zu of %zu maps read", out.size() + unread->size(), names.size()));
  }
  if (out.empty()) throw Failure("no drive's map can be read: " + unread->front().why_not);
  return out;
}

// Merged landmarks that are in the map, by their ids.
std::vector<size_t> in_order(const MergeResult &result) {
  std::vector<size_t> out;
  for (size_t l = 0; l < result.landmarks.size(); l++)
    if (result.map.has(static_cast<int>(l))) out.push_back(l);
  std::sort(out.begin(), out.end(),
            [&](size_t a, size_t b) { return result.landmarks[a].id < result.landmarks[b].id; });
  return out;
}

std::string csv_of(const MergeResult &result) {
  std::string out = "id,x_m,y_m,z_m,sigma_m,cov_xx,cov_xy,cov_yy,yaw_rad,cov_tt\n";
  for (const size_t l : in_order(result)) {
    const Merged &one = result.landmarks[l];
    const int x = result.map.x_at[l], heading = result.map.heading_at[l];
    const Eigen::Matrix2d c = result.map.covariance.block<2, 2>(x, x);
    const double larger = 0.5 * (c(0, 0) + c(1, 1)) + std::hypot(0.5 * (c(0, 0) - c(1, 1)), c(0, 1));
    out += text("%lld,%.9g,%.9g,%.9g,%.6g,%.9g,%.9g,%.9g,", static_cast<long long>(one.id), result.map.mean[x],
                result.map.mean[x + 1], one.z_weight > 0 ? one.z_sum_m / one.z_weight : 0.0, std::sqrt(larger), c(0, 0),
                c(0, 1), c(1, 1));
    if (heading >= 0)
      out += text("%.9g,%.9g", std::remainder(result.map.mean[heading], 2 * 3.14159265358979323846),
                  result.map.covariance(heading, heading));
    else
      out += ",";
    out += "\n";
  }
  return out;
}

// In the order of landmarks.csv: x, y and, where it has one, yaw of each landmark.
std::string covariance_of(const MergeResult &result) {
  std::vector<int> states;
  for (const size_t l : in_order(result)) {
    states.insert(states.end(), {result.map.x_at[l], result.map.x_at[l] + 1});
    if (result.map.heading_at[l] >= 0) states.push_back(result.map.heading_at[l]);
  }
  return npy_of(states.size(), [&](size_t i, size_t j) { return result.map.covariance(states[i], states[j]); });
}

nlohmann::ordered_json json_of(const MergeResult &result) {
  nlohmann::ordered_json out;
  out["landmarks"] = in_order(result).size();
  out["covariance_widened"] = result.widened;
  out["drives"] = nlohmann::ordered_json::array();
  for (const DriveVerdict &d : result.drives)
    out["drives"].push_back({{"name", d.name},
                             {"used", d.is_used},
                             {"landmarks", d.landmarks},
                             {"shared", d.shared},
                             {"chi2", d.chi2},
                             {"dof", d.dof},
                             {"why_not", d.why_not}});
  return out;
}

void print(const MergeResult &result) {
  std::printf("%-40s %9s %6s %11s\n", "drive", "landmarks", "shared", "chi2 / dof");
  size_t used = 0;
  for (const DriveVerdict &d : result.drives) {
    std::printf("%-40s %9d %6d %11.2f%s\n", d.name.c_str(), d.landmarks, d.shared, d.dof > 0 ? d.chi2 / d.dof : 0.0,
                d.is_used ? "" : "  LEFT OUT");
    used += d.is_used ? 1 : 0;
  }
  for (const DriveVerdict &d : result.drives)
    if (!d.is_used) std::printf("left out: %s: %s\n", d.name.c_str(), d.why_not.c_str());
  if (result.widened > 1.01)  // else it is printed as 1.00
    std::printf("drives differ by %.2f times what their covariances say: the map's is as much wider\n",
                std::sqrt(result.widened));
  std::printf("%zu landmarks of %zu drives\n", in_order(result).size(), used);
}

// SITE/FLOOR to the floor's landmarks.csv in the site's own files.
struct Target {
  fs::path site, landmarks;
};
Target target_of(const std::string &named) {
  fs::path path = fs::path(named).lexically_normal();
  if (path.filename().empty()) path = path.parent_path();
  const bool is_whole = fs::exists(path / "site.yaml") || !fs::exists(path.parent_path() / "site.yaml");
  const Target out{is_whole ? path : path.parent_path(), ""};
  const Floors site = read_floors(out.site);
  std::string names;
  for (int i = 0; i < site->floor_count; i++) {
    const wm_floor &floor = site->floors[i];
    names += (i > 0 ? ", " : "") + std::string(floor.name);
    if (is_whole ? site->floor_count > 1 : path.filename() != floor.name) continue;
    if (floor.landmarks[0] == '\0')
      throw Failure(out.site.string() + ": floor '" + floor.name + "' has no `landmarks`; name a file for them",
                    kUsage);
    return {out.site, floor.landmarks};
  }
  throw Failure(named + ": name a floor, SITE/FLOOR; " + out.site.string() + " has " + names, kUsage);
}

void deliver(const MergeArguments &a, const MergeResult &result) {
  if (!a.out.empty()) {
    fs::create_directories(a.out);
    const fs::path landmarks = fs::path(a.out) / "landmarks.csv";
    write(landmarks, csv_of(result));
    write(covariance_beside(landmarks), covariance_of(result));
    std::printf("%s: landmarks.csv, landmarks-covariance.npy\n", a.out.c_str());
  }
  if (a.site.empty()) return;
  const Target target = target_of(a.site);
  const auto below = [&](const fs::path &file) { return fs::relative(file, target.site).string(); };
  const char *user = std::getenv("USER");
  VersionWish wish{!a.author.empty() ? a.author
                   : user != nullptr ? user
                                     : "unknown",
                   !a.note.empty() ? a.note : text("merged of %zu drives", a.drives.size())};
  wish.changes[below(target.landmarks)] = csv_of(result);
  wish.changes[below(covariance_beside(target.landmarks))] = covariance_of(result);
  const MadeVersion made = make_version(target.site, wish);
  std::printf("%s: version %s\n", target.site.c_str(), made.name.c_str());
}

}  // namespace

void parse_merge(cli::App &app, MergeArguments &a) {
  app.description(
      "Merges the maps that drives made to one, with its covariance. Drives that do not fit the others are named and "
      "left out.");
  app.add_option("DRIVE", a.drives, "runs of `slam` (their map-estimate.wmmap), or files of start.saved_map")
      ->required();
  app.add_option("--out", a.out, "folder for landmarks.csv and landmarks-covariance.npy");
  app.add_option("--site", a.site,
                 "SITE/FLOOR: the floor's landmarks, and a new version of the building. The floor's landmarks of "
                 "before are --surveyed, where nothing else is");
  app.add_option("--surveyed", a.surveyed, "landmarks.csv with sigmas: they give the map's frame");
  app.add_flag("--one-frame", a.options.one_frame,
               "all drives began in one frame, each with its start's sigma; without: each has a frame of its own, and "
               "the map that of the first drive that fits");
  app.add_flag("--by-place", a.options.by_place, "landmarks have no ids in common: those at one place are one");
  app.add_option("--author", a.author, "of the version; without: the user's name");
  app.add_option("--note", a.note, "of the version");
  app.add_flag("--json", a.json, "one object instead of a table");
  app.footer(
      "examples:\n"
      "  waymark map merge runs/* --out merged\n"
      "  waymark map merge runs/* --surveyed anchors.csv --site office/ground --author Jane\n"
      "chi2 / dof of a drive is about 1 where it fits the others as its covariance says. More: docs/building.md.\n"
      "Exit code: 0 done, 1 a drive was left out or the work failed, 2 usage.");
}

int merge_command(const MergeArguments &a) {
  if (a.out.empty() && a.site.empty())
    throw Failure("--out FOLDER or --site SITE/FLOOR: where shall the map go?", kUsage);
  Progress progress;
  std::vector<DriveVerdict> unread;
  const std::vector<DriveMap> drives = read_all(a.drives, &progress, &unread);
  std::string surveyed_file = a.surveyed;
  if (surveyed_file.empty() && !a.site.empty() && !a.options.by_place)
    if (const fs::path there = target_of(a.site).landmarks; fs::exists(there)) surveyed_file = there.string();
  DriveMap surveyed;
  if (!surveyed_file.empty()) surveyed = read_surveyed_map(surveyed_file);
  MergeResult result = merge_maps(drives, surveyed_file.empty() ? nullptr : &surveyed, a.options,
                                  [&](const std::string &line) { progress.tell(line); });
  result.drives.insert(result.drives.end(), unread.begin(), unread.end());
  if (a.json)
    std::printf("%s\n", json_of(result).dump(2).c_str());
  else
    print(result);
  deliver(a, result);
  const bool all = std::all_of(result.drives.begin(), result.drives.end(), [](const auto &d) { return d.is_used; });
  return all ? kDone : kFailed;
}

}  // namespace wm::tools
