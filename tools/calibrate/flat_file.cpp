// SPDX-License-Identifier: Apache-2.0
#include "calibrate/flat_file.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <memory>
#include <sstream>

#include "common/failure.h"
#include "common/number.h"
#include "waymark/yaml.h"

namespace wm::calibrate {

using tools::Failure;

class Flattener {
 public:
  explicit Flattener(FlatFile &out) : out_(out) {}

  void add(const wm_yaml_node &node, const std::string &key) {
    if (wm_yaml_is_map(&node)) {
      for (size_t i = 0; i < wm_yaml_count(&node); i++) {
        const char *name = nullptr;
        int line = 0;
        const wm_yaml_node value = wm_yaml_value(&node, i, &name, &line);
        const std::string below = key.empty() ? name : key + "." + name;
        out_.at(below, line);
        add(value, below);
      }
    } else if (wm_yaml_is_list(&node)) {
      for (size_t i = 0; i < wm_yaml_count(&node); i++) {
        const wm_yaml_node item = wm_yaml_item(&node, i);
        add(item, wm_yaml_is_map(&item) ? key + "." + std::to_string(i) : key);
      }
    } else if (wm_yaml_is_scalar(&node)) {
      char text[256] = "";
      wm_error error{};
      if (wm_yaml_string(&node, text, sizeof text, &error) == WM_OK)
        out_.at(key, wm_yaml_line(&node)).words.emplace_back(text);
    }
  }

 private:
  FlatFile &out_;
};

FlatFile::Entry &FlatFile::at(const std::string &key, int line) {
  const auto [place, is_new] = entries_.try_emplace(key);
  if (is_new) {
    place->second.line = line;
    order_.push_back(key);
  }
  return place->second;
}

namespace {

// The end of the first document: a line "---" or "..." behind something that is neither blank nor a comment, as
// `ros2 topic echo` writes it behind each message. `further`: documents behind it.
size_t first_document(const std::string &text, size_t &further) {
  size_t end = text.size();
  bool has_content = false;
  for (size_t at = 0; at < text.size();) {
    const size_t next = std::min(text.find_first_of("\r\n", at), text.size());
    const std::string line = text.substr(at, next - at);
    const bool parts = line == "---" || line == "..." || line.starts_with("--- ");
    if (parts && has_content) {
      end = std::min(end, at);
      has_content = false;
    } else if (!parts && line.find_first_not_of(" \t\xEF\xBB\xBF") != std::string::npos && line[0] != '#' &&
               line[0] != '%') {
      further += end < text.size() && !has_content;
      has_content = true;
    }
    at = next + 1;
  }
  return end;
}

}  // namespace

std::string FlatFile::behind_first(const std::string &text) {
  size_t further = 0;
  const size_t end = first_document(text, further);
  const auto lines = std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(end), '\n');
  return std::string(static_cast<size_t>(lines), '\n') + text.substr(end);
}

void FlatFile::read_yaml(const std::string &whole) {
  const std::string text = whole.substr(0, first_document(whole, further_documents_));
  wm_error error{};
  wm_yaml *parsed = nullptr;
  const wm_status status = wm_yaml_parse(text.data(), text.size(), path_.c_str(), &parsed, &error);
  const std::unique_ptr<wm_yaml, void (*)(wm_yaml *)> doc(parsed, wm_yaml_free);
  if (status != WM_OK) throw Failure(std::string(error.text) + "; " + kUnderstood);
  const wm_yaml_node root = wm_yaml_root(doc.get());
  if (!wm_yaml_is_map(&root)) throw Failure(path_ + ": no calibration: KEY: VALUE lines are needed; " + kUnderstood);
  Flattener(*this).add(root, "");
}

