// SPDX-License-Identifier: Apache-2.0
// Lines of a server over TCP (gpsd, a velocity log), to which the connection is made again and again. Plain memory. One
// thread.
#ifndef WAYMARK_LINE_SOCKET_H
#define WAYMARK_LINE_SOCKET_H

#include <stddef.h>
#include <stdint.h>

#include "waymark/time.h"

// gpsd's longest line is 10240 bytes (GPS_JSON_RESPONSE_MAX of gps_json.h), a velocity log's about 1500.
#define LINE_SOCKET_BYTES_MAX 16384

typedef struct line_socket {
  char host[64];
  int32_t port;
  const char *greeting;  // sent at the beginning of a connection; NULL: nothing. It outlives the socket
  int fd, is_connected;
  wm_time_ns next_try_ns, read_ns;  // the next connection; the last byte, monotonic
  char bytes[LINE_SOCKET_BYTES_MAX];
  size_t used, taken;  // bytes read, and those of them that are handed out
  int skips;           // the rest of a line that is too long
  const char *fault;
} line_socket;

void line_socket_init(line_socket *self, const char *host, int32_t port, const char *greeting);
void line_socket_close(line_socket *self);
// The next whole line, without its end; until the next call. NULL: none yet. Constant cost but for the bytes.
const char *line_socket_next(line_socket *self, size_t *length);
// The same; where none is there it waits once for bytes or a connection, for up to WM_DEVICE_WAIT_MS.
const char *line_socket_read(line_socket *self, size_t *length);
// What went wrong with a line since the last call; NULL: nothing.
const char *line_socket_fault(line_socket *self);

#endif
