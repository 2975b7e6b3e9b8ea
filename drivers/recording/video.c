// SPDX-License-Identifier: Apache-2.0
#include "waymark/video.h"

#include <inttypes.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "arrival.h"
#include "calibration.h"
#include "container.h"
#include "csv.h"
#include "decoded.h"
#include "jpeg.h"
#include "video_raw.h"

#define PICTURE_SIDE_MAX 16384  // pixels
#define INTERVALS 9             // the usual period is their median

enum { FRAME, T, EXPOSURE, ARRIVAL };
static const csv_format kFormat = {{{"frame", CSV_WHOLE, CSV_NEEDED, 0, 2147483647.0},
                                    {"t_ns", CSV_TIME, CSV_NEEDED, 0, 0},
                                    {"exposure_ns", CSV_TIME, CSV_OPTIONAL, 0, 0},
                                    {"arrival_ns", CSV_TIME, CSV_OPTIONAL, 0, 0}}};

// The next picture and its row.
typedef struct located {
  int there;
  payload picture;
  wm_frame head;
} located;

struct wm_video {
  wm_frame_source base;
  container file;
  csv_reader csv;
  jpeg_decoder jpeg;
  int32_t camera;
  uint32_t width_px, height_px;
  uint8_t *bytes[2], *pixels;  // compressed: this picture and the one before
  size_t bytes_max, before_length;
  decoded_pictures *shared;  // shared with other readers of the same video; NULL: not shared
  decoded_picture *held;     // the last one handed out
  csv_row row, ahead;
  int has_row, has_ahead, rows_ended, pictures_ended;
  payload picture;  // read from the container, without its row yet
  int has_picture;
  int64_t newest_row;
  arrival_order order;
  located next;
  wm_time_ns last_ns, newest_ns, interval_ns[INTERVALS];
  size_t intervals;
  wm_video_counts counts;
};

// ── finding the files ───────────────────────────────────────────────────────────────────────────────────────────────

typedef struct place {
  const char *suffix;
  int is_folder;
} place;
static const place kPlaces[] = {{".avi", 0}, {".mkv", 0}, {"", 1}, {".mp4", 0}};
#define PLACE_COUNT (sizeof kPlaces / sizeof kPlaces[0])

static int video_path(const char *dir, const char *camera, const char *suffix, char out[WM_PATH_MAX]) {
  return snprintf(out, WM_PATH_MAX, "%s/video/%s%s", dir, camera, suffix) < WM_PATH_MAX;
}

// Index into kPlaces of the first place from `from` on with pictures, or PLACE_COUNT.
static size_t find_place(const char *dir, const char *camera, size_t from, char out[WM_PATH_MAX]) {
  for (size_t i = from; i < PLACE_COUNT; i++) {
    struct stat about;
    if (video_path(dir, camera, kPlaces[i].suffix, out) && stat(out, &about) == 0 &&
        (S_ISDIR(about.st_mode) != 0) == kPlaces[i].is_folder)
      return i;
  }
  return PLACE_COUNT;
}

int wm_video_there(const char *recording_dir, const char *camera_name) {
  char path[WM_PATH_MAX];
  return find_place(recording_dir, camera_name, 0, path) < PLACE_COUNT;
}

static wm_status open_pictures(wm_video *self, const char *dir, const char *camera, const warner *warn, wm_error *err) {
  char path[WM_PATH_MAX], other[WM_PATH_MAX];
  size_t found = find_place(dir, camera, 0, path);
  if (found == PLACE_COUNT)
    return wm_fail(err, WM_NOT_FOUND,
                   "%s/video: no pictures of the camera '%s': %s.avi, %s.mkv or a folder %s/ of JPEGs", dir, camera,
                   camera, camera, camera);
  if (find_place(dir, camera, found + 1, other) < PLACE_COUNT)
    warn_line(warn, WM_NOTE_FILE, "%s: is not read; %s is", other, path);
  return kPlaces[found].is_folder ? folder_open(&self->file, path, err) : container_open(&self->file, path, err);
}

// ── what is odd ─────────────────────────────────────────────────────────────────────────────────────────────────────

