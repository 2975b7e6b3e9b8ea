// SPDX-License-Identifier: Apache-2.0
#include <inttypes.h>
#include <stdio.h>

#include "waymark/can.h"

#define ERROR_FLAG 0x20000000u  // CAN_ERR_FLAG of linux/can.h

size_t wm_candump_write(const wm_can_frame *frame, char *out, size_t capacity) {
  uint64_t us = (frame->t_ns < 0 ? 0 - (uint64_t)frame->t_ns : (uint64_t)frame->t_ns) / 1000;
  int used = snprintf(out, capacity, "(%s%" PRIu64 ".%06" PRIu64 ") %s ", frame->t_ns < 0 ? "-" : "", us / 1000000,
                      us % 1000000, frame->iface);
  if (used < 0 || (size_t)used >= capacity) return 0;
  size_t length = (size_t)used;
  uint32_t id = frame->id | (frame->is_error ? ERROR_FLAG : 0);
  used = snprintf(out + length, capacity - length,
                  frame->is_extended || frame->is_error ? "%08" PRIX32 "#" : "%03" PRIX32 "#", id);
  if (used < 0 || length + (size_t)used + 2 * (size_t)frame->length + 8 > capacity) return 0;
  length += (size_t)used;
  if (frame->is_fd) length += (size_t)snprintf(out + length, capacity - length, "#%X", frame->fd_flags & 15u);
  if (frame->is_remote) {
    length += (size_t)snprintf(out + length, capacity - length, frame->length ? "R%u" : "R", frame->length);
  } else {
    for (unsigned i = 0; i < frame->length; i++)
      length += (size_t)snprintf(out + length, capacity - length, "%02X", frame->data[i]);
  }
  out[length++] = '\n';
  out[length] = '\0';
  return length;
}
