// SPDX-License-Identifier: Apache-2.0
#include "common/csv.h"

#include <algorithm>
#include <fstream>
#include <limits>

#include "common/failure.h"
#include "common/number.h"

namespace wm::tools {
namespace {

std::vector<char> read_bytes(const std::filesystem::path &path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw Failure(path.string() + ": can't be opened; is the path right, and may you read it?");
  std::vector<char> bytes{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  if (file.bad()) throw Failure(path.string() + ": could not be read to its end");
  return bytes;
}

std::vector<std::string_view> split(std::string_view line) {
  std::vector<std::string_view> fields;
  for (;;) {
    const size_t comma = line.find(',');
    fields.push_back(line.substr(0, comma));
    if (comma == std::string_view::npos) return fields;
    line.remove_prefix(comma + 1);
  }
}

}  // namespace

Csv Csv::load(const std::filesystem::path &path) {
  Csv csv;
  csv.path_ = path.string();
  csv.bytes_ = read_bytes(path);
  std::string_view rest(csv.bytes_.data(), csv.bytes_.size());
  if (rest.starts_with("\xEF\xBB\xBF")) rest.remove_prefix(3);
  for (size_t number = 1; !rest.empty(); ++number) {
    const size_t end = rest.find('\n');
    std::string_view line = rest.substr(0, end);
    rest.remove_prefix(end == std::string_view::npos ? rest.size() : end + 1);
    if (line.ends_with('\r')) line.remove_suffix(1);
    if (line.empty()) continue;
    const auto fields = split(line);
    if (csv.columns_.empty()) {
      csv.columns_.assign(fields.begin(), fields.end());
      continue;
    }
    if (fields.size() != csv.columns_.size())
      throw Failure(csv.path_ + ":" + std::to_string(number) + ": " + std::to_string(fields.size()) +
                    " fields, but the header has " + std::to_string(csv.columns_.size()) +
                    (rest.empty() ? " (the last line: was the writing cut short?)" : ""));
    csv.cells_.insert(csv.cells_.end(), fields.begin(), fields.end());
    csv.lines_.push_back(number);
  }
  if (csv.columns_.empty()) throw Failure(csv.path_ + ": is empty; a header line is expected");
  return csv;
}

std::optional<size_t> Csv::find(std::string_view column) const {
  const auto found = std::find(columns_.begin(), columns_.end(), column);
  if (found == columns_.end()) return std::nullopt;
  return static_cast<size_t>(found - columns_.begin());
}

size_t Csv::need(std::string_view column) const {
  if (const auto found = find(column)) return *found;
  std::string there;
  for (const auto &name : columns_) there += (there.empty() ? "" : ",") + name;
  throw Failure(path_ + ":1: no column '" + std::string(column) + "'; the header has " + there);
}

double Csv::number(size_t row, size_t column) const {
  const std::string_view field = text(row, column);
  if (field.empty()) return std::numeric_limits<double>::quiet_NaN();
  const std::optional<double> value = number_of<double>(field);
  if (!value) throw Failure(where(row, column) + ": '" + std::string(field) + "' is not a number");
  return *value;
}

double Csv::number(size_t row, std::optional<size_t> column) const {
  return column ? number(row, *column) : std::numeric_limits<double>::quiet_NaN();
}

int64_t Csv::integer(size_t row, size_t column) const {
  const std::string_view field = text(row, column);
  const std::optional<int64_t> value = number_of<int64_t>(field);
  if (!value) throw Failure(where(row, column) + ": '" + std::string(field) + "' is not a whole number of 64 bits");
  if (*value < -kIntegerLimit || *value > kIntegerLimit)
    throw Failure(where(row, column) + ": '" + std::string(field) + "' is out of range: at most 4e18 is possible");
  return *value;
}

std::string Csv::where(size_t row, size_t column) const {
  return path_ + ":" + std::to_string(lines_[row]) + ": " + columns_[column];
}

}  // namespace wm::tools