static void count(wm_video *self, uint64_t *counter, const char *format, ...) __attribute__((format(printf, 3, 4)));
static void count(wm_video *self, uint64_t *counter, const char *format, ...) {
  (*counter)++;
  if (self->counts.first_problem[0]) return;
  va_list args;
  va_start(args, format);
  (void)vsnprintf(self->counts.first_problem, sizeof self->counts.first_problem, format, args);
  va_end(args);
}

// ── rows ────────────────────────────────────────────────────────────────────────────────────────────────────────────

static wm_time_ns arrival_of(const csv_row *row) {
  return row->whole[ARRIVAL] == WM_TIME_NONE ? row->whole[T] : row->whole[ARRIVAL];
}

static void skip_frame(wm_video *self, const csv_row *row, const char *how, int64_t other) {
  count(self, &self->counts.malformed, "%s:%ld: frame: %" PRId64 " %s %" PRId64 "; the row is skipped",
        self->csv.lines.path, row->line, row->whole[FRAME], how, other);
}

// The next row whose picture comes behind those of the rows so far, and is not that of self->row.
static wm_status read_row(wm_video *self, csv_row *row, wm_error *err) {
  for (;;) {
    wm_error why;
    wm_status status = csv_next(&self->csv, err);
    if (status != WM_OK) return status;
    status = csv_read(&self->csv, row, &why);
    if (status == WM_OK && row->whole[FRAME] > self->newest_row && row->whole[FRAME] != self->row.whole[FRAME])
      return WM_OK;
    if (status == WM_OK)
      skip_frame(self, row, "after", self->row.whole[FRAME]);
    else
      count(self, &self->counts.malformed, "%.200s; the row is skipped", why.text);
  }
}

// The next good row, into self->row. One row is read ahead: a stamp, and the number of a picture, are checked against
// those after them.
static wm_status next_row(wm_video *self, wm_error *err) {
  if (self->rows_ended) return WM_END;
  wm_status status = self->has_ahead ? WM_OK : read_row(self, &self->ahead, err);
  while (status == WM_OK) {
    self->row = self->ahead;
    status = read_row(self, &self->ahead, err);
    if (status != WM_OK && status != WM_END) return status;
    self->has_ahead = status == WM_OK;
    if (self->has_ahead && self->ahead.whole[FRAME] < self->row.whole[FRAME]) {
      skip_frame(self, &self->row, "before", self->ahead.whole[FRAME]);
      continue;
    }
    wm_time_ns here_ns = arrival_of(&self->row), next_ns = self->has_ahead ? arrival_of(&self->ahead) : here_ns;
    if (!arrival_order_leaps(&self->order, here_ns, next_ns)) {
      self->rows_ended = !self->has_ahead;
      self->newest_row = self->row.whole[FRAME];
      return WM_OK;
    }
    char why[96];
    arrival_leap_text("t_ns:", here_ns, next_ns, "row", why, sizeof why);
    count(self, &self->counts.malformed, "%s:%ld: %s; the row is skipped", self->csv.lines.path, self->row.line, why);
  }
  if (status == WM_END) self->rows_ended = 1;
  return status;
}

// ── pictures ────────────────────────────────────────────────────────────────────────────────────────────────────────

// The container's next picture into self->picture; WM_END at its end or where it is corrupt.
static wm_status next_picture(wm_video *self, wm_error *err) {
  wm_error why;
  if (self->has_picture) return WM_OK;
  if (self->pictures_ended) return WM_END;
  wm_status status = self->file.next(&self->file, &self->picture, &why);
  self->counts.empty = self->file.empty;
  if (status == WM_OK) {
    self->has_picture = 1;
    return WM_OK;
  }
  if (status == WM_IO) {
    if (err) *err = why;
    return WM_IO;
  }
  if (status == WM_BAD_DATA) count(self, &self->counts.damaged, "%.200s; the pictures end here", why.text);
  self->pictures_ended = 1;
  return WM_END;
}

