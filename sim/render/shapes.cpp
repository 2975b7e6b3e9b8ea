// SPDX-License-Identifier: Apache-2.0
#include "render/shapes.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "waymark/internal/math/elementary.hpp"

namespace wm::render {

namespace {

double cross(const Vec2 &a, const Vec2 &b, const Vec2 &c) {
  return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
}

double signed_area(const std::vector<Vec2> &outline) {
  double twice = 0;
  for (size_t i = 0; i < outline.size(); i++) {
    const Vec2 &a = outline[i], &b = outline[(i + 1) % outline.size()];
    twice += a.x() * b.y() - a.y() * b.x();
  }
  return twice / 2;
}

// A grid of rows·columns positions, joined to triangles.
void join_grid(uint32_t columns, uint32_t rows, uint32_t material, Mesh &mesh) {
  for (uint32_t y = 0; y + 1 < rows; y++) {
    for (uint32_t x = 0; x + 1 < columns; x++) {
      const uint32_t a = y * columns + x, b = a + 1, c = a + columns, d = c + 1;
      mesh.triangles.push_back({a, b, d});
      mesh.triangles.push_back({a, d, c});
    }
  }
  mesh.materials.assign(mesh.triangles.size(), material);
}

}  // namespace

void Mesh::append(const Mesh &other) {
  const auto first = static_cast<uint32_t>(positions.size());
  // A smooth part beside a flat one: the flat one's missing normals are written as zero, which means flat.
  if (!other.normals.empty() || !normals.empty()) normals.resize(positions.size(), Vec3(0, 0, 0));
  positions.insert(positions.end(), other.positions.begin(), other.positions.end());
  uv.insert(uv.end(), other.uv.begin(), other.uv.end());
  if (!normals.empty() || !other.normals.empty()) {
    normals.insert(normals.end(), other.normals.begin(), other.normals.end());
    normals.resize(positions.size(), Vec3(0, 0, 0));
  }
  for (const auto &t : other.triangles) triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  materials.insert(materials.end(), other.materials.begin(), other.materials.end());
}

void Mesh::transform(const Pose &T) {
  for (Vec3 &p : positions) p = T * p;
  for (Vec3 &n : normals) n = T.linear() * n;
}

Mesh quad(const Vec3 &corner, const Vec3 &edge_u, const Vec3 &edge_v, uint32_t material) {
  Mesh mesh;
  const double u = edge_u.norm(), v = edge_v.norm();
  mesh.positions = {corner, corner + edge_u, corner + edge_u + edge_v, corner + edge_v};
  mesh.uv = {{0, 0}, {u, 0}, {u, v}, {0, v}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  mesh.materials = {material, material};
  return mesh;
}

Mesh picture(const Vec3 &middle, const Vec3 &right, const Vec3 &up, double width_m, double height_m,
             uint32_t material) {
  const Vec3 u = right.normalized() * width_m, v = up.normalized() * height_m;
  return quad(middle - 0.5 * u - 0.5 * v, u, v, material);
}

Mesh box(const Pose &T_map_box, const Vec3 &size_m, uint32_t material) {
  Mesh mesh;
  const Vec3 h = size_m / 2, x(size_m.x(), 0, 0), y(0, size_m.y(), 0), z(0, 0, size_m.z());
  mesh.append(quad({-h.x(), -h.y(), -h.z()}, x, z, material));
  mesh.append(quad({h.x(), h.y(), -h.z()}, -x, z, material));
  mesh.append(quad({h.x(), -h.y(), -h.z()}, y, z, material));
  mesh.append(quad({-h.x(), h.y(), -h.z()}, -y, z, material));
  mesh.append(quad({-h.x(), -h.y(), h.z()}, x, y, material));
  mesh.append(quad({h.x(), -h.y(), -h.z()}, -x, y, material));
  mesh.transform(T_map_box);
  return mesh;
}

Mesh cylinder(const Pose &T_map_cylinder, double radius_m, double height_m, int segments, uint32_t material) {
  return cone(T_map_cylinder, radius_m, radius_m, height_m, segments, material);
}

Mesh cone(const Pose &T_map_cone, double foot_m, double top_m, double height_m, int segments, uint32_t material) {
  Mesh mesh;
  const auto n = static_cast<uint32_t>(std::max(segments, 3));
  const double lean = foot_m - top_m, size = std::sqrt(lean * lean + height_m * height_m);
  for (int level = 0; level < 2; level++) {
    for (uint32_t i = 0; i <= n; i++) {
      const double angle = 2 * kPi * i / n;
      const sin_cos a = sincos(angle);
      const double r = level == 0 ? foot_m : top_m;
      mesh.positions.emplace_back(r * a.cos, r * a.sin, level * height_m);
      mesh.normals.emplace_back(height_m / size * a.cos, height_m / size * a.sin, lean / size);
      mesh.uv.emplace_back(angle * std::max(foot_m, top_m), level * height_m);
    }
  }
  join_grid(n + 1, 2, material, mesh);
  if (top_m > 0) {
    Mesh lid;
    std::vector<Vec2> rim;
    for (uint32_t i = 0; i < n; i++) {
      const sin_cos a = sincos(2 * kPi * i / n);
      rim.emplace_back(top_m * a.cos, top_m * a.sin);
    }
    mesh.append(flat_polygon(rim, height_m, true, material));
  }
  mesh.transform(T_map_cone);
  return mesh;
}

Mesh sphere(const Vec3 &middle, double radius_m, int rings, uint32_t material) {
  Pose T = Pose::Identity();
  T.translation() = middle;
  return ellipsoid(T, Vec3(radius_m, radius_m, radius_m), rings, material);
}

Mesh ellipsoid(const Pose &T_map_ellipsoid, const Vec3 &radii_m, int rings, uint32_t material) {
  Mesh mesh;
  const auto n = static_cast<uint32_t>(std::max(rings, 3));
  for (uint32_t i = 0; i <= n; i++) {
    const sin_cos up = sincos(kPi * (static_cast<double>(i) / n - 0.5));
    for (uint32_t j = 0; j <= 2 * n; j++) {
      const double angle = kPi * j / n;
      const sin_cos around = sincos(angle);
      const Vec3 unit(up.cos * around.cos, up.cos * around.sin, up.sin);
      mesh.positions.push_back(unit.cwiseProduct(radii_m));
      mesh.normals.push_back(unit.cwiseQuotient(radii_m).normalized());
      mesh.uv.emplace_back(angle * radii_m.x(), kPi * i / n * radii_m.z());
    }
  }
  join_grid(2 * n + 1, n + 1, material, mesh);
  mesh.transform(T_map_ellipsoid);
  return mesh;
}

Mesh height_field(const Vec3 &origin, double cell_m, int nx, int ny, const std::vector<double> &heights_m,
                  uint32_t material) {
  Mesh mesh;
  if (nx < 2 || ny < 2 || heights_m.size() < static_cast<size_t>(nx) * static_cast<size_t>(ny)) return mesh;
  auto height = [&](int x, int y) {
    const size_t at = static_cast<size_t>(std::clamp(y, 0, ny - 1)) * static_cast<size_t>(nx);
    return heights_m[at + static_cast<size_t>(std::clamp(x, 0, nx - 1))];
  };
  for (int y = 0; y < ny; y++) {
    for (int x = 0; x < nx; x++) {
      mesh.positions.push_back(origin + Vec3(x * cell_m, y * cell_m, height(x, y)));
      mesh.normals.push_back(
          Vec3(height(x - 1, y) - height(x + 1, y), height(x, y - 1) - height(x, y + 1), 2 * cell_m).normalized());
      mesh.uv.emplace_back(x * cell_m, y * cell_m);
    }
  }
  join_grid(static_cast<uint32_t>(nx), static_cast<uint32_t>(ny), material, mesh);
  return mesh;
}

Mesh walls(const std::vector<Vec2> &line, bool closed, double z0_m, double z1_m, uint32_t material) {
  Mesh mesh;
  double along = 0;
  const size_t n = line.size();
  for (size_t i = 0; n > 1 && i + (closed ? 0 : 1) < n; i++) {
    const Vec2 &a = line[i], &b = line[(i + 1) % n];
    const double length = (b - a).norm();
    if (length <= 0) continue;
    Mesh part = quad({a.x(), a.y(), z0_m}, {b.x() - a.x(), b.y() - a.y(), 0}, {0, 0, z1_m - z0_m}, material);
    for (Vec2 &uv : part.uv) uv.x() += along;
    mesh.append(part);
    along += length;
  }
  return mesh;
}

Mesh flat_polygon(const std::vector<Vec2> &outline, double z_m, bool up, uint32_t material) {
  Mesh mesh;
  for (const Vec2 &p : outline) {
    mesh.positions.emplace_back(p.x(), p.y(), z_m);
    mesh.uv.push_back(p);
  }
  std::vector<uint32_t> left(outline.size());
  std::iota(left.begin(), left.end(), 0u);
  if (signed_area(outline) < 0) std::reverse(left.begin(), left.end());
  auto is_ear = [&](size_t i) {
    const size_t n = left.size();
    const Vec2 &a = outline[left[(i + n - 1) % n]], &b = outline[left[i]], &c = outline[left[(i + 1) % n]];
    if (cross(a, b, c) <= 0) return false;
    return std::none_of(left.begin(), left.end(), [&](uint32_t k) {
      const Vec2 &p = outline[k];
      return p != a && p != b && p != c && cross(a, b, p) >= 0 && cross(b, c, p) >= 0 && cross(c, a, p) >= 0;
    });
  };
  while (left.size() >= 3) {
    size_t ear = 0;
    while (ear < left.size() && !is_ear(ear)) ear++;
    const bool found = ear < left.size();
    if (!found) ear = 0;  // corners on one line, or an outline that crosses itself: drop a corner and go on
    const size_t n = left.size();
    const std::array<uint32_t, 3> t{left[(ear + n - 1) % n], left[ear], left[(ear + 1) % n]};
    if (found) mesh.triangles.push_back(up ? t : std::array<uint32_t, 3>{t[0], t[2], t[1]});
    left.erase(left.begin() + static_cast<std::ptrdiff_t>(ear));
  }
  mesh.materials.assign(mesh.triangles.size(), material);
  return mesh;
}

Mesh extruded(const std::vector<Vec2> &outline, double z0_m, double z1_m, uint32_t side, uint32_t lid) {
  Mesh mesh = walls(outline, true, z0_m, z1_m, side);
  mesh.append(flat_polygon(outline, z0_m, false, lid));
  mesh.append(flat_polygon(outline, z1_m, true, lid));
  return mesh;
}

}  // namespace wm::render
