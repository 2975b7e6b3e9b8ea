// SPDX-License-Identifier: Apache-2.0
// Any bytes as a candump line: read or refused with a text, never more than the frame has room for.
#include <string.h>

#include "fuzz.h"
#include "waymark/can.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  wm_can_frame frame;
  wm_error err = {WM_OK, ""};
  wm_status status = wm_candump_parse((const char *)data, size, &frame, &err);
  if (status == WM_OK) {
    if (frame.length > WM_CAN_DATA_MAX || frame.id > 0x1FFFFFFF) abort();
    if (!memchr(frame.iface, '\0', sizeof frame.iface) || frame.iface[0] == '\0') abort();
  } else if (status != WM_AGAIN && (err.text[0] == '\0' || err.status != status)) {
    abort();  // a refusal without a word
  }
  return 0;
}
