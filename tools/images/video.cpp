// SPDX-License-Identifier: Apache-2.0
#include "images/video.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace wm::images {

namespace {

// Little-endian parts of a RIFF file.
struct Bytes {
  std::vector<uint8_t> data;

  void tag(const char *four) { data.insert(data.end(), four, four + 4); }
  void u16(uint32_t v) {
    for (int i = 0; i < 2; i++) data.push_back(static_cast<uint8_t>(v >> (8 * i)));
  }
  void u32(uint32_t v) {
    for (int i = 0; i < 4; i++) data.push_back(static_cast<uint8_t>(v >> (8 * i)));
  }
  size_t begin(const char *name) {
    tag(name);
    u32(0);
    return data.size();
  }
  // Fills in the size of what was begun.
  void end(size_t at) {
    const auto size = static_cast<uint32_t>(data.size() - at);
    for (size_t i = 0; i < 4; i++) data[at - 4 + i] = static_cast<uint8_t>(size >> (8 * i));
  }
};

constexpr uint64_t kLargestFile = 0xfff00000ull;
constexpr uint32_t kHasIndex = 0x10, kKeyFrame = 0x10;

}  // namespace

AviWriter::~AviWriter() {
  std::string ignored;
  if (file_) close(ignored);
}

bool AviWriter::put(const void *data, size_t size) {
  position_ += size;
  return std::fwrite(data, 1, size, file_) == size;
}

std::vector<uint8_t> AviWriter::header(uint32_t movi_bytes) const {
  const uint32_t frames = static_cast<uint32_t>(index_.size());
  const auto micros = static_cast<uint32_t>(std::lround(1e6 / rate_hz_));
  const char *code = coding_ == Coding::mjpeg ? "MJPG" : "Y800";
  const auto width = static_cast<uint32_t>(width_), height = static_cast<uint32_t>(height_);
  Bytes b;
  b.tag("RIFF");
  // Form "AVI ", hdrl, movi with its head, and the index.
  b.u32(static_cast<uint32_t>(4 + (8 + 192) + 8 + movi_bytes + (8 + 16 * index_.size())));
  b.tag("AVI ");
  const size_t hdrl = b.begin("LIST");
  b.tag("hdrl");
  const size_t avih = b.begin("avih");
  b.u32(micros);
  b.u32(0);  // bytes a second: not known beforehand
  b.u32(0);
  b.u32(kHasIndex);
  b.u32(frames);
  b.u32(0);
  b.u32(1);  // streams
  b.u32(largest_);
  b.u32(width);
  b.u32(height);
  for (int i = 0; i < 4; i++) b.u32(0);
  b.end(avih);
  const size_t strl = b.begin("LIST");
  b.tag("strl");
  const size_t strh = b.begin("strh");
  b.tag("vids");
  b.tag(code);
  b.u32(0);
  b.u32(0);
  b.u32(0);
  b.u32(micros);   // scale
  b.u32(1000000);  // rate: frames a second = rate / scale
  b.u32(0);
  b.u32(frames);
  b.u32(largest_);
  b.u32(0xffffffffu);  // quality: whatever
  b.u32(0);
  b.u16(0);
  b.u16(0);
  b.u16(width);
  b.u16(height);
  b.end(strh);
  const size_t strf = b.begin("strf");
  b.u32(40);
  b.u32(width);
  b.u32(height);
  b.u16(1);
  b.u16(coding_ == Coding::mjpeg ? 24 : 8);
  b.tag(code);
  b.u32(width * height * (coding_ == Coding::mjpeg ? 3 : 1));
  for (int i = 0; i < 4; i++) b.u32(0);
  b.end(strf);
  b.end(strl);
  b.end(hdrl);
  b.tag("LIST");
  b.u32(movi_bytes);
  b.tag("movi");
  return b.data;
}

