// SPDX-License-Identifier: Apache-2.0
#include "map/site.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <map>
#include <set>

#include "common/failure.h"
#include "common/program.h"
#include "common/text.h"
#include "common/yaml.h"
#include "map/check.h"
#include "map/connections.h"
#include "map/versions.h"
#include "waymark/recording.h"

namespace wm::tools {
namespace {

namespace fs = std::filesystem;

// A mounting is measured by hand, a lift's door found by a robot, within so much.
constexpr double kSamePlace_m = 0.5;
constexpr double kOutside_m = 1;     // a landmark may hang on a wall's other side
constexpr size_t kNamed = 5;         // landmarks that a line names; it counts the others
constexpr char kSaved[] = "WMMAP ";  // what a saved map begins with

void put_odd(void *context, wm_note, const char *line) { static_cast<SiteReport *>(context)->odd.emplace_back(line); }

// "SITE/site.yaml:12: floor 'ground'".
std::string where(const wm_floors &site, const wm_floor &floor) {
  return (floor.line > 0 ? text("%s:%d: ", site.yaml, floor.line) : text("%s: ", site.folder)) + "floor '" +
         floor.name + "'";
}

// What a floor's files say of it.
struct FloorContent {
  std::vector<wm_landmark> landmarks;
  bool has_raster = false;
  MapReport raster;
};

void read_landmarks(const wm_floor &floor, const std::string &at, FloorContent *out, SiteReport *report) {
  wm_landmark *list = nullptr;
  wm_appearance *looks = nullptr;
  size_t count = 0, look_count = 0;
  wm_error error{};
  if (wm_landmarks_load(floor.landmarks, put_odd, report, &list, &count, &error) != WM_OK) {
    report->wrong.push_back(at + ": " + error.text);
    return;
  }
  out->landmarks.assign(list, list + count);
  std::free(list);
  const fs::path appearance = fs::path(floor.landmarks).parent_path() / "landmarks/appearance.csv";
  if (!fs::exists(appearance)) return;
  if (wm_appearances_load(appearance.c_str(), put_odd, report, &looks, &look_count, &error) != WM_OK)
    report->wrong.push_back(at + ": " + error.text);
  wm_appearances_free(looks, look_count);
}

void read_raster(const wm_floor &floor, const std::string &at, FloorContent *out, SiteReport *report) {
  try {
    out->raster = check_map(floor.map, {});
    out->has_raster = true;
  } catch (const Failure &failure) {
    report->wrong.push_back(at + ": " + failure.what());
    return;
  }
  for (const std::string &line : out->raster.wrong) report->wrong.push_back(at + ": " + floor.map + ": " + line);
  for (const std::string &line : out->raster.odd) report->odd.push_back(at + ": " + floor.map + ": " + line);
}

void check_points(const wm_floor &floor, const std::string &at, SiteReport *report) {
  std::string begin(sizeof kSaved - 1, '\0');
  std::ifstream file(floor.points, std::ios::binary);
  if (!file)
    report->wrong.push_back(at + ": points: " + floor.points + ": can't be read; put it there or leave `points` out");
  else if (!file.read(begin.data(), static_cast<std::streamsize>(begin.size())) || begin != kSaved)
    report->wrong.push_back(at + ": points: " + floor.points + ": is no saved map, as start.saved_map writes it");
}

// Landmarks far outside of the map's picture: one of the two has another scale or origin.
void check_extent(const FloorContent &content, const std::string &at, SiteReport *report) {
  if (!content.has_raster || content.landmarks.empty()) return;
  const double margin_px = kOutside_m / content.raster.place.resolution_m;
  size_t outside = 0;
  for (const wm_landmark &l : content.landmarks) {
    const Eigen::Vector2d px = pixel_of(content.raster.layers, content.raster.place, {l.p_m[0], l.p_m[1]});
    outside += px.x() < -margin_px || px.y() < -margin_px || px.x() > content.raster.layers.width + margin_px ||
                       px.y() > content.raster.layers.height + margin_px
                   ? 1
                   : 0;
  }
  if (outside == 0) return;
  const std::string line = at + text(
                                    ": %zu of %zu landmarks lie outside of the map's picture: is `resolution` or "
                                    "`origin` of map.yaml another one than the landmarks' axes have?",
                                    outside, content.landmarks.size());
  (2 * outside > content.landmarks.size() ? report->wrong : report->odd).push_back(line);
}

FloorContent check_floor(const wm_floors &site, const wm_floor &floor, SiteReport *report) {
  FloorContent out;
  const std::string at = where(site, floor);
  if (floor.landmarks[0] != '\0') read_landmarks(floor, at, &out, report);
  if (floor.map[0] != '\0') read_raster(floor, at, &out, report);
  if (floor.points[0] != '\0') check_points(floor, at, report);
  check_extent(out, at, report);
  const auto tags = std::count_if(out.landmarks.begin(), out.landmarks.end(),
                                  [](const wm_landmark &l) { return std::isfinite(l.yaw_rad); });
  std::string fact = text("floor %s: %zu landmarks, %zd with a heading", floor.name, out.landmarks.size(), tags);
  if (out.has_raster) fact += ", map " + out.raster.facts.front();
  if (floor.points[0] != '\0') fact += ", saved points";
  if (std::isfinite(floor.origin[0])) fact += text(", origin %.7f, %.7f", floor.origin[0], floor.origin[1]);
  report->facts.push_back(fact);
  return out;
}

// ── floors with each other ──────────────────────────────────────────────────────────────────────────────────────────

bool is_one_landmark(const wm_floors &site, int a, const wm_landmark &of_a, int b, const wm_landmark &of_b) {
  for (int i = 0; i < site.connection_count; i++) {
    const wm_connection_end *from = end_on(site.connections[i], a), *to = end_on(site.connections[i], b);
    if (from == nullptr || to == nullptr) continue;
    const Eigen::Vector2d carried = carry(*from, *to, {of_a.p_m[0], of_a.p_m[1]});
    if ((carried - Eigen::Vector2d(of_b.p_m[0], of_b.p_m[1])).norm() < kSamePlace_m) return true;
  }
  return false;
}

// An identity is one landmark: on two floors only where both see the same one.
void check_identities(const wm_floors &site, const std::vector<FloorContent> &floors, SiteReport *report) {
  std::map<int32_t, std::pair<int, const wm_landmark *>> first;
  std::map<std::pair<int, int>, std::vector<int32_t>> twice;
  for (int floor = 0; floor < site.floor_count; floor++)
    for (const wm_landmark &l : floors[static_cast<size_t>(floor)].landmarks) {
      const auto [at, is_new] = first.try_emplace(l.id, floor, &l);
      if (!is_new && !is_one_landmark(site, at->second.first, *at->second.second, floor, l))
        twice[{at->second.first, floor}].push_back(l.id);
    }
  for (const auto &[pair, ids] : twice) {
    std::string list;
    for (size_t i = 0; i < std::min(ids.size(), kNamed); i++) list += (i > 0 ? ", " : "") + std::to_string(ids[i]);
    if (ids.size() > kNamed) list += text(" and %zu more", ids.size() - kNamed);
    report->wrong.push_back(where(site, site.floors[pair.second]) + ": has landmarks " + list + " as floor '" +
                            site.floors[pair.first].name +
                            "' has: an identity is one landmark. Give those of one floor other numbers" +
                            (site.connection_count > 0 ? ", or correct the connection over which both are seen" : ""));
  }
}

void check_places(const wm_floors &site, const std::vector<FloorContent> &floors, SiteReport *report) {
  for (int i = 0; i < site.connection_count; i++) {
    const wm_connection &c = site.connections[i];
    for (int k = 0; k < c.end_count; k++) {
      const FloorContent &floor = floors[static_cast<size_t>(c.ends[k].floor)];
      if (!floor.has_raster) continue;
      const Layers &m = floor.raster.layers;
      const Eigen::Vector2d px = pixel_of(m, floor.raster.place, {c.ends[k].x_m, c.ends[k].y_m});
      const std::string at = text("%s:%d: %s '%s': its end (%.2f, %.2f) ", site.yaml, c.line, kind_name(c.kind), c.name,
                                  c.ends[k].x_m, c.ends[k].y_m);
      const int x = static_cast<int>(std::lround(px.x())), y = static_cast<int>(std::lround(px.y()));
      if (x < 0 || y < 0 || x >= m.width || y >= m.height)
        report->wrong.push_back(at + "lies outside of the map of floor '" + site.floors[c.ends[k].floor].name +
                                "': correct the place, or the map's origin");
      else if (m.drivable[static_cast<size_t>(y) * static_cast<size_t>(m.width) + static_cast<size_t>(x)] == 0)
        report->odd.push_back(at + "is not drivable on floor '" + site.floors[c.ends[k].floor].name + "'");
    }
  }
}

void check_reach(const wm_floors &site, SiteReport *report) {
  std::set<int> reached{0};
  for (bool grows = true; grows;) {
    grows = false;
    for (int i = 0; i < site.connection_count; i++) {
      const wm_connection &c = site.connections[i];
      const bool touches =
          std::any_of(c.ends, c.ends + c.end_count, [&](const auto &end) { return reached.count(end.floor) > 0; });
      for (int k = 0; touches && k < c.end_count; k++) grows |= reached.insert(c.ends[k].floor).second;
    }
  }
  for (int i = 0; i < site.floor_count; i++)
    if (reached.count(i) == 0)
      report->odd.push_back(where(site, site.floors[i]) + ": no connection leads to it from floor '" +
                            site.floors[0].name + "'");
}

}  // namespace

Floors read_floors(const fs::path &site) {
  finish_version(site);
  wm_error error{};
  wm_floors *out = nullptr;
  need_ok(wm_floors_read(site.c_str(), &out, &error), error);
  return {out, std::free};
}

fs::path covariance_beside(const fs::path &landmarks) {
  fs::path out = landmarks;
  return out.replace_extension().concat("-covariance.npy");
}

std::vector<std::string> files_of(const wm_floors &site) {
  std::set<std::string> out;
  const auto add = [&](const fs::path &file, const std::string &named_by) {
    const std::string below =
        fs::path(file).lexically_normal().lexically_relative(fs::path(site.folder).lexically_normal());
    if (below.empty() || below.rfind("..", 0) == 0)
      throw Failure(named_by + ": names " + file.string() + ", outside of the site's folder; put a copy into it");
    if (!fs::is_regular_file(file)) throw Failure(named_by + ": names " + file.string() + ", which is not there");
    out.insert(below);
  };
  const std::string yaml = site.yaml[0] != '\0' ? site.yaml : site.folder;
  if (site.yaml[0] != '\0') add(site.yaml, yaml);
  for (int i = 0; i < site.floor_count; i++) {
    const wm_floor &floor = site.floors[i];
    for (const char *file : {floor.landmarks, floor.map, floor.points})
      if (*file != '\0') add(file, yaml);
    const fs::path looks = fs::path(floor.landmarks).parent_path() / "landmarks";
    if (floor.landmarks[0] != '\0' && fs::exists(looks / "appearance.csv"))
      for (const auto &entry : fs::directory_iterator(looks)) add(entry.path(), looks.string());
    if (const fs::path covariance = covariance_beside(floor.landmarks); fs::exists(covariance)) add(covariance, yaml);
    if (floor.map[0] == '\0') continue;
    const Yaml map(floor.map);
    for (const char *key : {"image", "layers.edges", "layers.drivable"})
      if (const std::string picture = map.text(key); !picture.empty())
        add(fs::path(floor.map).parent_path() / picture, floor.map);
  }
  return {out.begin(), out.end()};
}

SiteReport check_floors(const fs::path &folder) {
  SiteReport out;
  const Floors site = read_floors(folder);
  std::vector<FloorContent> floors;
  for (int i = 0; i < site->floor_count; i++) floors.push_back(check_floor(*site, site->floors[i], &out));
  check_identities(*site, floors, &out);
  check_places(*site, floors, &out);
  for (std::string &line : connections_that_do_not_meet(*site)) out.wrong.push_back(std::move(line));
  check_reach(*site, &out);
  try {
    (void)files_of(*site);
  } catch (const Failure &failure) {
    if (out.wrong.empty()) out.wrong.emplace_back(failure.what());
  }
  return out;
}

SiteReport check_site(const fs::path &folder) {
  SiteReport out = check_floors(folder);
  for (const VersionListed &version : list_versions(folder)) {
    if (!version.damage.empty())
      out.wrong.push_back(version.damage);
    else
      out.facts.push_back(version_line(version));
  }
  if (const std::string line = draft_against_current(folder); out.wrong.empty() && !line.empty())
    out.facts.push_back(line);
  return out;
}

}  // namespace wm::tools
