// SPDX-License-Identifier: Apache-2.0
// A version's edits from anywhere: they are refused with a field, or the files that they make of a small building hold
// no other bytes than text.
#include <cstdlib>
#include <fstream>

#include "map/site_edit.h"

using namespace wm::tools;

namespace {

std::filesystem::path make_building() {
  char name[] = "/tmp/fuzz-edit-XXXXXX";
  if (mkdtemp(name) == nullptr) __builtin_trap();
  const std::filesystem::path folder = name;
  std::ofstream(folder / "site.yaml") << "format: waymark-site/1\nname: B\norigin: [52.5, 13.4, 34]\n"
                                         "floors:\n  - {name: f, landmarks: landmarks.csv, map: map.yaml}\n";
  std::ofstream(folder / "landmarks.csv")
      << "id,x_m,y_m,z_m,sigma_m,cov_xx,cov_xy,cov_yy\n1,2,3,0,0.1,0.01,0,0.01\n2,4,5,,,,,\n";
  std::ofstream(folder / "map.yaml") << "image: plan.pgm\nresolution: 0.05\norigin: [-1.5, 2.5, 0.5]\n";
  return folder;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  static const std::filesystem::path building = make_building();
  try {
    const EditRequest request = read_edits({reinterpret_cast<const char *>(data), size});
    for (const auto &[path, bytes] : edited_files(building, request.edits))
      if (path.empty() || path.find("..") != std::string::npos || (bytes && bytes->find('\0') != std::string::npos))
        __builtin_trap();
  } catch (const Failure &failure) {
    if (failure.what()[0] == '\0') __builtin_trap();
  }
  return 0;
}
