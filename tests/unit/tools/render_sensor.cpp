// SPDX-License-Identifier: Apache-2.0
// The sensor's statistics measured back, and videos read back by ffmpeg.
#include <sys/stat.h>

#include "common/suite.h"
#include "images/video.h"
#include "render/sensor.h"

using namespace wm::images;
using namespace wm::render;

namespace {

Image even(int width, int height, float value) {
  Image out{width, height, 1, {}};
  out.values.assign(static_cast<size_t>(width) * static_cast<size_t>(height), value);
  return out;
}

TEST(test_noise_is_the_frames_own_and_the_same_again) {
  const Sensor sensor(SensorModel{}, 11, 64, 64, {31.5, 31.5});
  Picture8 a, b, c;
  sensor.develop(even(64, 64, 0.2f), {}, 3, a);
  sensor.develop(even(64, 64, 0.2f), {}, 3, b);
  sensor.develop(even(64, 64, 0.2f), {}, 4, c);
  TEST_ASSERT_TRUE(a.bytes == b.bytes);
  TEST_ASSERT_FALSE(a.bytes == c.bytes);
}

TEST(test_response_curve) {
  SensorModel model;
  model.vignetting = 0;
  const Sensor sensor(model, 1, 8, 8, {3.5, 3.5});
  Picture8 picture;
  for (double signal : {0.0, 0.0005, 0.01, 0.1, 0.3, 0.66, 0.9, 1.5, 8.0, 1e6}) {
    sensor.develop(even(8, 8, static_cast<float>(signal)), {.gain = 1, .noise_scale = 0}, 0, picture);
    // x^0.55 below the shoulder at 0.8, from there on an exponential with the same slope.
    const double y = std::pow(signal, 0.55);
    const double grey = 255 * (y < 0.8 ? y : 1 - 0.2 * std::exp(-(y - 0.8) / 0.2));
    TEST_ASSERT_DOUBLE_WITHIN(0.75, signal < 1e-4 ? 0 : grey, picture.bytes[0]);
  }
}

TEST(test_vignetting) {
  SensorModel model;
  model.response_power = 1, model.shoulder = 1, model.vignetting = 0.4;
  const Sensor sensor(model, 1, 201, 101, {100, 50});
  Picture8 picture;
  sensor.develop(even(201, 101, 0.8f), {.gain = 1, .noise_scale = 0}, 0, picture);
  TEST_ASSERT_INT_WITHIN(1, 204, picture.bytes[50 * 201 + 100]);
  TEST_ASSERT_INT_WITHIN(1, 122, picture.bytes[0]);  // a corner: 0.6 of it
  TEST_ASSERT_INT_WITHIN(1, static_cast<int>(204 * (1 - 0.4 * 0.2)),
                         picture.bytes[50 * 201 + 50]);  // r² = 2500 of 12500
}

TEST(test_auto_exposure_follows_slowly_and_wanders) {
  AutoExposure steady(0.2, 0.25, 0, 1);
  TEST_ASSERT_DOUBLE_WITHIN(1e-6, 2, steady.next(even(50, 50, 0.1f), 0));
  TEST_ASSERT_DOUBLE_WITHIN(1e-6, 2, steady.next(even(50, 50, 0.4f), 1));  // it learns of a picture after it
  double gain = 0;
  for (uint64_t i = 2; i < 60; i++) {
    const double next = steady.next(even(50, 50, 0.4f), i);
    if (i > 2) TEST_ASSERT_LESS_OR_EQUAL_DOUBLE(gain + 1e-9, next);
    gain = next;
  }
  TEST_ASSERT_DOUBLE_WITHIN(0.01, 0.5, gain);
  AutoExposure wandering(0.2, 0.25, 0.02, 1);
  double sum2 = 0;
  for (uint64_t i = 0; i < 4000; i++) {
    const double off = std::log(wandering.next(even(20, 20, 0.1f), i) / 2);
    sum2 += off * off;
  }
  // A first-order walk: deviation 0.02 / sqrt(1 - 0.98²) = 0.1005.
  TEST_ASSERT_DOUBLE_WITHIN(0.02, 0.1005, std::sqrt(sum2 / 4000));
}

// A picture that differs from frame to frame and from side to side.
Picture8 drawn(int width, int height, int channels, int frame) {
  Picture8 p{width, height, channels, {}};
  for (int y = 0; y < height; y++)
    for (int x = 0; x < width; x++)
      for (int c = 0; c < channels; c++)
        p.bytes.push_back(static_cast<uint8_t>(40 + x / 2 + 10 * frame + 30 * c + (y > height / 2 ? 60 : 0)));
  return p;
}

std::string folder() {
  char name[] = "/tmp/wm_render_XXXXXX";
  TEST_ASSERT_NOT_NULL(mkdtemp(name));
  return name;
}

bool have_ffmpeg() {
  return std::system("command -v ffmpeg >/dev/null 2>&1 && command -v ffprobe >/dev/null 2>&1") == 0;
}

std::vector<uint8_t> output_of(const std::string &command) {
  std::vector<uint8_t> out;
  FILE *pipe = popen(command.c_str(), "r");
  TEST_ASSERT_NOT_NULL(pipe);
  for (int c; (c = std::fgetc(pipe)) != EOF;) out.push_back(static_cast<uint8_t>(c));
  TEST_ASSERT_EQUAL_INT_MESSAGE(0, pclose(pipe), command.c_str());
  return out;
}

void write_video(const std::string &path, AviWriter::Coding coding, int channels, int frames) {
  AviWriter avi;
  std::string error;
  TEST_ASSERT_TRUE_MESSAGE(avi.open(path, coding, 97, 61, 12.5, error), error.c_str());
  for (int i = 0; i < frames; i++)
    TEST_ASSERT_TRUE_MESSAGE(avi.add(drawn(97, 61, channels, i), 95, error), error.c_str());
  TEST_ASSERT_FALSE(avi.add(drawn(96, 61, channels, 0), 95, error));
  TEST_ASSERT_TRUE_MESSAGE(avi.close(error), error.c_str());
  TEST_ASSERT_EQUAL_UINT32(frames, avi.frames());
}

TEST(test_ffmpeg_reads_the_videos) {
  if (!have_ffmpeg()) TEST_IGNORE_MESSAGE("ffmpeg is not installed");
  const std::string dir = folder();
  struct Case {
    const char *file, *format;
    AviWriter::Coding coding;
    int channels, tolerance;
  };
  for (const Case &c : {Case{"grey.avi", "gray", AviWriter::Coding::grey, 1, 0},
                        Case{"mjpeg.avi", "gray", AviWriter::Coding::mjpeg, 1, 6},
                        Case{"colour.avi", "rgb24", AviWriter::Coding::mjpeg, 3, 30}}) {
    const std::string path = dir + "/" + c.file;
    write_video(path, c.coding, c.channels, 5);
    const auto said = output_of(
        "ffprobe -v error -count_frames -show_entries stream=width,height,nb_read_frames,r_frame_rate -of csv=p=0 " +
        path + " 2>&1");
    TEST_ASSERT_EQUAL_STRING_LEN("97,61,25/2,5", reinterpret_cast<const char *>(said.data()), 12);
    const auto raw = output_of("ffmpeg -v error -i " + path + " -f rawvideo -pix_fmt " + c.format + " - 2>/dev/null");
    TEST_ASSERT_EQUAL_size_t(static_cast<size_t>(97 * 61 * 5 * c.channels), raw.size());
    const size_t size = raw.size() / 5;
    for (int i = 0; i < 5; i++) {
      const Picture8 expected = drawn(97, 61, c.channels, i);
      for (size_t k = 0; k < size; k++)
        TEST_ASSERT_INT_WITHIN_MESSAGE(c.tolerance, expected.bytes[k], raw[static_cast<size_t>(i) * size + k], c.file);
    }
  }
  TEST_ASSERT_EQUAL_INT(0, std::system(("rm -r " + dir).c_str()));
}

TEST(test_png_there_and_back_and_sheet) {
  const std::string dir = folder(), path = dir + "/a.png";
  std::string error;
  const Picture8 picture = drawn(33, 21, 3, 0);
  TEST_ASSERT_TRUE_MESSAGE(write_png(path, picture, error), error.c_str());
  Picture back;
  TEST_ASSERT_TRUE_MESSAGE(read_png(path, true, back, error), error.c_str());
  TEST_ASSERT_EQUAL_INT(33, back.width);
  TEST_ASSERT_EQUAL_INT(3, back.channels);
  for (size_t i = 0; i < picture.bytes.size(); i++)
    TEST_ASSERT_EQUAL_INT(picture.bytes[i], std::lround(back.values[i] * 255));
  TEST_ASSERT_FALSE(read_png(dir + "/none.png", true, back, error));
  TEST_ASSERT_NOT_NULL(std::strstr(error.c_str(), "none.png"));
  const Picture8 sheet = contact_sheet({{picture, "T=1.5 S"}, {drawn(66, 42, 1, 1), ""}, {picture, "3"}}, 2, 22);
  TEST_ASSERT_EQUAL_INT(4 + 2 * 26, sheet.width);
  TEST_ASSERT_EQUAL_INT(4 + 2 * (14 + 4 + 14), sheet.height);
  TEST_ASSERT_EQUAL_INT(3, sheet.channels);
  // The second cell is the grey picture, shrunk threefold: the mean of its upper left 3 x 3 pixels.
  TEST_ASSERT_INT_WITHIN(1, 50, sheet.bytes[static_cast<size_t>((4 * sheet.width + 4 + 26) * 3)]);
  TEST_ASSERT_EQUAL_INT(0, std::system(("rm -r " + dir).c_str()));
}

TEST(test_quality_control_finds_the_size) {
  QualityControl control(5000, 20, 95);
  for (int i = 0; i < 200; i++) control.wrote(static_cast<size_t>(100 * control.quality()));
  TEST_ASSERT_INT_WITHIN(2, 50, control.quality());
}

}  // namespace
