// SPDX-License-Identifier: Apache-2.0
#include "map/site_edit.h"

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <memory>
#include <unordered_map>

#include "common/csv.h"
#include "common/program.h"
#include "common/text.h"
#include "map/site.h"
#include "waymark/local_frame.h"
#include "waymark/yaml.h"

namespace wm::tools {
namespace {

namespace fs = std::filesystem;

// Rows by their `id`, as text: what nobody edits keeps its letters. Several rows may have one id (appearances).
class Table {
 public:
  explicit Table(const fs::path &file) {
    const Csv csv = Csv::load(file);
    const size_t id = csv.need("id");
    columns_ = csv.columns();
    for (size_t row = 0; row < csv.rows(); row++) {
      by_id_.emplace(csv.integer(row, id), rows_.size());
      auto &cells = rows_.emplace_back();
      for (size_t k = 0; k < columns_.size(); k++) cells.emplace_back(csv.text(row, k));
    }
  }

  [[nodiscard]] bool has(int64_t id) const { return by_id_.count(id) > 0; }
  void add(int64_t id) {
    by_id_.emplace(id, rows_.size());
    rows_.emplace_back(columns_.size());
    put(id, "id", std::to_string(id));
  }
  void remove(int64_t id) {
    const auto [from, to] = by_id_.equal_range(id);
    for (auto at = from; at != to; ++at) rows_[at->second].clear();
    by_id_.erase(from, to);
  }
  void rename(int64_t id, int64_t to) {
    std::vector<size_t> moved;
    const auto [from, end] = by_id_.equal_range(id);
    for (auto at = from; at != end; ++at) moved.push_back(at->second);
    put(id, "id", std::to_string(to));
    by_id_.erase(id);
    for (const size_t row : moved) by_id_.emplace(to, row);
  }
  // A column that is not there is added, where there is something to put into it.
  void put(int64_t id, const std::string &column, const std::string &value) {
    const auto found = std::find(columns_.begin(), columns_.end(), column);
    const auto k = static_cast<size_t>(found - columns_.begin());
    if (found == columns_.end()) {
      if (value.empty()) return;
      columns_.push_back(column);
      for (auto &cells : rows_)
        if (!cells.empty()) cells.emplace_back();
    }
    const auto [from, to] = by_id_.equal_range(id);
    for (auto at = from; at != to; ++at) rows_[at->second][k] = value;
  }
  [[nodiscard]] std::string text() const {
    std::string out;
    const auto line = [&out](const std::vector<std::string> &cells) {
      for (size_t k = 0; k < cells.size(); k++) out += (k > 0 ? "," : "") + cells[k];
      out += "\n";
    };
    line(columns_);
    for (const auto &cells : rows_)
      if (!cells.empty()) line(cells);
    return out;
  }

 private:
  std::vector<std::string> columns_;
  std::vector<std::vector<std::string>> rows_;  // empty: removed
  std::unordered_multimap<int64_t, size_t> by_id_;
};

using Document = std::unique_ptr<wm_yaml, void (*)(wm_yaml *)>;

Document parsed(const std::string &yaml, const fs::path &path) {
  wm_error error{};
  wm_yaml *out = nullptr;
  need_ok(wm_yaml_parse(yaml.data(), yaml.size(), path.c_str(), &out, &error), error);
  return {out, wm_yaml_free};
}

std::vector<double> numbers_of(const wm_yaml_node &node, size_t most) {
  std::vector<double> out(most);
  size_t count = 0;
  wm_error error{};
  need_ok(wm_yaml_f64_list(&node, 2, most, out.data(), &count, &error), error);
  out.resize(count);
  return out;
}

std::vector<Polygon> areas_of(const wm_yaml_node &root) {
  std::vector<Polygon> out;
  const wm_yaml_node list = wm_yaml_get(&root, "ignore");
  for (size_t i = 0; i < wm_yaml_count(&list); i++) {
    const wm_yaml_node polygon = wm_yaml_item(&list, i);
    Polygon &area = out.emplace_back();
    for (size_t k = 0; k < wm_yaml_count(&polygon); k++) {
      const std::vector<double> corner = numbers_of(wm_yaml_item(&polygon, k), 2);
      area.push_back({corner[0], corner[1]});
    }
  }
  return out;
}

std::string yaml_of(const std::vector<Polygon> &areas) {
  std::string out = "[";
  for (const Polygon &area : areas) {
    out += out.size() > 1 ? ", [" : "[";
    for (size_t k = 0; k < area.size(); k++) out += text("%s[%.9g, %.9g]", k > 0 ? ", " : "", area[k][0], area[k][1]);
    out += "]";
  }
  return out + "]";
}

// The files as they become, read when the first edit comes to them.
class Editing {
 public:
  explicit Editing(const fs::path &site) : site_(read_floors(site)) {}

