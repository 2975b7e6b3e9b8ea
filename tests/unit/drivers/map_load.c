// SPDX-License-Identifier: Apache-2.0
// Raster maps: what map.yaml and its pictures say, and what is said when they are wrong.
#include "common/folder.h"
#include "common/suite.h"
#include "waymark/map.h"

#define GEOMETRY "image: plan.pgm\nresolution: 0.05\norigin: [-1.5, 2.5, 0.5]\nnegate: 0\n"
#define YAML GEOMETRY "layers: {edges: edges.pgm, drivable: drivable.pgm}\n"

static wm_map *map;
static wm_error err;
static char warnings[1024];

static void keep_warning(void *context, wm_note note, const char *text) {
  (void)context;
  (void)note;
  snprintf(warnings, sizeof warnings, "%s", text);
}

void setUp(void) {
  folder_make();
  map = NULL;
  warnings[0] = '\0';
  folder_write("map.yaml", YAML);
  folder_write("plan.pgm", "P2\n3 2\n255\n254 205 0 254 254 100\n");
  folder_write("edges.pgm", "P2 # plain\n3 2 255\n0 255 127 128 0 255\n");
  folder_write_bytes("drivable.pgm", "P5\n3 2\n255\n\xff\xff\x00\x00\x01\xfe", 17);
}

void tearDown(void) {
  wm_map_free(map);
  folder_remove();
}

static wm_status try_load(void) {
  wm_map_free(map);
  map = NULL;
  return wm_map_load(folder_path("map.yaml"), keep_warning, NULL, &map, &err);
}

static const wm_raster *load(void) {
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, try_load(), err.text);
  return wm_map_raster(map);
}

static void refused(const char *yaml, const char *where, const char *what) {
  folder_write("map.yaml", yaml);
  TEST_ASSERT_NOT_EQUAL(WM_OK, try_load());
  TEST_ASSERT_NULL(map);
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, where), err.text);
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, what), err.text);
}

TEST(layers) {
  const wm_raster *r = load();
  const uint8_t edges[6] = {0, 255, 0, 255, 0, 255}, drivable[6] = {255, 255, 0, 0, 0, 255};
  TEST_ASSERT_EQUAL(3, r->width_px);
  TEST_ASSERT_EQUAL(2, r->height_px);
  TEST_ASSERT_EQUAL_DOUBLE(0.05, r->resolution_m);
  TEST_ASSERT_EQUAL_DOUBLE(-1.5, r->origin_x_m);
  TEST_ASSERT_EQUAL_DOUBLE(2.5, r->origin_y_m);
  TEST_ASSERT_EQUAL_DOUBLE(0.5, r->origin_yaw_rad);
  TEST_ASSERT_EQUAL_UINT8_ARRAY(edges, r->edges, 6);
  TEST_ASSERT_EQUAL_UINT8_ARRAY(drivable, r->drivable, 6);
}

TEST(what_is_free_is_drivable_where_there_is_no_layer) {
  folder_write("map.yaml", GEOMETRY "layers: {edges: edges.pgm}\n");
  const uint8_t free_pixels[6] = {255, 0, 0, 255, 255, 0};  // 205 is unknown
  TEST_ASSERT_EQUAL_UINT8_ARRAY(free_pixels, load()->drivable, 6);
  folder_write("map.yaml", "image: plan.pgm\nresolution: 0.05\norigin: [0, 0]\nnegate: 1\n");
  const uint8_t negated[6] = {0, 0, 255, 0, 0, 0};
  TEST_ASSERT_EQUAL_UINT8_ARRAY(negated, load()->drivable, 6);
  TEST_ASSERT_NULL(load()->edges);
}

TEST(unknown_places_that_the_thresholds_make_free_are_named) {
  folder_write("map.yaml", GEOMETRY);
  (void)load();
  TEST_ASSERT_EQUAL_STRING("", warnings);
  folder_write("map.yaml", GEOMETRY "free_thresh: 0.25\n");
  const uint8_t with_unknown[6] = {255, 255, 0, 255, 255, 0};
  TEST_ASSERT_EQUAL_UINT8_ARRAY(with_unknown, load()->drivable, 6);
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(warnings, "16 of 100 pixels are 205, which map savers write for unknown"),
                               warnings);
  warnings[0] = '\0';
  folder_write("map.yaml", GEOMETRY "free_thresh: 0.25\nmode: raw\n");
  (void)load();
  TEST_ASSERT_EQUAL_STRING("", warnings);
}

