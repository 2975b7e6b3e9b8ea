// SPDX-License-Identifier: Apache-2.0
#include "common/cameras.h"

#include <cmath>

#include "common/failure.h"
#include "common/yaml.h"

namespace wm::tools {
namespace {

std::string text_of(const wm_yaml_node &map, const char *key) {
  const wm_yaml_node node = wm_yaml_get(&map, key);
  char text[64] = "";
  wm_error error{};
  if (wm_yaml_there(&node) && wm_yaml_string(&node, text, sizeof text, &error) != WM_OK) throw Failure(error.text);
  return text;
}

NamedCamera read_camera(const Yaml &yaml, const std::string &name, const wm_yaml_node &node, const std::string &where) {
  NamedCamera out{name, {}};
  const std::string model = text_of(node, "model");
  if (!images::model_from_name(model, out.camera.model))
    throw Failure(where + ".model: '" + model +
                  "' cannot be projected here (equidistant, pinhole-radtan, omni, double-sphere can); waymark "
                  "calibrate import fits another one to these");
  const std::vector<double> size = yaml.numbers(node, "size");
  if (size.size() != 2) throw Failure(where + ".size: [width, height] is needed");
  out.camera.width = static_cast<int>(size[0]);
  out.camera.height = static_cast<int>(size[1]);
  out.camera.intrinsics = yaml.numbers(node, "intrinsics");
  out.camera.distortion = yaml.numbers(node, "distortion");
  std::string error;
  if (!images::camera_valid(out.camera, error)) throw Failure(where + "." + error);
  const wm_yaml_node mounting = wm_yaml_get(&node, "mounting");
  if (!wm_yaml_there(&mounting)) return out;
  const std::vector<double> xyz = yaml.numbers(mounting, "xyz_m");
  std::vector<double> rpy = yaml.numbers(mounting, "rpy_rad");
  if (rpy.empty())
    for (const double value : yaml.numbers(mounting, "rpy_deg")) rpy.push_back(value * images::kPi / 180);
  if ((!xyz.empty() && xyz.size() != 3) || (!rpy.empty() && rpy.size() != 3))
    throw Failure(where + ".mounting: xyz_m and rpy_deg have three numbers each");
  out.camera.T_base_camera =
      images::pose_xyz_rpy(xyz.empty() ? Eigen::Vector3d::Zero() : Eigen::Vector3d(xyz[0], xyz[1], xyz[2]),
                           rpy.empty() ? 0 : rpy[0], rpy.empty() ? 0 : rpy[1], rpy.empty() ? 0 : rpy[2]);
  return out;
}

}  // namespace

std::vector<NamedCamera> load_cameras(const std::filesystem::path &calibration) {
  const Yaml yaml(calibration);
  std::vector<NamedCamera> out;
  for (const auto &[name, node] : yaml.children("cameras"))
    out.push_back(read_camera(yaml, name, node, calibration.string() + ": cameras." + name));
  return out;
}

const NamedCamera &choose_camera(const std::vector<NamedCamera> &cameras, const std::string &name,
                                 const std::filesystem::path &calibration) {
  std::string known;
  for (const NamedCamera &camera : cameras) {
    if (camera.name == name || (name.empty() && cameras.size() == 1)) return camera;
    known += (known.empty() ? "" : ", ") + camera.name;
  }
  if (cameras.empty()) throw Failure(calibration.string() + ": has no cameras");
  throw Failure(calibration.string() + (name.empty() ? ": has several cameras; choose one by --camera: " + known
                                                     : ": has no camera '" + name + "'; it has " + known),
                kUsage);
}

std::optional<Eigen::Vector2d> floor_point(const images::Camera &camera, const Eigen::Vector2d &pixel) {
  Eigen::Vector3d ray;
  if (!images::unproject(camera, pixel, ray)) return {};
  const images::Pose T = images::T_base_optical(camera);
  const Eigen::Vector3d direction = T.linear() * ray;
  const Eigen::Vector3d centre = T.translation();
  if (!(direction.z() < -1e-9) || !(centre.z() > 0)) return {};
  return Eigen::Vector2d((centre - direction * (centre.z() / direction.z())).head<2>());
}

std::optional<Eigen::Vector2d> floor_pixel(const images::Camera &camera, const Eigen::Vector2d &point_base) {
  const Eigen::Vector3d point =
      images::T_base_optical(camera).inverse() * Eigen::Vector3d(point_base.x(), point_base.y(), 0);
  Eigen::Vector2d pixel;
  if (!images::project(camera, point, pixel)) return {};
  if (pixel.x() < -0.5 || pixel.y() < -0.5 || pixel.x() > camera.width - 0.5 || pixel.y() > camera.height - 0.5)
    return {};
  return pixel;
}

}  // namespace wm::tools
