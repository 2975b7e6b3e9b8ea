// SPDX-License-Identifier: Apache-2.0
// In the portable build in place of gethostbyname(), which LCM's TCP way calls: addresses in numbers alone
// ("192.168.1.2"). glibc looks names up by libraries of the image that it loads, and a static program can't.
#include <arpa/inet.h>
#include <netdb.h>
#include <netinet/in.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>

struct hostent *wm_host_by_number(const char *name);

// One at a time, as gethostbyname.
struct hostent *wm_host_by_number(const char *name) {
  static struct in_addr address;
  static char *none[1], *addresses[2];
  static struct hostent host;
  if (strcmp(name, "localhost") == 0) name = "127.0.0.1";
  if (inet_pton(AF_INET, name, &address) != 1) return NULL;
  addresses[0] = (char *)&address;
  host = (struct hostent){.h_name = addresses[0],
                          .h_aliases = none,
                          .h_addrtype = AF_INET,
                          .h_length = sizeof address,
                          .h_addr_list = addresses};
  return &host;
}
