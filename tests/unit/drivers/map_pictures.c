// SPDX-License-Identifier: Apache-2.0
// One map as every kind of picture that people have it in: the same cells come out. And what a mode makes of a level.
#include <zlib.h>

#include "common/folder.h"
#include "common/suite.h"
#include "waymark/map.h"

void setUp(void) { folder_make(); }
void tearDown(void) { folder_remove(); }

enum { kWide = 5, kHigh = 3, kCells = kWide * kHigh };
#define F 254  // free, unknown and occupied, as map_saver writes them
#define U 205
#define O 0
static const uint8_t kLevels[kCells] = {F, F, O, U, U, O, F, F, U, F, U, O, F, F, O};

// ── a PNG of any kind ───────────────────────────────────────────────────────────────────────────────────────────────

typedef struct picture {
  const char *about;
  int bits, colour_type, interlaced;  // IHDR's numbers
  double gamma;                       // 0: none stated
  int transparent;                    // levels of `U` are transparent, and stored as F below
  int tinted;                         // blue is a little darker
} picture;

typedef struct bytes {
  uint8_t at[4096];
  size_t count;
} bytes;

static void put(bytes *out, const void *data, size_t count) {
  memcpy(out->at + out->count, data, count);
  out->count += count;
}

static void put_u32(bytes *out, uint32_t v) {
  const uint8_t big[4] = {(uint8_t)(v >> 24), (uint8_t)(v >> 16), (uint8_t)(v >> 8), (uint8_t)v};
  put(out, big, 4);
}

static void put_chunk(bytes *out, const char *name, const bytes *data) {
  put_u32(out, (uint32_t)data->count);
  const size_t from = out->count;
  put(out, name, 4);
  put(out, data->at, data->count);
  put_u32(out, (uint32_t)crc32(0, out->at + from, (uInt)(out->count - from)));
}

// Samples of a pixel, in 8 bits: of grey, RGB, a palette's index, with alpha behind.
static int samples(const picture *p, uint8_t level, uint8_t out[4]) {
  const int clear = p->transparent && level == U;
  const uint8_t shown = clear ? F : level, alpha = clear ? 0 : 255;
  if (p->colour_type == 3) {
    out[0] = level == F ? 0 : level == U ? 1 : 2;
    return 1;
  }
  int n = 0;
  for (int i = 0; i < (p->colour_type & 2 ? 3 : 1); i++) out[n++] = shown;
  if (p->tinted && shown > 4) out[2] = (uint8_t)(shown - 4);
  if (p->colour_type & 4) out[n++] = alpha;
  return n;
}

// One row of the pixels x0, x0 + step ...; less than 8 bits are packed from the left.
static void put_row(bytes *out, const picture *p, int y, int x0, int step) {
  uint8_t packed = 0;
  int used = 0;
  put(out, "", 1);  // no filter
  for (int x = x0; x < kWide; x += step) {
    uint8_t s[4];
    const int n = samples(p, kLevels[y * kWide + x], s);
    for (int i = 0; i < n; i++) {
      if (p->bits >= 8) put(out, &s[i], 1);
      if (p->bits == 16) put(out, &s[i], 1);  // v * 257
      if (p->bits >= 8) continue;
      const int value = p->colour_type == 3 ? s[i] : s[i] >> (8 - p->bits);
      packed = (uint8_t)(packed | value << (8 - p->bits - used));
      if ((used += p->bits) < 8) continue;
      put(out, &packed, 1);
      packed = 0, used = 0;
    }
  }
  if (used > 0) put(out, &packed, 1);
}

static void put_pixels(bytes *out, const picture *p) {
  static const int kPasses[7][4] = {
      {0, 0, 8, 8}, {4, 0, 8, 8}, {0, 4, 4, 8}, {2, 0, 4, 4},
      {0, 2, 2, 4}, {1, 0, 2, 2}, {0, 1, 1, 2}};  // Adam7: first column and row, their steps
  for (int pass = 0; pass < (p->interlaced ? 7 : 1); pass++) {
    const int x0 = p->interlaced ? kPasses[pass][0] : 0, y0 = p->interlaced ? kPasses[pass][1] : 0;
    const int dx = p->interlaced ? kPasses[pass][2] : 1, dy = p->interlaced ? kPasses[pass][3] : 1;
    for (int y = y0; y < kHigh && x0 < kWide; y += dy) put_row(out, p, y, x0, dx);
  }
}