// Advances to the picture of self->row. WM_END: it is missing, and counted.
static wm_status find_picture(wm_video *self, payload *out, wm_error *err) {
  uint64_t wanted = (uint64_t)self->row.whole[FRAME];
  if (self->file.fd < 0) {
    wm_error why;
    if (folder_find(&self->file, wanted, out, &why) == WM_OK) return WM_OK;
    count(self, &self->counts.without_picture, "%.200s", why.text);
    return WM_END;
  }
  for (;;) {
    wm_status status = next_picture(self, err);
    if (status == WM_IO) return status;
    if (status == WM_END || self->picture.frame > wanted) {
      count(self, &self->counts.without_picture, "%s:%ld: frame %" PRIu64 " is not in the video", self->csv.lines.path,
            self->row.line, wanted);
      return WM_END;
    }
    self->has_picture = 0;
    if (self->picture.frame == wanted) {
      *out = self->picture;
      return WM_OK;
    }
    count(self, &self->counts.without_stamp, "%s: no row names the picture %" PRIu64, self->csv.lines.path,
          self->picture.frame);
  }
}

static int by_length(const void *a, const void *b) {
  wm_time_ns x = *(const wm_time_ns *)a, y = *(const wm_time_ns *)b;
  return (x > y) - (x < y);
}

// Counts gaps against the usual period, the median of the last few. A gap of an hour is a joint of two recordings.
static void count_gap(wm_video *self, wm_time_ns t_ns) {
  if (self->newest_ns == WM_TIME_NONE) return;
  wm_time_ns gap_ns = t_ns - self->newest_ns;
  if (gap_ns <= 0 || gap_ns > 3600 * WM_NS_PER_S) return;
  wm_time_ns sorted[INTERVALS];
  size_t n = self->intervals < INTERVALS ? self->intervals : INTERVALS;
  memcpy(sorted, self->interval_ns, n * sizeof sorted[0]);
  qsort(sorted, n, sizeof sorted[0], by_length);
  if (n >= 3) {
    wm_time_ns usual_ns = sorted[n / 2];
    if (gap_ns > usual_ns + usual_ns / 2) self->counts.lost += (uint64_t)((gap_ns + usual_ns / 2) / usual_ns - 1);
  }
  self->interval_ns[self->intervals++ % INTERVALS] = gap_ns;
}

// The next row and its picture, into self->next.
static wm_status locate(wm_video *self, wm_error *err) {
  while (!self->next.there) {
    if (!self->has_row) {
      wm_status status = next_row(self, err);
      if (status == WM_END) {
        if (self->file.fd < 0) return WM_END;
        while ((status = next_picture(self, err)) == WM_OK) {
          self->has_picture = 0;
          count(self, &self->counts.without_stamp, "%s: no row names the picture %" PRIu64, self->csv.lines.path,
                self->picture.frame);
        }
        return status;
      }
      if (status != WM_OK) return status;
      self->has_row = 1;
    }
    wm_status status = find_picture(self, &self->next.picture, err);
    if (status == WM_IO) return status;
    self->has_row = 0;
    if (status != WM_OK) continue;
    wm_time_ns t_ns = self->row.whole[T], exposure_ns = self->row.whole[EXPOSURE];
    if (t_ns == self->last_ns) {
      count(self, &self->counts.duplicated, "%s:%ld: t_ns: appears twice", self->csv.lines.path, self->row.line);
      continue;
    }
    count_gap(self, t_ns);
    if (self->newest_ns == WM_TIME_NONE || t_ns > self->newest_ns) self->newest_ns = t_ns;
    self->last_ns = t_ns;
    wm_source_counts order = {0};
    self->next.head = (wm_frame){.t_ns = t_ns,
                                 .arrival_ns = arrival_order_next(&self->order, arrival_of(&self->row), &order),
                                 .exposure_ns = exposure_ns < 0 ? 0 : exposure_ns,
                                 .number = (uint64_t)self->row.whole[FRAME],
                                 .camera = self->camera,
                                 .width_px = self->width_px,
                                 .height_px = self->height_px};
    self->counts.out_of_order += order.out_of_order;
    self->next.there = 1;
  }
  return WM_OK;
}

// ── decoding ────────────────────────────────────────────────────────────────────────────────────────────────────────

static void copy_rows(uint8_t *to, uint32_t to_stride, const uint8_t *from, uint32_t from_stride, uint32_t width,
                      uint32_t height) {
  for (uint32_t y = 0; y < height; y++) memcpy(to + (size_t)y * to_stride, from + (size_t)y * from_stride, width);
}

