// SPDX-License-Identifier: Apache-2.0
// Recordings that were rendered by another program, and our own of the same kinds, through the same reader: neither
// makes it complain, and files, columns and keys of the other one are in ours.
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <set>

#include "filmed.h"
#include "simulate/write.h"
#include "waymark/map.h"
#include "waymark/recording.h"
#include "waymark/video.h"

using namespace wm::sim;
namespace fs = std::filesystem;

namespace {

fs::path data, ours;

void complain(void *, wm_note, const char *text) { TEST_FAIL_MESSAGE(text); }

// A second of ours, in small pictures.
void make(const std::string &world, std::initializer_list<const char *> cameras, int width, int height) {
  Scenario scenario = shipped(world + "-easy");
  shrink(scenario, cameras, width, height);
  Film film = filmed(scenario, 1);
  wm_error err{};
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, observe_pictures(film, &err), err.text);
  const std::string dir = ours.string();
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, write_sensors(film.scenario, film.recording, dir, &err), err.text);
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, write_pictures(film, dir, nullptr, &err), err.text);
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, finish_recording(film.scenario, film.recording, dir, &err), err.text);
}

// Every stream to its end or some thousand events; every camera's first pictures.
uint32_t read_through(const fs::path &folder) {
  wm_recording *opened = nullptr;
  wm_error err{};
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_recording_open(folder.c_str(), nullptr, complain, nullptr, &opened, &err),
                            err.text);
  size_t count = 0;
  wm_source *const *sources = wm_recording_sources(opened, &count);
  TEST_ASSERT_GREATER_THAN(0, count);
  for (size_t i = 0; i < count; i++) {
    wm_event e{};
    size_t events = 0;
    while (events < 5000 && sources[i]->ops->next(sources[i], &e, &err) == WM_OK) events++;
    TEST_ASSERT_TRUE(events > 5);
    TEST_ASSERT_EQUAL_MESSAGE(0, sources[i]->counts.malformed, sources[i]->counts.first_problem);
  }
  const wm_rig *rig = wm_site_rig(wm_recording_site(opened));
  TEST_ASSERT_GREATER_THAN(0, rig->camera_count);
  for (uint32_t c = 0; c < rig->camera_count; c++) {
    wm_video *video = nullptr;
    TEST_ASSERT_EQUAL_MESSAGE(
        WM_OK,
        wm_video_open(folder.c_str(), &rig->cameras[c], static_cast<int32_t>(c), complain, nullptr, &video, &err),
        err.text);
    wm_frame frame{};
    for (int i = 0; i < 8; i++) TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_video_next(video, &frame, &err), err.text);
    const wm_video_counts *counts = wm_video_counted(video);
    TEST_ASSERT_EQUAL_MESSAGE(0, counts->damaged + counts->wrong_size + counts->malformed + counts->without_stamp,
                              counts->first_problem);
    wm_video_close(video);
  }
  const uint32_t quantities = wm_recording_quantities(opened);
  wm_recording_close(opened);
  if (!fs::exists(folder / "map/map.yaml")) return quantities;
  wm_map *map = nullptr;
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_map_load((folder / "map/map.yaml").c_str(), complain, nullptr, &map, &err),
                            err.text);
  TEST_ASSERT_NOT_NULL(wm_map_raster(map)->edges);
  TEST_ASSERT_NOT_NULL(wm_map_raster(map)->drivable);
  wm_map_free(map);
  return quantities;
}

// Every key of the other one's map is in ours, and lists are as long.
void keys_within(const wm_yaml_node &other, const wm_yaml_node &mine, const std::string &where) {
  if (wm_yaml_is_list(&other)) {
    TEST_ASSERT_TRUE_MESSAGE(wm_yaml_is_list(&mine), where.c_str());
    if (where.find("intrinsics") != std::string::npos || where.find("_m") != std::string::npos)
      TEST_ASSERT_EQUAL_MESSAGE(wm_yaml_count(&other), wm_yaml_count(&mine), where.c_str());
    return;
  }
  if (!wm_yaml_is_map(&other)) return;
  for (size_t i = 0; i < wm_yaml_count(&other); i++) {
    const char *key = nullptr;
    int line = 0;
    const wm_yaml_node value = wm_yaml_value(&other, i, &key, &line);
    if (std::string(key) == "notes") continue;  // for people
    const wm_yaml_node found = wm_yaml_get(&mine, key);
    const std::string path = where + "." + key;
    TEST_ASSERT_TRUE_MESSAGE(wm_yaml_there(&found), path.c_str());
    keys_within(value, found, path);
  }
}

std::string first_line(const fs::path &file) {
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  return line;
}

void compare(const char *name, const std::string &world, std::initializer_list<const char *> cameras, int width,
             int height) {
  const fs::path other = data / name;
  make(world, cameras, width, height);
  const uint32_t theirs = read_through(other), mine = read_through(ours);
  TEST_ASSERT_EQUAL_HEX32_MESSAGE(theirs, theirs & mine, name);
  for (const auto &entry : fs::recursive_directory_iterator(other)) {
    if (!entry.is_regular_file()) continue;
    const fs::path file = fs::relative(entry.path(), other), here = ours / file;
    TEST_ASSERT_TRUE_MESSAGE(fs::exists(here), file.c_str());
    // Columns, in their order; ours may have more behind them.
    if (file.extension() == ".csv")
      TEST_ASSERT_TRUE_MESSAGE((first_line(here) + ",").starts_with(first_line(entry.path()) + ","), file.c_str());
    if (file.extension() != ".yaml") continue;
    wm_yaml *a = nullptr, *b = nullptr;
    wm_error err{};
    TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_yaml_load(entry.path().c_str(), &a, &err), err.text);
    TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_yaml_load(here.c_str(), &b, &err), err.text);
    keys_within(wm_yaml_root(a), wm_yaml_root(b), file.string());
    wm_yaml_free(a);
    wm_yaml_free(b);
  }
}

TEST(test_corridor) { compare("corridor-a", "corridor", {"front"}, 160, 90); }
TEST(test_office) { compare("office-a", "office", {"ceiling"}, 160, 120); }
TEST(test_hall) { compare("hall-a", "hall", {"omni"}, 120, 120); }
TEST(test_seabed) { compare("seabed-a", "seabed", {"left", "right"}, 160, 120); }

}  // namespace

void setUp(void) {
  ours = "recordings_agree." + std::to_string(getpid());
  fs::create_directories(ours);
}
void tearDown(void) { fs::remove_all(ours); }

int suite_begin(int, char **) {
  const char *there = std::getenv("WM_DATA_DIR");
  data = there ? there : "";
  if (!fs::exists(data / "corridor-a/recording.yaml")) {
    std::puts(
        "recordings_agree: skipped: the recordings corridor-a, office-a, hall-a, seabed-a are not in WM_DATA_DIR");
    return 77;
  }
  return SUITE_RUNS;
}
