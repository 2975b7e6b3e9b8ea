// SPDX-License-Identifier: Apache-2.0
// Specks that drift in the water, drawn over the finished radiance.
#pragma once

#include "render/kernel.h"
#include "render/render.h"

namespace wm::render {

// Adds the specks that are nearer than what `depth` holds. They stand in cells of the water that drift with the
// current; which ones there are depends on the seed alone.
void draw_particles(const Scene &scene, const Frame<3> &frame, const Camera &camera, const Shot &shot, const Eye &eye,
                    uint64_t seed, const std::vector<float> &depth, Image &image);

}  // namespace wm::render
