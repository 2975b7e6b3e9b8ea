// SPDX-License-Identifier: Apache-2.0
// What the live page makes of messages and pictures from anywhere: valid JSON, and no memory without bounds.
#include <cstring>
#include <nlohmann/json.hpp>

#include "web/live.h"
#include "web/pictures.h"

using namespace wm::tools;

namespace {

const WebSite kNowhere;
const char *const kKinds[] = {"POSE",      "HEALTH", "INNOVATION", "OBSERVATIONS",
                              "LANDMARKS", "MAP",    "PARTICLES",  "HYPOTHESES"};

// The first byte chooses: a picture, or messages of a byte for the kind, two for the length, then their bytes.
void take_messages(const uint8_t *data, size_t size) {
  Live live(kNowhere);
  int64_t now_ns = 1;
  while (size > 3) {
    size_t length = data[1] + 256U * data[2];
    if (length > size - 3) length = size - 3;
    live.take(kKinds[data[0] % (sizeof kKinds / sizeof kKinds[0])], data + 3, length, now_ns);
    now_ns += 100'000'000;
    data += 3 + length;
    size -= 3 + length;
  }
  if (!nlohmann::json::accept(live.state(now_ns, {}))) __builtin_trap();
}

void take_picture(const uint8_t *data, size_t size) {
  wm_picture_head head{};
  if (size < 5) return;
  std::memcpy(head.magic, WM_PICTURE_MAGIC, sizeof head.magic);
  head.width_px = data[0];
  head.height_px = data[1];
  head.event_count = data[2];
  head.event_bytes = data[3] + 256U * data[4];
  std::vector<uint8_t> body(data + 5, data + size);
  const size_t wanted = wm_picture_body_bytes(&head);
  if (wanted <= 1U << 20) body.resize(wanted);
  const auto looked = read_picture(head, body);
  if (looked && !nlohmann::json::accept(picture_json(*looked, kNowhere, nullptr, {}, 1))) __builtin_trap();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  if (size == 0) return 0;
  if (data[0] % 2 == 0)
    take_messages(data + 1, size - 1);
  else
    take_picture(data + 1, size - 1);
  return 0;
}
