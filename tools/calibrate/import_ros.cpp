// SPDX-License-Identifier: Apache-2.0
// ROS camera_info: the file of camera_calibration and of camera_info_manager, what `ros2 topic echo` prints, and the
// INI that camera_calibration writes beside its YAML (ost.ini, ost.txt).
#include <algorithm>
#include <map>
#include <sstream>

#include "calibrate/foreign.h"
#include "common/failure.h"
#include "common/number.h"

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
  const std::vector<double> roi = file.numbers("roi.width");
  if (roi.size() == 1 && roi[0] > 0 && roi[0] < width)
    out.notes.push_back("roi is a part of the picture: the entry is for the whole one");
  if (file.further_documents() > 0)
    out.notes.push_back("the first of " + std::to_string(file.further_documents() + 1) + " messages is taken");
  return {out};
}

namespace {

using IniValues = std::map<std::string, std::vector<double>>;

// All words of a line as numbers; false where one is none.
bool numbers_of(const std::string &line, std::vector<double> &out) {
  std::istringstream words(line);
  std::vector<double> all;
  for (std::string word; words >> word;) {
    const std::optional<double> value = tools::number_of<double>(word);
    if (!value) return false;
    all.push_back(*value);
  }
  out.insert(out.end(), all.begin(), all.end());
  return !all.empty();
}

// "[section]", a line with a key, lines with its numbers. The sections in their order.
std::vector<std::pair<std::string, IniValues>> sections_of(const std::string &text) {
  std::vector<std::pair<std::string, IniValues>> out;
  std::istringstream lines(text);
  std::string key;
  for (std::string line; std::getline(lines, line);) {
    while (!line.empty() && std::isspace(static_cast<unsigned char>(line.back())) != 0) line.pop_back();
    if (line.empty() || line[0] == '#') continue;
    if (line.front() == '[' && line.back() == ']')
      out.emplace_back(line.substr(1, line.size() - 2), IniValues{});
    else if (!out.empty() && !numbers_of(line, out.back().second[key]))
      key = line;
  }
  return out;
}

}  // namespace

std::vector<ForeignCamera> read_ros_ini(const std::string &text, const std::string &path, const ImportHints &hints) {
  std::vector<ForeignCamera> out;
  int width = hints.width, height = hints.height;
  for (const auto &section : sections_of(text)) {
    const std::string &name = section.first;
    const IniValues &values = section.second;
    const auto numbers = [&values](const char *key) {
      const auto place = values.find(key);
      return place == values.end() ? std::vector<double>{} : place->second;
    };
    if (name == "image" && width == 0 && numbers("width").size() == 1 && numbers("height").size() == 1) {
      width = static_cast<int>(numbers("width")[0]);
      height = static_cast<int>(numbers("height")[0]);
    }
    const std::vector<double> k = numbers("camera matrix"), d = numbers("distortion");
    if (k.empty()) continue;
    if (k.size() != 9 || !(k[0] > 0) || !(k[4] > 0))
      throw tools::Failure(path + ": [" + name + "]: camera matrix: three lines of three numbers are needed");
    if (d.size() == 4 && hints.lens.empty())
      throw tools::Failure(path + ": [" + name +
                               "]: four coefficients are k1 k2 p1 p2 of a plain lens or k1 k2 k3 k4 of a fisheye; give "
                               "--lens plain or --lens fisheye",
                           tools::kUsage);
    if (width <= 0 || height <= 0)
      throw tools::Failure(path + ": has no size of the pictures; give --size WIDTHxHEIGHT", tools::kUsage);
    const Matrix3 m{k[0], k[4], k[2], k[5], k[1]};
    out.push_back(hints.lens == "fisheye" ? fisheye_camera(m, d, width, height) : plain_camera(m, d, width, height));
    out.back().model = "ROS camera_calibration, " + std::to_string(d.size()) + " coefficients";
    out.back().name = name.substr(name.rfind('/') + 1);  // of a stereo camera: "narrow_stereo/left"
  }
  if (out.empty()) throw tools::Failure(path + ": no section has a camera matrix");
  return out;
}

}  // namespace wm::calibrate