bool AviWriter::open(const std::string &path, Coding coding, int width, int height, double rate_hz,
                     std::string &error) {
  if (file_) return error = path_ + ": is still open", false;
  if (width < 1 || height < 1 || width > 65535 || height > 65535)
    return error = path + ": a video's size must be 1 to 65535 pixels a side", false;
  path_ = path, coding_ = coding, width_ = width, height_ = height;
  rate_hz_ = rate_hz > 1e-3 && rate_hz < 1e5 ? rate_hz : 10;
  position_ = 0, largest_ = 0;
  index_.clear();
  file_ = std::fopen(path.c_str(), "wb");
  const std::vector<uint8_t> head = header(4);
  if (!file_ || !put(head.data(), head.size())) return error = path + ": " + std::strerror(errno), false;
  return true;
}

bool AviWriter::add_chunk(const uint8_t *data, size_t size, std::string &error) {
  if (!file_) return error = "no video is open", false;
  // The index comes after the pictures and must fit as well.
  if (position_ + size + 16 * (index_.size() + 2) > kLargestFile)
    return error = path_ + ": would be larger than 4 GB, which AVI can't hold; make the recording shorter", false;
  const uint64_t movi_tag = header(4).size() - 4;
  const Chunk chunk{static_cast<uint32_t>(position_ - movi_tag), static_cast<uint32_t>(size)};
  Bytes head;
  head.tag(coding_ == Coding::mjpeg ? "00dc" : "00db");
  head.u32(chunk.size);
  const uint8_t pad = 0;
  if (!put(head.data.data(), head.data.size()) || !put(data, size) || (size % 2 && !put(&pad, 1)))
    return error = path_ + ": " + std::strerror(errno), false;
  largest_ = std::max(largest_, chunk.size);
  index_.push_back(chunk);
  return true;
}

bool AviWriter::add(const Picture8 &picture, int quality, std::string &error) {
  if (picture.width != width_ || picture.height != height_)
    return error = path_ + ": a picture has another size than the video", false;
  if (coding_ == Coding::grey) {
    if (picture.channels != 1) return error = path_ + ": without loss only grey pictures are written", false;
    return add_chunk(picture.bytes.data(), picture.bytes.size(), error);
  }
  return jpeg_.compress(picture, quality, error) && add_chunk(jpeg_.data(), jpeg_.size(), error);
}

bool AviWriter::add_jpeg(const uint8_t *data, size_t size, std::string &error) {
  if (coding_ != Coding::mjpeg) return error = path_ + ": is not a video of JPEG pictures", false;
  return add_chunk(data, size, error);
}

bool AviWriter::close(std::string &error) {
  if (!file_) return true;
  const uint64_t movi_begin = header(4).size() - 4;
  const auto movi_bytes = static_cast<uint32_t>(position_ - movi_begin);
  Bytes tail;
  tail.tag("idx1");
  tail.u32(static_cast<uint32_t>(16 * index_.size()));
  for (const Chunk &chunk : index_) {
    tail.tag(coding_ == Coding::mjpeg ? "00dc" : "00db");
    tail.u32(kKeyFrame);
    tail.u32(chunk.offset);
    tail.u32(chunk.size);
  }
  bool fine = put(tail.data.data(), tail.data.size());
  const std::vector<uint8_t> head = header(movi_bytes);
  fine = fine && std::fseek(file_, 0, SEEK_SET) == 0 && std::fwrite(head.data(), 1, head.size(), file_) == head.size();
  fine = std::fclose(file_) == 0 && fine;
  file_ = nullptr;
  if (!fine) error = path_ + ": " + std::strerror(errno);
  return fine;
}

QualityControl::QualityControl(double bytes_a_frame, int low, int high)
    : wanted_(bytes_a_frame), low_(low), high_(high), quality_(0.5 * (low + high)) {}

void QualityControl::wrote(size_t bytes) {
  const double off = static_cast<double>(bytes) / wanted_ - 1;
  quality_ = std::clamp(quality_ - std::clamp(6 * off, -4.0, 4.0), low_, high_);
}

}  // namespace wm::images
