// SPDX-License-Identifier: Apache-2.0
#include "init/text_file.h"

#include <sstream>

#include "common/unpacked.h"

namespace wm::init {

std::string read_text(const std::filesystem::path &path) { return tools::read_unpacked(path); }

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
