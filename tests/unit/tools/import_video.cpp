// SPDX-License-Identifier: Apache-2.0
// `waymark import`: a compressed video in MP4, made here, against what the robot's reader then reads of it.
#include <unistd.h>
#include <memory>

#include <fstream>

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/cpu.h>
#include <libavutil/display.h>
}

#include "common/failure.h"
#include "common/suite.h"
#include "import/decoder.h"
#include "import/import.h"
#include "made.h"
#include "waymark/video.h"

namespace {

namespace fs = std::filesystem;
constexpr int kWidth = 160, kHeight = 96, kPictures = 30, kBar = 16;
fs::path folder;

// A bright bar that goes to the right by 4 px a picture.
bool is_bright(int x, int picture) { return x / 4 >= picture && x / 4 < picture + kBar / 4; }

uint8_t bar(int x, int, int picture) { return is_bright(x, picture) ? 235 : 16; }
// Fine curves that move, with noise.
uint8_t curves(int x, int y, int picture) {
  auto noise = static_cast<uint32_t>((picture * kHeight + y) * kWidth + x) * 2654435761u;
  noise = (noise ^ noise >> 15) * 2246822519u;
  return static_cast<uint8_t>((x + 3 * picture) * (y + picture) / 64 + static_cast<int>(noise >> 29));
}

// As a phone that was held upright writes it.
void turn(AVStream *stream, int clockwise_deg) {
  constexpr size_t kBytes = 9 * sizeof(int32_t);
#if LIBAVCODEC_VERSION_MAJOR < 61
  uint8_t *data = av_stream_new_side_data(stream, AV_PKT_DATA_DISPLAYMATRIX, kBytes);
#else
  AVCodecParameters *about = stream->codecpar;
  uint8_t *data =
      av_packet_side_data_new(&about->coded_side_data, &about->nb_coded_side_data, AV_PKT_DATA_DISPLAYMATRIX, kBytes, 0)
          ->data;
#endif
  TEST_ASSERT_NOT_NULL(data);
  av_display_rotation_set(reinterpret_cast<int32_t *>(data), clockwise_deg);
}

// Pictures that refer to later ones are among them, where the encoder can: their order in the file is another.
void encode(const fs::path &file, AVCodecID kind, uint8_t (*grey)(int x, int y, int picture), int turn_deg = 0,
            bool is_interlaced = false) {
  AVFormatContext *format = nullptr;
  TEST_ASSERT_TRUE(avformat_alloc_output_context2(&format, nullptr, "mp4", file.c_str()) >= 0);
  const AVCodec *codec = avcodec_find_encoder(kind);
  if (!codec) codec = avcodec_find_encoder(AV_CODEC_ID_MPEG4);
  AVCodecContext *to = avcodec_alloc_context3(codec);
  to->width = kWidth;
  to->height = kHeight;
  to->pix_fmt = AV_PIX_FMT_YUV420P;
  to->time_base = {1, 10};
  to->max_b_frames = 2;
  to->bit_rate = 10000;  // coarse: much of a picture is that of the one before, moved by half pixels
  to->thread_count = 1;
  if ((format->oformat->flags & AVFMT_GLOBALHEADER) != 0) to->flags |= AV_CODEC_FLAG_GLOBAL_HEADER;
  if (is_interlaced) to->flags |= AV_CODEC_FLAG_INTERLACED_DCT;
  TEST_ASSERT_EQUAL(0, avcodec_open2(to, codec, nullptr));
  AVStream *stream = avformat_new_stream(format, nullptr);
  avcodec_parameters_from_context(stream->codecpar, to);
  stream->time_base = to->time_base;
  if (turn_deg != 0) turn(stream, turn_deg);
  TEST_ASSERT_TRUE(avio_open(&format->pb, file.c_str(), AVIO_FLAG_WRITE) >= 0);
  TEST_ASSERT_TRUE(avformat_write_header(format, nullptr) >= 0);
  AVFrame *frame = av_frame_alloc();
  frame->format = to->pix_fmt;
  frame->width = kWidth;
  frame->height = kHeight;
  TEST_ASSERT_EQUAL(0, av_frame_get_buffer(frame, 0));
  AVPacket *packet = av_packet_alloc();
  for (int picture = 0; picture <= kPictures; picture++) {
    if (picture < kPictures) {
      TEST_ASSERT_EQUAL(0, av_frame_make_writable(frame));
      for (int y = 0; y < kHeight; y++)
        for (int x = 0; x < kWidth; x++) frame->data[0][y * frame->linesize[0] + x] = grey(x, y, picture);
      for (int c = 1; c < 3; c++)
        for (int y = 0; y < kHeight / 2; y++)
          std::memset(frame->data[c] + static_cast<ptrdiff_t>(y) * frame->linesize[c], 128, kWidth / 2);
      frame->pts = picture + picture / 10;  // a gap every tenth
    }
    TEST_ASSERT_EQUAL(0, avcodec_send_frame(to, picture < kPictures ? frame : nullptr));
    while (avcodec_receive_packet(to, packet) == 0) {
      av_packet_rescale_ts(packet, to->time_base, stream->time_base);
      TEST_ASSERT_TRUE(av_interleaved_write_frame(format, packet) >= 0);
    }
  }
  av_write_trailer(format);
  avio_closep(&format->pb);
  av_packet_free(&packet);
  av_frame_free(&frame);
  avcodec_free_context(&to);
  avformat_free_context(format);
}

void write_stamps(const fs::path &file, int rows) {
  std::ofstream out(file);
  out << "frame,t_ns,exposure_ns,arrival_ns\n";
  for (int i = 0; i < rows; i++)
    out << i << ',' << 5'000'000'000LL + i * 100'000'007LL << ",4000000," << 5'040'000'000LL + i * 100'000'007LL
        << '\n';
}

// Each picture as the robot reads it: the bar where it belongs, black and white of full range.
void judge(const fs::path &recording, int64_t first_ns, int64_t eleventh_ns, int64_t exposure_ns) {
  wm_camera camera{};
  std::strcpy(camera.name, "front");
  wm_error err{};
  wm_video *opened = nullptr;
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_video_open(recording.c_str(), &camera, 0, nullptr, nullptr, &opened, &err),
                            err.text);
  const std::unique_ptr<wm_video, decltype(&wm_video_close)> video(opened, wm_video_close);
  wm_frame frame{};
  int count = 0;
  double off = 0;
  for (; wm_video_next(video.get(), &frame, &err) == WM_OK; count++) {
    for (int x = 0; x < kWidth; x++) {
      const int want = is_bright(x, count) ? 255 : 0;
      off +=
          std::fabs(frame.grey[static_cast<size_t>(kHeight / 2) * frame.stride_bytes + static_cast<size_t>(x)] - want);
    }
    if (count == 0) TEST_ASSERT_EQUAL_INT64(first_ns, frame.t_ns);
    if (count == 10) TEST_ASSERT_EQUAL_INT64(eleventh_ns, frame.t_ns);
    TEST_ASSERT_EQUAL_INT64(exposure_ns, frame.exposure_ns);
  }
  TEST_ASSERT_EQUAL(kPictures, count);
  TEST_ASSERT_EQUAL(0, wm_video_counted(video.get())->without_picture);
  TEST_ASSERT_TRUE(off / (kPictures * kWidth) < 8);
}

