// SPDX-License-Identifier: Apache-2.0
// Every configuration that is shipped is read, with the real estimators.
#include <dirent.h>
#include <stdio.h>
#include <string.h>

#include "unity.h"
#include "waymark/config.h"

void setUp(void) {}
void tearDown(void) {}

static void each_is_read(void) {
  DIR *dir = opendir("config");
  TEST_ASSERT_NOT_NULL(dir);
  int read = 0;
  for (struct dirent *entry; (entry = readdir(dir));) {
    const char *end = strrchr(entry->d_name, '.');
    char path[512];
    wm_config config;
    wm_error err = {0};
    if (!end || strcmp(end, ".yaml") != 0) continue;
    snprintf(path, sizeof path, "config/%s", entry->d_name);
    TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_config_load(path, &config, &err), err.text);
    wm_config_free(&config);
    read++;
  }
  closedir(dir);
  TEST_ASSERT_GREATER_THAN(0, read);
}

int main(void) {
  UNITY_BEGIN();
  RUN_TEST(each_is_read);
  return UNITY_END();
}
