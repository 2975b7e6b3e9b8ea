// SPDX-License-Identifier: Apache-2.0
#include "map/add_landmark.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <optional>

#include "common/cameras.h"
#include "common/csv.h"
#include "common/failure.h"
#include "common/grey_picture.h"
#include "images/pictures.h"

namespace wm::tools {
namespace {

namespace fs = std::filesystem;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kSideMax_px = 192, kSideMin_px = 8;
constexpr int kSamples = 4;  // a pixel, along each axis

// The picture's geometry: rays of pixels and back. Without a calibration a pixel is its own ray.
struct Optics {
  std::optional<images::Camera> camera;

  Vector3d ray(const Vector2d &pixel) const {
    Vector3d out(pixel.x(), pixel.y(), 1);
    if (camera && !images::unproject(*camera, pixel, out))
      throw Failure(
          "--corners: the camera has no ray at (" + std::to_string(pixel.x()) + ", " + std::to_string(pixel.y()) + ")",
          kUsage);
    return out;
  }
  bool pixel(const Vector3d &ray, Vector2d *out) const {
    if (camera) return images::project(*camera, ray, *out);
    *out = ray.head<2>() / ray.z();
    return ray.z() > 0;
  }
};

// Takes the square's corners (0,0), (1,0), (1,1), (0,1) to the four rays, up to their lengths: r1 s1, r2 s2, r3 s3 are
// found so that r1 s1 + r3 s3 = r2 s2 + r4 s4 (a plane's parallelogram).
Matrix3d square_to_rays(const Vector3d rays[4]) {
  Matrix3d sides;
  sides << rays[1], -rays[2], rays[3];
  if (std::fabs(sides.determinant()) < 1e-12 * rays[1].norm() * rays[2].norm() * rays[3].norm())
    throw Failure("--corners: three of them lie on one line", kUsage);
  const Vector3d scale = sides.inverse() * rays[0];  // rays[0] = s1 rays[1] - s2 rays[2] + s3 rays[3]
  if (!(scale.minCoeff() > 0))
    throw Failure(
        "--corners: are not a convex quadrilateral in the order upper left, upper right, lower right, lower left",
        kUsage);
  Matrix3d out;
  out << scale[0] * rays[1] - rays[0], scale[2] * rays[3] - rays[0], rays[0];
  return out;
}

double bilinear(const GreyPicture &picture, const Vector2d &at) {
  const double x = std::clamp(at.x(), 0.0, picture.width - 1.0), y = std::clamp(at.y(), 0.0, picture.height - 1.0);
  const int column = std::min(static_cast<int>(x), picture.width - 2),
            row = std::min(static_cast<int>(y), picture.height - 2);
  const double fx = x - column, fy = y - row;
  return (1 - fy) * ((1 - fx) * picture.at(column, row) + fx * picture.at(column + 1, row)) +
         fy * ((1 - fx) * picture.at(column, row + 1) + fx * picture.at(column + 1, row + 1));
}

images::Picture8 cut_out(const GreyPicture &picture, const Optics &optics, const Matrix3d &square, int width,
                         int height) {
  images::Picture8 out{width, height, 1, {}};
  for (int y = 0; y < height; y++)
    for (int x = 0; x < width; x++) {
      double sum = 0;
      for (int i = 0; i < kSamples * kSamples; i++) {
        const int across = i % kSamples, down = i / kSamples;
        const Vector3d place((x + (across + 0.5) / kSamples) / width, (y + (down + 0.5) / kSamples) / height, 1);
        Vector2d at;
        if (!optics.pixel(square * place, &at))
          throw Failure("--corners: the landmark reaches behind the lens", kUsage);
        sum += bilinear(picture, at);
      }
      out.bytes.push_back(static_cast<uint8_t>(std::lround(sum / (kSamples * kSamples))));
    }
  return out;
}

void append(const fs::path &file, const std::string &header, const std::string &row) {
  const bool is_new = !fs::exists(file);
  std::ofstream out(file, std::ios::app);
  if (is_new) out << header << '\n';
  out << row << '\n';
  out.close();
  if (!out) throw Failure(file.string() + ": could not be written");
}

// Where landmarks.csv has the landmark; nothing where it hasn't.
std::optional<Vector3d> place_in(const fs::path &file, int id) {
  if (!fs::exists(file)) return std::nullopt;
  const Csv csv = Csv::load(file);
  const size_t ids = csv.need("id"), x = csv.need("x_m"), y = csv.need("y_m"), z = csv.need("z_m");
  for (size_t row = 0; row < csv.rows(); row++)
    if (csv.integer(row, ids) == id) return Vector3d(csv.number(row, x), csv.number(row, y), csv.number(row, z));
  return std::nullopt;
}

std::string row_of(const fs::path &file, int id, const Vector3d &at, double sigma_m) {
  char text[64];
  std::vector<std::string> columns = {"id", "x_m", "y_m", "z_m", "sigma_m"};
  if (fs::exists(file)) columns = Csv::load(file).columns();
  std::string out;
  for (const std::string &column : columns) {
    if (&column != columns.data()) out += ",";
    const double value = column == "x_m"       ? at.x()
                         : column == "y_m"     ? at.y()
                         : column == "z_m"     ? at.z()
                         : column == "sigma_m" ? sigma_m
                                               : std::nan("");
    if (column == "id")
      out += std::to_string(id);
    else if (std::isfinite(value)) {
      std::snprintf(text, sizeof text, "%.6f", value);
      out += text;
    }
  }
  return out;
}

Vector3d vector_of(const std::vector<double> &v) { return {v[0], v[1], v[2]}; }

}  // namespace

AddedLandmark add_landmark(const AddLandmark &a) {
  AddedLandmark out{};
  const bool is_file = a.map.extension() == ".csv";
  const fs::path folder = is_file ? a.map.parent_path() : a.map;
  out.landmarks = is_file ? a.map : a.map / "landmarks.csv";
  out.appearances = folder / "landmarks/appearance.csv";
  const std::optional<Vector3d> known = place_in(out.landmarks, a.id);
  if (!known && a.at_m.empty())
    throw Failure(
        out.landmarks.string() + ": has no landmark " + std::to_string(a.id) + "; give its place by --at X,Y,Z",
        kUsage);
  const Vector3d at = a.at_m.empty() ? *known : vector_of(a.at_m);
  if (known && (*known - at).norm() > 1e-3)
    throw Failure(out.landmarks.string() + ": landmark " + std::to_string(a.id) +
                      " is on the map at another place; leave --at out to add one more picture of it",
                  kUsage);

  const GreyPicture picture = load_picture(a.picture);
  Optics optics;
  if (!a.calibration.empty())
    optics.camera = choose_camera(load_cameras(a.calibration), a.camera, a.calibration).camera;
  if (optics.camera && (optics.camera->width != picture.width || optics.camera->height != picture.height))
    throw Failure(a.picture + ": has another size than the camera of " + a.calibration, kUsage);
  const double right = picture.width - 0.5, bottom = picture.height - 0.5;
  std::vector<double> c = a.corners_px;
  if (c.empty()) c = {-0.5, -0.5, right, -0.5, right, bottom, -0.5, bottom};
  Vector2d corners[4];
  Vector3d rays[4];
  for (size_t i = 0; i < 4; i++) {
    corners[i] = {c[2 * i], c[2 * i + 1]};
    if (corners[i].x() < -0.5 || corners[i].y() < -0.5 || corners[i].x() > right || corners[i].y() > bottom)
      throw Failure("--corners: a corner lies outside of the picture", kUsage);
    rays[i] = optics.ray(corners[i]);
  }
  const Matrix3d square = square_to_rays(rays);

  if (!std::isnan(a.yaw_deg))
    out.yaw_rad = a.yaw_deg * M_PI / 180;
  else if (!a.from_m.empty())
    out.yaw_rad = std::atan2(a.from_m[0] - at.x(), at.y() - a.from_m[1]);  // its normal points to who took it
  else
    throw Failure(
        "--yaw (degrees in the map from its left to its right edge) or --from X,Y,Z (it faces that place) is needed",
        kUsage);
  if (!a.size_m.empty()) {
    out.width_m = a.size_m[0];
    out.height_m = a.size_m[1];
  } else if (optics.camera && !a.from_m.empty()) {
    // The plane through the corners, at the distance that the two places have.
    const double scale = (at - vector_of(a.from_m)).norm() / (square * Vector3d(0.5, 0.5, 1)).norm();
    out.width_m = scale * square.col(0).norm();
    out.height_m = scale * square.col(1).norm();
  } else {
    throw Failure("--size WIDTH,HEIGHT in metres is needed, or --from with --calibration and --camera", kUsage);
  }

  const double wide = 0.5 * ((corners[1] - corners[0]).norm() + (corners[2] - corners[3]).norm()),
               high = 0.5 * ((corners[3] - corners[0]).norm() + (corners[2] - corners[1]).norm());
  const double shrink = std::min(1.0, kSideMax_px / std::max(wide, high));
  out.width_px = static_cast<int>(std::lround(shrink * wide));
  out.height_px = static_cast<int>(std::lround(shrink * high));
  if (std::min(out.width_px, out.height_px) < kSideMin_px)
    throw Failure("--corners: less than " + std::to_string(kSideMin_px) + " pixels a side are too few", kUsage);
  const images::Picture8 look = cut_out(picture, optics, square, out.width_px, out.height_px);
  double sum = 0, squares = 0;
  for (const uint8_t v : look.bytes) sum += v, squares += static_cast<double>(v) * v;
  const double n = static_cast<double>(look.bytes.size());
  out.spread_grey = std::sqrt(std::max(0.0, squares / n - sum / n * sum / n));

  std::error_code failed;
  fs::create_directories(folder / "landmarks", failed);
  if (failed) throw Failure((folder / "landmarks").string() + ": " + failed.message());
  std::string name = std::to_string(a.id) + ".png";
  for (int i = 2; fs::exists(folder / "landmarks" / name); i++)
    name = std::to_string(a.id) + "-" + std::to_string(i) + ".png";
  out.picture = folder / "landmarks" / name;
  std::string error;
  if (!images::write_png(out.picture, look, error)) throw Failure(error);
  char row[160];
  std::snprintf(row, sizeof row, "%d,%s,%.4f,%.4f,%.6f", a.id, name.c_str(), out.width_m, out.height_m, out.yaw_rad);
  append(out.appearances, "id,picture,width_m,height_m,yaw_rad", row);
  if (!known) append(out.landmarks, "id,x_m,y_m,z_m,sigma_m", row_of(out.landmarks, a.id, at, a.sigma_m));
  return out;
}

}  // namespace wm::tools