wm::tools::ImportWish wish_to(const char *out) {
  wm::tools::ImportWish wish;
  wish.video = folder / "drive.mp4";
  wish.out = folder / out;
  wish.camera = "front";
  wish.begin_ns = 7'000'000'000;
  return wish;
}

void refused(const wm::tools::ImportWish &wish, const char *text) {
  made::refused(text, [&] { (void)wm::tools::import_video(wish); });
}

TEST(the_containers_stamps_where_there_are_no_others) {
  const wm::tools::Imported made = wm::tools::import_video(wish_to("plain"));
  TEST_ASSERT_EQUAL(kPictures, made.pictures);
  TEST_ASSERT_EQUAL(0, made.damaged);
  TEST_ASSERT_FALSE(made.own_stamps);
  judge(folder / "plain", 7'000'000'000, 8'100'000'000, 0);
}

TEST(a_csv_of_stamps_is_kept_as_it_is) {
  wm::tools::ImportWish wish = wish_to("stamped");
  wish.stamps = folder / "stamps.csv";
  write_stamps(wish.stamps, kPictures);
  TEST_ASSERT_TRUE(wm::tools::import_video(wish).own_stamps);
  judge(folder / "stamped", 5'000'000'000, 6'000'000'070, 4'000'000);
}

std::vector<uint8_t> pixels(const fs::path &file) {
  std::vector<uint8_t> out;
  wm::tools::Decoder decoder(file);
  while (const auto shown = decoder.next()) out.insert(out.end(), shown->grey->bytes.begin(), shown->grey->bytes.end());
  return out;
}

