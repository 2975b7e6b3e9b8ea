// SPDX-License-Identifier: Apache-2.0
// Which program wrote a file.
#include <sstream>

#include "calibrate/foreign.h"
#include "common/failure.h"
#include "common/number.h"
#include "common/unpacked.h"

namespace wm::calibrate {

namespace {

// "[image]" alone on a line begins the INI of ROS' camera_calibration, behind comments.
bool is_ros_ini(const std::string &text) {
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with('#') || line.find_first_not_of(" \t\r") == std::string::npos) continue;
    return line.starts_with("[image]");
  }
  return false;
}

bool is_ros(const FlatFile &file) {
  return file.has("distortion_model") && file.first({"image_width", "width"}) != nullptr &&
         file.first({"camera_matrix.data", "K", "k"}) != nullptr;
}

// Drivers send a K of zeros, or ones, before a camera is calibrated, and `topic echo` prints that first.
std::vector<ForeignCamera> read_ros_echo(const std::string &text, const FlatFile &first, const ImportHints &hints) {
  const auto is_empty = [](const FlatFile &file) {
    const FlatFile::Entry *k = file.first({"camera_matrix.data", "K", "k"});
    const std::optional<double> focal = k->words.empty() ? std::nullopt : tools::number_of<double>(k->words.front());
    return focal && *focal <= 1;
  };
  std::string rest = text;
  FlatFile file = first;
  size_t skipped = 0;
  for (; is_empty(file) && file.further_documents() > 0; skipped++) {
    rest = FlatFile::behind_first(rest);
    FlatFile next = FlatFile::parse(rest, file.path());
    if (!is_ros(next)) break;
    file = next;
  }
  std::vector<ForeignCamera> out = read_ros(file, hints);
  if (skipped > 0)
    out.front().notes.insert(
        out.front().notes.begin(),
        "the first " + std::to_string(skipped) + " messages are of a camera that is not calibrated (K is 0)");
  return out;
}

// PhotonVision's settings of a camera have a list with a calibration for each size of picture.
std::vector<ForeignCamera> read_photonvision_settings(const FlatFile &file, const ImportHints &hints) {
  std::vector<ForeignCamera> out;
  for (size_t i = 0; file.has("calibrations." + std::to_string(i) + ".cameraIntrinsics"); i++) {
    const FlatFile part = file.below("calibrations." + std::to_string(i));
    for (ForeignCamera &camera : read_opencv(part, hints)) {
      camera.name = "camera" + std::to_string(camera.width) + "x" + std::to_string(camera.height);
      out.push_back(camera);
    }
  }
  return out;
}

}  // namespace

std::vector<ForeignCamera> read_foreign(const std::filesystem::path &path, const ImportHints &hints) {
  if (std::filesystem::is_directory(path))
    throw tools::Failure(path.string() + ": is a folder; a calibration file is needed", tools::kUsage);
  const std::string text = tools::read_unpacked(path);
  if (is_ros_ini(text)) return read_ros_ini(text, path.string(), hints);
  if (text.starts_with('#') && text.find("polynomial") != std::string::npos)
    return read_ocamcalib(text, path.string(), hints);

  const FlatFile flat = FlatFile::parse(text, path.string());
  for (const std::string &name : flat.children(""))
    if (flat.has(name + ".camera_model")) return read_kalibr(flat, hints);
  if (is_ros(flat)) return read_ros_echo(text, flat, hints);
  for (const std::string &name : flat.children(""))
    if (is_ros(flat.below(name))) return read_ros(flat.below(name), hints);  // {"camera_info": {...}}
  if (flat.has("calibrations.0.cameraIntrinsics")) return read_photonvision_settings(flat, hints);
  if (flat.has("cameras"))
    throw tools::Failure(path.string() + ": is a calibration.yaml already; there is nothing to import");
  return read_opencv(flat, hints);
}

}  // namespace wm::calibrate
