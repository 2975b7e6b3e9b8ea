// SPDX-License-Identifier: Apache-2.0
#include "import/decoder.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/display.h>
#include <libavutil/imgutils.h>
#include <libswscale/swscale.h>
}

#include <array>
#include <cmath>
#include <cstring>

#include "common/failure.h"

namespace wm::tools {

constexpr int kErrnoMost = 200;  // Linux has 133; libav's own codes are far above

struct Decoder::Libav {
  std::filesystem::path file;
  AVFormatContext *format = nullptr;
  AVCodecContext *codec = nullptr;
  AVPacket *packet = nullptr;
  AVFrame *frame = nullptr;
  SwsContext *scale = nullptr;
  int stream = -1, source_format = -1;
  std::optional<int64_t> first_pts;
  bool drained = false;
  uint64_t damaged = 0;
  images::Picture8 grey;
  uint64_t interlaced = 0;
  int turned_deg = 0;

  ~Libav() {
    sws_freeContext(scale);
    av_frame_free(&frame);
    av_packet_free(&packet);
    avcodec_free_context(&codec);
    avformat_close_input(&format);
  }
  // One more packet into the decoder; false when there are none left.
  bool feed() {
    while (av_read_frame(format, packet) == 0) {
      const bool is_ours = packet->stream_index == stream;
      if (is_ours && avcodec_send_packet(codec, packet) < 0) damaged++;
      av_packet_unref(packet);
      if (is_ours) return true;
    }
    if (drained) return false;
    drained = true;
    return avcodec_send_packet(codec, nullptr) == 0;
  }
  void to_grey();
  void look();
};

// What the container and the codec say of a picture.
void Decoder::Libav::look() {
#ifdef AV_FRAME_FLAG_INTERLACED
  interlaced += (frame->flags & AV_FRAME_FLAG_INTERLACED) != 0;
#else
  interlaced += frame->interlaced_frame != 0;
#endif
  const AVFrameSideData *side = av_frame_get_side_data(frame, AV_FRAME_DATA_DISPLAYMATRIX);
  if (!side || side->size < sizeof(std::array<int32_t, 9>)) return;
  std::array<int32_t, 9> matrix{};
  std::memcpy(matrix.data(), side->data, sizeof matrix);
  const double turn_deg = -av_display_rotation_get(matrix.data());
  if (std::isfinite(turn_deg)) turned_deg = static_cast<int>(std::lround(turn_deg + 360)) % 360;
}

// The brightness alone, 0 to 255 whatever range the video has it in, the same bytes on every machine.
void Decoder::Libav::to_grey() {
  if (frame->width != grey.width || frame->height != grey.height)
    throw Failure(file.string() + ": its pictures change their size; cut it where they do");
  if (frame->format != source_format) {
    sws_freeContext(scale);
    scale = sws_getContext(frame->width, frame->height, static_cast<AVPixelFormat>(frame->format), frame->width,
                           frame->height, AV_PIX_FMT_GRAY8, SWS_POINT | SWS_BITEXACT | SWS_ACCURATE_RND, nullptr,
                           nullptr, nullptr);
    if (!scale) throw Failure(file.string() + ": pictures of a form that can't be made grey");
    source_format = frame->format;
    const int *matrix = sws_getCoefficients(SWS_CS_DEFAULT);
    const bool is_full = frame->color_range == AVCOL_RANGE_JPEG || frame->format == AV_PIX_FMT_YUVJ420P ||
                         frame->format == AV_PIX_FMT_YUVJ422P || frame->format == AV_PIX_FMT_YUVJ444P;
    sws_setColorspaceDetails(scale, matrix, is_full ? 1 : 0, matrix, 1, 0, 1 << 16, 1 << 16);
  }
  uint8_t *rows[] = {grey.bytes.data(), nullptr, nullptr, nullptr};
  const int strides[] = {grey.width, 0, 0, 0};
  sws_scale(scale, frame->data, frame->linesize, 0, frame->height, rows, strides);
}

// libav draws text files as pictures of letters ("tty", by the name's ending).
static void refuse_text(const AVFormatContext &format, const std::filesystem::path &file) {
  const std::string name = format.iformat->name;
  for (const char *text : {"tty", "bin", "xbin", "adf", "idf"})
    if (name == text) throw Failure(file.string() + ": is text, not a video", kUsage);
}

Decoder::Decoder(const std::filesystem::path &file) : av_(std::make_unique<Libav>()) {
  Libav &av = *av_;
  av.file = file;
  av_log_set_level(AV_LOG_FATAL);
  const auto why = [&file](int code) {
    const int system = AVUNERROR(code);  // errno, or a number of libav's own
    return file.string() + ": " +
           (system > 0 && system < kErrnoMost ? std::strerror(system)
                                              : "is not a video that can be read, or it is damaged");
  };
  // Every picture in the file has its row: an edit list, by which players leave some out, is not looked at.
  AVDictionary *options = nullptr;
  av_dict_set(&options, "ignore_editlist", "1", 0);
  const int opened = avformat_open_input(&av.format, file.c_str(), nullptr, &options);
  av_dict_free(&options);
  if (opened < 0) throw Failure(why(opened), kUsage);
  refuse_text(*av.format, file);
  if (const int code = avformat_find_stream_info(av.format, nullptr); code < 0) throw Failure(why(code));
#if LIBAVCODEC_VERSION_MAJOR < 60
  av_format_inject_global_side_data(av.format);  // newer ones give a picture the container's matrix without
#endif
  const AVCodec *codec = nullptr;
  av.stream = av_find_best_stream(av.format, AVMEDIA_TYPE_VIDEO, -1, -1, &codec, 0);
  if (av.stream < 0 || !codec) throw Failure(file.string() + ": has no video in it that libav can decode");
  av.codec = avcodec_alloc_context3(codec);
  av.packet = av_packet_alloc();
  av.frame = av_frame_alloc();
  const AVStream *stream = av.format->streams[av.stream];
  if (!av.codec || !av.packet || !av.frame) throw Failure(file.string() + ": no memory");
  if (const int code = avcodec_parameters_to_context(av.codec, stream->codecpar); code < 0) throw Failure(why(code));
  // MPEG-4 and MPEG-2 leave the last bit of their DCT to the decoder, and libav rounds motion by the processor's own
  // way: one way for all.
  av.codec->flags |= AV_CODEC_FLAG_BITEXACT;
  av.codec->idct_algo = FF_IDCT_SIMPLE;
  if (const int code = avcodec_open2(av.codec, codec, nullptr); code < 0) throw Failure(why(code));
  av.grey.width = av.codec->width;
  av.grey.height = av.codec->height;
  if (av.grey.width < 1 || av.grey.height < 1) throw Failure(file.string() + ": its pictures have no size");
  av.grey.bytes.resize(static_cast<size_t>(av.grey.width) * static_cast<size_t>(av.grey.height));
}

Decoder::~Decoder() = default;

int Decoder::width() const { return av_->grey.width; }
int Decoder::height() const { return av_->grey.height; }
const char *Decoder::codec() const { return avcodec_get_name(av_->codec->codec_id); }
uint64_t Decoder::damaged() const { return av_->damaged; }
uint64_t Decoder::interlaced() const { return av_->interlaced; }
int Decoder::turned_deg() const { return av_->turned_deg; }

double Decoder::rate_hz() const {
  const AVRational rate = av_->format->streams[av_->stream]->avg_frame_rate;
  return rate.num > 0 && rate.den > 0 ? av_q2d(rate) : 30.0;
}

std::optional<Decoder::Shown> Decoder::next() {
  Libav &av = *av_;
  for (int code; (code = avcodec_receive_frame(av.codec, av.frame)) != 0;) {
    if (code != AVERROR(EAGAIN) && code != AVERROR_EOF) av.damaged++;
    if (code == AVERROR_EOF || !av.feed()) return std::nullopt;
  }
  if (av.frame->decode_error_flags != 0 || (av.frame->flags & AV_FRAME_FLAG_CORRUPT) != 0) av.damaged++;
  av.look();
  av.to_grey();
  Shown out{&av.grey, std::nullopt};
  if (const int64_t pts = av.frame->best_effort_timestamp; pts != AV_NOPTS_VALUE) {
    if (!av.first_pts) av.first_pts = pts;
    out.t_s = static_cast<double>(pts - *av.first_pts) * av_q2d(av.format->streams[av.stream]->time_base);
  }
  return out;
}

}  // namespace wm::tools
