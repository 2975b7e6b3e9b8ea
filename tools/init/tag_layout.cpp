// SPDX-License-Identifier: Apache-2.0
#include "init/tag_layout.h"

#include <cmath>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>

#include "common/failure.h"
#include "init/text_file.h"

namespace wm::init {
namespace {

using nlohmann::json;

constexpr double kFarthest_m = 10000;
constexpr int64_t kIdMax = 65535;  // of the largest family
constexpr double kUnitLengthOff = 0.01;

class Reader {
 public:
  explicit Reader(std::string path) : path_(std::move(path)) {}

  TagLayout read(const std::string &text) {
    json doc;
    try {
      doc = json::parse(text);
    } catch (const json::exception &problem) {  // with line and column
      throw tools::Failure(path_ + ": not valid JSON: " + problem.what());
    }
    if (!doc.is_object() || !doc.contains("tags"))
      fail("tags", "is missing; a layout of WPILib has {\"tags\": [{\"ID\": 1, \"pose\": {...}}], \"field\": {...}}");
    const json &tags = doc["tags"];
    if (!tags.is_array() || tags.empty()) fail("tags", "a list of tags is needed");
    TagLayout out;
    std::map<int64_t, size_t> known;
    for (size_t i = 0; i < tags.size(); i++) {
      const std::string key = "tags[" + std::to_string(i) + "]";
      out.tags.push_back(tag(tags[i], key));
      const auto [place, is_new] = known.emplace(out.tags.back().id, i);
      if (!is_new)
        fail(key + ".ID", std::to_string(out.tags.back().id) + " is given twice (first in tags[" +
                              std::to_string(place->second) + "])");
    }
    if (doc.contains("field")) {
      out.length_m = number(member(doc["field"], "field", "length"), "field.length");
      out.width_m = number(member(doc["field"], "field", "width"), "field.width");
    }
    return out;
  }

 private:
  [[noreturn]] void fail(const std::string &key, const std::string &text) const {
    throw tools::Failure(path_ + ": " + key + ": " + text);
  }

  const json &member(const json &map, const std::string &key, const char *name) const {
    if (!map.is_object() || !map.contains(name)) fail(key, std::string(name) + " is missing");
    return map[name];
  }

  double number(const json &value, const std::string &key) const {
    if (value.is_structured()) fail(key, "is a list or a map; a number is needed");  // its text may be of any depth
    if (!value.is_number())
      fail(key, "'" + value.dump(-1, ' ', true, json::error_handler_t::replace).substr(0, 40) + "' is not a number");
    const auto out = value.get<double>();
    if (!std::isfinite(out) || std::abs(out) > kFarthest_m)
      fail(key, "is out of range; at most 10000 is possible, in m");
    return out;
  }

  Tag tag(const json &value, const std::string &key) const {
    const json &id = member(value, key, "ID");
    if (!id.is_number_integer() || id.get<int64_t>() < 0 || id.get<int64_t>() > kIdMax)
      fail(key + ".ID", "a whole number from 0 to 65535 is needed");
    const json &pose = member(value, key, "pose"), &place = member(pose, key + ".pose", "translation");
    const std::string at = key + ".pose.translation";
    Tag out{id.get<int64_t>(), {}};
    const char *const names[] = {"x", "y", "z"};
    for (int i = 0; i < 3; i++) out.place_m[i] = number(member(place, at, names[i]), at + "." + names[i]);
    rotation(member(member(pose, key + ".pose", "rotation"), key + ".pose.rotation", "quaternion"),
             key + ".pose.rotation.quaternion");
    return out;
  }

  void rotation(const json &value, const std::string &key) const {
    double square = 0;
    for (const char *name : {"W", "X", "Y", "Z"}) {
      const double part = number(member(value, key, name), key + "." + name);
      square += part * part;
    }
    if (std::abs(square - 1) > kUnitLengthOff) fail(key, "its length is not 1");
  }

  std::string path_;
};

}  // namespace

TagLayout parse_tag_layout(const std::string &text, const std::string &path) { return Reader(path).read(text); }
TagLayout read_tag_layout(const std::filesystem::path &path) {
  return parse_tag_layout(read_text(path), path.string());
}

std::string landmarks_csv(const TagLayout &layout, double sigma_m) {
  std::string out = "id,x_m,y_m,z_m,sigma_m\n";
  for (const Tag &tag : layout.tags) {
    char line[128];
    std::snprintf(line, sizeof line, "%lld,%.6g,%.6g,%.6g,%.6g\n", static_cast<long long>(tag.id), tag.place_m.x(),
                  tag.place_m.y(), tag.place_m.z(), sigma_m);
    out += line;
  }
  return out;
}

}  // namespace wm::init
