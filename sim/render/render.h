// SPDX-License-Identifier: Apache-2.0
// Pictures of a scene through a camera: ray casting with Embree 3, one row of pixels after another.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "images/camera.h"
#include "render/scene.h"

namespace wm::render {

struct Quality {
  int samples = 4;            // rays a pixel, each at its own place in the pixel and its own time of the exposure
  double psf_sigma_px = 0.5;  // the lens: a Gaussian over the picture, after the rays; 0: none
  bool mirrors = true;
  bool movers = true;
  int threads = 0;     // 0: as many as the machine has. Bits don't depend on it
  bool plain = false;  // without AVX2 where the machine has it. Bits don't depend on it
};

struct Shot {
  int64_t t_ns = 0;                             // middle of the exposure of the middle row
  int64_t exposure_ns = 0;                      // of each row
  uint64_t frame = 0;                           // with the seed: what the random places in pixels are drawn from
  float light = 1;                              // what of the lamps, the sun and emissions is on (lights off: 0..0.05)
  float ambient = 1;                            // what of the ambient light is there
  std::function<Pose(double t_ns)> T_map_base;  // where the robot is; asked for each row and sample, from one thread
};

// Linear radiance, row by row, 1 or 3 values a pixel.
struct Image {
  int width = 0, height = 0, channels = 1;
  std::vector<float> values;
};

class Renderer {
 public:
  // The scene is committed and outlives the renderer. Makes a table of the camera's directions (about 1 us a pixel).
  // nullptr and a text when the camera is not valid or the scene isn't committed.
  static std::unique_ptr<Renderer> make(const Scene &scene, const Camera &camera, const Quality &quality, uint64_t seed,
                                        bool colour, std::string &error);
  ~Renderer();

  // Renders into `out` (its memory is reused). One call at a time. The same scene, camera, quality, seed and shot give
  // the same bits.
  void render(const Shot &shot, Image &out);

  const Camera &camera() const;

 private:
  struct Data;
  explicit Renderer(std::unique_ptr<Data> data);
  std::unique_ptr<Data> data_;
};

// The pixel where the renderer shows a point of the map: each row looks from where the robot is at the row's time
// (fixed-point iteration, to 1e-4 px). False when it has no pixel. Doesn't ask what stands in between: Scene::visible.
bool project_shot(const Camera &camera, const Shot &shot, const Vec3 &point_map, Vec2 &pixel);
// Centre of the camera at the time of row v.
Vec3 camera_centre(const Camera &camera, const Shot &shot, double v_px);

}  // namespace wm::render
