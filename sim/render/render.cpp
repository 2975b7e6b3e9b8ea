// SPDX-License-Identifier: Apache-2.0
#include "render/render.h"

#include <cmath>

#include "render/painter.h"
#include "render/psf.h"
#include "render/scene_data.h"
#include "render/workers.h"

namespace wm::render {

struct Renderer::Data {
  Camera camera;
  Quality quality;
  bool colour;
  Workers workers;
  std::unique_ptr<Painter> painter;
  Image raw;

  Data(const Camera &camera_in, const Quality &quality_in, bool colour_in)
      : camera(camera_in), quality(quality_in), colour(colour_in), workers(quality_in.threads) {}
};

std::unique_ptr<Renderer> Renderer::make(const Scene &scene, const Camera &camera, const Quality &quality,
                                         uint64_t seed, bool colour, std::string &error) {
  if (!scene.data().committed) return error = "the scene is not committed", nullptr;
  if (!camera_valid(camera, error)) return nullptr;
  if (quality.samples < 1 || quality.samples > 256) return error = "samples: 1 to 256 a pixel", nullptr;
  if (!(quality.psf_sigma_px >= 0) || quality.psf_sigma_px > 20) return error = "psf_sigma_px: 0 to 20", nullptr;
  auto data = std::make_unique<Data>(camera, quality, colour);
  data->painter = Painter::make(scene, camera, quality, seed, colour, data->workers.count());
  return std::unique_ptr<Renderer>(new Renderer(std::move(data)));
}

Renderer::Renderer(std::unique_ptr<Data> data) : data_(std::move(data)) {}
Renderer::~Renderer() = default;
const Camera &Renderer::camera() const { return data_->camera; }

void Renderer::render(const Shot &shot, Image &out) {
  Data &d = *data_;
  d.raw.width = d.camera.width, d.raw.height = d.camera.height, d.raw.channels = d.colour ? 3 : 1;
  d.raw.values.resize(static_cast<size_t>(d.camera.width) * static_cast<size_t>(d.camera.height) *
                      static_cast<size_t>(d.raw.channels));
  d.painter->begin(shot);
  d.workers.run(d.camera.height, 4, [&](int begin, int end, int worker) {
    for (int y = begin; y < end; y++) d.painter->row(y, worker, d.raw);
  });
  d.painter->end(shot, d.raw);
  spread(d.quality.psf_sigma_px, d.workers, d.raw, out);
}

Vec3 camera_centre(const Camera &camera, const Shot &shot, double v_px) {
  return shot.T_map_base(static_cast<double>(shot.t_ns) + row_offset_ns(camera, v_px)) *
         T_base_optical(camera).translation();
}

bool project_shot(const Camera &camera, const Shot &shot, const Vec3 &point_map, Vec2 &pixel) {
  const Pose T_camera_base = T_base_optical(camera).inverse();
  double v = 0.5 * (camera.height - 1);
  for (int i = 0; i < 30; i++) {
    const Pose T_map_base = shot.T_map_base(static_cast<double>(shot.t_ns) + row_offset_ns(camera, v));
    if (!project(camera, T_camera_base * (T_map_base.inverse() * point_map), pixel)) return false;
    if (camera.readout_ns == 0 || std::fabs(pixel.y() - v) < 1e-4) return true;
    v = pixel.y();
  }
  return false;
}

}  // namespace wm::render
