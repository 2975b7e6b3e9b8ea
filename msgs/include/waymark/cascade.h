// SPDX-License-Identifier: Apache-2.0
// A cascade of boosted classifiers as OpenCV's XML files have it (stage type BOOST, features LBP or HAAR): the numbers
// of such a file, checked by its reader. P. Viola, M. Jones 2001 (cascade, Haar features); S. Liao et al. 2007
// (multi-block LBP). Part of the setup of one process: its arrays belong to the reader of the file, and it is never
// logged or sent.
#ifndef WAYMARK_CASCADE_H
#define WAYMARK_CASCADE_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define WM_CASCADE_RECTS 3
#define WM_CASCADE_SIDE_MAX 200  // px of a window

// Rectangles in the window, px. LBP: one, the upper left of 3 x 3 blocks. HAAR: two or three, with weights.
typedef struct wm_cascade_feature {
  uint8_t x[WM_CASCADE_RECTS], y[WM_CASCADE_RECTS], width[WM_CASCADE_RECTS], height[WM_CASCADE_RECTS];
  float weight[WM_CASCADE_RECTS];  // 0: no such rectangle
} wm_cascade_feature;

// Of a tree; `next` above 0 is a node of the same tree, further on, else minus the number of a leaf of it.
typedef struct wm_cascade_node {
  int16_t next[2];  // where the test holds, and where it doesn't
  uint32_t feature;
  float threshold;    // HAAR: the test is "less than"
  uint32_t codes[8];  // LBP: the test is "a code of this set"
} wm_cascade_node;

typedef struct wm_cascade_tree {
  uint32_t first_node, first_leaf;
} wm_cascade_tree;

typedef struct wm_cascade_stage {
  uint32_t first_tree, trees;
  float threshold;  // the leaves' sum must reach it
} wm_cascade_stage;

typedef struct wm_cascade {
  uint32_t is_lbp;
  uint32_t width_px, height_px;  // of a window
  double height_m;               // of the object in a window; its middle is the landmark's place
  size_t feature_count, node_count, leaf_count, tree_count, stage_count;
  wm_cascade_feature *features;
  wm_cascade_node *nodes;
  float *leaves;
  wm_cascade_tree *trees;
  wm_cascade_stage *stages;
} wm_cascade;

#ifdef __cplusplus
}
#endif

#endif
