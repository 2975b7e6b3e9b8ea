// SPDX-License-Identifier: Apache-2.0
// Prints the reference of the configuration, for docs/config.md.
#include "config/config.h"

int main(void) {
  wm_config_reference(stdout);
  return 0;
}
