// SPDX-License-Identifier: Apache-2.0
// A camera of another program as an entry of calibration.yaml.
#include <cstdio>
#include <limits>

#include "calibrate/fit.h"
#include "calibrate/foreign.h"
#include "common/failure.h"

namespace wm::calibrate {
namespace {

using images::Model;

constexpr double kGood_px = 0.5, kUsable_px = 3;
constexpr double kPlainWidest_rad = 1.4;  // beyond it a plain lens' model has no use

void say_fit(const Fit &fit) {
  std::fprintf(stderr, "  %-14s off by %.4f px in the mean, at most %.4f px (at %.0f, %.0f)",
               model_name(fit.camera.model), fit.mean_px, fit.max_px, fit.worst.x(), fit.worst.y());
  if (fit.failed > 0)
    std::fprintf(stderr, "; shows nothing in %.1f %% of the picture",
                 100.0 * static_cast<double>(fit.failed) / static_cast<double>(fit.rays));
  std::fputc('\n', stderr);
}

std::vector<Model> candidates(const std::string &model_name, double widest_rad) {
  Model model = Model::equidistant;
  if (images::model_from_name(model_name, model)) return {model};
  std::vector<Model> out{Model::equidistant, Model::double_sphere};
  if (widest_rad < kPlainWidest_rad) out.push_back(Model::pinhole_radtan);
  return out;
}

// The fit that is least off where it is most off; one that misses parts of the picture only when all do.
Fit best_fit(const ForeignCamera &camera, const std::string &model_name, const std::string &file) {
  const std::vector<Ray> rays = sample_rays(camera.unproject, camera.width, camera.height, 33, 25);
  if (rays.size() < 50)
    throw tools::Failure(file + ": its model gives rays for hardly any pixel of " + std::to_string(camera.width) +
                         " x " + std::to_string(camera.height) + "; is the size right?");
  Fit best;
  best.max_px = std::numeric_limits<double>::infinity();
  best.failed = std::numeric_limits<size_t>::max();
  for (const Model model : candidates(model_name, widest_angle(rays))) {
    const Fit fit = fit_model(model, camera.unproject, camera.width, camera.height, camera.centre);
    say_fit(fit);
    if (std::pair(fit.failed, fit.max_px) < std::pair(best.failed, best.max_px)) best = fit;
  }
  return best;
}

}  // namespace

Entry import_camera(const ForeignCamera &camera, const std::string &name, const std::string &model,
                    const std::string &file) {
  std::fprintf(stderr, "%s (%s, %d x %d):\n", name.c_str(), camera.model.c_str(), camera.width, camera.height);
  for (const std::string &note : camera.notes) std::fprintf(stderr, "  note: %s\n", note.c_str());
  Entry out{name, {}, "", false};
  if (camera.same && (model == "auto" || model == model_name(camera.same->model))) {
    out.camera = *camera.same;
    out.remark = "from " + camera.model + ", the same model";
    std::fprintf(stderr, "  %-14s is the same model: taken over as it is\n", model_name(out.camera.model));
  } else {
    const Fit fit = best_fit(camera, model, file);
    char remark[160];
    std::snprintf(remark, sizeof remark, "from %s: fitted, off by %.3g px in the mean, at most %.3g px",
                  camera.model.c_str(), fit.mean_px, fit.max_px);
    out.camera = fit.camera;
    out.remark = remark;
    std::fprintf(stderr, "  verdict: %s\n",
                 fit.failed > 0           ? "the model can't show all of the picture; what lies there must not be used"
                 : fit.max_px <= kGood_px ? "good: the models agree within a detector's precision"
                 : fit.max_px <= kUsable_px
                     ? "usable; the rim is off, see above"
                     : "poor: the models disagree; calibrate anew with waymark calibrate camera");
  }
  std::string error;
  if (!images::camera_valid(out.camera, error)) throw tools::Failure(file + ": " + error);
  return out;
}

}  // namespace wm::calibrate
