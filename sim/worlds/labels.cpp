// SPDX-License-Identifier: Apache-2.0
// What is really in a picture: true features through the true camera, where nothing stands before them.
#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>

#include "waymark/internal/math/elementary.hpp"
#include "worlds/world.h"

namespace wm::sim {
namespace {

using images::Vec2;
using images::Vec3;

// Looked-at points lie this far off their surfaces, so that these don't hide them.
constexpr double kOff_m = 0.004;

struct View {
  const World &world;
  const images::Camera &camera;
  const render::Shot &shot;

  // Where a point is in the picture; false outside of it, or when `off` (the same point, a little before its surface)
  // is hidden.
  bool sees(const Vec3 &point, const Vec3 &off, Vec2 &pixel, double slack_m = 0.01) const {
    return projects(point, pixel) &&
           world.scene.visible(render::camera_centre(camera, shot, pixel.y()), off, shot.t_ns, slack_m);
  }
  bool projects(const Vec3 &point, Vec2 &pixel) const {
    return render::project_shot(camera, shot, point, pixel) && pixel.x() >= -0.5 && pixel.y() >= -0.5 &&
           pixel.x() <= camera.width - 0.5 && pixel.y() <= camera.height - 0.5;
  }
  Vec3 centre() const { return render::camera_centre(camera, shot, 0.5 * (camera.height - 1)); }
};

void add(std::string &rows, const char *format, ...) __attribute__((format(printf, 2, 3)));
void add(std::string &rows, const char *format, ...) {
  char text[256];
  va_list args;
  va_start(args, format);
  const int length = std::vsnprintf(text, sizeof text, format, args);
  va_end(args);
  rows.append(text, static_cast<size_t>(std::clamp(length, 0, static_cast<int>(sizeof text) - 1)));
}

// Joints of wall and floor. Each face is walked along in steps of about a degree; where a joint comes into view or goes
// out of it the place is found by halving. Faces that follow one another make one polyline.
void label_edges(const View &view, std::string &rows) {
  const Vec3 eye = view.centre();
  int polyline = -1;
  bool open = false;  // the last polyline ends at the end of the face before
  const Face *before = nullptr;
  for (const Face &f : view.world.plan.faces) {
    const double dx = f.b.x_m - f.a.x_m, dy = f.b.y_m - f.a.y_m, length = std::sqrt(dx * dx + dy * dy);
    const bool joined = before != nullptr && before->b.x_m == f.a.x_m && before->b.y_m == f.a.y_m;
    before = &f;
    const bool faces_eye = dx * (eye.y() - f.a.y_m) - dy * (eye.x() - f.a.x_m) > 0;
    if (f.bottom_m > 0 || !f.mapped || !faces_eye || distance_m({eye.x(), eye.y()}, f) > view.world.label_reach_m) {
      open = false;
      continue;
    }
    const Vec3 off(-dy / length * kOff_m, dx / length * kOff_m, kOff_m);
    const auto sees = [&](double s, Vec2 &pixel) {
      const Vec3 p(f.a.x_m + s * dx, f.a.y_m + s * dy, 0);
      return (p - eye).norm() <= view.world.label_reach_m && view.sees(p, p + off, pixel);
    };
    const auto border = [&](double hidden, double seen) {
      Vec2 pixel, last;
      sees(seen, last);
      for (int i = 0; i < 10; i++) {
        const double middle = 0.5 * (hidden + seen);
        if (sees(middle, pixel))
          seen = middle, last = pixel;
        else
          hidden = middle;
      }
      return last;
    };
    const auto write = [&](const Vec2 &p) {
      add(rows, "%llu,%d,%.3f,%.3f\n", static_cast<unsigned long long>(view.shot.frame), polyline, p.x(), p.y());
    };
    double s = 0, last_s = 0;
    bool last_seen = false;
    for (bool first = true;; first = false) {
      Vec2 pixel;
      const bool seen = sees(s, pixel);
      if (seen && !last_seen) {
        const bool goes_on = first && joined && open;
        if (!goes_on) polyline++;
        if (!first) write(border(last_s, s));
        if (!goes_on || !first) write(pixel);
      } else if (seen) {
        write(pixel);
      } else if (last_seen) {
        write(border(s, last_s));
      }
      last_seen = seen;
      last_s = s;
      if (s >= 1) break;
      const double far = (Vec3(f.a.x_m + s * dx, f.a.y_m + s * dy, 0) - eye).norm();
      s = std::min(1.0, s + std::clamp(0.02 * far, 0.01, 0.25) / length);
    }
    open = last_seen;
  }
}

bool panel_seen(const View &view, const World::Panel &panel, Vec2 pixels[4]) {
  const Vec3 middle = panel.middle(), eye = view.centre();
  if (panel.normal.dot(eye - middle) <= 0 || (eye - middle).norm() > view.world.label_reach_m) return false;
  for (int i = 0; i < 4; i++) {
    const Vec3 inside = panel.corners[i] + 0.02 * (middle - panel.corners[i]) + kOff_m * panel.normal;
    if (!view.sees(panel.corners[i], inside, pixels[i])) return false;
  }
  Vec2 pixel;
  return view.sees(middle, middle + kOff_m * panel.normal, pixel);
}

void label_markers(const View &view, std::string &rows) {
  for (const World::Panel &panel : view.world.panels) {
    Vec2 p[4];
    if (!panel_seen(view, panel, p)) continue;
    add(rows, "%llu,%d", static_cast<unsigned long long>(view.shot.frame), panel.id);
    for (const Vec2 &q : p) add(rows, ",%.3f,%.3f", q.x(), q.y());
    add(rows, "\n");
  }
}

void label_landmarks(const View &view, size_t camera_index, std::string &rows) {
  for (const World::Panel &panel : view.world.panels) {
    Vec2 p[4], middle;
    if (panel_seen(view, panel, p) && view.projects(panel.middle(), middle))
      add(rows, "%llu,%zu,%d,%.3f,%.3f\n", static_cast<unsigned long long>(view.shot.frame), camera_index, panel.id,
          middle.x(), middle.y());
  }
}

// An upright edge counts when its upper end is in view. Its azimuth is taken when that row was exposed.
void label_lines(const View &view, std::string &rows) {
  for (const World::Line &line : view.world.lines) {
    const Vec3 top = line.foot + 0.97 * (line.head - line.foot), side(line.side.x(), line.side.y(), 0);
    Vec2 pixel;
    if (!view.sees(top, top + 0.012 * side, pixel, 0.02)) continue;
    const double t_ns = static_cast<double>(view.shot.t_ns) + images::row_offset_ns(view.camera, pixel.y());
    const images::Pose T_map_base = view.shot.T_map_base(t_ns);
    const Vec3 ray = T_map_base.linear().transpose() * (top - render::camera_centre(view.camera, view.shot, pixel.y()));
    add(rows, "%llu,%d,%.6f\n", static_cast<unsigned long long>(view.shot.frame), line.id, wm::atan2(ray.y(), ray.x()));
  }
}

void label_beacons(const View &view, size_t camera_index, std::string &rows) {
  for (const WorldLandmark &beacon : view.world.truth) {
    Vec2 pixel;
    const Vec3 eye = view.centre();
    if ((beacon.p - eye).norm() > view.world.label_reach_m) continue;
    // The middle of its near side: the sphere itself hides its centre.
    const Vec3 near = beacon.p + (view.world.beacon_radius_m * 1.1) * (eye - beacon.p).normalized();
    if (view.sees(beacon.p, near, pixel))
      add(rows, "%llu,%zu,%d,%.3f,%.3f\n", static_cast<unsigned long long>(view.shot.frame), camera_index, beacon.id,
          pixel.x(), pixel.y());
  }
}

}  // namespace

bool panel_in_view(const World &world, const images::Camera &camera, const render::Shot &shot,
                   const World::Panel &panel, images::Vec2 pixels[4]) {
  return panel_seen({world, camera, shot}, panel, pixels);
}

const char *label_file(World::Labels what) {
  switch (what) {
    case World::Labels::edges: return "labels/edges.csv";
    case World::Labels::markers: return "labels/markers.csv";
    case World::Labels::lines: return "labels/lines.csv";
    case World::Labels::landmarks: return "labels/landmarks.csv";
    case World::Labels::beacons: return "labels/beacons.csv";
  }
  return "";
}

const char *label_header(World::Labels what) {
  switch (what) {
    case World::Labels::edges: return "frame,polyline,u_px,v_px";
    case World::Labels::markers: return "frame,id,u0_px,v0_px,u1_px,v1_px,u2_px,v2_px,u3_px,v3_px";
    case World::Labels::lines: return "frame,id,azimuth_rad";
    case World::Labels::landmarks:
    case World::Labels::beacons: return "frame,camera,id,u_px,v_px";
  }
  return "";
}

void World::label(Labels what, size_t camera_index, const images::Camera &camera, const render::Shot &shot,
                  std::string &rows) const {
  const View view{*this, camera, shot};
  switch (what) {
    case Labels::edges: return label_edges(view, rows);
    case Labels::markers: return label_markers(view, rows);
    case Labels::lines: return label_lines(view, rows);
    case Labels::landmarks: return label_landmarks(view, camera_index, rows);
    case Labels::beacons: return label_beacons(view, camera_index, rows);
  }
}

}  // namespace wm::sim
