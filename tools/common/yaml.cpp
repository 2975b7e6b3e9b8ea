// SPDX-License-Identifier: Apache-2.0
#include "common/yaml.h"

#include <array>

#include "common/failure.h"

namespace wm::tools {

Yaml::Yaml(const std::filesystem::path &file) {
  if (!std::filesystem::exists(file)) return;
  wm_error error{};
  if (wm_yaml_load(file.c_str(), &doc_, &error) != WM_OK) throw Failure(error.text);
}

Yaml::~Yaml() { wm_yaml_free(doc_); }

wm_yaml_node Yaml::root() const { return doc_ == nullptr ? wm_yaml_node{} : wm_yaml_root(doc_); }

std::string Yaml::text(const char *key) const {
  const wm_yaml_node map = root();
  if (!wm_yaml_there(&map)) return "";
  const wm_yaml_node node = wm_yaml_get(&map, key);
  if (!wm_yaml_there(&node) || !wm_yaml_is_scalar(&node)) return "";
  std::string out(4096, '\0');
  if (wm_yaml_string(&node, out.data(), out.size(), nullptr) != WM_OK) return "";
  out.resize(out.find('\0'));
  return out;
}

std::vector<double> Yaml::numbers(const wm_yaml_node &map, const char *key) const {
  if (!wm_yaml_there(&map)) return {};
  const wm_yaml_node node = wm_yaml_get(&map, key);
  if (!wm_yaml_there(&node)) return {};
  std::array<double, 64> values{};
  size_t count = 0;
  wm_error error{};
  if (wm_yaml_f64_list(&node, 1, values.size(), values.data(), &count, &error) != WM_OK) throw Failure(error.text);
  return {values.begin(), values.begin() + static_cast<std::ptrdiff_t>(count)};
}

std::vector<std::pair<std::string, wm_yaml_node>> Yaml::children(const char *key) const {
  const wm_yaml_node map = root();
  if (!wm_yaml_there(&map)) return {};
  const wm_yaml_node node = wm_yaml_get(&map, key);
  std::vector<std::pair<std::string, wm_yaml_node>> out;
  if (!wm_yaml_there(&node) || !wm_yaml_is_map(&node)) return out;
  for (size_t i = 0; i < wm_yaml_count(&node); ++i) {
    const char *name = nullptr;
    const wm_yaml_node value = wm_yaml_value(&node, i, &name, nullptr);
    out.emplace_back(name, value);
  }
  return out;
}

}  // namespace wm::tools
