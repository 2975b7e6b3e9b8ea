// SPDX-License-Identifier: Apache-2.0
// A small YAML or XML file of another program as a table: "camera_matrix.data" -> the words that stand there, however
// they are nested. What other programs write is read leniently; what is needed of it is checked by who asks.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace wm::calibrate {

inline constexpr const char *kUnderstood =
    "files of OpenCV, Kalibr (camchain), ROS (camera_info, ost.ini), PhotonVision and OCamCalib (calib_results.txt) "
    "are "
    "understood";

class FlatFile {
 public:
  struct Entry {
    std::vector<std::string> words;
    int line = 0;
  };

  // YAML (also OpenCV's, whose first line is none) or, where it begins with '<', XML without its outermost element.
  // Throws tools::Failure with file and line.
  static FlatFile load(const std::filesystem::path &path);
  static FlatFile parse(std::string text, const std::string &path);

  [[nodiscard]] const Entry *find(const std::string &key) const;
  // The first of the keys that is there, or nullptr.
  [[nodiscard]] const Entry *first(const std::vector<std::string> &keys) const;
  [[nodiscard]] bool has(const std::string &key) const { return find(key) != nullptr; }
  // The text of a key, "" where it isn't there.
  [[nodiscard]] std::string text(const std::string &key) const;
  // Numbers of an entry. Throws Failure with file, line and key where a word is none, or is not finite.
  [[nodiscard]] std::vector<double> numbers(const std::string &key) const;
  // Names directly under a key ("" for the top), in the order of the file.
  [[nodiscard]] std::vector<std::string> children(const std::string &key) const;
  // "FILE:LINE: KEY: text" as a Failure to throw.
  [[noreturn]] void fail(const std::string &key, const std::string &text) const;
  [[nodiscard]] const std::string &path() const { return path_; }
  // What is below a key, as a file of its own.
  [[nodiscard]] FlatFile below(const std::string &key) const;
  // Documents of the YAML (parted by lines of ---) behind the first one, which alone is read.
  [[nodiscard]] size_t further_documents() const { return further_documents_; }
  // A text without its first document, whose lines are blank then.
  [[nodiscard]] static std::string behind_first(const std::string &text);

 private:
  friend class Flattener;
  void read_yaml(const std::string &text);
  void read_xml(const std::string &text);
  Entry &at(const std::string &key, int line);

  std::string path_;
  size_t further_documents_ = 0;
  std::map<std::string, Entry> entries_;
  std::vector<std::string> order_;
};

}  // namespace wm::calibrate