// With the processor's own instructions and without: another one has others.
TEST(pixels_do_not_depend_on_the_processor) {
  for (const AVCodecID kind : {AV_CODEC_ID_H264, AV_CODEC_ID_MPEG4, AV_CODEC_ID_MPEG2VIDEO}) {
    encode(folder / "curves.mp4", kind, curves);
    const std::vector<uint8_t> own = pixels(folder / "curves.mp4");
    av_force_cpu_flags(0);
    const std::vector<uint8_t> plain = pixels(folder / "curves.mp4");
    av_force_cpu_flags(-1);
    TEST_ASSERT_EQUAL(kPictures * kWidth * kHeight, own.size());
    TEST_ASSERT_TRUE_MESSAGE(own == plain, avcodec_get_name(kind));
  }
}

TEST(what_viewers_turn_and_what_is_interlaced_is_counted) {
  wm::tools::ImportWish wish = wish_to("turned");
  wish.video = folder / "turned.mp4";
  encode(wish.video, AV_CODEC_ID_H264, bar, 90);
  wm::tools::Imported made = wm::tools::import_video(wish);
  TEST_ASSERT_EQUAL(90, made.turned_deg);
  TEST_ASSERT_EQUAL(kWidth, made.width);
  TEST_ASSERT_EQUAL(0, made.interlaced);
  wish = wish_to("interlaced");
  wish.video = folder / "interlaced.mp4";
  encode(wish.video, AV_CODEC_ID_MPEG2VIDEO, bar, 0, true);
  made = wm::tools::import_video(wish);
  TEST_ASSERT_EQUAL(0, made.turned_deg);
  TEST_ASSERT_EQUAL(kPictures, made.interlaced);
}

TEST(what_does_not_agree_is_said_and_leaves_nothing) {
  wm::tools::ImportWish wish = wish_to("refused");
  wish.stamps = folder / "short.csv";
  write_stamps(wish.stamps, kPictures - 1);
  refused(wish, "29 rows, but");
  std::ofstream(wish.stamps) << "t,x\n";
  refused(wish, "frame,t_ns,exposure_ns");
  wish = wish_to("refused");
  wish.video = folder / "short.csv";
  refused(wish, "short.csv");
  wish.video = folder / "none.mp4";
  refused(wish, "none.mp4");
  TEST_ASSERT_TRUE(!fs::exists(folder / "refused/video") || fs::is_empty(folder / "refused/video"));
  (void)wm::tools::import_video(wish_to("twice"));
  refused(wish_to("twice"), "is there already");
}

// libav draws these as pictures of letters; others it can't read at all.
TEST(text_is_no_video) {
  struct Row {
    const char *name, *says;
  };
  for (const Row &row :
       {Row{"notes.txt", "notes.txt: is text, not a video"}, Row{"art.ans", "art.ans: is text, not a video"},
        Row{"drive.nfo", "drive.nfo: is text, not a video"}, Row{"a.asc", "a.asc: is text, not a video"},
        Row{"notes.md", "notes.md: "}, Row{"drive.mp4.txt", "drive.mp4.txt: is text, not a video"},
        Row{"broken.mp4", "broken.mp4: is not a video that can be read, or it is damaged"}}) {
    wm::tools::ImportWish wish = wish_to("text");
    wish.video = folder / row.name;
    std::ofstream text(wish.video);
    for (int line = 0; line < 60; line++) text << "Line " << line << " of a text, which is not a video.\n";
    text.close();
    refused(wish, row.says);
    TEST_ASSERT_TRUE(!fs::exists(folder / "text/video") || fs::is_empty(folder / "text/video"));
  }
}

}  // namespace

int suite_begin(int, char **) {
  folder = fs::temp_directory_path() / ("import_video_" + std::to_string(getpid()));
  fs::create_directories(folder);
  av_log_set_level(AV_LOG_FATAL);
  encode(folder / "drive.mp4", AV_CODEC_ID_H264, bar);
  return SUITE_RUNS;
}

void suite_end() { fs::remove_all(folder); }
