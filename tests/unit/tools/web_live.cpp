// SPDX-License-Identifier: Apache-2.0
// The live page's edge to messages: whatever comes over LCM or the picture socket becomes valid JSON, in bounded
// memory.
#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <nlohmann/json.hpp>
#include <random>

#include "common/failure.h"
#include "common/suite.h"
#include "common/trials.h"
#include "made.h"
#include "web/live.h"
#include "web/pictures.h"
#include "web/server.h"

using namespace wm::tools;
using nlohmann::json;

namespace {

constexpr int64_t kSecond = 1'000'000'000;
const double kNone = std::numeric_limits<double>::quiet_NaN();
const WebSite kNowhere;

using Bytes = std::vector<uint8_t>;

Bytes pose_bytes(int64_t t_ns, double x_m, double y_m, uint32_t jumps = 0) {
  wm_published p{};
  p.now.t_ns = t_ns;
  p.now.pose_map_base.p_m[0] = x_m;
  p.now.pose_map_base.p_m[1] = y_m;
  p.now.pose_map_base.q_xyzw[3] = 1;
  p.now.covariance[0] = p.now.covariance[7] = 0.01;
  p.now.state = WM_STATE_TRACKING;
  p.now.dof = 3;
  p.jumps = jumps;
  Bytes out(WM_LCM_MESSAGE_MAX);
  out.resize(wm_lcm_pose(&p, t_ns, out.data(), out.size()));
  return out;
}

Bytes health_bytes(const char *name) {
  wm_health h{};
  h.state = WM_STATE_TRACKING;
  h.reckoning_left_s = INFINITY;
  h.lost_probability = kNone;
  h.source_count = 1;
  std::strncpy(h.sources[0].name, name, sizeof h.sources[0].name - 1);
  h.sources[0].device = WM_DEVICE_ABSENT;
  h.sources[0].late = 3;
  Bytes out(WM_LCM_MESSAGE_MAX);
  out.resize(wm_lcm_health(&h, out.data(), out.size()));
  return out;
}

void take(Live *live, const char *what, const Bytes &bytes, int64_t now_ns = kSecond) {
  live->take(what, bytes.data(), bytes.size(), now_ns);
}

json state(const Live &live, const Has &has = {}) { return json::parse(live.state(kSecond, has)); }

TEST(numbers_that_are_none_become_null) {
  Live live(kNowhere);
  TEST_ASSERT_EQUAL_STRING("waiting", state(live)["state"].get<std::string>().c_str());
  take(&live, "POSE", pose_bytes(1, kNone, INFINITY));
  take(&live, "HEALTH", health_bytes("can"));
  const json seen = state(live);
  TEST_ASSERT_TRUE(seen["pose"]["x_m"].is_null());
  TEST_ASSERT_TRUE(seen["pose"]["y_m"].is_null());
  TEST_ASSERT_TRUE(seen["health"]["left_s"].is_null());
  TEST_ASSERT_TRUE(seen["health"]["lost_probability"].is_null());
  TEST_ASSERT_EQUAL(0, seen["trail"]["points"].size());
  TEST_ASSERT_GREATER_OR_EQUAL(1, seen["health"]["findings"].size());
  TEST_ASSERT_TRUE(seen["health"]["sources"][0]["is_bad"].get<bool>());
  TEST_ASSERT_TRUE(!seen["health"]["sources"][0]["remedy"].get<std::string>().empty());
}

TEST(names_of_strangers_are_text) {
  Live live(kNowhere);
  take(&live, "HEALTH", health_bytes("<script>alert(\"1\")</script>"));
  TEST_ASSERT_EQUAL_STRING("<script>alert(\"1\")</script>",
                           state(live)["health"]["sources"][0]["name"].get<std::string>().c_str());
  take(&live, "HEALTH", health_bytes("\xff\xc0\x80 \xed\xa0\x80"));  // no UTF-8
  TEST_ASSERT_TRUE(state(live)["health"]["sources"][0]["name"].is_string());
}

TEST(a_run_is_metrics) {
  Live live(kNowhere);
  TEST_ASSERT_TRUE(live.metrics(kSecond).find("\nwaymark_up 0\n") != std::string::npos);
  const Bytes health = health_bytes("lidar\"");
  live.take("HEALTH", health.data(), health.size(), kSecond);
  const std::string text = live.metrics(kSecond);
  TEST_ASSERT_TRUE(text.find("\nwaymark_up 1\n") != std::string::npos);
  TEST_ASSERT_TRUE(text.find("\nwaymark_source_late_total{source=\"lidar\\\"\"} 3\n") != std::string::npos);
  TEST_ASSERT_EQUAL('\n', text.back());
}

// A browser that takes what is new each time has what the server has.
TEST(the_trail_is_bounded_and_whole) {
  Live live(kNowhere);
  json mine = json::array();
  Has has;
  constexpr int kPoses = 60000;
  for (int i = 0; i <= kPoses; i++) {
    const double turn = i * 1e-3;
    take(&live, "POSE", pose_bytes(i * 20'000'000LL + 1, 50 * std::sin(turn), 0.05 * i, i >= 30000 ? 1 : 0));
    if (i % 97 != 0 && i != kPoses) continue;
    const json trail = state(live, has)["trail"];
    if (trail["generation"] != has.trail_generation) mine.clear();
    has.trail_generation = trail["generation"];
    while (mine.size() > trail["from"].get<size_t>()) mine.erase(mine.size() - 1);
    for (const json &point : trail["points"]) mine.push_back(point);
    has.trail_points = static_cast<int64_t>(mine.size());
  }
  const json whole = state(live)["trail"]["points"];
  TEST_ASSERT_TRUE(whole == mine);
  TEST_ASSERT_LESS_OR_EQUAL(Trail::kPoints, whole.size());
  TEST_ASSERT_GREATER_THAN(Trail::kPoints / 4, whole.size());
  TEST_ASSERT_EQUAL_DOUBLE(0, whole.front()[1].get<double>());  // from the start
  TEST_ASSERT_DOUBLE_WITHIN(2, 0.05 * kPoses, whole.back()[1].get<double>());
  int jumps = 0;
  for (const json &point : whole) jumps += point[4].get<int>();
  TEST_ASSERT_EQUAL(1, jumps);
}

TEST(a_map_in_parts_is_taken_when_it_is_whole) {
  Live live(kNowhere);
  std::vector<wm_landmark> landmarks(300);
  std::vector<double> covariance(4 * landmarks.size(), 0.25);
  for (size_t i = 0; i < landmarks.size(); i++) landmarks[i].id = static_cast<int32_t>(i);
  const auto send = [&](size_t first) {
    Bytes out(WM_LCM_MESSAGE_MAX);
    out.resize(wm_lcm_map(landmarks.data(), reinterpret_cast<const double(*)[4]>(covariance.data()), landmarks.size(),
                          first, 5, out.data(), out.size()));
    take(&live, "MAP", out);
  };
  send(0);
  TEST_ASSERT_EQUAL(0, state(live)["landmarks"]["list"].size());
  send(256);
  const json seen = state(live)["landmarks"];
  TEST_ASSERT_EQUAL(300, seen["list"].size());
  TEST_ASSERT_EQUAL(299, seen["list"][299][0].get<int>());
  TEST_ASSERT_EQUAL_DOUBLE(0.25, seen["list"][0][4].get<double>());
  Has has;
  has.landmarks = seen["version"];
  TEST_ASSERT_FALSE(state(live, has).contains("landmarks"));
}

TEST(a_sighting_is_a_line_to_its_landmark) {
  WebSite site;
  site.sensors["eye"].T_base.translation() = Eigen::Vector3d(0.5, 0, 0);
  Live live(site);
  take(&live, "POSE", pose_bytes(kSecond, 1, 2));
  const wm_landmark landmark{7, {4.5, 2, 0}, 0.1, kNone, {kNone, kNone, kNone}, kNone};
  Bytes out(WM_LCM_MESSAGE_MAX);
  out.resize(wm_lcm_landmarks(&landmark, 1, 0, 1, out.data(), out.size()));
  take(&live, "LANDMARKS", out);
  wm_event event{};
  event.kind = WM_EVENT_SIGHTING;
  event.t_ns = kSecond;
  event.as.sighting = wm_sighting_without_numbers();
  event.as.sighting.landmark_id = 7;
  event.as.sighting.bearing_rad = 0;
  out.resize(WM_LCM_MESSAGE_MAX);
  out.resize(wm_lcm_observations("eye", &event, 1, out.data(), out.size()));
  take(&live, "OBSERVATIONS", out);
  wm_innovation innovation{};
  innovation.t_ns = kSecond;
  innovation.landmark_id = 7;
  innovation.verdict = WM_REJECTED_GATE;
  out.resize(WM_LCM_MESSAGE_MAX);
  out.resize(wm_lcm_innovation(&innovation, out.data(), out.size()));
  take(&live, "INNOVATION", out);
  const json ray = state(live)["rays"][0];
  TEST_ASSERT_EQUAL_DOUBLE(1.5, ray[0].get<double>());
  TEST_ASSERT_EQUAL_DOUBLE(4.5, ray[2].get<double>());
  TEST_ASSERT_EQUAL_DOUBLE(2, ray[3].get<double>());
  TEST_ASSERT_EQUAL_STRING("refused", ray[4].get<std::string>().c_str());
}

// Any bytes, and messages with bytes changed.
TEST(whatever_comes_gives_valid_json) {
  std::mt19937 draw(1);
  Live live(kNowhere);
  const std::vector<std::string> kinds = {"POSE", "HEALTH",    "INNOVATION", "OBSERVATIONS", "LANDMARKS",
                                          "MAP",  "PARTICLES", "HYPOTHESES", "OTHER"};
  std::vector<wm_place> places(WM_LCM_PLACES_MAX);
  Bytes cloud(WM_LCM_MESSAGE_MAX);
  cloud.resize(wm_lcm_places(places.data(), places.size(), 5000, 3, cloud.data(), cloud.size()));
  const std::vector<Bytes> seeds = {pose_bytes(1, 2, 3), health_bytes("can"), cloud, {}, Bytes(300, 0xff)};
  for (uint64_t i = wm_trials(20000, 5000); i > 0; i--) {
    Bytes bytes = seeds[draw() % seeds.size()];
    for (uint32_t k = draw() % 12; k > 0 && !bytes.empty(); k--)
      bytes[8 + draw() % (bytes.size() > 8 ? bytes.size() - 8 : 1) % bytes.size()] = static_cast<uint8_t>(draw());
    if (draw() % 9 == 0) bytes.resize(draw() % (bytes.size() + 1));
    take(&live, kinds[draw() % kinds.size()].c_str(), bytes, draw() % 3 * kSecond);
    if (i % 20 == 0) TEST_ASSERT_TRUE(state(live).is_object());
  }
}

wm_picture_head head_of(uint32_t width, uint32_t height) {
  wm_picture_head head{};
  std::memcpy(head.magic, WM_PICTURE_MAGIC, sizeof head.magic);
  head.width_px = width;
  head.height_px = height;
  head.source_count = 1;
  std::strcpy(head.source_name, "edges:front");
  std::strcpy(head.camera, "front");
  return head;
}

// A camera 1 m above the floor, tilted down; an edge point 2 m ahead is seen where the map's edge is expected.
TEST(what_is_seen_and_what_is_expected_meet) {
  WebSite site;
  NamedCamera camera{"front", {}};
  camera.camera.width = 640;
  camera.camera.height = 400;
  camera.camera.intrinsics = {300, 300, 319.5, 199.5};
  camera.camera.distortion = {0, 0, 0, 0};
  camera.camera.T_base_camera = wm::images::pose_xyz_rpy({0, 0, 1}, 0, 0.4, 0);
  site.cameras = {camera};
  site.sensors["front"].T_base = camera.camera.T_base_camera;
  std::vector<uint8_t> edges(100 * 100), floor(100 * 100, 255);
  edges[50 * 100 + 70] = 255;  // its centre: x 7.05, y 4.95
  const wm_raster raster{100, 100, 0.1, 0, 0, 0, edges.data(), floor.data(), 0};
  const MapEdges map(raster);

  wm_picture_head head = head_of(640, 400);
  wm_event event{};
  event.kind = WM_EVENT_POINTS;
  event.as.points.count = 1;
  event.as.points.x_m[0] = 2;
  event.as.points.y_m[0] = 0;
  Bytes body(WM_PICTURE_EVENTS_MAX);
  head.event_count = 1;
  head.event_bytes = static_cast<uint32_t>(wm_event_encode(&event, body.data(), body.size()));
  body.resize(head.event_bytes);
  body.resize(head.event_bytes + 640 * 400, 100);
  const auto looked = read_picture(head, body);
  TEST_ASSERT_TRUE(looked.has_value());

  Around around;
  around.pose.emplace();
  around.pose->p_m = {5.05, 4.95, 0};
  around.landmarks = {{3, {8, 4.95, 1}, kNone, kNone, {kNone, kNone, kNone}, kNone}};
  const json seen = json::parse(picture_json(*looked, site, &map, around, 1));
  TEST_ASSERT_EQUAL(1, seen["dots"].size());
  TEST_ASSERT_EQUAL(1, seen["map_dots"].size());
  for (int i = 0; i < 2; i++)
    TEST_ASSERT_DOUBLE_WITHIN(0.2, seen["dots"][0][i].get<double>(), seen["map_dots"][0][i].get<double>());
  TEST_ASSERT_EQUAL(3, seen["map_marks"][0][2].get<int>());
  TEST_ASSERT_GREATER_THAN(100, seen["jpeg"].get<std::string>().size());
  around.pose.reset();
  TEST_ASSERT_EQUAL(0, json::parse(picture_json(*looked, site, &map, around, 2))["map_dots"].size());
}

TEST(pictures_of_strangers_are_refused) {
  std::mt19937 draw(2);
  const Bytes whole(64);
  wm_picture_head head = head_of(8, 8);
  TEST_ASSERT_TRUE(read_picture(head, whole).has_value());
  TEST_ASSERT_FALSE(read_picture(head_of(9, 8), whole).has_value());
  head.event_count = 1;
  TEST_ASSERT_FALSE(read_picture(head, whole).has_value());
  head = head_of(0xffffffff, 0xffffffff);
  TEST_ASSERT_EQUAL(SIZE_MAX, wm_picture_body_bytes(&head));
  head = head_of(1, 1);
  std::memset(head.camera, 'a', sizeof head.camera);
  TEST_ASSERT_EQUAL(SIZE_MAX, wm_picture_body_bytes(&head));
  for (uint64_t i = wm_trials(20000, 5000); i > 0; i--) {
    head = head_of(4, 4);
    head.event_bytes = draw() % 100;
    head.event_count = draw() % 4;
    Bytes body(head.event_bytes + 16);
    for (uint8_t &byte : body) byte = draw() % 3 == 0 ? static_cast<uint8_t>(draw()) : 0;
    const auto looked = read_picture(head, body);
    if (looked) TEST_ASSERT_TRUE(json::parse(picture_json(*looked, kNowhere, nullptr, {}, i)).is_object());
  }
}

TEST(addresses_and_hosts) {
  TEST_ASSERT_EQUAL(9000, listen_at("9000").port);
  TEST_ASSERT_EQUAL_STRING("127.0.0.1", listen_at("9000").address.c_str());
  TEST_ASSERT_EQUAL_STRING("0.0.0.0", listen_at("0.0.0.0").address.c_str());
  TEST_ASSERT_EQUAL(8080, listen_at("0.0.0.0").port);
  TEST_ASSERT_EQUAL_STRING("::", listen_at("[::]:81").address.c_str());
  TEST_ASSERT_EQUAL(81, listen_at("[::]:81").port);
  TEST_ASSERT_EQUAL_STRING("::1", listen_at("::1").address.c_str());
  for (const char *wrong : {"", "70000", "-1", "robot:80", "1.2.3.4:", "1.2.3.4:x", "[::1:80", ":::::", "80 "})
    made::refused("", [&] { (void)listen_at(wrong); });
  for (const char *own : {"localhost", "localhost:8080", "127.0.0.1:1", "[::1]", "[::1]:80"})
    TEST_ASSERT_TRUE_MESSAGE(is_own_host(own), own);
  for (const char *other : {"", "evil.example", "localhost.evil.example", "127.0.0.1.evil.example:80", "a:b:localhost"})
    TEST_ASSERT_FALSE_MESSAGE(is_own_host(other), other);
  WebRequest request;
  request.query = {{"n", "12"}, {"m", "12x"}, {"l", "99999999999999999999"}, {"e", ""}};
  TEST_ASSERT_EQUAL(12, request.number("n", 1));
  for (const char *none : {"m", "l", "e", "absent"}) TEST_ASSERT_EQUAL(1, request.number(none, 1));
}

int connect_to(uint16_t port) {
  sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_port = htons(port);
  at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const int out = socket(AF_INET, SOCK_STREAM, 0);
  TEST_ASSERT_EQUAL(0, connect(out, reinterpret_cast<sockaddr *>(&at), sizeof at));
  const timeval patience{20, 0};
  (void)setsockopt(out, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  return out;
}

std::string answer_of(uint16_t port, const std::string &request) {
  const int client = connect_to(port);
  (void)send(client, request.data(), request.size(), MSG_NOSIGNAL);
  char text[4096] = "";
  (void)recv(client, text, sizeof text - 1, 0);
  (void)close(client);
  return text;
}

// A client that sends single bytes is disconnected after the timeout; others are answered meanwhile.
TEST(a_slow_client_is_sent_away) {
  WebServer server(
      {"127.0.0.1", 0},
      [](const WebRequest &request) {
        return WebAnswer{200, "text/plain", std::make_shared<const std::string>("path " + request.path)};
      },
      std::chrono::milliseconds(300));
  const int slow = connect_to(server.port());
  bool is_open = true;
  for (int i = 0; i < 2000 && is_open; i++) {
    is_open = send(slow, "G", 1, MSG_NOSIGNAL) == 1;
    server.end_slow_clients();
    (void)usleep(10000);
  }
  TEST_ASSERT_FALSE(is_open);
  (void)close(slow);
  const auto has = [](const std::string &text, const char *part) { return text.find(part) != std::string::npos; };
  const std::string head = " HTTP/1.1\r\nHost: localhost\r\n\r\n";
  TEST_ASSERT_TRUE(has(answer_of(server.port(), "GET /a" + head), "path /a"));
  TEST_ASSERT_TRUE(has(answer_of(server.port(), "GET /%00/../%41" + head), "path /%00/../%41"));  // as it is
  TEST_ASSERT_TRUE(has(answer_of(server.port(), "POST /a" + head), " 405 "));
  TEST_ASSERT_TRUE(has(answer_of(server.port(), "GET /a HTTP/1.1\r\nHost: evil.example\r\n\r\n"), " 403 "));
  TEST_ASSERT_FALSE(has(answer_of(server.port(), "GET /" + std::string(30000, 'a') + head), " 200 "));
}

}  // namespace
