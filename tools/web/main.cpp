// SPDX-License-Identifier: Apache-2.0
// waymark web: a run in a browser, from its messages; or a building, to be edited.
#include <signal.h>
#include <time.h>

#include <chrono>
#include <cstdio>
#include <mutex>

#include "common/program.h"
#include "report/style.h"
#include "web/editor.h"
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
  std::string edit;  // a site
  std::vector<std::string> drives;
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

bool ends(const std::string &text, const std::string &end) {
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

// What is in the program: `home` for "/", styles and scripts. 404 for others.
WebAnswer page_file(const std::string &path, const std::string &home) {
  const bool is_home = path == "/";
  const auto found = kPageFiles.find(is_home ? home : path.substr(1));
  if (found != kPageFiles.end() && is_home) return file("text/html; charset=utf-8", found->second);
  if (found != kPageFiles.end() && ends(path, ".css"))
    return file("text/css; charset=utf-8", (path == "/page.css" ? page_colours() : "") + found->second);
  if (found != kPageFiles.end() && ends(path, ".js")) return file("text/javascript; charset=utf-8", found->second);
  return {404, "text/plain; charset=utf-8", std::make_shared<const std::string>("there is no such page\n")};
}

WebAnswer answer(const WebRequest &request, Shown *shown, Pictures *pictures, const MapView &map) {
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
  return page_file(request.path, "page.html");
}

std::string address_of(const ListenAt &at, uint16_t port) {
  const std::string name = at.address == "127.0.0.1"                   ? "localhost"
                           : at.address.find(':') != std::string::npos ? "[" + at.address + "]"
                                                                       : at.address;
  return "http://" + name + ":" + std::to_string(port);
}

// `step` is called until it returns false, the program is asked to end, or the wished time is over.
template <typename Step>
void go_on(WebServer *server, double duration_s, const Step &step) {
  const auto begin = std::chrono::steady_clock::now();
  auto next = begin;
  while (stop_asked == 0 && step()) {
    const auto now = std::chrono::steady_clock::now();
    if (duration_s > 0 && std::chrono::duration<double>(now - begin).count() > duration_s) break;
    if (now < next) continue;
    server->end_slow_clients();
    next = now + std::chrono::seconds(1);
  }
}

constexpr size_t kEditBytes = 4 << 20;  // of a version's edits: 20000 take less

int edit(const Wishes &wishes) {
  if (!wishes.config.empty()) throw Failure("--edit shows a building, CONFIG a run: name one of them", kUsage);
  const std::string token = Editor::make_token();
  Editor editor(wishes.edit, wishes.drives, token);
  const ListenAt at = listen_at(wishes.listen);
  WebServer server(
      at,
      [&editor](const WebRequest &request) {
        WebAnswer page = page_file(request.path, "edit.html");
        return page.status == 200 && !request.is_post ? page : editor.answer(request);
      },
      WebServer::kPatience, kEditBytes);
  std::printf("%s/#token=%s\n", address_of(at, server.port()).c_str(), token.c_str());
  (void)std::fflush(stdout);
  go_on(&server, wishes.duration_s, [] {
    const timespec wait{0, 200'000'000};
    (void)nanosleep(&wait, nullptr);
    return true;
  });
  return kDone;
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
  std::printf("%s\n", address_of(at, server.port()).c_str());
  (void)std::fflush(stdout);
  go_on(&server, wishes.duration_s, [&lcm] { return lcm_handle_timeout(lcm.get(), 200) >= 0; });
  std::printf("%lld pictures were encoded\n", static_cast<long long>(pictures.encoded()));
  return kDone;
}

}  // namespace
}  // namespace wm::tools

int main(int argc, char **argv) {
  using namespace wm::tools;
  Wishes wishes;
  wm::cli::App app(
      "Shows a run as it goes on a page for browsers: map, path, landmarks, sightings, live pictures, health. Or a "
      "building (--edit), whose maps a person edits there.",
      "waymark web");
  app.add_option("CONFIG", wishes.config, "the run's configuration: map, calibration, channels, picture socket");
  app.add_option("--recording", wishes.recording, "the recording that the run plays, which has map and calibration");
  app.add_option("--map", wishes.map, "the map.yaml to draw, instead of theirs");
  app.add_option("--listen", wishes.listen,
                 "PORT, ADDRESS or ADDRESS:PORT; 127.0.0.1 is this computer alone, 0.0.0.0 everybody: a run without a "
                 "password, a "
                 "building with the token of its address")
      ->capture_default_str();
  app.add_option("--url", wishes.url, "LCM's, instead of the configuration's");
  app.add_option("--prefix", wishes.prefix, "of the channels, instead of the configuration's (WAYMARK_)");
  app.add_option("--pictures", wishes.pictures, "the run's picture socket, instead of the configuration's");
  auto *edited = app.add_option(
      "--edit", wishes.edit,
      "a building's folder: an editor of its plans, landmarks and tags, which saves versions; the address has a token");
  app.add_option("--drive", wishes.drives, "a run whose poses the editor draws; may be given several times")
      ->needs(edited);
  app.add_option("--duration", wishes.duration_s, "seconds, then stop")->check(wm::cli::not_negative());
  app.footer(
      "examples:\n"
      "  waymark web /etc/waymark/robot.yaml\n"
      "  waymark web config/datasets/corridor.yaml --recording REC --listen 0.0.0.0:8080\n"
      "  waymark web --edit office --drive runs/monday\n"
      "  ssh -L 8080:localhost:8080 robot waymark web /etc/waymark/robot.yaml");
  struct sigaction action {};
  action.sa_handler = on_signal;
  (void)sigaction(SIGINT, &action, nullptr);
  (void)sigaction(SIGTERM, &action, nullptr);
  return run_program(app, argc, argv, [&wishes] { return wishes.edit.empty() ? show(wishes) : edit(wishes); });
}
