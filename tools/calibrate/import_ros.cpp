// SPDX-License-Identifier: Apache-2.0
// ROS camera_info: the file of camera_calibration and of camera_info_manager, and what `ros2 topic echo` prints.
#include "calibrate/foreign.h"
#include "common/failure.h"

namespace wm::calibrate {

std::vector<ForeignCamera> read_ros(const FlatFile &file, const ImportHints &hints) {
  const auto take = [&](const std::vector<std::string> &keys) {
    for (const std::string &key : keys)
      if (const FlatFile::Entry *entry = file.find(key); entry != nullptr && !entry->words.empty()) return key;
    throw tools::Failure(file.path() + ": " + keys.front() + " is missing");
  };
  const std::string matrix = take({"camera_matrix.data", "camera_matrix", "K", "k"});
  const std::vector<double> k = file.numbers(matrix);
  if (k.size() != 9) file.fail(matrix, "has " + std::to_string(k.size()) + " numbers; 9 are needed");
  if (!(k[0] > 0) || !(k[4] > 0)) file.fail(matrix, "focal lengths must be positive: was this camera calibrated?");
  const FlatFile::Entry *bending = file.first({"distortion_coefficients.data", "distortion_coefficients", "D", "d"});
  std::vector<double> d;
  if (bending != nullptr && !bending->words.empty())
    d = file.numbers(take({"distortion_coefficients.data", "distortion_coefficients", "D", "d"}));

  int width = hints.width, height = hints.height;
  if (width == 0) {
    width = static_cast<int>(file.numbers(take({"image_width", "width"})).at(0));
    height = static_cast<int>(file.numbers(take({"image_height", "height"})).at(0));
  }
  const Matrix3 m{k[0], k[4], k[2], k[5], k[1]};
  const std::string model = file.text("distortion_model");
  ForeignCamera out;
  if (model == "plumb_bob" || model == "rational_polynomial" || model.empty())
    out = plain_camera(m, d, width, height);
  else if (model == "equidistant" || model == "fisheye")
    out = fisheye_camera(m, d, width, height);
  else
    file.fail("distortion_model",
              "'" + model + "' is unknown; plumb_bob, rational_polynomial, equidistant and fisheye are");
  out.model = "ROS camera_info, " + (model.empty() ? "no distortion model" : model);
  out.name = file.text("camera_name");
  const std::vector<double> binning = file.numbers("binning_x");
  if (binning.size() == 1 && binning[0] > 1)
    out.notes.push_back("binning_x is " + file.text("binning_x") +
                        ": the entry is for the whole picture; give the binned one's file");
  return {out};
}

}  // namespace wm::calibrate