static void write_png(const char *name, const picture *p) {
  bytes png = {0}, head = {0}, raw = {0}, packed = {0}, part = {0};
  const uint8_t kinds[5] = {(uint8_t)p->bits, (uint8_t)p->colour_type, 0, 0, (uint8_t)p->interlaced};
  put(&png, "\x89PNG\r\n\x1a\n", 8);
  put_u32(&head, kWide);
  put_u32(&head, kHigh);
  put(&head, kinds, 5);
  put_chunk(&png, "IHDR", &head);
  if (p->gamma > 0) {
    put_u32(&part, (uint32_t)(p->gamma * 100000));
    put_chunk(&png, "gAMA", &part);
  }
  if (p->colour_type == 3) {
    const uint8_t clear = p->transparent ? F : U;
    const uint8_t colours[9] = {F, F, F, clear, clear, clear, O, O, O};
    part.count = 0;
    put(&part, colours, 9);
    put_chunk(&png, "PLTE", &part);
    part.count = 0;
    put(&part, "\xff\x00", 2);
    if (p->transparent) put_chunk(&png, "tRNS", &part);
  }
  put_pixels(&raw, p);
  uLongf room = sizeof packed.at;
  TEST_ASSERT_EQUAL(Z_OK, compress(packed.at, &room, raw.at, raw.count));
  packed.count = room;
  put_chunk(&png, "IDAT", &packed);
  part.count = 0;
  put_chunk(&png, "IEND", &part);
  folder_write_bytes(name, (const char *)png.at, png.count);
}

static const picture kPictures[] = {
    {"grey", 8, 0, 0, 0, 0, 0},
    {"grey of 16 bits", 16, 0, 0, 0, 0, 0},
    {"grey of 16 bits, gamma 1", 16, 0, 0, 1, 0, 0},
    {"gamma 1", 8, 0, 0, 1, 0, 0},
    {"gamma 1/2.2", 8, 0, 0, 0.45455, 0, 0},
    {"grey of 4 bits", 4, 0, 0, 0, 0, 0},
    {"interlaced", 8, 0, 1, 0, 0, 0},
    {"grey and alpha", 8, 4, 0, 0, 0, 0},
    {"grey and alpha, unknown is transparent", 8, 4, 0, 0, 1, 0},
    {"grey and alpha of 16 bits, interlaced", 16, 4, 1, 0, 1, 0},
    {"colours", 8, 2, 0, 0, 0, 0},
    {"colours of 16 bits", 16, 2, 0, 0, 0, 0},
    {"tinted", 8, 2, 0, 0, 0, 1},
    {"colours and alpha", 8, 6, 0, 0, 0, 0},
    {"colours and alpha, unknown is transparent", 8, 6, 0, 0, 1, 0},
    {"palette", 8, 3, 0, 0, 0, 0},
    {"palette of 2 bits", 2, 3, 0, 0, 0, 0},
    {"palette, unknown is transparent", 8, 3, 0, 0, 1, 0},
};

static wm_error err;

static int8_t meant(uint8_t level) {
  return level == F ? WM_CELL_FREE : level == O ? WM_CELL_OCCUPIED : WM_CELL_UNKNOWN;
}

#define ABOUT "resolution: 0.05\norigin: [0, 0, 0]\n"

TEST(one_map_in_every_kind_of_picture) {
  for (size_t i = 0; i < sizeof kPictures / sizeof *kPictures; i++) {
    const picture *p = &kPictures[i];
    wm_raster place;
    int8_t *cells;
    wm_map *map;
    write_png("plan.png", p);
    folder_write("map.yaml", "image: plan.png\n" ABOUT);
    TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_map_cells_load(folder_path("map.yaml"), &place, &cells, &err), err.text);
    TEST_ASSERT_EQUAL_MESSAGE(kWide, place.width_px, p->about);
    for (int k = 0; k < kCells; k++) TEST_ASSERT_EQUAL_MESSAGE(meant(kLevels[k]), cells[k], p->about);
    free(cells);
    TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_map_load(folder_path("map.yaml"), NULL, NULL, &map, &err), err.text);
    for (int k = 0; k < kCells; k++)
      TEST_ASSERT_EQUAL_MESSAGE(kLevels[k] == F ? 255 : 0, wm_map_raster(map)->drivable[k], p->about);
    wm_map_free(map);
  }
}

