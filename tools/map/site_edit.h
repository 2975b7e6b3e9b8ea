// SPDX-License-Identifier: Apache-2.0
// Changes of a building that a person makes on the editor's page: JSON from anywhere, and the site's files with them.
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/failure.h"
#include "map/versions.h"

namespace wm::tools {

// What is wrong with a field: "edits[3].x_m".
struct FieldError : Failure {
  FieldError(std::string at, const std::string &text) : Failure(at + ": " + text), field(std::move(at)) {}
  std::string field;
};

using Polygon = std::vector<std::array<double, 2>>;  // corners of a polygon in the floor's axes, m

enum class EditKind { kSet, kAdd, kDelete, kRename, kScale, kOrigin, kIgnore };

struct SiteEdit {
  EditKind kind;
  std::string at;  // "edits[3]"
  std::string floor;
  std::map<std::string, std::optional<double>> numbers;  // by their names; none: null
  std::vector<Polygon> areas;
  [[nodiscard]] double number(const char *name) const { return numbers.at(name).value(); }
};

struct EditRequest {
  std::string base, author, note;  // base: site_hash() of what was edited
  std::vector<SiteEdit> edits;     // in their order
};

// {"base", "author", "note", "edits": [{"do", "floor", ...}]}; docs/building.md has the kinds with their fields.
// Unknown and double keys, other types and numbers beyond their bounds are refused: throws FieldError.
EditRequest read_edits(const std::string &json);

// The files that the edits change. What is not edited stays as it is, letter by letter. Throws FieldError where an edit
// does not fit the site (no such floor or landmark), Failure where a file can't be read.
FileChanges edited_files(const std::filesystem::path &site, const std::vector<SiteEdit> &edits);

// The areas whose edges map.yaml ignores. Throws Failure.
std::vector<Polygon> ignored_areas(const std::filesystem::path &map_yaml);

}  // namespace wm::tools
