// SPDX-License-Identifier: Apache-2.0
// waymark calibrate import: other programs' calibrations into ours.
#include <cstdio>
#include <memory>

#include "calibrate/commands.h"
#include "calibrate/entry.h"
#include "calibrate/foreign.h"
#include "common/failure.h"

namespace wm::calibrate {
namespace {

struct ImportArguments {
  std::string file, name, model = "auto", size, lens, out;
};

void parse_size(const std::string &text, ImportHints &hints) {
  char rest = 0;
  if (text.empty()) return;
  if (std::sscanf(text.c_str(), "%dx%d%c", &hints.width, &hints.height, &rest) != 2 || hints.width < 1 ||
      hints.height < 1)
    throw tools::Failure("--size: '" + text + "' is not WIDTHxHEIGHT, as in 1280x720", tools::kUsage);
}

int run(const ImportArguments &a) {
  ImportHints hints{.lens = a.lens};
  parse_size(a.size, hints);
  const std::vector<ForeignCamera> cameras = read_foreign(a.file, hints);
  std::vector<Entry> entries;
  for (size_t i = 0; i < cameras.size(); i++) {
    std::string name = a.name.empty() ? cameras[i].name : a.name + (cameras.size() > 1 ? std::to_string(i) : "");
    if (name.empty()) name = "camera";
    entries.push_back(import_camera(cameras[i], name, a.model, a.file));
  }
  write_new(a.out, calibration_yaml(entries));
  return tools::kDone;
}

}  // namespace

std::function<int()> import_command(wm::cli::App &app) {
  auto a = std::make_shared<ImportArguments>();
  app.description(
      "Turns a camera calibration of OpenCV, Kalibr, ROS, PhotonVision or OCamCalib into entries of calibration.yaml.");
  app.add_option("FILE", a->file,
                 "YAML or XML of OpenCV, Kalibr's camchain, ROS camera_info (also ost.ini and `topic echo`), "
                 "PhotonVision's JSON, OCamCalib's calib_results.txt; also packed (.gz)")
      ->required();
  app.add_option("--name", a->name, "the camera's name; default: the file's, else 'camera'");
  app.add_option("--model", a->model,
                 "fit this model; auto: the file's model if it is supported, else the one that fits best")
      ->check(wm::cli::one_of({"auto", "equidistant", "double-sphere", "pinhole-radtan", "omni"}))
      ->capture_default_str();
  app.add_option("--size", a->size, "WIDTHxHEIGHT of the pictures, where the file doesn't have it");
  app.add_option("--lens", a->lens, "whether OpenCV's four coefficients are of a plain lens or of a fisheye")
      ->check(wm::cli::one_of({"plain", "fisheye"}));
  app.add_option("--out", a->out, "a new file to write; default: the screen");
  app.footer(
      "examples:\n"
      "  waymark calibrate import camchain.yaml --out calibration.yaml\n"
      "  waymark calibrate import calib_results.txt --name front --model double-sphere\n"
      "  waymark calibrate import camera.xml --lens fisheye --size 1280x720\n"
      "Where the model differs from ours, the best of ours is fitted over the whole picture; how far it is off, in\n"
      "pixels, is printed. The mounting isn't in such files: measure it, or waymark calibrate mounting.");
  return [a] { return run(*a); };
}

}  // namespace wm::calibrate
