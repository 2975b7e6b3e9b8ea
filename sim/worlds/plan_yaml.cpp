// SPDX-License-Identifier: Apache-2.0
// A plan of polylines with thickness, from YAML.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>

#include "waymark/internal/math/elementary.hpp"
#include "waymark/yaml.h"
#include "worlds/plan.h"

namespace wm::sim {
namespace {

constexpr double kFar_m = 1e4;

struct Opening {
  enum class Kind { opening, door, window };
  double from_m, to_m;  // along the wall
  Kind kind;
  double height_m, sill_m;
};

double length_of(Point a, Point b) {
  const double dx = b.x_m - a.x_m, dy = b.y_m - a.y_m;
  return std::sqrt(dx * dx + dy * dy);
}

// A wall's middle line, asked by the way along it.
class Line {
 public:
  Line(std::vector<Point> points, bool closed) : points_(std::move(points)), closed_(closed) {
    if (closed_) points_.push_back(points_.front());
    way_.push_back(0);
    for (size_t i = 1; i < points_.size(); i++) way_.push_back(way_.back() + length_of(points_[i - 1], points_[i]));
  }
  double length_m() const { return way_.back(); }
  bool closed() const { return closed_; }

  // The outline, counter-clockwise, of the wall between two places; corners are mitred. `to` may be beyond the end of
  // a closed line.
  std::vector<Point> strip(double from, double to, double thickness) const {
    std::vector<Point> right, left;
    const auto add = [&](Point p, double nx, double ny) {  // (nx, ny): to the left, mitred
      left.push_back({p.x_m + 0.5 * thickness * nx, p.y_m + 0.5 * thickness * ny});
      right.push_back({p.x_m - 0.5 * thickness * nx, p.y_m - 0.5 * thickness * ny});
    };
    const auto end = [&](double way) {
      const double s = std::fmod(way, length_m() * (1 + 1e-15));
      size_t i = 1;
      while (i + 1 < way_.size() && way_[i] < s) i++;
      const auto [nx, ny] = normal(i);
      const double u = (s - way_[i - 1]) / (way_[i] - way_[i - 1]);
      add({points_[i - 1].x_m + u * (points_[i].x_m - points_[i - 1].x_m),
           points_[i - 1].y_m + u * (points_[i].y_m - points_[i - 1].y_m)},
          nx, ny);
    };
    end(from);
    for (int lap = 0; lap < (closed_ ? 2 : 1); lap++)
      for (size_t i = lap == 0 ? 1 : 0; i + 1 < points_.size(); i++) {
        const double s = way_[i] + lap * length_m();
        if (s <= from + 1e-9 || s >= to - 1e-9) continue;
        corner(i, add);
      }
    end(to);
    right.insert(right.end(), left.rbegin(), left.rend());
    return right;
  }
  // A closed line without openings: the ring's two outlines (to the right and to the left of the line), as the line
  // runs.
  std::pair<std::vector<Point>, std::vector<Point>> rings(double thickness) const {
    std::vector<Point> right, left;
    for (size_t i = 0; i + 1 < points_.size(); i++)
      corner(i, [&](Point p, double nx, double ny) {
        left.push_back({p.x_m + 0.5 * thickness * nx, p.y_m + 0.5 * thickness * ny});
        right.push_back({p.x_m - 0.5 * thickness * nx, p.y_m - 0.5 * thickness * ny});
      });
    return {right, left};
  }

 private:
  // Unit vector to the left of piece i (from point i - 1 to point i).
  std::pair<double, double> normal(size_t i) const {
    const double l = way_[i] - way_[i - 1];
    return {-(points_[i].y_m - points_[i - 1].y_m) / l, (points_[i].x_m - points_[i - 1].x_m) / l};
  }
  template <typename Add>
  void corner(size_t i, const Add &add) const {
    const size_t last = points_.size() - 1;
    const auto [ax, ay] = normal(i == 0 ? last : i);
    const auto [bx, by] = normal(i == 0 ? 1 : i + 1);
    // The mitre: along the mean of both normals, so long that its share along each is 1; sharp corners are blunted.
    const double k = 1 / std::max(0.25, 1 + ax * bx + ay * by);
    add(points_[i], (ax + bx) * k, (ay + by) * k);
  }

