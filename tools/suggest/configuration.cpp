// SPDX-License-Identifier: Apache-2.0
#include "suggest/configuration.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <utility>

#include "common/failure.h"
#include "common/program.h"
#include "waymark/yaml.h"

namespace wm::suggest {
namespace {

namespace fs = std::filesystem;
using Leaves = std::vector<std::pair<std::string, std::string>>;  // dotted key, text

constexpr const char *kFiles[] = {"calibration", "landmarks", "dbc",    "can_signals", "map",           "file",
                                  "saved_pose",  "saved_map", "folder", "socket",      "picture_socket"};

std::string text_of(const wm_yaml_node &node) {
  char text[512] = "";
  wm_error error{};
  tools::need_ok(wm_yaml_string(&node, text, sizeof text, &error), error);
  return text;
}

void collect(const wm_yaml_node &map, const std::string &prefix, Leaves &out) {
  for (size_t i = 0; i < wm_yaml_count(&map); i++) {
    const char *key = nullptr;
    const wm_yaml_node value = wm_yaml_value(&map, i, &key, nullptr);
    if (wm_yaml_is_map(&value))
      collect(value, prefix + key + ".", out);
    else if (wm_yaml_is_scalar(&value))
      out.emplace_back(prefix + key, text_of(value));
  }
}

// Names of files, as they are found from the folder of the new file.
void move_files(const wm_yaml_node &node, const fs::path &from, const fs::path &to,
                std::vector<std::pair<std::string, std::string>> &out) {
  for (size_t i = 0; i < wm_yaml_count(&node); i++) {
    const char *key = "";
    const wm_yaml_node value = wm_yaml_is_map(&node) ? wm_yaml_value(&node, i, &key, nullptr) : wm_yaml_item(&node, i);
    if (wm_yaml_is_map(&value) || wm_yaml_is_list(&value)) move_files(value, from, to, out);
    const bool is_file =
        std::any_of(std::begin(kFiles), std::end(kFiles), [&](const char *k) { return k == std::string(key); });
    if (!is_file || !wm_yaml_is_scalar(&value)) continue;
    const fs::path path = text_of(value);
    if (!path.is_absolute()) out.emplace_back(value.path, fs::proximate(from / path, to).string());
  }
}

std::string number(double value) {
  char text[32];
  (void)std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

// All of the document but these sections, and with files moved.
std::string written(const wm_yaml *doc, const std::vector<std::string> &left_out, const fs::path &from,
                    const fs::path &to) {
  std::vector<std::pair<std::string, std::string>> files;
  if (fs::weakly_canonical(from) != fs::weakly_canonical(to)) move_files(wm_yaml_root(doc), from, to, files);
  std::vector<wm_yaml_change> changes;
  for (const auto &[path, text] : files) {
    changes.push_back({{}, text.c_str()});
    (void)std::snprintf(changes.back().path, sizeof changes.back().path, "%s", path.c_str());
  }
  for (const std::string &section : left_out) {
    changes.push_back({{}, nullptr});
    (void)std::snprintf(changes.back().path, sizeof changes.back().path, "%s", section.c_str());
  }
  char *text = nullptr;
  size_t length = 0;
  std::FILE *stream = open_memstream(&text, &length);
  wm_error error{};
  const wm_status status = wm_yaml_write(doc, changes.data(), changes.size(), stream, &error);
  (void)std::fclose(stream);
  std::string out(text, length);
  std::free(text);
  tools::need_ok(status, error);
  return out;
}

}  // namespace

std::string changed_configuration(const wm_config &config, const std::vector<NewValue> &values, const std::string &head,
                                  const fs::path &file) {
  wm_error error{};
  wm_yaml *loaded = nullptr;
  tools::need_ok(wm_yaml_parse(config.text, config.text_length, config.path, &loaded, &error), error);
  const std::unique_ptr<wm_yaml, void (*)(wm_yaml *)> doc(loaded, wm_yaml_free);
  const wm_yaml_node root = wm_yaml_root(doc.get());

  std::vector<std::string> sections;
  for (const NewValue &value : values)
    if (std::find(sections.begin(), sections.end(), value.section) == sections.end()) sections.push_back(value.section);
  const fs::path from = fs::absolute(config.path).parent_path(), to = fs::absolute(file).parent_path();
  std::string out = head + written(doc.get(), sections, from, to);
  for (const std::string &section : sections) {
    Leaves leaves;
    const wm_yaml_node map = wm_yaml_get(&root, section.c_str());
    if (wm_yaml_there(&map)) collect(map, "", leaves);
    out += section + ":\n";
    const auto is_new = [&](const std::string &key) {
      return std::any_of(values.begin(), values.end(),
                         [&](const NewValue &v) { return v.section == section && v.key == key; });
    };
    for (const auto &leaf : leaves)
      if (!is_new(leaf.first)) out += "  " + leaf.first + ": " + leaf.second + "\n";
    for (const NewValue &value : values)
      if (value.section == section)
        out += "  " + value.key + ": " + number(value.value) + "  # " + value.comment + "\n";
  }
  wm_config read{};
  tools::need_ok(wm_config_parse_logged(out.c_str(), out.size(), file.c_str(), &read, &error), error);
  wm_config_free(&read);
  return out;
}

}  // namespace wm::suggest
