// SPDX-License-Identifier: Apache-2.0
// videos make FILE CODEC: a short video of a moving pattern. videos FILE: a hash of its pictures as grey, by the libav
// that is there, with the options of `waymark import`.
#include <inttypes.h>
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/imgutils.h>
#include <libavutil/opt.h>
#include <libswscale/swscale.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { WIDTH = 320, HEIGHT = 240, PICTURES = 25 };

static void stop(const char *why) {
  fprintf(stderr, "videos: %s\n", why);
  exit(1);
}

static void draw(AVFrame *frame, int k) {
  uint32_t noise = (uint32_t)k + 1;
  for (int y = 0; y < HEIGHT; y++)
    for (int x = 0; x < WIDTH; x++) {
      noise = noise * 1664525u + 1013904223u;
      frame->data[0][y * frame->linesize[0] + x] = (uint8_t)((x + 3 * k) * (y + k) / 64 + (int)(noise >> 29));
      if (y % 2 == 0 && x % 2 == 0)
        for (int plane = 1; plane < 3; plane++)
          frame->data[plane][y / 2 * frame->linesize[plane] + x / 2] = (uint8_t)(128 + (x + plane * k) % 40);
    }
}

static void make(const char *path, const char *name) {
  const AVCodec *codec = avcodec_find_encoder_by_name(name);
  if (!codec) stop("no such encoder here");
  AVCodecContext *to = avcodec_alloc_context3(codec);
  to->width = WIDTH, to->height = HEIGHT, to->pix_fmt = AV_PIX_FMT_YUV420P, to->time_base = (AVRational){1, 25};
  to->gop_size = 12, to->max_b_frames = 2, to->bit_rate = 400000;
  if (avcodec_open2(to, codec, NULL) != 0) stop("the encoder does not open");
  AVFrame *frame = av_frame_alloc();
  frame->width = WIDTH, frame->height = HEIGHT, frame->format = AV_PIX_FMT_YUV420P;
  if (av_frame_get_buffer(frame, 0) != 0) stop("no memory");
  AVPacket *packet = av_packet_alloc();
  FILE *out = fopen(path, "wb");
  if (!out) stop("the file can't be written");
  for (int k = 0; k <= PICTURES; k++) {
    if (k < PICTURES) {
      if (av_frame_make_writable(frame) != 0) stop("no memory");
      draw(frame, k);
      frame->pts = k;
    }
    if (avcodec_send_frame(to, k < PICTURES ? frame : NULL) != 0) stop("it does not encode");
    for (; avcodec_receive_packet(to, packet) == 0; av_packet_unref(packet))
      (void)fwrite(packet->data, 1, (size_t)packet->size, out);
  }
  (void)fclose(out);
}

static uint64_t hash = 14695981039346656037u;

static void take(AVFrame *frame, uint8_t *grey) {
  struct SwsContext *scale =
      sws_getContext(frame->width, frame->height, frame->format, frame->width, frame->height, AV_PIX_FMT_GRAY8,
                     SWS_POINT | SWS_BITEXACT | SWS_ACCURATE_RND, NULL, NULL, NULL);
  const int *matrix = sws_getCoefficients(SWS_CS_DEFAULT);
  sws_setColorspaceDetails(scale, matrix, 0, matrix, 1, 0, 1 << 16, 1 << 16);
  uint8_t *rows[4] = {grey, NULL, NULL, NULL};
  const int strides[4] = {frame->width, 0, 0, 0};
  sws_scale(scale, (const uint8_t *const *)frame->data, frame->linesize, 0, frame->height, rows, strides);
  sws_freeContext(scale);
  for (int i = 0; i < frame->width * frame->height; i++) hash = (hash ^ grey[i]) * 1099511628211u;
}

static void decode(const char *path) {
  AVFormatContext *format = NULL;
  av_log_set_level(AV_LOG_FATAL);
  if (avformat_open_input(&format, path, NULL, NULL) != 0 || avformat_find_stream_info(format, NULL) < 0)
    stop("not a video");
  const AVCodecParameters *about = format->streams[0]->codecpar;
  AVCodecContext *from = avcodec_alloc_context3(avcodec_find_decoder(about->codec_id));
  from->flags |= AV_CODEC_FLAG_BITEXACT;  // as tools/import/decoder.cpp
  from->idct_algo = FF_IDCT_SIMPLE;
  if (avcodec_parameters_to_context(from, about) < 0 || avcodec_open2(from, from->codec, NULL) != 0) stop("no decoder");
  AVPacket *packet = av_packet_alloc();
  AVFrame *frame = av_frame_alloc();
  uint8_t *grey = malloc((size_t)WIDTH * HEIGHT);
  int pictures = 0;
  for (int more = 1; more;) {
    more = av_read_frame(format, packet) == 0;
    (void)avcodec_send_packet(from, more ? packet : NULL);
    for (; avcodec_receive_frame(from, frame) == 0; pictures++) take(frame, grey);
    if (more) av_packet_unref(packet);
  }
  printf("%s, %d pictures: %016" PRIx64 "\n", avcodec_get_name(about->codec_id), pictures, hash);
  free(grey);
}

int main(int argc, char **argv) {
  if (argc == 4) make(argv[2], argv[3]);
  if (argc == 2) decode(argv[1]);
  return 0;
}