// Elements and their text; attributes, comments and declarations are passed over.
void FlatFile::read_xml(const std::string &text) {
  std::vector<std::string> open;
  int line = 1;
  size_t at_char = 0;
  const auto key = [&] {
    std::string out;
    for (size_t i = 1; i < open.size(); i++) out += (out.empty() ? "" : ".") + open[i];
    return out;
  };
  const auto skip = [&](size_t to) {
    line += static_cast<int>(std::count(text.begin() + static_cast<std::ptrdiff_t>(at_char),
                                        text.begin() + static_cast<std::ptrdiff_t>(to), '\n'));
    at_char = to;
  };
  while (at_char < text.size()) {
    const size_t tag = std::min(text.find('<', at_char), text.size());
    std::istringstream words(text.substr(at_char, tag - at_char));
    for (std::string word; words >> word;) {
      word.erase(std::remove(word.begin(), word.end(), '"'), word.end());
      if (open.size() > 1) at(key(), line).words.push_back(word);
    }
    skip(tag);
    if (tag == text.size()) break;
    const bool comment = text.compare(tag, 4, "<!--") == 0;
    const size_t end = text.find(comment ? "-->" : ">", tag);
    if (end == std::string::npos) throw Failure(path_ + ":" + std::to_string(line) + ": this XML tag has no end ('>')");
    std::string name = comment ? "!" : text.substr(tag + 1, end - tag - 1);
    if (name.starts_with('/')) {
      if (open.empty() || open.back() != name.substr(1, name.find_last_not_of(" \t\r\n")))
        throw Failure(path_ + ":" + std::to_string(line) + ": </" + name.substr(1) + "> closes what isn't open");
      open.pop_back();
    } else if (!name.starts_with('?') && !name.starts_with('!')) {
      const bool closed = name.ends_with('/');
      open.push_back(name.substr(0, name.find_first_of(" \t\r\n/")));
      if (open.size() > 1) at(key(), line);
      if (closed) open.pop_back();
    }
    skip(end + (comment ? 3 : 1));
  }
  if (!open.empty()) throw Failure(path_ + ": <" + open.back() + "> is never closed: was the file cut off?");
}

FlatFile FlatFile::parse(std::string text, const std::string &path) {
  FlatFile out;
  out.path_ = path;
  const size_t start = std::min(text.find_first_not_of(" \t\r\n\xEF\xBB\xBF"), text.size());
  if (text.compare(start, 1, "<") == 0) {
    out.read_xml(text);
    return out;
  }
  // OpenCV's "%YAML:1.0" is no YAML directive; blanks keep the columns.
  if (text.compare(start, 6, "%YAML:") == 0)
    for (size_t i = start; i < text.size() && text[i] != '\n'; i++) text[i] = ' ';
  out.read_yaml(text);
  return out;
}

FlatFile FlatFile::load(const std::filesystem::path &path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw Failure(path.string() + ": cannot be read: " + std::strerror(errno));
  std::stringstream text;
  text << file.rdbuf();
  if (std::filesystem::is_directory(path)) throw Failure(path.string() + ": is a folder; a file is needed");
  return parse(text.str(), path.string());
}

const FlatFile::Entry *FlatFile::find(const std::string &key) const {
  const auto place = entries_.find(key);
  return place == entries_.end() ? nullptr : &place->second;
}

const FlatFile::Entry *FlatFile::first(const std::vector<std::string> &keys) const {
  for (const std::string &key : keys)
    if (const Entry *entry = find(key)) return entry;
  return nullptr;
}

std::string FlatFile::text(const std::string &key) const {
  const Entry *entry = find(key);
  return entry == nullptr || entry->words.empty() ? "" : entry->words.front();
}

std::vector<double> FlatFile::numbers(const std::string &key) const {
  const Entry *entry = find(key);
  std::vector<double> out;
  if (entry == nullptr) return out;
  for (const std::string &word : entry->words) {
    const std::optional<double> value = tools::number_of<double>(word);
    if (!value || !std::isfinite(*value)) fail(key, "'" + word + "' is not a number");
    out.push_back(*value);
  }
  return out;
}

FlatFile FlatFile::below(const std::string &key) const {
  FlatFile out;
  out.path_ = path_;
  const std::string prefix = key + ".";
  for (const std::string &name : order_) {
    if (!name.starts_with(prefix)) continue;
    out.order_.push_back(name.substr(prefix.size()));
    out.entries_[out.order_.back()] = entries_.at(name);
  }
  return out;
}

std::vector<std::string> FlatFile::children(const std::string &key) const {
  std::vector<std::string> out;
  const std::string prefix = key.empty() ? "" : key + ".";
  for (const std::string &name : order_)
    if (name.starts_with(prefix) && name.find('.', prefix.size()) == std::string::npos)
      out.push_back(name.substr(prefix.size()));
  return out;
}

void FlatFile::fail(const std::string &key, const std::string &text) const {
  const Entry *entry = find(key);
  throw Failure(path_ + ":" + (entry == nullptr ? "" : std::to_string(entry->line) + ":") + " " + key + ": " + text);
}

}  // namespace wm::calibrate