  std::vector<Point> points_;
  bool closed_;
  std::vector<double> way_;
};

class Reader {
 public:
  Reader(wm_error *err, Plan &plan) : err_(err), plan_(plan) {}
  wm_status status() const { return status_; }

  void read(const wm_yaml_node &root) {
    static const char *const known[] = {"format",  "ceiling_m", "outside", "rooms", "walls",
                                        "pillars", "shelves",   "clutter", nullptr};
    take(wm_yaml_check_keys(&root, known, WM_YAML_STRICT, nullptr, err_));
    static const char *const formats[] = {"waymark-plan/1", nullptr}, *const outsides[] = {"solid", "free", nullptr};
    int32_t choice = 0;
    wm_yaml_node node = wm_yaml_get(&root, "format");
    if (ok() && !wm_yaml_there(&node)) take(wm_yaml_fail(&root, err_, "`format: waymark-plan/1` is missing"));
    if (ok()) take(wm_yaml_choice(&node, formats, &choice, err_));
    number(root, "ceiling_m", 0.5, 50, plan_.ceiling_m);
    plan_.outside_is_solid = false;
    node = wm_yaml_get(&root, "outside");
    if (ok() && wm_yaml_there(&node)) {
      take(wm_yaml_choice(&node, outsides, &choice, err_));
      plan_.outside_is_solid = choice == 0;
    }
    each(root, "rooms", [&](const wm_yaml_node &item) { room(item); });
    each(root, "walls", [&](const wm_yaml_node &item) { wall(item); });
    each(root, "pillars", [&](const wm_yaml_node &item) { body(item, Surface::pillar, plan_.ceiling_m, true); });
    each(root, "shelves", [&](const wm_yaml_node &item) { body(item, Surface::shelf, 2.0, true); });
    each(root, "clutter", [&](const wm_yaml_node &item) { body(item, Surface::carton, 0.5, false); });
  }

