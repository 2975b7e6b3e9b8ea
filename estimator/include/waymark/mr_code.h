// SPDX-License-Identifier: Apache-2.0
// The MR code: a coded marker after [FengND]: a black pentagon ring in a white rim, 8 x
// 8 modules inside, and one black module below the tip that marks this vertex. The paper's layout and code are not
// legible in the copy at hand; these are our own (docs/markers.md has a picture).
//
// Code: the identity's 16 bits in a binary BCH code of 63 bits that corrects 11 errors (d = 23;
// [Bose1960]), and one module that makes the number of set bits even (d = 24). Up to
// WM_MR_CORRECTED flipped modules are corrected, from there to d - WM_MR_CORRECTED - 1 = 17 refused: 3e-7 of all
// patterns are within reach of any identity at all.
#ifndef WAYMARK_MR_CODE_H
#define WAYMARK_MR_CODE_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define WM_MR_IDS 65536    // identities: 16 bits
#define WM_MR_CORRECTED 6  // module errors that the code corrects
#define WM_MR_DISTANCE 24  // least distance of two codes in any rotation, modules

// The print in units of its size, which is the pentagon's largest width (from its left to its right vertex, outer edge
// of the black). Origin at the pentagon's centre, x to the right, y DOWN for a reader.
#define WM_MR_CIRCUMRADIUS 0.52573111211913361  // outer edge of the ring, to a vertex
#define WM_MR_MODULE 0.068                      // side of a module, width of the ring and of the white rim around it
#define WM_MR_INNER 0.8401224113764473          // inner edge of the ring: the outer one shrunk about the centre
#define WM_MR_CODE_LEFT (-4 * WM_MR_MODULE)     // upper left corner of the 8 x 8 modules
#define WM_MR_CODE_TOP (0.0337 - 4 * WM_MR_MODULE)
#define WM_MR_TIP_Y (-0.337)  // centre of the black module below the tip; its x is 0

// Vertex 0 to 4 of the ring's outer edge, clockwise from the tip for a reader. Constant cost. Any thread.
void wm_mr_vertex(int vertex, double xy[2]);

// The 64 modules of an identity: bit 8 * row + column, from the upper left; set is black. 0 for an identity that does
// not exist. About 0.1 us.
uint64_t wm_mr_encode(uint32_t id);

// Colour of the print at a place: 1 black, 0 white, -1 beyond its white rim. For drawing it.
int wm_mr_ink(uint64_t modules, double x, double y);

// Decodes 64 modules: the identity, and the number of wrong modules. Returns 0 where no identity is near enough. About
// 1 us. Any thread.
int wm_mr_decode(uint64_t modules, uint32_t *id, int *wrong);

#ifdef __cplusplus
}
#endif

#endif
