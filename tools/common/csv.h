// SPDX-License-Identifier: Apache-2.0
// The CSV of recordings and runs: UTF-8, comma, one header line, no quotes, empty field = absent. A file is read whole;
// cells are looked at when they are asked for. One thread at a time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace wm::tools {

class Csv {
 public:
  // Throws Failure with file and line: not there, no header, a row with more or fewer fields than the header.
  static Csv load(const std::filesystem::path &path);

  [[nodiscard]] size_t rows() const { return columns_.empty() ? 0 : cells_.size() / columns_.size(); }
  [[nodiscard]] const std::vector<std::string> &columns() const { return columns_; }
  [[nodiscard]] std::optional<size_t> find(std::string_view column) const;
  // Index of a column that must be there; throws Failure naming what the header has.
  [[nodiscard]] size_t need(std::string_view column) const;

  [[nodiscard]] std::string_view text(size_t row, size_t column) const {
    return cells_[row * columns_.size() + column];
  }
  // NaN where the field is empty (or the column is not there). Throws Failure where the text is not a number.
  [[nodiscard]] double number(size_t row, size_t column) const;
  [[nodiscard]] double number(size_t row, std::optional<size_t> column) const;
  // As in recordings: the difference of two stamps in ns fits into 64 bits.
  static constexpr int64_t kIntegerLimit = 4'000'000'000'000'000'000;
  // Throws Failure where the field is empty, not a whole number of 64 bits, or beyond kIntegerLimit.
  [[nodiscard]] int64_t integer(size_t row, size_t column) const;
  // "FILE:LINE: COLUMN" of a cell, for messages.
  [[nodiscard]] std::string where(size_t row, size_t column) const;

 private:
  std::string path_;
  std::vector<char> bytes_;  // what the cells look into; a vector, as it stays in place when moved
  std::vector<std::string> columns_;
  std::vector<std::string_view> cells_;
  std::vector<size_t> lines_;
};

}  // namespace wm::tools
