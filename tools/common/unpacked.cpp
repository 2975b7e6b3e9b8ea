// SPDX-License-Identifier: Apache-2.0
#include "common/unpacked.h"

#include <zlib.h>

#include <cerrno>
#include <cstring>
#include <memory>

#include "common/failure.h"

namespace wm::tools {

constexpr size_t kLargest = 64U << 20U;  // bytes; a calibration of many pictures has a few

// zlib's reader hands on what is not packed as it is.
std::string read_unpacked(const std::filesystem::path &path) {
  if (std::filesystem::is_directory(path)) throw Failure(path.string() + ": is a folder; a file is needed", kUsage);
  errno = 0;
  std::unique_ptr<gzFile_s, int (*)(gzFile)> file(gzopen(path.c_str(), "rb"), gzclose);
  if (!file) throw Failure(path.string() + ": cannot be read: " + std::strerror(errno), kUsage);
  std::string out;
  char part[1U << 16U];
  int n = 0;
  while ((n = gzread(file.get(), part, sizeof part)) > 0) {
    out.append(part, static_cast<size_t>(n));
    if (out.size() > kLargest) throw Failure(path.string() + ": is larger than 64 MB; is it the right file?");
  }
  const bool is_cut = gzclose(file.release()) == Z_BUF_ERROR;
  if (n < 0 || is_cut) throw Failure(path.string() + ": is packed by gzip, and damaged or cut off");
  if (out.rfind("\xef\xbb\xbf", 0) == 0) out.erase(0, 3);  // a byte order mark, which editors of Windows write
  if (out.rfind("\xff\xfe", 0) == 0 || out.rfind("\xfe\xff", 0) == 0)
    throw Failure(path.string() + ": is written in UTF-16; save it as UTF-8");
  return out;
}

}  // namespace wm::tools
