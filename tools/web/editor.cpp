// SPDX-License-Identifier: Apache-2.0
#include "web/editor.h"

#include <sys/random.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "common/csv.h"
#include "common/program.h"
#include "common/text.h"
#include "map/connections.h"
#include "map/site.h"
#include "map/site_edit.h"
#include "map/versions.h"
#include "waymark/map.h"

namespace wm::tools {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr double kStep_m = 0.05;         // of a drawn drive, at least
constexpr size_t kDrivePoints = 20'000;  // 300 kB of JSON

WebAnswer json_answer(const Json &body, int status = 200) {
  return {status, "application/json",
          std::make_shared<const std::string>(body.dump(-1, ' ', false, Json::error_handler_t::replace))};
}

WebAnswer failed(int status, const std::string &field, const std::string &text) {
  return json_answer({{"errors", {{{"field", field}, {"text", text}}}}}, status);
}

// As long as the right one whatever is given: how much of it fits can't be measured.
bool is_same(const std::string &right, const std::string &given) {
  unsigned differ = right.size() == given.size() ? 0 : 1;
  for (size_t i = 0; i < right.size(); i++)
    differ |= static_cast<unsigned char>(right[i]) ^ static_cast<unsigned char>(i < given.size() ? given[i] : 0);
  return differ == 0;
}

// A path for each floor that the drive was on; without a column `floor` it is drawn on all.
Json drive_json(const std::string &run) {
  const fs::path folder(run), published = folder / "published.csv";
  const Csv csv = Csv::load(fs::exists(published) ? published : folder / "trajectory.csv");
  const size_t x = csv.need("x_m"), y = csv.need("y_m");
  const auto floor = csv.find("floor");
  Json out = Json::array();
  std::map<std::string, Json> paths;
  std::map<std::string, std::pair<double, double>> last;
  const double step_m = csv.rows() > kDrivePoints ? 2 * kStep_m : kStep_m;
  for (size_t row = 0; row < csv.rows(); row++) {
    const double px = csv.number(row, x), py = csv.number(row, y);
    const std::string on = floor ? std::string(csv.text(row, *floor)) : "";
    const auto before = last.find(on);
    if (!std::isfinite(px) || !std::isfinite(py) || paths[on].size() >= kDrivePoints) continue;
    if (before != last.end() && std::hypot(px - before->second.first, py - before->second.second) < step_m) continue;
    last[on] = {px, py};
    paths[on].push_back({std::round(px * 1000) / 1000, std::round(py * 1000) / 1000});
  }
  const std::string name = fs::weakly_canonical(folder).filename();
  for (auto &[on, points] : paths)
    if (!points.empty())
      out.push_back({{"name", name + (on.empty() ? "" : ", " + on)},
                     {"floor", on.empty() ? Json(nullptr) : Json(on)},
                     {"points", points}});
  if (out.empty()) throw Failure(run + ": has no poses to draw", kUsage);
  return out;
}

Json landmarks_json(const wm_floor &floor) {
  Json out = Json::array();
  if (floor.landmarks[0] == '\0') return out;
  wm_landmark *list = nullptr;
  size_t count = 0;
  wm_error error{};
  need_ok(wm_landmarks_load(floor.landmarks, nullptr, nullptr, &list, &count, &error), error);
  const std::unique_ptr<wm_landmark, decltype(&std::free)> held(list, std::free);
  for (size_t i = 0; i < count; i++) {
    const wm_landmark &l = list[i];
    const bool has_shape = std::isfinite(l.cov_m2[0]);
    out.push_back({{"id", l.id},  // NaN becomes null
                   {"x_m", l.p_m[0]},
                   {"y_m", l.p_m[1]},
                   {"z_m", l.p_m[2]},
                   {"sigma_m", l.sigma_m},
                   {"yaw_rad", l.yaw_rad},
                   {"cov", has_shape ? Json{l.cov_m2[0], l.cov_m2[1], l.cov_m2[2]} : Json(nullptr)}});
  }
  return out;
}

Json connections_json(const wm_floors &site) {
  Json out = Json::array();
  for (int i = 0; i < site.connection_count; i++) {
    const wm_connection &c = site.connections[i];
    Json ends = Json::array();
    for (int k = 0; k < c.end_count; k++)
      ends.push_back({{"floor", site.floors[c.ends[k].floor].name}, {"x_m", c.ends[k].x_m}, {"y_m", c.ends[k].y_m}});
    out.push_back({{"name", c.name}, {"kind", kind_name(c.kind)}, {"radius_m", c.radius_m}, {"ends", ends}});
  }
  return out;
}

Json versions_json(const std::vector<VersionListed> &all) {
  Json out = Json::array();
  for (const VersionListed &v : all)
    out.push_back({{"name", v.name},
                   {"base", v.base},
                   {"date", v.date},
                   {"author", v.author},
                   {"note", v.note},
                   {"damage", v.damage}});
  return out;
}

MapView plan_of(const wm_floor &floor) {
  if (floor.map[0] == '\0') return view_map(nullptr);
  wm_map *loaded = nullptr;
  wm_error error{};
  if (wm_map_load(floor.map, nullptr, nullptr, &loaded, &error) != WM_OK) return view_map(nullptr);  // check says why
  const std::unique_ptr<wm_map, decltype(&wm_map_free)> map(loaded, wm_map_free);
  return view_map(wm_map_raster(map.get()));
}

}  // namespace

