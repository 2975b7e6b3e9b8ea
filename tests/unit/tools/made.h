// SPDX-License-Identifier: Apache-2.0
// Small runs and recordings with known errors, made in a folder that goes away.
#pragma once

#include <cstdarg>
#include <filesystem>
#include <fstream>
#include <string>

#include "common/failure.h"
#include "common/suite.h"

namespace made {

// What a command's failure said; nothing where it did not fail.
template <class Do>
std::string why_of(const Do &done) {
  try {
    done();
  } catch (const wm::tools::Failure &problem) {
    return problem.what();
  }
  return {};
}

// Fails with a text that has this in it.
template <class Do>
void refused(const std::string &said, const Do &done) {
  const std::string why = why_of(done);
  TEST_ASSERT_NOT_EMPTY_MESSAGE(why.c_str(), ("was taken; should be refused by: " + said).c_str());
  TEST_ASSERT_NOT_NULL_MESSAGE(std::strstr(why.c_str(), said.c_str()), why.c_str());
}

// A folder of its own under the system's temporary folder, removed at the end.
class Folder {
 public:
  Folder() {
    std::string name = (std::filesystem::temp_directory_path() / "waymark-test-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) std::abort();
    path_ = name;
  }
  ~Folder() { std::filesystem::remove_all(path_); }
  Folder(const Folder &) = delete;
  Folder &operator=(const Folder &) = delete;

  [[nodiscard]] const std::filesystem::path &path() const { return path_; }
  void clear() const {
    for (const auto &entry : std::filesystem::directory_iterator(path_)) std::filesystem::remove_all(entry);
  }
  void write(const std::string &name, const std::string &text) const { std::ofstream(path_ / name) << text; }

 private:
  std::filesystem::path path_;
};

inline std::string format(const char *text, ...) __attribute__((format(printf, 1, 2)));
inline std::string format(const char *text, ...) {
  char buffer[512];
  va_list arguments;
  va_start(arguments, text);
  std::vsnprintf(buffer, sizeof buffer, text, arguments);
  va_end(arguments);
  return buffer;
}

inline const char *const kTruthHeader = "t_ns,x_m,y_m,z_m,qx,qy,qz,qw\n";
inline const char *const kPlanarHeader =
    "t_ns,x_m,y_m,z_m,qx,qy,qz,qw,cov_xx,cov_xy,cov_yy,cov_xt,cov_yt,cov_tt,state\n";

// "T_NS," of a time in seconds.
inline std::string stamp(double t_s) { return format("%lld,", std::llround(t_s * 1e9)); }

// "x,y,z,qx,qy,qz,qw" of a planar pose; `sign` -1 writes the quaternion's negative, the same rotation.
inline std::string pose(double x, double y, double heading, double sign = 1) {
  return format("%.12g,%.12g,0,0,0,%.15g,%.15g", x, y, sign * std::sin(heading / 2), sign * std::cos(heading / 2));
}

}  // namespace made
