// SPDX-License-Identifier: Apache-2.0
// `waymark-web --edit SITE`: a building as JSON and pictures, and versions of it from a person's edits. Called by one
// thread; a version that is saved, checked and synced keeps other requests waiting meanwhile.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "web/map_view.h"
#include "web/server.h"

namespace wm::tools {

class Editor {
 public:
  // Without this token in the head X-Waymark-Token nothing is answered.
  static constexpr size_t kTokenDigits = 32;
  static std::string make_token();  // 128 random bits; throws Failure

  // `drives`: runs whose poses are drawn. Throws Failure where the folder is no building, or a run has no poses.
  Editor(std::filesystem::path site, const std::vector<std::string> &drives, std::string token);

  // GET /site.json, /newest.json, /plan.png?floor=N&layer=NAME; POST /version. 404 for others.
  WebAnswer answer(const WebRequest &request);

 private:
  struct Shown {  // of one state of the files
    std::string hash;
    std::vector<std::string> wrong, odd;
    std::vector<MapView> plans;
  };
  const Shown &shown();
  WebAnswer site_json();
  WebAnswer plan(const WebRequest &request);
  WebAnswer save(const WebRequest &request);

  std::filesystem::path site_;
  std::string token_;
  std::string drives_;  // JSON
  Shown shown_;
};

}  // namespace wm::tools
