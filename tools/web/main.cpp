// SPDX-License-Identifier: Apache-2.0
// waymark web: a run in a browser, from its messages.
#include <signal.h>

#include <chrono>
#include <cstdio>
#include <mutex>

#include "common/program.h"
#include "report/style.h"
#include "web/live.h"
#include "web/map_view.h"
#include "web/page.h"
#include "web/pictures.h"
#include "web/server.h"

extern "C" {
#include "live/lcm_connect.h"
#include "rt/clock.h"
}

namespace wm::tools {
namespace {

namespace fs = std::filesystem;

volatile sig_atomic_t stop_asked = 0;
void on_signal(int) { stop_asked = 1; }

struct Wishes {
  std::string config, recording, map, url, prefix, listen = "127.0.0.1:8080", pictures;
  double duration_s = 0;
};

// The run as it goes, between who listens and who answers.
struct Shown {
  explicit Shown(const WebSite &known) : site(known), live(known) {}
  const WebSite &site;
  std::mutex lock;  // of `live`
  Live live;
  std::string prefix;
};

void on_message(const lcm_recv_buf_t *message, const char *channel, void *context) {
  auto *shown = static_cast<Shown *>(context);
  const std::string what = std::string(channel).substr(shown->prefix.size());
  const std::lock_guard<std::mutex> hold(shown->lock);
  shown->live.take(what, message->data, message->data_size, wm_monotonic_ns());
}

void listen_to(lcm_t *lcm, Shown *shown) {
  for (const char *what : {"POSE", "POSE_BOUND", "HEALTH", "INNOVATION", "OBSERVATIONS", "LANDMARKS", "MAP",
                           "PARTICLES", "HYPOTHESES", "REFUSED"}) {
    // The channel is a pattern there: a prefix is meant letter by letter.
    std::string pattern;
    for (const char c : shown->prefix + what)
      pattern +=
          std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' ? std::string(1, c) : std::string("\\") + c;
    (void)lcm_subscribe(lcm, pattern.c_str(), on_message, shown);
  }
}

WebAnswer file(const std::string &type, const std::string &body) {
  return {200, type, std::make_shared<const std::string>(body)};
}

WebAnswer json(std::shared_ptr<const std::string> body) { return {200, "application/json", std::move(body)}; }

WebAnswer answer(const WebRequest &request, Shown *shown, Pictures *pictures, const MapView &map) {
  const auto page = kPageFiles.find(request.path == "/" ? "page.html" : request.path.substr(1));
  if (request.path == "/" && page != kPageFiles.end()) return file("text/html; charset=utf-8", page->second);
  if (request.path == "/page.css" && page != kPageFiles.end())
    return file("text/css; charset=utf-8", page_colours() + page->second);
  if (request.path == "/page.js" && page != kPageFiles.end())
    return file("text/javascript; charset=utf-8", page->second);
  if (request.path == "/state.json") {
    const Has has{request.number("generation", 0), request.number("points", 0), request.number("landmarks", 0),
                  request.number("places", 0)};
    const std::lock_guard<std::mutex> hold(shown->lock);
    return json(std::make_shared<const std::string>(shown->live.state(wm_monotonic_ns(), has)));
  }
  if (request.path == "/metrics") {
    const std::lock_guard<std::mutex> hold(shown->lock);
    return file("text/plain; version=0.0.4; charset=utf-8", shown->live.metrics(wm_monotonic_ns()));
  }
  if (request.path == "/picture.json") {
    auto picture = pictures->newest(request.number("source", 0), request.number("number", -1));
    return picture ? json(std::move(picture)) : WebAnswer{204};
  }
  if (request.path == "/map.json") return json(map.json);
  if (request.path == "/floor.png" && map.floor_png) return {200, "image/png", map.floor_png};
  if (request.path == "/edges.png" && map.edges_png) return {200, "image/png", map.edges_png};
  return {404, "text/plain; charset=utf-8", std::make_shared<const std::string>("there is no such page\n")};
}

int show(const Wishes &wishes) {
  WebSite site = load_web_site(wishes.config, wishes.recording, wishes.map);
  if (!wishes.url.empty()) site.lcm_url = wishes.url;
  if (!wishes.prefix.empty()) site.prefix = wishes.prefix;
  if (!wishes.pictures.empty()) site.picture_socket = wishes.pictures;
  Shown shown(site);
  shown.prefix = site.prefix;
  const MapView map = view_map(site.raster());
  Pictures pictures(site, [&shown](int64_t t_ns) {
    const std::lock_guard<std::mutex> hold(shown.lock);
    Around out{shown.live.pose_at_stamp(t_ns), shown.live.known()};
    out.landmarks.insert(out.landmarks.end(), shown.live.own().begin(), shown.live.own().end());
    return out;
  });
  const ListenAt at = listen_at(wishes.listen);
  WebServer server(at, [&](const WebRequest &request) { return answer(request, &shown, &pictures, map); });

  const char *url = lcm_connect_url(site.lcm_url.c_str()), *why = "";
  const std::unique_ptr<lcm_t, decltype(&lcm_destroy)> lcm(lcm_connect(url, &why), lcm_destroy);
  if (!lcm)
    throw Failure("LCM: no way in on " + std::string(url) + ": " + why +
                  " (`ip route add 224.0.0.0/4 dev lo` makes a route on this computer)");
  listen_to(lcm.get(), &shown);
  const bool is_six = at.address.find(':') != std::string::npos;
  std::printf("http://%s:%d\n",
              at.address == "127.0.0.1" ? "localhost" : (is_six ? "[" + at.address + "]" : at.address).c_str(),
              server.port());
  (void)std::fflush(stdout);

  const auto begin = std::chrono::steady_clock::now();
  auto next = begin;
  while (stop_asked == 0) {
    if (lcm_handle_timeout(lcm.get(), 200) < 0) break;
    const auto now = std::chrono::steady_clock::now();
    if (wishes.duration_s > 0 && std::chrono::duration<double>(now - begin).count() > wishes.duration_s) break;
    if (now < next) continue;
    server.end_slow_clients();
    next = now + std::chrono::seconds(1);
  }
  std::printf("%lld pictures were encoded\n", static_cast<long long>(pictures.encoded()));
  return kDone;
}

}  // namespace
}  // namespace wm::tools