static jpeg_verdict decode(wm_video *self, size_t length, uint8_t *grey, uint32_t stride_bytes, char *why,
                           size_t why_bytes) {
  if (self->file.coding == PICTURE_JPEG)
    return jpeg_decode(&self->jpeg, self->bytes[0], length, self->width_px, self->height_px, grey, stride_bytes, why,
                       why_bytes);
  // Rows are packed, or padded to four bytes.
  uint32_t padded = (self->width_px + 3) & ~UINT32_C(3), stride = self->width_px;
  if (length == (size_t)padded * self->height_px) stride = padded;
  if (length != (size_t)stride * self->height_px) {
    (void)snprintf(why, why_bytes, "has %zu bytes, the camera %u x %u pixels", length, self->width_px, self->height_px);
    return JPEG_WRONG_SIZE;
  }
  copy_rows(grey, stride_bytes, self->bytes[0], stride, self->width_px, self->height_px);
  return JPEG_GOOD;
}

// Destination of a picture's pixels; `grey` NULL: a shared picture, where there is room.
typedef struct target {
  uint8_t *grey;
  uint32_t stride_bytes;
} target;

// Decodes into the shared picture, or takes it from another reader.
static jpeg_verdict decode_shared(wm_video *self, size_t length, target *out, char *why, size_t why_bytes) {
  int is_mine;
  const target own = {self->pixels, self->width_px};
  decoded_picture *p = decoded_hold(self->shared, self->next.picture.frame, &is_mine, &self->base.decoded_in_ns);
  self->held = p;
  *out = p ? (target){p->grey, self->width_px} : own;
  if (!p) return decode(self, length, own.grey, own.stride_bytes, why, why_bytes);
  if (is_mine) {
    p->why[0] = '\0';
    p->verdict = decode(self, length, p->grey, self->width_px, p->why, sizeof p->why);
    decoded_done(self->shared, p);
  }
  (void)snprintf(why, why_bytes, "%s", p->why);
  return p->verdict;
}

// 1: a frame; 0: none, counted; other cases by *status.
static int take(wm_video *self, target *to, wm_status *status, wm_error *err) {
  const payload *picture = &self->next.picture;
  char why[256];
  if (picture->length > self->bytes_max) {
    count(self, &self->counts.damaged,
          "%s: frame %" PRIu64 ": %" PRIu64 " bytes are more than a picture of %u x %u has", self->file.path,
          picture->frame, picture->length, self->width_px, self->height_px);
    return 0;
  }
  wm_error read_error;
  *status = container_read(&self->file, picture, self->bytes[0], &read_error);
  if (*status != WM_OK) {
    int is_io = *status == WM_IO;
    if (is_io && err) *err = read_error;
    if (!is_io) count(self, &self->counts.damaged, "%.200s", read_error.text);
    *status = is_io ? WM_IO : WM_OK;
    return 0;
  }
  size_t length = (size_t)picture->length;
  if (length == self->before_length && memcmp(self->bytes[0], self->bytes[1], length) == 0) {
    count(self, &self->counts.duplicated, "%s: frame %" PRIu64 " is the one before, byte by byte", self->file.path,
          picture->frame);
    return 0;
  }
  jpeg_verdict verdict = to->grey ? decode(self, length, to->grey, to->stride_bytes, why, sizeof why)
                                  : decode_shared(self, length, to, why, sizeof why);
  if (verdict != JPEG_GOOD) {
    count(self, verdict == JPEG_DAMAGED ? &self->counts.damaged : &self->counts.wrong_size, "%s: frame %" PRIu64 ": %s",
          self->file.path, picture->frame, why);
    return 0;
  }
  uint8_t *before = self->bytes[1];
  self->bytes[1] = self->bytes[0];
  self->bytes[0] = before;
  self->before_length = length;
  return 1;
}

static wm_status next_to(wm_video *self, target wanted, wm_frame *out, wm_error *err) {
  for (;;) {
    if (self->shared) decoded_let_go(self->shared, self->held);
    self->held = NULL;
    self->base.decoded_in_ns = 0;
    wm_status status = locate(self, err);
    if (status != WM_OK) return status;
    target to = wanted;
    int is_frame = take(self, &to, &status, err);
    if (status != WM_OK) return status;
    self->next.there = 0;
    if (!is_frame) continue;
    *out = self->next.head;
    out->grey = to.grey;
    out->stride_bytes = to.stride_bytes;
    self->counts.frames++;
    return WM_OK;
  }
}