// Pixels of 5 cm, the lower left one at the origin: edges in columns 1 (top row), 0 and 2 (bottom row).
TEST(edges_within_an_ignored_area_do_not_count) {
  folder_write("map.yaml",
               "image: plan.pgm\nresolution: 0.05\norigin: [-1.5, 2.5, 0]\nlayers: {edges: edges.pgm}\n"
               "ignore: [[[-1.46, 2.56], [-1.41, 2.56], [-1.41, 2.59], [-1.46, 2.59]], "
               "[[-1.41, 2.4], [9, 2.4], [-1.41, 2.54]]]\n");
  const uint8_t edges[6] = {0, 0, 0, 255, 0, 0};
  TEST_ASSERT_EQUAL_UINT8_ARRAY(edges, load()->edges, 6);
  TEST_ASSERT_EQUAL_STRING("", warnings);
  // A trough about column 1: what lies between its sides counts.
  folder_write("map.yaml",
               "resolution: 0.05\norigin: [-1.5, 2.5, 0]\nlayers: {edges: edges.pgm}\n"
               "ignore: [[[-1.6, 2.4], [-1.45, 2.4], [-1.45, 2.65], [-1.4, 2.65], [-1.4, 2.4], [-1.2, 2.4], "
               "[-1.2, 2.7], [-1.6, 2.7]]]\n");
  const uint8_t between[6] = {0, 255, 0, 0, 0, 0};
  TEST_ASSERT_EQUAL_UINT8_ARRAY(between, load()->edges, 6);
  // Turned by a right angle: x of the map is up in the picture, y to its left.
  folder_write("map.yaml",
               "resolution: 0.05\norigin: [1, 2, -1.57079632679]\nlayers: {edges: edges.pgm}\n"
               "ignore: [[[0.96, 1.99], [1.01, 1.99], [1.01, 1.86], [0.96, 1.86]]]\n");
  const uint8_t turned[6] = {0, 255, 0, 255, 0, 255};
  TEST_ASSERT_EQUAL_UINT8_ARRAY(turned, load()->edges, 6);
  folder_write("map.yaml",
               "resolution: 0.05\norigin: [1, 2, -1.57079632679]\nlayers: {edges: edges.pgm}\n"
               "ignore: [[[1.01, 1.99], [1.04, 1.99], [1.04, 1.86], [1.01, 1.86]]]\n");
  const uint8_t lower[6] = {0, 255, 0, 0, 0, 0};
  TEST_ASSERT_EQUAL_UINT8_ARRAY(lower, load()->edges, 6);
}

// Beyond the picture, over all of it, and with the same corner twice: no pixel outside is touched.
TEST(ignored_areas_of_any_size) {
  const uint8_t none[6] = {0};
  folder_write("map.yaml",
               YAML "ignore: [[[-1e8, -1e8], [1e8, -1e8], [1e8, 1e8], [-1e8, 1e8]], [[0, 0], [0, 0], [0, 0]]]\n");
  TEST_ASSERT_EQUAL_UINT8_ARRAY(none, load()->edges, 6);
  folder_write("map.yaml", YAML "ignore: [[[50, 50], [60, 50], [60, 60]]]\n");
  const uint8_t all[6] = {0, 255, 0, 255, 0, 255};
  TEST_ASSERT_EQUAL_UINT8_ARRAY(all, load()->edges, 6);
  folder_write("map.yaml", YAML "ignore: []\n");
  TEST_ASSERT_EQUAL_UINT8_ARRAY(all, load()->edges, 6);
  refused(YAML "ignore: 3\n", "ignore", "a list of polygons");
  refused(YAML "ignore: [[[1, 1], [2, 2]]]\n", "ignore[0]", "3 to 1000 corners");
  refused(YAML "ignore: [[[1, 1], [2, 2], [3]]]\n", "ignore[0][2]", "2");
  refused(YAML "ignore: [[[1, 1], [2, 2], [3, 1e9]]]\n", "ignore[0][2]", "metres up to 1e8");
}

TEST(the_hash_tells_maps_apart) {
  const uint64_t hash = load()->hash;
  TEST_ASSERT_TRUE(load()->hash == hash);
  folder_write("edges.pgm", "P2\n3 2\n255\n0 255 0 255 255 255\n");
  TEST_ASSERT_FALSE(load()->hash == hash);
  folder_write("edges.pgm", "P2\n3 2\n255\n0 200 0 255 0 255\n");  // the same edges
  TEST_ASSERT_TRUE(load()->hash == hash);
  folder_write("map.yaml",
               "image: plan.pgm\nresolution: 0.05\norigin: [-1.5, 2.5, 0.25]\nlayers: {edges: edges.pgm, "
               "drivable: drivable.pgm}\n");
  TEST_ASSERT_FALSE(load()->hash == hash);
}