int main(int argc, char **argv) {
  using namespace wm::tools;
  Wishes wishes;
  wm::cli::App app(
      "Shows a run as it goes on a page for browsers: map, path, landmarks, sightings, live pictures, health.",
      "waymark web");
  app.add_option("CONFIG", wishes.config, "the run's configuration: map, calibration, channels, picture socket");
  app.add_option("--recording", wishes.recording, "the recording that the run plays, which has map and calibration");
  app.add_option("--map", wishes.map, "the map.yaml to draw, instead of theirs");
  app.add_option(
         "--listen", wishes.listen,
         "PORT, ADDRESS or ADDRESS:PORT; 127.0.0.1 is this computer alone, 0.0.0.0 everybody, without a password")
      ->capture_default_str();
  app.add_option("--url", wishes.url, "LCM's, instead of the configuration's");
  app.add_option("--prefix", wishes.prefix, "of the channels, instead of the configuration's (WAYMARK_)");
  app.add_option("--pictures", wishes.pictures, "the run's picture socket, instead of the configuration's");
  app.add_option("--duration", wishes.duration_s, "seconds, then stop")->check(wm::cli::not_negative());
  app.footer(
      "examples:\n"
      "  waymark web /etc/waymark/robot.yaml\n"
      "  waymark web config/datasets/corridor.yaml --recording REC --listen 0.0.0.0:8080\n"
      "  ssh -L 8080:localhost:8080 robot waymark web /etc/waymark/robot.yaml");
  struct sigaction action {};
  action.sa_handler = on_signal;
  (void)sigaction(SIGINT, &action, nullptr);
  (void)sigaction(SIGTERM, &action, nullptr);
  return run_program(app, argc, argv, [&wishes] { return show(wishes); });
}
