// SPDX-License-Identifier: Apache-2.0
// Pictures of materials from numbers: the same seed gives the same picture. All repeat without a seam. Values are
// linear reflectance. `size_px` is both edges unless said; `metres` is what one copy covers.
#pragma once

#include <cstdint>

#include "render/texture.h"

namespace wm::render {

// Value noise of several octaves in [0, 1], mean about 0.5, that repeats after the picture; `cells` at the coarsest.
Picture noise(uint64_t seed, int size_px, int cells, int octaves, double gain = 0.5);
// Painted wall: nearly even, faint clouds and roller marks; `grime` in [0, 1] adds stains and streaks.
Picture paint(uint64_t seed, int size_px, Colour colour, double grime);
// Square tiles with joints: `tiles` a picture edge, joint's share of a tile's edge, each tile a little different.
Picture tiles(uint64_t seed, int size_px, int tiles, double joint, Colour tile, Colour joint_colour, double variation);
// Boards along u: `rows` boards a picture, ends staggered, grain.
Picture planks(uint64_t seed, int size_px, int rows, Colour colour, double variation);
Picture carpet(uint64_t seed, int size_px, Colour colour, double contrast);
Picture linoleum(uint64_t seed, int size_px, Colour colour, double speckle);
Picture concrete(uint64_t seed, int size_px, Colour colour, double stains);
Picture bricks(uint64_t seed, int size_px, int rows, Colour brick, Colour mortar, double variation);
Picture asphalt(uint64_t seed, int size_px, Colour colour, double cracks);
Picture sand(uint64_t seed, int size_px, Colour colour, double ripples);
Picture rock(uint64_t seed, int size_px, Colour colour, double contrast);
Picture ceiling_panels(uint64_t seed, int size_px, int panels, Colour colour);
// A made-up poster: blocks, bars and circles in few strong colours with a border.
Picture poster(uint64_t seed, int width_px, int height_px);
// A door leaf with frame, panels and a handle; a window with frame and bars; a shelf's front with goods of many
// colours.
Picture door(uint64_t seed, int width_px, int height_px, Colour leaf, Colour frame);
Picture window(uint64_t seed, int width_px, int height_px, Colour glass, Colour frame);
Picture goods(uint64_t seed, int width_px, int height_px, int shelves);
// Lays dirt over a picture: dark stains, scuffs along u. amount in [0, 1].
void add_dirt(uint64_t seed, double amount, Picture &picture);

}  // namespace wm::render
