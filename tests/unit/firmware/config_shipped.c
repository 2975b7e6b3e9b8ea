// SPDX-License-Identifier: Apache-2.0
// Every configuration that is shipped is read, with the real estimators.
#include <dirent.h>

#include "common/suite.h"
#include "config/config.h"

static void each_of(const char *folder) {
  DIR *dir = opendir(folder);
  TEST_ASSERT_NOT_NULL_MESSAGE(dir, folder);
  int read = 0;
  for (struct dirent *entry; (entry = readdir(dir));) {
    const char *end = strrchr(entry->d_name, '.');
    char path[512];
    wm_config config;
    wm_error err = {0};
    if (!end || strcmp(end, ".yaml") != 0) continue;
    snprintf(path, sizeof path, "%s/%s", folder, entry->d_name);
    TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_config_load_undecided(path, &config, &err), err.text);
    TEST_ASSERT_EQUAL_STRING("", config.warnings);
    wm_config_free(&config);
    read++;
  }
  closedir(dir);
  TEST_ASSERT_GREATER_THAN(0, read);
}

TEST(each_is_read) {
  each_of("config");
  each_of("config/datasets");
}

TEST(a_moved_one_is_read_where_it_is_and_said) {
  const char *old = "config/office-frozen.yaml", *none = "config/no-such.yaml";
  wm_config config;
  wm_error err = {0};
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_config_load(old, &config, &err), err.text);
  TEST_ASSERT_EQUAL(0, strncmp(config.warnings, old, strlen(old)));
  TEST_ASSERT_EQUAL_STRING(": has moved to config/datasets/office-frozen.yaml, write that\n",
                           config.warnings + strlen(old));
  wm_config_free(&config);
  TEST_ASSERT_EQUAL(WM_NOT_FOUND, wm_config_load(none, &config, &err));
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, none), err.text);
}

static int is_param(const wm_param_table *table, const char *key) {
  for (size_t i = 0; i < table->count; i++)
    if (strcmp(table->params[i].key, key) == 0) return 1;
  return 0;
}

// Whether a new key, which may stand in a shared section and end with a `*`, leads to a parameter.
static int leads_to_param(const wm_param_table *table, const char *key) {
  for (int i = 0; i < WM_CONFIG_SHARED; i++) {
    const size_t n = strlen(wm_config_shared[i].prefix);
    if (key[0] == '/' && strncmp(key + 1, wm_config_shared[i].prefix, n) == 0)
      return leads_to_param(wm_config_shared[i].table, key + 1 + n);
  }
  const size_t n = strcspn(key, "*");
  for (size_t i = 0; i < table->count; i++)
    if (strncmp(table->params[i].key, key, key[n] == '*' ? n : n + 1) == 0) return 1;
  return 0;
}

static void check_old(const wm_param_table *table) {
  for (const wm_param_old *old = table->old; old && old->key; old++) {
    TEST_ASSERT_FALSE_MESSAGE(is_param(table, old->key), old->key);
    TEST_ASSERT_TRUE_MESSAGE(!old->new_key || leads_to_param(table, old->new_key), old->key);
    TEST_ASSERT_TRUE_MESSAGE(old->new_key || old->about, old->key);
    for (const wm_param_old *other = table->old; other < old; other++)
      TEST_ASSERT_TRUE_MESSAGE(
          strcmp(other->key, old->key) != 0 || strcmp(other->new_key ? other->new_key : "", old->new_key) != 0,
          old->key);
  }
}

// An old key is no parameter; the new one is; what was removed has a reason.
TEST(old_keys_lead_to_parameters) {
  size_t count;
  const wm_estimator *const *estimators = wm_estimators(&count);
  for (size_t i = 0; i < count; i++) check_old(&estimators[i]->params);
  const wm_detector *const *detectors = wm_detectors(&count);
  for (size_t i = 0; i < count; i++) check_old(&detectors[i]->params);
  for (int i = 0; i < WM_CONFIG_SHARED; i++) check_old(wm_config_shared[i].table);
  check_old(&wm_runtime_params_table);
}