wm_status wm_video_next_into(wm_video *self, uint8_t *grey, uint32_t stride_bytes, wm_frame *out, wm_error *err) {
  return next_to(self, (target){grey, stride_bytes}, out, err);
}

wm_status wm_video_next(wm_video *self, wm_frame *out, wm_error *err) {
  return next_to(self, self->shared ? (target){0} : (target){self->pixels, self->width_px}, out, err);
}

wm_status wm_video_share(wm_video *self, wm_video *with, wm_error *err) {
  if (self->file.coding != PICTURE_JPEG || self->shared) return WM_OK;
  wm_status status = with->shared ? WM_OK : decoded_open(with->width_px, with->height_px, &with->shared, err);
  if (status != WM_OK) return status;
  decoded_join(with->shared);
  self->shared = with->shared;
  return WM_OK;
}

wm_status wm_video_peek(wm_video *self, wm_frame *out, wm_error *err) {
  wm_status status = locate(self, err);
  if (status == WM_OK) *out = self->next.head;
  return status;
}

wm_status wm_video_skip(wm_video *self, wm_error *err) {
  wm_status status = locate(self, err);
  if (status != WM_OK) return status;
  self->next.there = 0;
  self->counts.skipped++;
  return WM_OK;
}

wm_status wm_video_skip_to(wm_video *self, wm_time_ns now_ns, wm_error *err) {
  wm_status status;
  while ((status = locate(self, err)) == WM_OK && self->has_ahead && arrival_of(&self->ahead) <= now_ns) {
    self->next.there = 0;
    self->counts.skipped++;
  }
  return status == WM_END ? WM_OK : status;
}

// ── as a frame source ───────────────────────────────────────────────────────────────────────────────────────────────

static wm_status peek(wm_frame_source *base, wm_frame *out, wm_error *err) {
  return wm_video_peek((wm_video *)base, out, err);
}

static wm_status next(wm_frame_source *base, wm_frame *out, wm_error *err) {
  wm_video *self = (wm_video *)base;
  return base->into ? wm_video_next_into(self, base->into, self->width_px, out, err) : wm_video_next(self, out, err);
}

static wm_status skip(wm_frame_source *base, wm_error *err) { return wm_video_skip((wm_video *)base, err); }

static wm_status skip_to(wm_frame_source *base, wm_time_ns now_ns, wm_error *err) {
  return wm_video_skip_to((wm_video *)base, now_ns, err);
}

static void raw(const wm_frame_source *base, wm_camera_raw *out) {
  const wm_video *self = (const wm_video *)base;
  *out = (wm_camera_raw){.data = self->bytes[1],  // the newest; the other buffer is for the next
                         .bytes = (uint32_t)self->before_length,
                         .is_jpeg = self->file.coding == PICTURE_JPEG};
}

static void count_all(const wm_frame_source *base, wm_source_counts *out) {
  const wm_video_counts *c = &((const wm_video *)base)->counts;
  *out = (wm_source_counts){.lost = c->lost + c->empty + c->without_picture,
                            .malformed = c->malformed + c->damaged + c->wrong_size + c->without_stamp,
                            .frozen = c->duplicated,
                            .overflows = c->skipped};
  (void)snprintf(out->first_problem, sizeof out->first_problem, "%s", c->first_problem);
}

static void close_video(wm_frame_source *base) { wm_video_close((wm_video *)base); }

static const wm_frame_source_ops kFrames = {peek, next, skip, skip_to, raw, count_all, close_video};

wm_frame_source *wm_video_frames(wm_video *self) { return &self->base; }

// ── opening ─────────────────────────────────────────────────────────────────────────────────────────────────────────

