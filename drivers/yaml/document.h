// SPDX-License-Identifier: Apache-2.0
// The tree behind waymark/yaml.h.
#ifndef WM_YAML_DOCUMENT_H
#define WM_YAML_DOCUMENT_H

#include "waymark/yaml.h"

#define WM_YAML_BYTES_MAX (16u << 20)  // usual files are some kB
#define WM_YAML_NODES_MAX 1000000      // with aliases expanded: bounds memory and time
#define WM_YAML_DEPTH_MAX 64           // bounds the recursion
#define WM_YAML_ANCHORS_MAX 1000       // each alias searches them

typedef enum yaml_kind { YAML_KIND_NULL, YAML_KIND_SCALAR, YAML_KIND_LIST, YAML_KIND_MAP } yaml_kind;

typedef struct yaml_tree_node {
  uint8_t kind;
  uint8_t quoted;   // a scalar in quotes or a block: never a number, bool or null
  int line;         // from 1
  size_t first;     // scalar: offset into the pool; list, map: into the links
  size_t count;     // scalar: bytes; list: items; map: pairs (key and value follow each other in the links)
  size_t expanded;  // nodes below with aliases written out, and itself
} yaml_tree_node;

struct wm_yaml {
  char file[512];
  yaml_tree_node *nodes;  // [0] is an absent node
  size_t node_count, node_capacity;
  int *links;
  size_t link_count, link_capacity;
  char *pool;  // scalars, each terminated
  size_t pool_used, pool_capacity;
  int root;
};

static inline const char *yaml_text(const wm_yaml *doc, int id) { return doc->pool + doc->nodes[id].first; }

#endif
