// SPDX-License-Identifier: Apache-2.0
// waymark calibrate import: other programs' calibrations into ours.
#include <cstdio>
#include <memory>

#include "calibrate/commands.h"
#include "calibrate/entry.h"
#include "calibrate/fit.h"
#include "calibrate/foreign.h"
#include "common/failure.h"

namespace wm::calibrate {
namespace {

using render::Model;

struct Arguments {
  std::string file, name, model = "auto", size, lens, out;
};

constexpr double kGood_px = 0.5, kUsable_px = 3;
constexpr double kPlainWidest_rad = 1.4;  // beyond it a plain lens' model has no use

void parse_size(const std::string &text, ImportHints &hints) {
  char rest = 0;
  if (text.empty()) return;
  if (std::sscanf(text.c_str(), "%dx%d%c", &hints.width, &hints.height, &rest) != 2 || hints.width < 1 ||
      hints.height < 1)
    throw tools::Failure("--size: '" + text + "' is not WIDTHxHEIGHT, as in 1280x720", tools::kUsage);
}

void say_fit(const Fit &fit) {
  std::fprintf(stderr, "  %-14s off by %.4f px in the mean, at most %.4f px (at %.0f, %.0f)",
               model_name(fit.camera.model), fit.mean_px, fit.max_px, fit.worst.x(), fit.worst.y());
  if (fit.failed > 0)
    std::fprintf(stderr, "; shows nothing in %.1f %% of the picture",
                 100.0 * static_cast<double>(fit.failed) / static_cast<double>(fit.rays));
  std::fputc('\n', stderr);
}

std::vector<Model> candidates(const Arguments &a, double widest_rad) {
  Model model = Model::equidistant;
  if (render::model_from_name(a.model, model)) return {model};
  std::vector<Model> out{Model::equidistant, Model::double_sphere};
  if (widest_rad < kPlainWidest_rad) out.push_back(Model::pinhole_radtan);
  return out;
}

// The fit that is least off where it is most off; one that misses parts of the picture only when all do.
Fit best_fit(const Arguments &a, const ForeignCamera &camera) {
  const std::vector<Ray> rays = sample_rays(camera.unproject, camera.width, camera.height, 33, 25);
  if (rays.size() < 50)
    throw tools::Failure(a.file + ": its model gives rays for hardly any pixel of " + std::to_string(camera.width) +
                         " x " + std::to_string(camera.height) + "; is the size right?");
  Fit best;
  best.max_px = std::numeric_limits<double>::infinity();
  best.failed = std::numeric_limits<size_t>::max();
  for (const Model model : candidates(a, widest_angle(rays))) {
    const Fit fit = fit_model(model, camera.unproject, camera.width, camera.height, camera.centre);
    say_fit(fit);
    if (std::pair(fit.failed, fit.max_px) < std::pair(best.failed, best.max_px)) best = fit;
  }
  return best;
}

Entry import_one(const Arguments &a, const ForeignCamera &camera, const std::string &name) {
  std::fprintf(stderr, "%s (%s, %d x %d):\n", name.c_str(), camera.model.c_str(), camera.width, camera.height);
  for (const std::string &note : camera.notes) std::fprintf(stderr, "  note: %s\n", note.c_str());
  Entry out{name, {}, "", false};
  if (camera.same && (a.model == "auto" || a.model == model_name(camera.same->model))) {
    out.camera = *camera.same;
    out.remark = "from " + camera.model + ", the same model";
    std::fprintf(stderr, "  %-14s is the same model: taken over as it is\n", model_name(out.camera.model));
  } else {
    const Fit fit = best_fit(a, camera);
    char remark[160];
    std::snprintf(remark, sizeof remark, "from %s: fitted, off by %.3g px in the mean, at most %.3g px",
                  camera.model.c_str(), fit.mean_px, fit.max_px);
    out.camera = fit.camera;
    out.remark = remark;
    std::fprintf(stderr, "  verdict: %s\n",
                 fit.failed > 0           ? "the model can't show all of the picture; what lies there must not be used"
                 : fit.max_px <= kGood_px ? "good: the models agree to well within what a detector sees"
                 : fit.max_px <= kUsable_px
                     ? "usable; the rim is off, see above"
                     : "poor: the models disagree; calibrate anew with waymark calibrate camera");
  }
  std::string error;
  if (!render::camera_valid(out.camera, error)) throw tools::Failure(a.file + ": " + error);
  return out;
}

int run(const Arguments &a) {
  ImportHints hints{.lens = a.lens};
  parse_size(a.size, hints);
  const std::vector<ForeignCamera> cameras = read_foreign(a.file, hints);
  std::vector<Entry> entries;
  for (size_t i = 0; i < cameras.size(); i++) {
    std::string name = a.name.empty() ? cameras[i].name : a.name + (cameras.size() > 1 ? std::to_string(i) : "");
    if (name.empty()) name = "camera";
    entries.push_back(import_one(a, cameras[i], name));
  }
  write_new(a.out, calibration_yaml(entries));
  return tools::kDone;
}

}  // namespace

std::function<int()> import_command(wm::cli::App &app) {
  auto a = std::make_shared<Arguments>();
  app.description("Turns a camera calibration of OpenCV, Kalibr, ROS or OCamCalib into entries of calibration.yaml.");
  app.add_option("FILE", a->file,
                 "YAML or XML of OpenCV, Kalibr's camchain, ROS camera_info, OCamCalib's calib_results.txt")
      ->required();
  app.add_option("--name", a->name, "the camera's name; default: the file's, else 'camera'");
  app.add_option("--model", a->model, "fit to this model; auto: the file's where we have it, else the best of ours")
      ->check(wm::cli::one_of({"auto", "equidistant", "double-sphere", "pinhole-radtan", "omni"}))
      ->capture_default_str();
  app.add_option("--size", a->size, "WIDTHxHEIGHT of the pictures, where the file doesn't have it");
  app.add_option("--lens", a->lens, "OpenCV's four coefficients are of a plain lens or of a fisheye")
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
