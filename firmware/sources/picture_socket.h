// SPDX-License-Identifier: Apache-2.0
// Pictures of a run for a program on the same computer that a person looks at: a local stream socket
// (publish.picture_socket). A reader asks for the next picture of a detector and gets it with what the detector found
// in it; who does not ask costs nothing. Numbers are this computer's own: both sides are of one build.
//
//   reader: wm_picture_request                    run: wm_picture_head, events (wm_event_encode), width x height grey
#ifndef WAYMARK_SOURCES_PICTURE_SOCKET_H
#define WAYMARK_SOURCES_PICTURE_SOCKET_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "waymark/health.h"
#include "waymark/setup.h"

#define WM_PICTURE_MAGIC "WMPICT1"
#define WM_PICTURE_EDGE_MAX 16384u
#define WM_PICTURE_EVENTS_MAX ((size_t)64 << 10)  // bytes of encoded events

typedef struct wm_picture_request {
  char magic[8];
  uint32_t source;  // from 0; the head has how many there are
  uint32_t reserved;
} wm_picture_request;

typedef struct wm_picture_head {
  char magic[8];
  uint32_t source, source_count;
  uint32_t width_px, height_px;  // 0: there is no such source
  uint32_t event_count, event_bytes;
  int64_t t_ns;     // of the picture, on the run's clock
  uint64_t missed;  // pictures that others got while this reader was still at the one before
  char source_name[WM_HEALTH_NAME_MAX];
  char camera[WM_NAME_MAX];
} wm_picture_head;

// Bytes behind the head; SIZE_MAX where it is none. Constant cost, any thread.
static inline size_t wm_picture_body_bytes(const wm_picture_head *head) {
  if (memcmp(head->magic, WM_PICTURE_MAGIC, sizeof head->magic) != 0) return SIZE_MAX;
  if (head->width_px > WM_PICTURE_EDGE_MAX || head->height_px > WM_PICTURE_EDGE_MAX) return SIZE_MAX;
  if (head->event_bytes > WM_PICTURE_EVENTS_MAX || head->event_count > head->event_bytes) return SIZE_MAX;
  if (memchr(head->source_name, '\0', sizeof head->source_name) == NULL) return SIZE_MAX;
  if (memchr(head->camera, '\0', sizeof head->camera) == NULL) return SIZE_MAX;
  return head->event_bytes + (size_t)head->width_px * head->height_px;
}

#endif