std::string Editor::make_token() {
  unsigned char random[kTokenDigits / 2];
  if (getrandom(random, sizeof random, 0) != static_cast<ssize_t>(sizeof random))
    throw Failure("no random numbers for a token are to be had");
  std::string out;
  for (const unsigned char byte : random) out += text("%02x", byte);
  return out;
}

Editor::Editor(fs::path site, const std::vector<std::string> &drives, std::string token)
    : site_(std::move(site)), token_(std::move(token)) {
  (void)read_floors(site_);
  Json all = Json::array();
  for (const std::string &run : drives)
    for (Json &path : drive_json(run)) all.push_back(std::move(path));
  drives_ = all.dump(-1, ' ', false, Json::error_handler_t::replace);
}

const Editor::Shown &Editor::shown() {
  const std::string hash = site_hash(site_);
  if (hash == shown_.hash) return shown_;
  Shown next{hash, {}, {}, {}};
  SiteReport report = check_floors(site_);
  next.wrong = std::move(report.wrong);
  next.odd = std::move(report.odd);
  const Floors site = read_floors(site_);
  for (int i = 0; i < site->floor_count; i++) next.plans.push_back(plan_of(site->floors[i]));
  return shown_ = std::move(next);
}

WebAnswer Editor::site_json() {
  const Shown &now = shown();
  const Floors site = read_floors(site_);
  Json floors = Json::array();
  for (int i = 0; i < site->floor_count; i++) {
    const wm_floor &floor = site->floors[i];
    Json layers = Json::parse(*now.plans[static_cast<size_t>(i)].json), plan;
    if (!layers.empty()) plan = {{"origin", layers.begin().value()["origin"]}, {"layers", layers}};
    floors.push_back(
        {{"name", floor.name},
         {"has_landmarks", floor.landmarks[0] != '\0'},
         {"origin",
          std::isfinite(floor.origin[0]) ? Json{floor.origin[0], floor.origin[1], floor.origin[2]} : Json(nullptr)},
         {"plan", plan},
         {"areas", floor.map[0] != '\0' ? Json(ignored_areas(floor.map)) : Json::array()},
         {"landmarks", landmarks_json(floor)}});
  }
  const std::vector<VersionListed> versions = list_versions(site_);
  std::string current;
  for (const VersionListed &v : versions)
    if (v.is_current) current = v.name;
  Json out = {
      {"name", site->name[0] != '\0' ? std::string(site->name) : fs::weakly_canonical(site_).filename().string()},
      {"base", now.hash},
      {"current", current},
      {"versions", versions_json(versions)},
      {"floors", floors},
      {"connections", connections_json(*site)},
      {"wrong", now.wrong},
      {"odd", now.odd},
      {"drives", Json::parse(drives_)}};
  if (!current.empty() && current != now.hash) out["odd"].push_back(draft_against_current(site_));
  return json_answer(out);
}

WebAnswer Editor::plan(const WebRequest &request) {
  const Shown &now = shown();
  const auto layer = request.query.find("layer");
  const int64_t floor = request.number("floor", -1);
  if (floor < 0 || static_cast<size_t>(floor) >= now.plans.size() || layer == request.query.end())
    return WebAnswer{404};
  const MapView &view = now.plans[static_cast<size_t>(floor)];
  const auto &png = layer->second == "floor" ? view.floor_png : view.edges_png;
  return png ? WebAnswer{200, "image/png", png} : WebAnswer{404};
}

WebAnswer Editor::save(const WebRequest &request) {
  try {
    const EditRequest wanted = read_edits(request.body);
    if (wanted.edits.empty()) return failed(400, "edits", "there is nothing to save");
    if (site_hash(site_) != wanted.base) throw OutdatedBase(site_, wanted.base);
    const MadeVersion made =
        make_version(site_, {wanted.author, wanted.note, wanted.base, edited_files(site_, wanted.edits)});
    return json_answer({{"version", made.name}, {"is_new", made.is_new}});
  } catch (const FieldError &error) {
    return failed(400, error.field, error.what());
  } catch (const OutdatedBase &error) {
    return failed(409, "base", error.what());
  } catch (const Failure &failure) {
    return failed(422, "", failure.what());
  }
}

WebAnswer Editor::answer(const WebRequest &request) {
  if (!is_same(token_, request.token))
    return failed(403, "X-Waymark-Token", "the token that waymark-web printed is needed");
  try {
    if (request.is_post) return request.path == "/version" ? save(request) : WebAnswer{404};
    if (request.path == "/site.json") return site_json();
    if (request.path == "/newest.json") return json_answer({{"base", site_hash(site_)}});
    if (request.path == "/plan.png") return plan(request);
  } catch (const Failure &failure) {
    return failed(500, "", failure.what());
  }
  return WebAnswer{404};
}

}  // namespace wm::tools