// A layer: what is transparent is not in it.
TEST(transparent_is_not_in_a_layer) {
  wm_map *map;
  write_png("edges.png", &(picture){"", 8, 6, 0, 0, 1, 0});
  folder_write("map.yaml", ABOUT "layers: {edges: edges.png}\n");
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_map_load(folder_path("map.yaml"), NULL, NULL, &map, &err), err.text);
  for (int k = 0; k < kCells; k++) TEST_ASSERT_EQUAL(kLevels[k] == F ? 255 : 0, wm_map_raster(map)->edges[k]);
  wm_map_free(map);
}

TEST(pictures_that_are_cut_off) {
  for (size_t i = 0; i < sizeof kPictures / sizeof *kPictures; i++) {
    write_png("plan.png", &kPictures[i]);
    FILE *file = fopen(folder_path("plan.png"), "rb");
    bytes all = {0};
    TEST_ASSERT_NOT_NULL(file);
    all.count = fread(all.at, 1, sizeof all.at, file);
    (void)fclose(file);
    for (size_t n = 4; n + 16 < all.count; n++) {  // the end chunk isn't needed
      wm_grey grey;
      TEST_ASSERT_EQUAL(WM_BAD_DATA, wm_grey_decode(all.at, n, "plan.png", &grey, &err));
      TEST_ASSERT_NULL(grey.pixels);
      TEST_ASSERT_EQUAL_STRING("plan.png: a broken PNG: it is cut off, or its bytes are damaged", err.text);
    }
  }
}

TEST(levels_by_mode) {
  static const struct {
    const char *keys;
    int8_t meant[8];
  } rows[] = {
      // levels: 0, 50, 66, 100, 101, 205, 206, 255
      {"", {100, 100, 100, -1, -1, -1, 0, 0}},
      {"mode: trinary\n", {100, 100, 100, -1, -1, -1, 0, 0}},
      {"mode: scale\nnegate: 0\n", {100, 100, 100, -1, -1, -1, 0, 0}},
      {"mode: scale\nnegate: 1\n", {0, -1, -1, -1, -1, 100, 100, 100}},
      {"negate: true\n", {0, -1, -1, -1, -1, 100, 100, 100}},
      {"mode: raw\n", {0, -1, 100, 100, -1, -1, -1, -1}},
      {"mode: raw\nfree_thresh: 0.51\n", {0, 0, 100, 100, -1, -1, -1, -1}},
      {"free_thresh: 0.25\noccupied_thresh: 0.78\n", {100, 100, -1, -1, -1, 0, 0, 0}},
  };
  for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
    char yaml[256];
    wm_raster place;
    int8_t *cells;
    (void)snprintf(yaml, sizeof yaml, "\xEF\xBB\xBFimage: plan.pgm\n" ABOUT "%s", rows[i].keys);
    folder_write("map.yaml", yaml);
    folder_write("plan.pgm", "P2 # of a comment\n8 1\n255\n0 50 66 100\n101 205 206 255\n");
    TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_map_cells_load(folder_path("map.yaml"), &place, &cells, &err), err.text);
    TEST_ASSERT_EQUAL_INT8_ARRAY_MESSAGE(rows[i].meant, cells, 8, rows[i].keys);
    free(cells);
  }
}

TEST(modes_that_are_refused) {
  static const char *const rows[][2] = {
      {"image: plan.pgm\n" ABOUT "mode: rwa\n", "map.yaml:4: mode"},
      {"image: plan.pgm\n" ABOUT "mode: raw\nnegate: 1\n", "map.yaml:5: negate: the map servers of ROS 1 and 2 differ"},
      {"image: plan.pgm\n" ABOUT "negate: 2\n", "map.yaml:4: negate"},
      {ABOUT, "map.yaml:1: image: is missing"},
  };
  folder_write("plan.pgm", "P2\n1 1\n255\n0\n");
  for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
    wm_raster place;
    int8_t *cells;
    folder_write("map.yaml", rows[i][0]);
    TEST_ASSERT_NOT_EQUAL(WM_OK, wm_map_cells_load(folder_path("map.yaml"), &place, &cells, &err));
    TEST_ASSERT_NULL(cells);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, rows[i][1]), err.text);
  }
}
