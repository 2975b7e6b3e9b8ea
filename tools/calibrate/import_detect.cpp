// SPDX-License-Identifier: Apache-2.0
// Which program wrote a file.
#include <cstring>
#include <fstream>
#include <sstream>

#include "calibrate/foreign.h"
#include "common/failure.h"

namespace wm::calibrate {

std::vector<ForeignCamera> read_foreign(const std::filesystem::path &path, const ImportHints &hints) {
  if (std::filesystem::is_directory(path))
    throw tools::Failure(path.string() + ": is a folder; a calibration file is needed", tools::kUsage);
  std::ifstream file(path, std::ios::binary);
  if (!file) throw tools::Failure(path.string() + ": cannot be read: " + std::strerror(errno), tools::kUsage);
  std::stringstream content;
  content << file.rdbuf();
  const std::string text = content.str();
  if (text.starts_with('#') && text.find("polynomial") != std::string::npos)
    return read_ocamcalib(text, path.string(), hints);

  const FlatFile flat = FlatFile::parse(text, path.string());
  for (const std::string &name : flat.children(""))
    if (flat.has(name + ".camera_model")) return read_kalibr(flat, hints);
  const bool ros = flat.has("distortion_model") && flat.first({"image_width", "width"}) != nullptr &&
                   flat.first({"camera_matrix.data", "K", "k"}) != nullptr;
  if (ros) return read_ros(flat, hints);
  if (flat.has("cameras"))
    throw tools::Failure(path.string() + ": is a calibration.yaml already; there is nothing to import");
  return read_opencv(flat, hints);
}

}  // namespace wm::calibrate
