// SPDX-License-Identifier: Apache-2.0
// What the libjpeg-turbo that is loaded makes of the same pictures: a line "what: hash" for each way to encode and to
// decode, and its words on damaged pictures. Two systems with equal lines give detectors equal pixels.
#include <inttypes.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <turbojpeg.h>

enum { WIDTH = 333, HEIGHT = 245, TJ_PROGRESSIVE = 16384 };  // no multiples of a block

static uint8_t rgb[HEIGHT][WIDTH][3], grey[HEIGHT][WIDTH], out[HEIGHT * WIDTH * 3];

static uint64_t hash(const uint8_t *bytes, size_t count) {  // FNV-1a
  uint64_t h = 14695981039346656037u;
  for (size_t i = 0; i < count; i++) h = (h ^ bytes[i]) * 1099511628211u;
  return h;
}

// Slopes, an edge, and noise of small whole numbers.
static void draw(void) {
  uint32_t noise = 1;
  for (int y = 0; y < HEIGHT; y++)
    for (int x = 0; x < WIDTH; x++) {
      noise = noise * 1664525u + 1013904223u;
      const int wave = (x * 7 + y * 3) % 256, edge = x > 100 + y / 3 ? 60 : 0, grain = (int)(noise >> 28);
      rgb[y][x][0] = (uint8_t)((wave / 2 + edge + grain) & 255);
      rgb[y][x][1] = (uint8_t)((255 - wave) / 2 + edge + grain / 2);
      rgb[y][x][2] = (uint8_t)((y + grain) & 255);
      grey[y][x] = (uint8_t)(wave / 2 + edge + grain);
    }
}

static void decode(const char *what, const uint8_t *jpeg, unsigned long size) {
  static const struct {
    const char *name;
    int format, flags;
  } ways[] = {{"grey, accurate (the robot)", TJPF_GRAY, TJFLAG_ACCURATEDCT},
              {"grey, default (the desk)", TJPF_GRAY, 0},
              {"grey, fast DCT", TJPF_GRAY, TJFLAG_FASTDCT},
              {"colour, smooth chroma", TJPF_RGB, TJFLAG_ACCURATEDCT},
              {"colour, fast upsampling", TJPF_RGB, TJFLAG_ACCURATEDCT | TJFLAG_FASTUPSAMPLE}};
  for (size_t i = 0; i < sizeof ways / sizeof ways[0]; i++) {
    tjhandle handle = tjInitDecompress();
    const int failed = tjDecompress2(handle, jpeg, size, out, WIDTH, 0, HEIGHT, ways[i].format, ways[i].flags);
    printf("decode %s, %s: ", what, ways[i].name);
    if (failed) {
      printf("%s\n", tjGetErrorStr2(handle));
    } else {
      printf("%016" PRIx64 "\n", hash(out, (size_t)WIDTH * HEIGHT * (ways[i].format == TJPF_RGB ? 3 : 1)));
    }
    (void)tjDestroy(handle);
  }
}

static void decode_damaged(const char *what, const uint8_t *jpeg, unsigned long size) {
  tjhandle handle = tjInitDecompress();
  memset(out, 0, sizeof out);
  const int failed = tjDecompress2(handle, jpeg, size, out, WIDTH, 0, HEIGHT, TJPF_GRAY, TJFLAG_ACCURATEDCT);
  printf("decode %s: %s, %016" PRIx64 "\n", what, failed ? tjGetErrorStr2(handle) : "good",
         hash(out, (size_t)WIDTH * HEIGHT));
  (void)tjDestroy(handle);
}

static void damage(const uint8_t *jpeg, unsigned long size) {
  uint8_t *copy = malloc(size + 3);
  if (!copy) exit(1);
  decode_damaged("one that is cut at two thirds", jpeg, size * 2 / 3);
  memcpy(copy, jpeg, 2);  // stray bytes between the begin and the first segment
  memcpy(copy + 2, "\x01\x02\x03", 3);
  memcpy(copy + 5, jpeg + 2, size - 2);
  decode_damaged("one with stray bytes", copy, size + 3);
  memcpy(copy, jpeg, size);
  for (unsigned long i = size / 2; i < size / 2 + 8; i++) copy[i] = 0x55;
  decode_damaged("one with eight wrong bytes", copy, size);
  free(copy);
}

int main(void) {
  static const struct {
    const char *name;
    int sampling, quality, flags;
  } pictures[] = {{"grey, quality 95, accurate (the robot's records)", TJSAMP_GRAY, 95, TJFLAG_ACCURATEDCT},
                  {"4:2:0, quality 90 (the simulator)", TJSAMP_420, 90, 0},
                  {"grey, quality 80 (the simulator)", TJSAMP_GRAY, 80, 0},
                  {"4:2:2, quality 70, accurate (as webcams)", TJSAMP_422, 70, TJFLAG_ACCURATEDCT},
                  {"4:4:4, quality 98", TJSAMP_444, 98, TJFLAG_ACCURATEDCT},
                  {"4:2:0, quality 85, progressive", TJSAMP_420, 85, TJFLAG_ACCURATEDCT | TJ_PROGRESSIVE}};
  setvbuf(stdout, NULL, _IONBF, 0);
  draw();
  for (size_t i = 0; i < sizeof pictures / sizeof pictures[0]; i++) {
    tjhandle handle = tjInitCompress();
    uint8_t *jpeg = NULL;
    unsigned long size = 0;
    const int is_grey = pictures[i].sampling == TJSAMP_GRAY;
    if (tjCompress2(handle, is_grey ? &grey[0][0] : &rgb[0][0][0], WIDTH, 0, HEIGHT, is_grey ? TJPF_GRAY : TJPF_RGB,
                    &jpeg, &size, pictures[i].sampling, pictures[i].quality, pictures[i].flags) != 0) {
      printf("encode %s: %s\n", pictures[i].name, tjGetErrorStr2(handle));
      return 1;
    }
    printf("encode %s: %016" PRIx64 "\n", pictures[i].name, hash(jpeg, size));
    decode(pictures[i].name, jpeg, size);
    if (i == 3) damage(jpeg, size);
    tjFree(jpeg);
    (void)tjDestroy(handle);
  }
  return 0;
}
