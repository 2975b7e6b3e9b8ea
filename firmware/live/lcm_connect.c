// SPDX-License-Identifier: Apache-2.0
#include "live/lcm_connect.h"

#include <arpa/inet.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#define DEFAULT_URL "udpm://239.255.76.67:7667?ttl=0"

const char *lcm_connect_url(const char *configured) {
  const char *from_environment = getenv("LCM_DEFAULT_URL");
  if (configured[0]) return configured;
  return from_environment && from_environment[0] ? from_environment : DEFAULT_URL;
}

// 0, or errno. URLs other than "udpm://ADDRESS:PORT..." are left to LCM.
static int no_route(const char *url) {
  char address[64];
  int port;
  if (sscanf(url, "udpm://%63[0-9.]:%d", address, &port) != 2) return 0;
  struct sockaddr_in to = {.sin_family = AF_INET, .sin_port = htons((uint16_t)port)};
  if (inet_pton(AF_INET, address, &to.sin_addr) != 1) return 0;
  int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (fd < 0) return errno;
  int reason = connect(fd, (const struct sockaddr *)&to, sizeof to) == 0 ? 0 : errno;
  (void)close(fd);
  return reason;
}

lcm_t *lcm_connect(const char *url, const char **why) {
  int reason = no_route(url);
  *why = reason ? strerror(reason) : "see LCM's message above";
  return reason ? NULL : lcm_create(url);
}
