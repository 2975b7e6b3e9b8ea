// SPDX-License-Identifier: Apache-2.0
// Any video that libav reads, picture by picture in the order in which they are shown.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "images/pictures.h"

namespace wm::tools {

class Decoder {
 public:
  // Throws Failure where there is no such file, or libav finds no video in it that it can read.
  explicit Decoder(const std::filesystem::path &file);
  ~Decoder();
  Decoder(const Decoder &) = delete;
  Decoder &operator=(const Decoder &) = delete;

  [[nodiscard]] int width() const;
  [[nodiscard]] int height() const;
  [[nodiscard]] double rate_hz() const;  // of the container, for players; 30 where it has none
  [[nodiscard]] const char *codec() const;

  struct Shown {
    const images::Picture8 *grey;  // until the next one
    std::optional<double> t_s;     // the container's stamp, from its first picture on; none: it has none
  };
  // None at the end. Throws Failure where the size of the pictures changes.
  std::optional<Shown> next();
  [[nodiscard]] uint64_t damaged() const;     // packets that could not be decoded, pictures decoded with errors
  [[nodiscard]] uint64_t interlaced() const;  // pictures whose lines are of two moments
  [[nodiscard]] int turned_deg() const;       // clockwise, by which viewers turn the pictures; they come as stored

 private:
  struct Libav;
  std::unique_ptr<Libav> av_;
};

}  // namespace wm::tools
