// SPDX-License-Identifier: Apache-2.0
#include "init/text_file.h"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>

#include "common/failure.h"

namespace wm::init {

constexpr uintmax_t kLargest = 64U << 20U;

std::string read_text(const std::filesystem::path &path) {
  if (std::filesystem::is_directory(path)) throw tools::Failure(path.string() + ": is a folder; a file is needed");
  std::ifstream file(path, std::ios::binary);
  if (!file) throw tools::Failure(path.string() + ": cannot be read: " + std::strerror(errno));
  std::error_code unknown;
  if (std::filesystem::file_size(path, unknown) > kLargest && !unknown)
    throw tools::Failure(path.string() + ": is larger than 64 MB; is it the right file?");
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

std::string one_line(const std::string &text) {
  std::string out;
  bool is_odd = false;
  for (const char c : text) {
    const bool was_odd = is_odd;
    is_odd = c < ' ' || c > '~';
    if (!is_odd)
      out += c;
    else if (!was_odd)
      out += '?';
  }
  return out;
}

std::vector<std::string> split(const std::string &text) {
  std::istringstream words(text);
  std::vector<std::string> out;
  for (std::string word; words >> word;) out.push_back(word);
  return out;
}

}  // namespace wm::init
