// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdio>
#include <set>
#include <string>
#include <vector>

#include "simulate/angle.h"
#include "simulate/scenario.h"
#include "waymark/yaml.h"

namespace wm::sim {

inline constexpr double kMilli = 1e-3, kPercent = 1e-2;
inline constexpr double kFar_m = 1e5;

// Reads values out of maps until something is wrong; from then on does nothing and keeps the first error.
class Reader {
 public:
  explicit Reader(wm_error *err) : err_(err) {}
  wm_status status() const { return status_; }
  bool ok() const { return status_ == WM_OK; }
  wm_error *error() const { return err_; }
  void take(wm_status status) {
    if (ok()) status_ = status;
  }

  // Refuses what is not a map, and keys that are not in `known` (NULL-terminated).
  void keys(const wm_yaml_node &map, const char *const *known) {
    if (ok()) take(wm_yaml_check_keys(&map, known, WM_YAML_STRICT, nullptr, err_));
  }
  wm_yaml_node child(const wm_yaml_node &map, const char *key, bool required) {
    wm_yaml_node node{};
    if (!ok()) return node;
    node = wm_yaml_get(&map, key);
    if (required && !wm_yaml_there(&node)) fail(map, (std::string("`") + key + "` is missing here").c_str());
    return node;
  }
  // out = scale * value; left alone when the key isn't there.
  void number(const wm_yaml_node &map, const char *key, double min, double max, double scale, double &out,
              bool required = false) {
    const wm_yaml_node node = child(map, key, required);
    if (!ok() || !wm_yaml_there(&node)) return;
    double value = 0;
    take(wm_yaml_f64(&node, min, max, &value, err_));
    if (ok()) out = value * scale;
  }
  void integer(const wm_yaml_node &map, const char *key, int64_t min, int64_t max, int64_t &out,
               bool required = false) {
    const wm_yaml_node node = child(map, key, required);
    if (ok() && wm_yaml_there(&node)) take(wm_yaml_i64(&node, min, max, &out, err_));
  }
  void text(const wm_yaml_node &map, const char *key, std::string &out, bool required = false) {
    const wm_yaml_node node = child(map, key, required);
    if (!ok() || !wm_yaml_there(&node)) return;
    char buffer[512];
    take(wm_yaml_string(&node, buffer, sizeof buffer, err_));
    if (ok()) out = buffer;
  }
  void flag(const wm_yaml_node &map, const char *key, bool &out) {
    const wm_yaml_node node = child(map, key, false);
    int value = 0;
    if (!ok() || !wm_yaml_there(&node)) return;
    take(wm_yaml_bool(&node, &value, err_));
    if (ok()) out = value != 0;
  }
  // One of `words` (NULL-terminated): its number in `out`.
  void word(const wm_yaml_node &map, const char *key, const char *const *words, int &out, bool required = false) {
    const wm_yaml_node node = child(map, key, required);
    if (ok() && wm_yaml_there(&node)) take(wm_yaml_choice(&node, words, &out, err_));
  }
  // Two numbers, the second at least the first.
  void range(const wm_yaml_node &map, const char *key, double min, double max, double *out) {
    double both[2];
    const wm_yaml_node node = child(map, key, false);
    if (!ok() || !wm_yaml_there(&node) || numbers(map, key, 2, 2, both) != 2 || !ok()) return;
    if (both[0] < min || both[1] > max || both[0] > both[1]) {
      char text[128];
      std::snprintf(text, sizeof text, "two numbers from %g to %g, the smaller one first", min, max);
      return fail(node, text);
    }
    out[0] = both[0];
    out[1] = both[1];
  }
  size_t numbers(const wm_yaml_node &map, const char *key, size_t min_count, size_t max_count, double *out,
                 bool required = false) {
    const wm_yaml_node node = child(map, key, required);
    size_t count = 0;
    if (ok() && wm_yaml_there(&node)) take(wm_yaml_f64_list(&node, min_count, max_count, out, &count, err_));
    return count;
  }
  // The items of a list.
  size_t list(const wm_yaml_node &node) {
    if (!ok() || !wm_yaml_there(&node)) return 0;
    if (!wm_yaml_is_list(&node)) fail(node, "a list is needed here");
    return ok() ? wm_yaml_count(&node) : 0;
  }
  void fail(const wm_yaml_node &node, const char *what) {
    if (ok())
      take(wm_fail(err_, WM_BAD_CONFIG, "%s:%d: %s: %s", wm_yaml_file(&node), wm_yaml_line(&node),
                   node.path[0] ? node.path : "scenario", what));
  }

 private:
  wm_error *err_;
  wm_status status_ = WM_OK;
};

// A list of cameras, each with a name of its own.
template <class Item>
void read_named(Reader &r, const wm_yaml_node &list, void (*read_one)(Reader &, const wm_yaml_node &, Item &),
                std::vector<Item> &out) {
  std::set<std::string> names;
  for (size_t i = 0, n = r.list(list); i < n && r.ok(); i++) {
    const wm_yaml_node node = wm_yaml_item(&list, i);
    Item item;
    read_one(r, node, item);
    if (r.ok() && !names.insert(item.name).second)
      r.fail(node, "this name is there already; each camera needs its own");
    out.push_back(item);
  }
}

// Keys that only worlds with pictures have: `pictures`, and `cameras` that change the world's own.
void read_pictures(Reader &r, const wm_yaml_node &map, Pictures &out);
void read_pixel_cameras(Reader &r, const wm_yaml_node &list, Scenario &out);
// Sensors; landmarks drawn by the seed; the way of a vehicle with six degrees of freedom.
void read_sensors(Reader &r, const wm_yaml_node &list, Scenario &out);
void read_scatter(Reader &r, const wm_yaml_node &map, Scenario &out);
void read_path(Reader &r, const wm_yaml_node &map, Scenario &out);
// The base, and what measures its motion.
void read_motion(Reader &r, const wm_yaml_node &map, Scenario &out);

}  // namespace wm::sim
