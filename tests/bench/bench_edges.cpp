// SPDX-License-Identifier: Apache-2.0
// What the parts of pf_edges and edge_mcl cost on a map of 4676 x 1372 pixels at 75 a metre: making the map ready, the
// update of a cloud's weights by 180 points, one whole scan. Medians of single calls, one thread. With a map.yaml as
// its argument, that file's loading and making ready.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <vector>

#include "drawn_map.h"
#include "drawn_search.h"
#include "filters/pf_edges/particles.hpp"
#include "timing.h"
#include "waymark/estimator.h"
#include "waymark/map.h"
#include "waymark/random.h"

namespace {

// What the filter makes of a map at its start.
struct ready_map {
  wm::edge_map map;
  wm::score_field field;
  block memory, layers;
  size_t bytes = 0;
  void make(const wm_raster &raster) {
    bytes = wm::edge_map::bytes(raster) + wm::score_field::bytes(raster);
    if (!memory) {
      memory = allocate(wm::edge_map::bytes(raster));
      layers = allocate(wm::score_field::bytes(raster) + 1);
    }
    map.init(raster, memory.get());
    wm::score_table table;
    const double sigma[wm::kSigmaClasses] = {0.05, 0.06, 0.08, 0.12};
    wm::make_score_table(map, sigma, 0.05, false, &table);
    field.init(map, table, layers.get());
  }
};

void bench_cloud(int particles) {
  bench::cloud_at_work work(particles);
  const double weights = bench::median_us(2001, [&] { work.weigh(); });
  const double move = bench::median_us(2001, [&] { work.move(); });
  const double resample = bench::median_us(2001, [&] { work.resample(); });
  std::printf("%5d particles x %d points: weights %8.1f us, moving %7.1f us, resampling %7.1f us\n", particles,
              bench::kScanPoints, weights, move, resample);
}

// A minute of scans of a robot that does not know where it is.
void bench_search() {
  bench::search_at_work work;
  std::vector<double> each;
  for (int i = 0; i < bench::rounds(600); i++) {
    work.prepare();
    const double begin = bench::thread_us();
    work.scan();
    const double end = bench::thread_us();
    if (work.searching()) each.push_back(end - begin);
  }
  if (each.empty()) return;
  std::sort(each.begin(), each.end());
  std::printf("a scan while searching (%zu of %d were): median %.2f ms, 99 %% below %.2f, the longest %.2f\n",
              each.size(), bench::rounds(600), each[each.size() / 2] * 1e-3, each[each.size() * 99 / 100] * 1e-3,
              each.back() * 1e-3);
}

}  // namespace

int main(int argc, char **argv) {
  const std::vector<uint8_t> edges = bench::drawn_edges();
  const wm_raster raster = {bench::kMapWidth, bench::kMapHeight, bench::kMapPixel_m, 0, 0, 0, edges.data(), nullptr, 0};
  ready_map made;
  const double ready = bench::median_us(11, [&] { made.make(raster); });
  std::printf("map of %d x %d pixels made ready in %.1f ms, %.1f MB\n", bench::kMapWidth, bench::kMapHeight,
              ready * 1e-3, (double)made.bytes * 1e-6);
  bench_cloud(200);
  bench_cloud(2000);
  bench_search();
  if (argc > 1) {
    wm_map *loaded = nullptr;
    wm_error err = {};
    const double load = bench::median_us(5, [&] {
      wm_map_free(loaded);
      if (wm_map_load(argv[1], nullptr, nullptr, &loaded, &err) != WM_OK) std::fprintf(stderr, "%s\n", err.text);
    });
    if (!loaded) return 1;
    ready_map real;
    const double build = bench::median_us(5, [&] { real.make(*wm_map_raster(loaded)); });
    std::printf("%s: %u x %u pixels loaded in %.1f ms, made ready in %.1f ms, %.1f MB\n", argv[1],
                wm_map_raster(loaded)->width_px, wm_map_raster(loaded)->height_px, load * 1e-3, build * 1e-3,
                (double)real.bytes * 1e-6);
    wm_map_free(loaded);
  }
  return 0;
}