// A camera of unknown size takes that of its first picture.
static wm_status size_of_first(wm_video *self, wm_error *err) {
  self->width_px = self->file.width_px;
  self->height_px = self->file.height_px;
  if (self->file.coding == PICTURE_GREY) return WM_OK;
  wm_status status = locate(self, err);
  if (status != WM_OK && status != WM_END) return status;
  uint64_t length = status == WM_OK ? self->next.picture.length : 0;
  jpeg_verdict verdict = JPEG_DAMAGED;
  uint8_t *bytes = length > 0 && length <= (UINT64_C(1) << 28) ? malloc((size_t)length) : NULL;
  if (bytes && container_read(&self->file, &self->next.picture, bytes, NULL) == WM_OK)
    verdict = jpeg_size(&self->jpeg, bytes, (size_t)length, &self->width_px, &self->height_px);
  free(bytes);
  self->next.head.width_px = self->width_px;
  self->next.head.height_px = self->height_px;
  if (verdict == JPEG_GOOD) return WM_OK;
  return wm_fail(err, WM_BAD_DATA, "%s: the first picture can't be read, and nothing else gives the pictures' size",
                 self->file.path);
}

static wm_status take_memory(wm_video *self, wm_error *err) {
  if (self->width_px < 1 || self->height_px < 1 || self->width_px > PICTURE_SIDE_MAX ||
      self->height_px > PICTURE_SIDE_MAX)
    return wm_fail(err, WM_BAD_DATA, "%s: pictures of %u x %u pixels are not read (1 to %d a side)", self->file.path,
                   self->width_px, self->height_px, PICTURE_SIDE_MAX);
  self->bytes_max = jpeg_bytes_max(self->width_px, self->height_px);
  self->bytes[0] = malloc(self->bytes_max);
  self->bytes[1] = malloc(self->bytes_max);
  self->pixels = malloc((size_t)self->width_px * self->height_px);
  if (self->bytes[0] && self->bytes[1] && self->pixels) return WM_OK;
  return wm_fail(err, WM_IO, "%s: no memory for its pictures", self->file.path);
}

static wm_status open_all(wm_video *self, const char *dir, const wm_camera *camera, const warner *warn, wm_error *err) {
  char path[WM_PATH_MAX];
  wm_status status = open_pictures(self, dir, camera->name, warn, err);
  if (status != WM_OK) return status;
  if (!video_path(dir, camera->name, ".csv", path))
    return wm_fail(err, WM_NOT_FOUND, "%s: the path is longer than %d bytes", dir, WM_PATH_MAX - 1);
  status = csv_open(&self->csv, path, &kFormat, warn->fn, warn->context, err);
  if (status == WM_NOT_FOUND)
    return wm_fail(err, WM_NOT_FOUND, "%s: is not there; it holds the stamp of each picture of %s", path,
                   self->file.path);
  if (status == WM_OK) status = jpeg_open(&self->jpeg, err);
  if (status != WM_OK) return status;
  self->width_px = camera->width_px;
  self->height_px = camera->height_px;
  if (self->width_px == 0) status = size_of_first(self, err);
  return status == WM_OK ? take_memory(self, err) : status;
}

wm_status wm_video_open(const char *recording_dir, const wm_camera *camera, int32_t index, wm_warn_fn warn,
                        void *context, wm_video **out, wm_error *err) {
  *out = NULL;
  wm_video *self = calloc(1, sizeof *self);
  if (!self) return wm_fail(err, WM_IO, "%s: no memory to open its video", recording_dir);
  self->base.ops = &kFrames;
  self->file.fd = -1;
  self->camera = index;
  self->newest_row = self->row.whole[FRAME] = -1;
  self->last_ns = self->newest_ns = WM_TIME_NONE;
  const warner told = {warn, context};
  wm_status status = open_all(self, recording_dir, camera, &told, err);
  if (status != WM_OK) {
    wm_video_close(self);
    return status;
  }
  *out = self;
  return WM_OK;
}

void wm_video_close(wm_video *self) {
  if (!self) return;
  if (self->shared) decoded_let_go(self->shared, self->held);
  decoded_close(self->shared);
  container_close(&self->file);
  csv_close(&self->csv);
  jpeg_close(&self->jpeg);
  free(self->bytes[0]);
  free(self->bytes[1]);
  free(self->pixels);
  free(self);
}

const wm_video_counts *wm_video_counted(const wm_video *self) { return &self->counts; }

// ── as they are stored ──────────────────────────────────────────────────────────────────────────────────────────────

const container *video_container(const wm_video *self) { return &self->file; }
const payload *video_peeked(const wm_video *self) { return &self->next.picture; }

void video_size(const wm_video *self, uint32_t *width_px, uint32_t *height_px) {
  *width_px = self->width_px;
  *height_px = self->height_px;
}
