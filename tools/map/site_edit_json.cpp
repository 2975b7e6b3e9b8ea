// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "common/text.h"
#include "map/site_edit.h"

namespace wm::tools {
namespace {

using Json = nlohmann::json;

constexpr size_t kDepthMax = 8;      // the deepest that is needed is 6: a coordinate of an area's corner
constexpr size_t kEditsMax = 20000;  // an hour of a person's work is a thousand
constexpr size_t kAreasMax = 1000, kCornersMax = 1000;
constexpr double kFar_m = 1e8, kIdMax = 2147483647;  // as landmarks.csv has them

struct Field {
  const char *name;
  bool is_needed, is_whole, may_be_null;
  double min, max;
};

constexpr bool kNeeded = true, kWhole = true, kNull = true;
constexpr Field kId{"id", kNeeded, kWhole, false, 0, kIdMax}, kX{"x_m", false, false, false, -kFar_m, kFar_m},
    kY{"y_m", false, false, false, -kFar_m, kFar_m}, kZ{"z_m", false, false, kNull, -kFar_m, kFar_m},
    kSigma{"sigma_m", false, false, kNull, 0, 1e6}, kYaw{"yaw_rad", false, false, kNull, -6.2832, 6.2832},
    kNeedX{"x_m", kNeeded, false, false, -kFar_m, kFar_m}, kNeedY{"y_m", kNeeded, false, false, -kFar_m, kFar_m};

struct Kind {
  const char *name;
  EditKind kind;
  std::vector<Field> fields;
};
const Kind kKinds[] = {
    {"set", EditKind::kSet, {kId, kX, kY, kZ, kSigma, kYaw}},
    {"add", EditKind::kAdd, {kId, kNeedX, kNeedY, kZ, kSigma, kYaw}},
    {"delete", EditKind::kDelete, {kId}},
    {"rename", EditKind::kRename, {kId, {"to", kNeeded, kWhole, false, 0, kIdMax}}},
    {"scale", EditKind::kScale, {{"factor", kNeeded, false, false, 1e-3, 1e3}, kNeedX, kNeedY}},
    {"origin",
     EditKind::kOrigin,
     {kNeedX,
      kNeedY,
      {"latitude_deg", kNeeded, false, false, -89.9, 89.9},  // near a pole east has no direction
      {"longitude_deg", kNeeded, false, false, -180, 180},
      {"altitude_m", kNeeded, false, false, -9999, 9999}}},
    {"ignore", EditKind::kIgnore, {}},
};

// Depth and double keys are refused while they are read: a tree is never deeper, and none of two values is dropped.
Json parse(const std::string &text) {
  std::vector<std::set<std::string>> keys;
  const auto watch = [&](int depth, Json::parse_event_t event, Json &value) {
    if (static_cast<size_t>(depth) > kDepthMax) throw FieldError("", wm::tools::text("deeper than %zu", kDepthMax));
    keys.resize(static_cast<size_t>(depth) + 1);
    if (event == Json::parse_event_t::object_start) keys.emplace_back();
    if (event == Json::parse_event_t::key && !keys.back().insert(value.get<std::string>()).second)
      throw FieldError(value.get<std::string>(), "stands twice in one object");
    return true;
  };
  try {
    return Json::parse(text, watch);
  } catch (const Json::exception &problem) {
    throw FieldError("", std::string("is no JSON: ") + problem.what());
  }
}

void need_keys(const Json &object, const std::string &at, const std::set<std::string> &known) {
  if (!object.is_object()) throw FieldError(at, "an object {...} is needed");
  for (const auto &[key, value] : object.items())
    if (known.count(key) == 0) throw FieldError(at + (at.empty() ? "" : ".") + key, "unknown key");
}

std::string read_text(const Json &object, const std::string &at, const char *key, size_t bytes_max, bool is_needed) {
  const std::string field = at + (at.empty() ? "" : ".") + key;
  if (!object.contains(key)) {
    if (is_needed) throw FieldError(field, "is missing");
    return "";
  }
  const Json &value = object[key];
  if (!value.is_string()) throw FieldError(field, "a text is needed");
  const auto &out = value.get_ref<const std::string &>();
  if (out.size() > bytes_max) throw FieldError(field, text("has %zu bytes; %zu are allowed", out.size(), bytes_max));
  return out;
}

double read_number(const Json &value, const std::string &at, double min, double max, bool is_whole) {
  if (!value.is_number()) throw FieldError(at, "a number is needed");
  const auto out = value.get<double>();
  if (!(out >= min && out <= max)) throw FieldError(at, text("%g; from %g to %g is allowed", out, min, max));
  if (is_whole && out != std::floor(out)) throw FieldError(at, text("%g; a whole number is needed", out));
  return out;
}

std::vector<Polygon> read_areas(const Json &edit, const std::string &at) {
  std::vector<Polygon> out;
  if (!edit.contains("areas")) throw FieldError(at, "is missing: a list of polygons [[x, y], ...]");
  const Json &areas = edit["areas"];
  if (!areas.is_array() || areas.size() > kAreasMax)
    throw FieldError(at, text("a list of polygons is needed, at most %zu", kAreasMax));
  for (size_t i = 0; i < areas.size(); i++) {
    const std::string area_at = at + text("[%zu]", i);
    if (!areas[i].is_array() || areas[i].size() < 3 || areas[i].size() > kCornersMax)
      throw FieldError(area_at, text("3 to %zu corners [x, y] are needed", kCornersMax));
    Polygon &area = out.emplace_back();
    for (size_t k = 0; k < areas[i].size(); k++) {
      const std::string corner_at = area_at + text("[%zu]", k);
      const Json &corner = areas[i][k];
      if (!corner.is_array() || corner.size() != 2) throw FieldError(corner_at, "[x, y] in m is needed");
      area.push_back({read_number(corner[0], corner_at, -kFar_m, kFar_m, false),
                      read_number(corner[1], corner_at, -kFar_m, kFar_m, false)});
    }
  }
  return out;
}

SiteEdit read_edit(const Json &json, const std::string &at) {
  if (!json.is_object()) throw FieldError(at, "an object {...} is needed");
  const std::string wanted = read_text(json, at, "do", 16, true);
  std::string names;
  for (const Kind &kind : kKinds) {
    names += (names.empty() ? "" : ", ") + std::string(kind.name);
    if (wanted != kind.name) continue;
    SiteEdit out{kind.kind, at, read_text(json, at, "floor", 64, true), {}, {}};
    std::set<std::string> known{"do", "floor"};
    for (const Field &field : kind.fields) {
      known.insert(field.name);
      const std::string field_at = at + "." + field.name;
      if (!json.contains(field.name)) {
        if (field.is_needed) throw FieldError(field_at, "is missing");
        continue;
      }
      const Json &value = json[field.name];
      if (value.is_null() && field.may_be_null)
        out.numbers[field.name] = std::nullopt;
      else
        out.numbers[field.name] = read_number(value, field_at, field.min, field.max, field.is_whole);
    }
    if (kind.kind == EditKind::kIgnore) {
      known.insert("areas");
      out.areas = read_areas(json, at + ".areas");
    }
    need_keys(json, at, known);
    return out;
  }
  throw FieldError(at + ".do", "'" + wanted + "' is none of " + names);
}

}  // namespace

EditRequest read_edits(const std::string &json) {
  const Json root = parse(json);
  need_keys(root, "", {"base", "author", "note", "edits"});
  EditRequest out{read_text(root, "", "base", 16, true),
                  read_text(root, "", "author", 63, true),
                  read_text(root, "", "note", 255, false),
                  {}};  // as a version's record has them
  if (out.author.empty()) throw FieldError("author", "is empty: who makes the version?");
  if (!root.contains("edits") || !root["edits"].is_array() || root["edits"].size() > kEditsMax)
    throw FieldError("edits", text("a list of edits is needed, at most %zu", kEditsMax));
  for (size_t i = 0; i < root["edits"].size(); i++)
    out.edits.push_back(read_edit(root["edits"][i], text("edits[%zu]", i)));
  return out;
}

}  // namespace wm::tools
