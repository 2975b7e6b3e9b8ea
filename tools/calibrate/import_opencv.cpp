// SPDX-License-Identifier: Apache-2.0
// OpenCV's FileStorage, YAML or XML, in the spellings that its samples, tutorials and their users write.
#include "calibrate/foreign.h"
#include "common/failure.h"

namespace wm::calibrate {
namespace {

// PhotonVision's JSON; the coefficients' name is wrong in its first versions.
const char *const kPhotonMatrix = "cameraIntrinsics", *const kPhotonCoefficients = "cameraExtrinsics";

const std::vector<std::string> kMatrix{
    "camera_matrix", "Camera_Matrix", "cameraMatrix", "CameraMatrix", "intrinsic_matrix", "mtx", "K", "M1", "K1",
    kPhotonMatrix};
const std::vector<std::string> kDistortion{"distortion_coefficients",
                                           "Distortion_Coefficients",
                                           "distCoeffs",
                                           "dist_coeffs",
                                           "dist_coeff",
                                           "distortion_coeffs",
                                           "DistCoeffs",
                                           "dist",
                                           "D",
                                           "D1",
                                           kPhotonCoefficients};

// The key of a matrix that is there, as it stands or with its numbers under "data"; "" where none is.
std::string key_of(const FlatFile &file, const std::vector<std::string> &names) {
  for (const std::string &name : names) {
    if (file.has(name + ".data")) return name + ".data";
    if (const FlatFile::Entry *entry = file.find(name); entry != nullptr && !entry->words.empty()) return name;
  }
  return "";
}

void read_size(const FlatFile &file, const ImportHints &hints, int &width, int &height) {
  width = hints.width;
  height = hints.height;
  if (width > 0) return;
  for (const auto &[w, h] : {std::pair{"image_width", "image_height"}, std::pair{"width", "height"},
                             std::pair{"image_Width", "image_Height"}, std::pair{"imageWidth", "imageHeight"},
                             std::pair{"resolution.width", "resolution.height"}}) {
    const std::vector<double> a = file.numbers(w), b = file.numbers(h);
    if (a.size() == 1 && b.size() == 1) width = static_cast<int>(a[0]), height = static_cast<int>(b[0]);
  }
  for (const char *key : {"image_size", "img_size", "imageSize", "size", "resolution"}) {
    const std::vector<double> both = width > 0 ? std::vector<double>{} : file.numbers(key);
    if (both.size() == 2) width = static_cast<int>(both[0]), height = static_cast<int>(both[1]);
  }
  if (width <= 0 || height <= 0)
    throw tools::Failure(file.path() + ": has no size of the pictures; give --size WIDTHxHEIGHT", tools::kUsage);
}

bool is_fisheye(const FlatFile &file, const ImportHints &hints, const std::string &key, size_t coefficients) {
  if (!hints.lens.empty()) return hints.lens == "fisheye";
  const FlatFile::Entry *flag = file.first({"fisheye_model", "fisheye", "is_fisheye"});
  if (flag != nullptr && !flag->words.empty()) return flag->words[0] != "0" && flag->words[0] != "false";
  const std::string model = file.text("distortion_model") + file.text("model") + file.text("camera_model");
  for (const char *name : {"fisheye", "equidistant", "kannala", "KANNALA"})
    if (model.find(name) != std::string::npos) return true;
  if (coefficients == 4 && model.empty() && !file.has(kPhotonMatrix))
    file.fail(key,
              "four coefficients are k1 k2 p1 p2 of a plain lens or k1 k2 k3 k4 of a fisheye, and the file doesn't "
              "state which; give --lens plain (cv2.calibrateCamera) or --lens fisheye (cv2.fisheye)");
  return false;
}

}  // namespace

std::vector<ForeignCamera> read_opencv(const FlatFile &file, const ImportHints &hints) {
  const std::string matrix = key_of(file, kMatrix), bending = key_of(file, kDistortion);
  if (matrix.empty())
    throw tools::Failure(file.path() + ": no camera matrix in it (camera_matrix, cameraMatrix, K ...); " + kUnderstood);
  const std::vector<double> k = file.numbers(matrix);
  const std::vector<double> d = bending.empty() ? std::vector<double>{} : file.numbers(bending);
  if (k.size() != 9) file.fail(matrix, "has " + std::to_string(k.size()) + " numbers; 9 of a 3 x 3 matrix are needed");
  if (!(k[0] > 0) || !(k[4] > 0)) file.fail(matrix, "focal lengths must be positive");
  if (d.size() > 12 && std::any_of(d.begin() + 12, d.end(), [](double v) { return v != 0; }))
    file.fail(bending, "a tilted sensor (tau x, tau y) is not supported; calibrate without CALIB_TILTED_MODEL");

  int width = 0, height = 0;
  read_size(file, hints, width, height);
  const Matrix3 m{k[0], k[4], k[2], k[5], k[1]};
  const std::vector<double> xi = file.numbers("xi.data").empty() ? file.numbers("xi") : file.numbers("xi.data");
  ForeignCamera out;
  if (xi.size() == 1) {  // OpenCV's omnidir: Mei's model
    images::Camera camera{
        .model = images::Model::omni, .width = width, .height = height, .intrinsics = {}, .distortion = {}};
    camera.intrinsics = {xi[0], m.fx, m.fy, m.cx, m.cy};
    camera.distortion = d;
    camera.distortion.resize(d.size() > 4 ? 5 : 4, 0.0);
    out = our_camera(camera);
    out.model = "OpenCV omnidir";
    if (m.skew != 0) out.notes.push_back("the skew of the camera matrix is left out");
  } else if (is_fisheye(file, hints, bending.empty() ? matrix : bending, d.size())) {
    if (d.size() > 4) file.fail(bending, "a fisheye has four coefficients, here are " + std::to_string(d.size()));
    out = fisheye_camera(m, d, width, height);
    out.model = "OpenCV fisheye";
  } else {
    out = plain_camera(m, {d.begin(), d.begin() + static_cast<std::ptrdiff_t>(std::min<size_t>(d.size(), 12))}, width,
                       height);
    out.model = (file.has(kPhotonMatrix) ? "PhotonVision, " : "OpenCV, ") + std::to_string(d.size()) + " coefficients";
  }
  out.name = file.text("camera_name");
  if (file.has("M2") || file.has("K2")) out.notes.push_back("a stereo file: only its first camera was taken");
  return {out};
}

}  // namespace wm::calibrate
