// SPDX-License-Identifier: Apache-2.0
// A saved map is `firmware/output/saved_map.h`'s head and an image of slam (estimator/filters/slam/keep.cpp),
// version 1.
#include "map/drive_map.h"

#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <memory>

#include "common/failure.h"
#include "common/program.h"
#include "common/text.h"
#include "output/crc32.h"
#include "waymark/recording.h"

namespace wm::tools {
namespace {

namespace fs = std::filesystem;

// The head's fields of a fixed size one after the other, little-endian.
class Bytes {
 public:
  explicit Bytes(const fs::path &file) : path_(file.string()) {
    std::ifstream from(file, std::ios::binary);
    if (!from) throw Failure(path_ + ": can't be read");
    bytes_.assign(std::istreambuf_iterator<char>(from), {});
  }
  template <typename Value>
  Value get() {
    Value out;
    need(sizeof out);
    std::memcpy(&out, bytes_.data() + at_, sizeof out);
    at_ += sizeof out;
    return out;
  }
  void skip(size_t count) {
    need(count);
    at_ += count;
  }
  bool is(const char *magic) {
    const size_t length = std::strlen(magic);
    const bool same = bytes_.size() >= at_ + length && std::memcmp(bytes_.data() + at_, magic, length) == 0;
    if (same) at_ += length;
    return same;
  }
  void need(size_t count) const {
    if (bytes_.size() - at_ < count) throw Failure(path_ + ": is truncated");
  }
  [[nodiscard]] size_t at() const { return at_; }
  [[nodiscard]] const char *data() const { return bytes_.data(); }
  [[nodiscard]] size_t size() const { return bytes_.size(); }

 private:
  std::string path_;
  std::vector<char> bytes_;
  size_t at_ = 0;
};

void check_head(Bytes &bytes, const std::string &path) {
  if (!bytes.is("WMMAP 1\n")) throw Failure(path + ": is no saved map of this version");
  bytes.skip(8 + 8 + 8);  // hashes of configuration and calibration, UTC
  const auto image = bytes.get<uint64_t>();
  const size_t before = bytes.at();
  const auto crc = bytes.get<uint32_t>();
  if (image != bytes.size() - bytes.at()) throw Failure(path + ": is truncated");
  if (crc32_of(crc32_of(0, bytes.data(), before), bytes.data() + bytes.at(), image) != crc)
    throw Failure(path + ": its checksum is wrong: it is damaged");
}

struct Image {
  uint32_t robot_states, landmarks, width;
  bool has_identities;
};

Image read_image_head(Bytes &bytes, const std::string &path) {
  if (!bytes.is("WMSLAM\n"))
    throw Failure(path + ": is no map of slam; other estimators' maps have no landmarks to merge");
  bytes.skip(1);
  if (bytes.get<uint32_t>() != 1) throw Failure(path + ": its map has another version than this program reads");
  Image out{};
  out.robot_states = bytes.get<uint32_t>();
  out.landmarks = bytes.get<uint32_t>();
  out.width = bytes.get<uint32_t>();
  bytes.skip(8);  // next_id, returned
  out.has_identities = bytes.get<uint32_t>() == 0;
  bytes.skip(4 + 16);  // by_bearings, scale_origin_m
  if (out.width < 2 || out.width > 3) throw Failure(path + ": its landmarks have another kind than this program reads");
  return out;
}

struct Kept {
  DriveMap::Landmark landmark;
  bool is_kept;
};

Kept read_landmark(Bytes &bytes) {
  Kept out{};
  out.landmark.z_m = bytes.get<double>();
  bytes.skip(4 * 8);  // mean_m, means
  out.landmark.id = bytes.get<int32_t>();
  bytes.skip(8);  // surveyed, tilt_sensor
  out.landmark.seen = bytes.get<uint32_t>();
  out.is_kept = bytes.get<uint8_t>() != 0;
  bytes.skip(7);
  return out;
}

// Rows and columns of the kept landmarks, of the packed upper half.
void read_states(Bytes &bytes, const std::vector<int> &into, DriveMap *out) {
  for (const int row : into) {
    const auto value = bytes.get<double>();
    if (row >= 0) out->mean[row] = value;
  }
  for (size_t i = 0; i < into.size(); i++)
    for (size_t j = i; j < into.size(); j++) {
      const auto value = bytes.get<double>();
      if (into[i] >= 0 && into[j] >= 0) out->covariance(into[i], into[j]) = out->covariance(into[j], into[i]) = value;
    }
}

}  // namespace

DriveMap read_drive_map(const fs::path &from) {
  const fs::path file = fs::is_directory(from) ? from / "map-estimate.wmmap" : from;
  if (!fs::exists(file))
    throw Failure(file.string() +
                  ": is not there; a run of `slam` that was tracking at its end writes it (replay the drive)");
  Bytes bytes(file);
  check_head(bytes, file.string());
  const Image image = read_image_head(bytes, file.string());
  DriveMap out;
  out.name = from.string();
  out.has_identities = image.has_identities;
  out.width = static_cast<int>(image.width);
  std::vector<int> into(image.robot_states, -1);
  for (uint32_t i = 0; i < image.landmarks; i++) {
    const Kept kept = read_landmark(bytes);
    for (int k = 0; k < out.width; k++)
      into.push_back(kept.is_kept ? static_cast<int>(out.landmarks.size()) * out.width + k : -1);
    if (kept.is_kept) out.landmarks.push_back(kept.landmark);
  }
  const auto states = static_cast<Eigen::Index>(out.landmarks.size()) * out.width;
  out.mean.resize(states);
  out.covariance.resize(states, states);
  bytes.need(into.size() * 8 + into.size() * (into.size() + 1) / 2 * 8);
  read_states(bytes, into, &out);
  if (out.landmarks.empty()) throw Failure(file.string() + ": has no landmarks");
  return out;
}

DriveMap read_surveyed_map(const fs::path &csv) {
  wm_landmark *list = nullptr;
  size_t count = 0;
  wm_error error{};
  need_ok(wm_landmarks_load(csv.c_str(), nullptr, nullptr, &list, &count, &error), error);
  const std::unique_ptr<wm_landmark, void (*)(void *)> landmarks(list, std::free);
  DriveMap out;
  out.name = csv.string();
  out.mean = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(2 * count));
  out.covariance = Eigen::MatrixXd::Zero(out.mean.size(), out.mean.size());
  for (size_t i = 0; i < count; i++) {
    const wm_landmark &l = list[i];
    const auto at = static_cast<Eigen::Index>(2 * i);
    out.landmarks.push_back({l.id, l.p_m[2], 1});
    out.mean.segment<2>(at) << l.p_m[0], l.p_m[1];
    if (std::isfinite(l.cov_m2[0]))
      out.covariance.block<2, 2>(at, at) << l.cov_m2[0], l.cov_m2[1], l.cov_m2[1], l.cov_m2[2];
    else if (l.sigma_m > 0)
      out.covariance.block<2, 2>(at, at) = l.sigma_m * l.sigma_m * Eigen::Matrix2d::Identity();
    else
      throw Failure(text("%s: landmark %d has no sigma_m: how well is it surveyed?", csv.c_str(), l.id), kUsage);
  }
  return out;
}

}  // namespace wm::tools
