// SPDX-License-Identifier: Apache-2.0
// Kalibr's camchain.yaml (and camchain-imucam.yaml): cam0, cam1 ...
#include "calibrate/foreign.h"
#include "common/failure.h"

namespace wm::calibrate {
namespace {

struct Entry {
  const FlatFile &file;
  std::string cam;

  [[nodiscard]] std::vector<double> numbers(const char *name, size_t count) const {
    const std::string key = cam + "." + name;
    std::vector<double> out = file.numbers(key);
    if (out.size() != count)
      file.fail(file.has(key) ? key : cam, std::string(name) + " has " + std::to_string(out.size()) + " numbers; " +
                                               std::to_string(count) + " are needed");
    return out;
  }
};

ForeignCamera pinhole(const Entry &entry, const std::string &bending, int width, int height) {
  const std::vector<double> k = entry.numbers("intrinsics", 4);
  const Matrix3 m{k[0], k[1], k[2], k[3], 0};
  if (bending == "radtan") return plain_camera(m, entry.numbers("distortion_coeffs", 4), width, height);
  if (bending == "equidistant") return fisheye_camera(m, entry.numbers("distortion_coeffs", 4), width, height);
  if (bending == "fov") return fov_camera(m, entry.numbers("distortion_coeffs", 1)[0], width, height);
  if (bending == "none" || bending.empty()) return plain_camera(m, {}, width, height);
  entry.file.fail(entry.cam + ".distortion_model",
                  "'" + bending + "' is unknown; radtan, equidistant, fov and none are");
}

ForeignCamera read_camera(const Entry &entry, const ImportHints &hints) {
  const std::string model = entry.file.text(entry.cam + ".camera_model"),
                    bending = entry.file.text(entry.cam + ".distortion_model");
  int width = hints.width, height = hints.height;
  if (width == 0) {
    const std::vector<double> size = entry.numbers("resolution", 2);
    width = static_cast<int>(size[0]);
    height = static_cast<int>(size[1]);
  }
  if (model == "pinhole") return pinhole(entry, bending, width, height);
  const bool bare = bending.empty() || bending == "none";
  if (model == "omni" && (bending == "radtan" || bare)) {
    images::Camera camera{
        .model = images::Model::omni, .width = width, .height = height, .intrinsics = {}, .distortion = {}};
    camera.intrinsics = entry.numbers("intrinsics", 5);
    camera.distortion = bare ? std::vector<double>(4, 0.0) : entry.numbers("distortion_coeffs", 4);
    return our_camera(camera);
  }
  if (model == "ds" && bare) {
    images::Camera camera{
        .model = images::Model::double_sphere, .width = width, .height = height, .intrinsics = {}, .distortion = {}};
    camera.intrinsics = entry.numbers("intrinsics", 6);
    return our_camera(camera);
  }
  if (model == "eucm" && bare) {
    const std::vector<double> k = entry.numbers("intrinsics", 6);
    return eucm_camera(k[0], k[1], {k[2], k[3], k[4], k[5], 0}, width, height);
  }
  entry.file.fail(entry.cam + ".camera_model",
                  "'" + model + "' with '" + bending +
                      "' is not known; pinhole (radtan, equidistant, fov, none), omni (radtan, none), ds and eucm are");
}

}  // namespace

std::vector<ForeignCamera> read_kalibr(const FlatFile &file, const ImportHints &hints) {
  std::vector<ForeignCamera> out;
  for (const std::string &cam : file.children("")) {
    if (!file.has(cam + ".camera_model")) continue;
    ForeignCamera camera = read_camera({file, cam}, hints);
    camera.name = cam;
    camera.model = "Kalibr " + file.text(cam + ".camera_model") + " + " +
                   (file.has(cam + ".distortion_model") ? file.text(cam + ".distortion_model") : "none");
    if (file.has(cam + ".T_cam_imu") || file.has(cam + ".T_cn_cnm1"))
      camera.notes.push_back(
          "the cameras' poses to each other and to the IMU (T_cn_cnm1, T_cam_imu) are left out: a mounting here is in "
          "base_link");
    if (file.has(cam + ".timeshift_cam_imu"))
      camera.notes.push_back("timeshift_cam_imu is left out: stamps are the recording's");
    out.push_back(camera);
  }
  return out;
}

}  // namespace wm::calibrate