TEST(deep_pgm) {
  folder_write_bytes("edges.pgm", "P5\n3 2\n1000\n\x00\x00\x03\xe8\x01\xf3\x01\xf5\xff\xff\x00\x01", 24);
  const uint8_t edges[6] = {0, 255, 0, 255, 255, 0};
  TEST_ASSERT_EQUAL_UINT8_ARRAY(edges, load()->edges, 6);
}

TEST(wrong_yaml) {
  refused("resolution: 0\norigin: [0, 0, 0]\nlayers: {edges: edges.pgm}\n", "map.yaml:1: resolution", "above 0");
  refused("resolution: -0.1\norigin: [0, 0, 0]\nlayers: {edges: edges.pgm}\n", "map.yaml:1: resolution", "above 0");
  refused("resolution: .nan\norigin: [0, 0, 0]\nlayers: {edges: edges.pgm}\n", "map.yaml:1: resolution", "nan");
  refused("resolution: 1e-9\norigin: [0, 0, 0]\nlayers: {edges: edges.pgm}\n", "map.yaml:1: resolution", "0.0001");
  refused("origin: [0, 0, 0]\nlayers: {edges: edges.pgm}\n", "map.yaml:1", "resolution: is missing");
  refused("resolution: 0.05\nlayers: {edges: edges.pgm}\n", "map.yaml:1", "origin: is missing");
  refused("resolution: 0.05\norigin: [0]\n", "map.yaml:2: origin", "2 to 3");
  refused("resolution: 0.05\norigin: [0, .inf, 0]\n", "map.yaml:2: origin", "inf");
  refused("resolution: 0.05\norigin: [0, 0, 0]\n", "map.yaml:1", "layers.edges");
  refused("resolutoin: 0.05\norigin: [0, 0, 0]\n", "map.yaml:1: resolutoin", "did you mean 'resolution'");
  refused("resolution: 0.05\norigin: [0, 0, 0]\nlayers: {egdes: edges.pgm}\n", "map.yaml:3: layers.egdes",
          "did you mean 'edges'");
  refused("resolution: 0.05\norigin: [0, 0, 0]\nlayers: edges.pgm\n", "map.yaml:3: layers", "{edges: FILE");
  refused("resolution: 0.05\norigin: [0, 0, 0]\nlayers: {edges: nowhere.png}\n", "map.yaml:3: layers.edges",
          "'nowhere.png' can't be read");
  refused(GEOMETRY "free_thresh: 0.7\noccupied_thresh: 0.6\n", "map.yaml:5: free_thresh", "above occupied_thresh");
  refused("- a\n", "map.yaml:1", "a map with image");
  folder_write("map.yaml", YAML "colour: 1\n");
  (void)load();
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(warnings, "colour"), warnings);
}

TEST(wrong_pictures) {
  static const struct {
    const char *bytes;
    size_t size;
    const char *what;
  } kCases[] = {
      {"", 0, "is empty"},
      {"GIF89a", 6, "neither PNG nor PGM"},
      {"P6\n3 2\n255\n", 11, "neither PNG nor PGM"},
      {"P5\n3 2\n", 7, "head of the PGM is broken"},
      {"P5\n3 2\n0\n", 9, "head of the PGM is broken"},
      {"P5\n3 2\n70000\n", 13, "head of the PGM is broken"},
      {"P5\n-3 2\n255\n", 12, "head of the PGM is broken"},
      {"P5\n0 2\n255\n", 11, "without pixels"},
      {"P5\n3 2\n255\nabcde", 16, "its head states 6 pixels"},
      {"P2\n3 2\n255\n1 2 3 4 5", 20, "truncated"},
      {"P2\n3 2\n255\n1 2 3 4 5 256", 24, "pixel 5"},
      {"P5\n40000 2\n255\n", 15, "too many"},
      {"P5\n30000 30000\n255\n", 19, "too many"},
      {"P5\n4294967295 4294967295\n255\n", 29, "too many"},
      {"P5\n99999999999 2\n255\n", 21, "head of the PGM is broken"},
      {"\x89PNG\r\n\x1a\n", 8, "a broken PNG"},
      {"P2\n2 2\n255\n1 2 3 4", 18, "must be of one size"},
  };
  for (size_t i = 0; i < sizeof kCases / sizeof kCases[0]; i++) {
    folder_write_bytes("edges.pgm", kCases[i].bytes, kCases[i].size);
    refused(YAML, "map.yaml:5: layers", kCases[i].what);
  }
}