  void apply(const SiteEdit &edit) {
    const wm_floor &floor = floor_of(edit);
    switch (edit.kind) {
      case EditKind::kScale: return scale(edit, map_of(floor, edit));
      case EditKind::kIgnore: return put_yaml(map_of(floor, edit), "ignore", yaml_of(edit.areas), edit);
      case EditKind::kOrigin: return place(edit, floor);
      default: return landmark(edit, floor);
    }
  }

  FileChanges changes() {
    for (auto &[path, table] : tables_) texts_[path] = table.text();
    FileChanges out;
    for (auto &[path, bytes] : texts_)
      if (bytes != read(path)) out[below(path)] = std::move(bytes);
    for (const auto &[path, table] : tables_)
      if (out.count(below(path)) > 0)  // a covariance of all together is one of the landmarks before
        if (const fs::path joint = covariance_beside(path); fs::exists(joint)) out[below(joint)] = std::nullopt;
    return out;
  }

 private:
  [[nodiscard]] std::string below(const fs::path &path) const {
    return path.lexically_normal().lexically_relative(fs::path(site_->folder).lexically_normal());
  }

  static std::string read(const fs::path &path) {
    std::ifstream file(path, std::ios::binary);
    std::string out{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
    if (!file) throw Failure(path.string() + ": can't be read");
    return out;
  }

  [[nodiscard]] const wm_floor &floor_of(const SiteEdit &edit) const {
    for (int i = 0; i < site_->floor_count; i++)
      if (edit.floor == site_->floors[i].name) return site_->floors[i];
    throw FieldError(edit.at + ".floor", "there is no floor '" + edit.floor + "'");
  }

  static fs::path map_of(const wm_floor &floor, const SiteEdit &edit) {
    if (floor.map[0] == '\0') throw FieldError(edit.at + ".floor", "floor '" + edit.floor + "' has no plan");
    return floor.map;
  }

  Table &table(const fs::path &file) { return tables_.try_emplace(file, file).first->second; }
  std::string &yaml(const fs::path &file) {
    const auto [at, is_new] = texts_.try_emplace(file);
    if (is_new) at->second = read(file);
    return at->second;
  }

  void put_yaml(const fs::path &file, const std::string &key, const std::string &value, const SiteEdit &edit) {
    std::string &whole = yaml(file);
    char *out = nullptr;
    size_t length = 0;
    wm_error error{};
    if (wm_yaml_edit(whole.data(), whole.size(), key.c_str(), value.c_str(), "", &out, &length, &error) != WM_OK)
      throw FieldError(edit.at, file.string() + ": " + error.text);
    whole.assign(out, length);
    std::free(out);
  }

  void landmark(const SiteEdit &edit, const wm_floor &floor) {
    if (floor.landmarks[0] == '\0')
      throw FieldError(edit.at + ".floor", "floor '" + edit.floor + "' has no file of landmarks in site.yaml");
    Table &rows = table(floor.landmarks);
    const auto id = static_cast<int64_t>(edit.number("id"));
    const auto need_free = [&](const char *field, int64_t wanted) {
      if (rows.has(wanted))
        throw FieldError(edit.at + "." + field, text("landmark %lld is there already", static_cast<long long>(wanted)));
    };
    if (edit.kind == EditKind::kAdd)
      need_free("id", id);
    else if (!rows.has(id))
      throw FieldError(edit.at + ".id", text("there is no landmark %lld", static_cast<long long>(id)));
    const fs::path looks_file = fs::path(floor.landmarks).parent_path() / "landmarks/appearance.csv";
    Table *looks = nullptr;
    if ((edit.kind == EditKind::kDelete || edit.kind == EditKind::kRename) && fs::exists(looks_file))
      looks = &table(looks_file);
    if (edit.kind == EditKind::kDelete) {
      rows.remove(id);
      if (looks != nullptr) looks->remove(id);
    } else if (edit.kind == EditKind::kRename) {
      const auto to = static_cast<int64_t>(edit.number("to"));
      if (to != id) need_free("to", to);
      rows.rename(id, to);
      if (looks != nullptr) looks->rename(id, to);
    } else {
      if (edit.kind == EditKind::kAdd) rows.add(id);
      for (const auto &[name, value] : edit.numbers)
        if (name != "id") rows.put(id, name, value ? text("%.10g", *value) : "");
      // Covariances of a measured place or heading are not those of one that a person gave.
      if (edit.numbers.count("x_m") + edit.numbers.count("y_m") + edit.numbers.count("sigma_m") > 0)
        for (const char *name : {"cov_xx", "cov_xy", "cov_yy"}) rows.put(id, name, "");
      if (edit.numbers.count("yaw_rad") > 0) rows.put(id, "cov_tt", "");
    }
  }

  // The plan becomes `factor` times as large; the given place stays.
  void scale(const SiteEdit &edit, const fs::path &map) {
    const Document document = parsed(yaml(map), map);
    const wm_yaml_node root = wm_yaml_root(document.get()), origin_node = wm_yaml_get(&root, "origin"),
                       resolution_node = wm_yaml_get(&root, "resolution");
    const double factor = edit.number("factor"), x = edit.number("x_m"), y = edit.number("y_m");
    double resolution = 0;
    wm_error error{};
    need_ok(wm_yaml_f64(&resolution_node, 1e-12, 1e6, &resolution, &error), error);
    const std::vector<double> origin = numbers_of(origin_node, 3);
    std::vector<Polygon> areas = areas_of(root);
    for (Polygon &area : areas)
      for (auto &corner : area) corner = {x + factor * (corner[0] - x), y + factor * (corner[1] - y)};
    put_yaml(map, "resolution", text("%.12g", resolution * factor), edit);
    put_yaml(map, "origin",
             text("[%.12g, %.12g, %.12g]", x + factor * (origin[0] - x), y + factor * (origin[1] - y),
                  origin.size() > 2 ? origin[2] : 0.0),
             edit);
    if (!areas.empty()) put_yaml(map, "ignore", yaml_of(areas), edit);
  }

  // The origin for which the place has this latitude and longitude. A step of metres as degrees of a sphere is off by
  // some per mille of itself, so that five leave nothing.
  void place(const SiteEdit &edit, const wm_floor &floor) {
    if (site_->yaml[0] == '\0')
      throw FieldError(edit.at,
                       "a building without site.yaml has no place for an origin; write one (docs/building.md)");
    constexpr double kMetres = 6371000 * 3.14159265358979323846 / 180;  // of a degree
    const double known[3] = {edit.number("latitude_deg"), edit.number("longitude_deg"), edit.number("altitude_m")};
    double origin[3] = {known[0], known[1], known[2]};
    for (int step = 0; step < 5; step++) {
      double enu_m[3];
      local_frame(origin, known, enu_m);
      origin[0] += (enu_m[1] - edit.number("y_m")) / kMetres;
      origin[1] += (enu_m[0] - edit.number("x_m")) / (kMetres * std::cos(origin[0] * 3.14159265358979323846 / 180));
      origin[2] += enu_m[2];
    }
    const Document document = parsed(yaml(site_->yaml), site_->yaml);
    const wm_yaml_node root = wm_yaml_root(document.get()), floors = wm_yaml_get(&root, "floors");
    const auto index = static_cast<size_t>(&floor - site_->floors);
    const wm_yaml_node item = wm_yaml_item(&floors, index), own = wm_yaml_get(&item, "origin");
    put_yaml(site_->yaml, wm_yaml_there(&own) ? text("floors[%zu].origin", index) : "origin",
             text("[%.9f, %.9f, %.3f]", origin[0], origin[1], origin[2]), edit);
  }

  Floors site_;
  std::map<fs::path, Table> tables_;
  std::map<fs::path, std::string> texts_;
};

}  // namespace

FileChanges edited_files(const fs::path &site, const std::vector<SiteEdit> &edits) {
  Editing editing(site);
  for (const SiteEdit &edit : edits) editing.apply(edit);
  return editing.changes();
}

std::vector<Polygon> ignored_areas(const fs::path &map_yaml) {
  wm_error error{};
  wm_yaml *loaded = nullptr;
  need_ok(wm_yaml_load(map_yaml.c_str(), &loaded, &error), error);
  const Document document(loaded, wm_yaml_free);
  return areas_of(wm_yaml_root(document.get()));
}

}  // namespace wm::tools