 private:
  bool ok() const { return status_ == WM_OK; }
  void take(wm_status status) {
    if (ok()) status_ = status;
  }
  void number(const wm_yaml_node &map, const char *key, double min, double max, double &out) {
    const wm_yaml_node node = wm_yaml_get(&map, key);
    if (ok() && wm_yaml_there(&node)) take(wm_yaml_f64(&node, min, max, &out, err_));
  }
  template <typename Do>
  void each(const wm_yaml_node &map, const char *key, const Do &act) {
    const wm_yaml_node list = wm_yaml_get(&map, key);
    if (!ok() || !wm_yaml_there(&list)) return;
    if (!wm_yaml_is_list(&list)) return take(wm_yaml_fail(&list, err_, "a list is needed here"));
    for (size_t i = 0; i < wm_yaml_count(&list) && ok(); i++) act(wm_yaml_item(&list, i));
  }
  std::vector<Point> points(const wm_yaml_node &list, size_t least) {
    std::vector<Point> out;
    if (!ok()) return out;
    if (!wm_yaml_is_list(&list) || wm_yaml_count(&list) < least) {
      take(wm_yaml_fail(&list, err_, "a list of at least %zu points [x, y] in metres is needed here", least));
      return out;
    }
    for (size_t i = 0; i < wm_yaml_count(&list) && ok(); i++) {
      const wm_yaml_node item = wm_yaml_item(&list, i);
      double xy[2];
      size_t count = 0;
      take(wm_yaml_f64_list(&item, 2, 2, xy, &count, err_));
      if (!ok()) break;
      const bool same = !out.empty() && out.back().x_m == xy[0] && out.back().y_m == xy[1];
      if (same || std::fabs(xy[0]) > kFar_m || std::fabs(xy[1]) > kFar_m)
        take(wm_yaml_fail(&item, err_, "a point within %g m that differs from the one before is needed here", kFar_m));
      out.push_back({xy[0], xy[1]});
    }
    return out;
  }
  void room(const wm_yaml_node &item) {
    std::vector<Point> p = points(item, 3);
    double area = 0;
    for (size_t i = 0; i < p.size(); i++) {
      const Point a = p[i], b = p[(i + 1) % p.size()];
      area += a.x_m * b.y_m - b.x_m * a.y_m;
    }
    if (area < 0) std::reverse(p.begin(), p.end());
    for (size_t i = 0; i < p.size(); i++) plan_.faces.push_back({p[i], p[(i + 1) % p.size()], 0, plan_.ceiling_m});
  }
  void body(const wm_yaml_node &item, Surface surface, double height, bool mapped) {
    static const char *const known[] = {"xy_m", "size_m", "yaw_deg", "height_m", nullptr};
    if (ok()) take(wm_yaml_check_keys(&item, known, WM_YAML_STRICT, nullptr, err_));
    double xy[2] = {0, 0}, size[2] = {0.4, 0.4}, yaw_deg = 0;
    size_t count = 0;
    wm_yaml_node node = wm_yaml_get(&item, "xy_m");
    if (ok() && !wm_yaml_there(&node)) take(wm_yaml_fail(&item, err_, "`xy_m: [x, y]` is missing here"));
    if (ok()) take(wm_yaml_f64_list(&node, 2, 2, xy, &count, err_));
    node = wm_yaml_get(&item, "size_m");
    if (ok() && wm_yaml_there(&node)) {
      take(wm_yaml_f64_list(&node, 2, 2, size, &count, err_));
      if (ok() && !(size[0] > 0 && size[1] > 0)) take(wm_yaml_fail(&node, err_, "sizes above 0 are wanted here"));
    }
    number(item, "yaw_deg", -360, 360, yaw_deg);
    number(item, "height_m", 0.01, plan_.ceiling_m, height);
    if (ok())
      plan_.add_body(turned_box({xy[0], xy[1]}, size[0], size[1], yaw_deg * kPi / 180), 0, height, surface, mapped);
  }
  void wall(const wm_yaml_node &item) {
    static const char *const known[] = {"points_m", "thickness_m", "height_m", "closed", "openings", nullptr};
    if (ok()) take(wm_yaml_check_keys(&item, known, WM_YAML_STRICT, nullptr, err_));
    const wm_yaml_node list = wm_yaml_get(&item, "points_m"), flag = wm_yaml_get(&item, "closed");
    if (ok() && !wm_yaml_there(&list)) take(wm_yaml_fail(&item, err_, "`points_m` is missing here"));
    int closed = 0;
    if (ok() && wm_yaml_there(&flag)) take(wm_yaml_bool(&flag, &closed, err_));
    const std::vector<Point> p = points(list, closed ? 3 : 2);
    double thickness = 0.15, height = plan_.ceiling_m;
    number(item, "thickness_m", 0.01, 2, thickness);
    number(item, "height_m", 0.05, plan_.ceiling_m, height);
    if (!ok()) return;
    const Line line(p, closed != 0);
    std::vector<Opening> openings;
    each(item, "openings", [&](const wm_yaml_node &o) { opening(o, line.length_m(), height, openings); });
    if (ok()) build(line, thickness, height, openings);
  }
  void opening(const wm_yaml_node &item, double length, double wall_height, std::vector<Opening> &out) {
    static const char *const known[] = {"at_m", "width_m", "kind", "height_m", "sill_m", nullptr}, *const kinds[] = {
                                                                                                       "opening",
                                                                                                       "door", "window",
                                                                                                       nullptr};
    take(wm_yaml_check_keys(&item, known, WM_YAML_STRICT, nullptr, err_));
    double at = 0, width = 0.9, sill = 0.9, opening_height = 2.1;
    int32_t kind = 0;
    const wm_yaml_node node = wm_yaml_get(&item, "kind");
    if (ok() && wm_yaml_there(&node)) take(wm_yaml_choice(&node, kinds, &kind, err_));
    if (kind == 2) opening_height = 1.2;
    number(item, "at_m", 0, length, at);
    number(item, "width_m", 0.05, length, width);
    number(item, "height_m", 0.05, wall_height, opening_height);
    number(item, "sill_m", 0, wall_height, sill);
    if (!ok()) return;
    const double from = at - 0.5 * width, to = at + 0.5 * width, before = out.empty() ? 0 : out.back().to_m;
    if (from < before || to > length)
      return take(wm_yaml_fail(&item, err_,
                               "spans %g to %g m of a wall of %g m; openings stand in order, without overlap, inside "
                               "of it (`at_m` is the middle)",
                               from, to, length));
    out.push_back({from, to, static_cast<Opening::Kind>(kind), opening_height, sill});
  }
  void build(const Line &line, double thickness, double height, const std::vector<Opening> &openings) {
    constexpr double kLeaf_m = 0.04;
    if (line.closed() && openings.empty()) {
      const auto [right, left] = line.rings(thickness);
      // Outside to the right of a counter-clockwise line; free space lies left of faces, so one ring runs back.
      for (size_t n = right.size(), i = 0; i < n; i++) {
        plan_.faces.push_back({right[(i + 1) % n], right[i], 0, height});
        plan_.faces.push_back({left[i], left[(i + 1) % n], 0, height});
      }
      return;
    }
    double from = line.closed() ? openings.front().to_m : 0;
    const double end = line.closed() ? openings.front().from_m + line.length_m() : line.length_m();
    for (size_t i = line.closed() ? 1 : 0; i < openings.size(); i++) {
      solid(line, from, openings[i].from_m, thickness, 0, height, Surface::wall);
      from = openings[i].to_m;
    }
    solid(line, from, end, thickness, 0, height, Surface::wall);
    for (const Opening &o : openings) {
      const double bottom = o.kind == Opening::Kind::window ? o.sill_m : 0, top = std::min(height, bottom + o.height_m);
      if (o.kind == Opening::Kind::door) solid(line, o.from_m, o.to_m, kLeaf_m, 0, top, Surface::door);
      if (o.kind == Opening::Kind::window) {
        solid(line, o.from_m, o.to_m, thickness, 0, bottom, Surface::wall);
        solid(line, o.from_m, o.to_m, kLeaf_m, bottom, top, Surface::window);
      }
      solid(line, o.from_m, o.to_m, thickness, top, height, Surface::wall);
    }
  }
  void solid(const Line &line, double from, double to, double thickness, double bottom, double top, Surface surface) {
    if (to - from > 1e-6 && top - bottom > 1e-6)
      plan_.add_body(line.strip(from, to, thickness), bottom, top, surface, true);
  }

  wm_error *err_;
  Plan &plan_;
  wm_status status_ = WM_OK;
};

wm_status read_document(wm_yaml *doc, Plan &out, wm_error *err) {
  const std::unique_ptr<wm_yaml, decltype(&wm_yaml_free)> owner(doc, wm_yaml_free);
  out = Plan{};
  Reader reader(err, out);
  reader.read(wm_yaml_root(doc));
  return reader.status();
}

}  // namespace

wm_status load_plan(const std::string &path, Plan &out, wm_error *err) {
  wm_yaml *doc = nullptr;
  if (const wm_status status = wm_yaml_load(path.c_str(), &doc, err); status != WM_OK) return status;
  return read_document(doc, out, err);
}

wm_status parse_plan(const std::string &text, const std::string &path, Plan &out, wm_error *err) {
  wm_yaml *doc = nullptr;
  if (const wm_status status = wm_yaml_parse(text.data(), text.size(), path.c_str(), &doc, err); status != WM_OK)
    return status;
  return read_document(doc, out, err);
}

}  // namespace wm::sim
