// SPDX-License-Identifier: Apache-2.0
// A YAML file as the desk's commands read it: what is there is taken, what isn't is empty.
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "waymark/yaml.h"

namespace wm::tools {

class Yaml {
 public:
  // Empty where the file is not there; throws Failure where it is no YAML.
  explicit Yaml(const std::filesystem::path &file);
  ~Yaml();
  Yaml(const Yaml &) = delete;
  Yaml &operator=(const Yaml &) = delete;

  // A scalar by its key ("a.b" goes down); "" where it is not there or no scalar.
  [[nodiscard]] std::string text(const char *key) const;
  // Numbers of a list; empty where it is not there. Throws Failure where they are no numbers.
  [[nodiscard]] std::vector<double> numbers(const char *key) const { return numbers(root(), key); }
  [[nodiscard]] std::vector<double> numbers(const wm_yaml_node &map, const char *key) const;
  // Keys and values of the map by that key.
  [[nodiscard]] std::vector<std::pair<std::string, wm_yaml_node>> children(const char *key) const;

 private:
  [[nodiscard]] wm_yaml_node root() const;
  wm_yaml *doc_ = nullptr;
};

}  // namespace wm::tools
