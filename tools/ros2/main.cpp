// SPDX-License-Identifier: Apache-2.0
// waymark ros2: a run's poses for ROS 2, and ROS 2's data for a run.
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <thread>

extern "C" {
#include "live/lcm_connect.h"
}

#include "common/program.h"
#include "ros2/bridge.h"

namespace wm::ros2 {
namespace {

using tools::Failure;
using Clock = std::chrono::steady_clock;

constexpr int kDomainMax = 232;  // with larger ones the ports of DDS exceed 65535
// Participants announce themselves at once when another one comes; that takes milliseconds, on a loaded computer more.
constexpr auto kDiscovery = std::chrono::milliseconds(1000);

volatile std::sig_atomic_t stop_asked = 0;

void on_signal(int) { stop_asked = 1; }

struct Options {
  Wishes bridge;
  std::string url;
  std::optional<int> domain;  // none: that of the environment
  double duration_s = 0;
  std::vector<double> origin;
};

int domain_of_environment() {
  const char *text = std::getenv("ROS_DOMAIN_ID");
  if (text == nullptr || text[0] == '\0') return 0;
  char *end = nullptr;
  const long domain = std::strtol(text, &end, 10);
  if (*end != '\0' || domain < 0 || domain > kDomainMax)
    throw Failure(std::string("ROS_DOMAIN_ID: '") + text + "' is not a domain from 0 to " + std::to_string(kDomainMax),
                  tools::kUsage);
  return static_cast<int>(domain);
}

void check(const Options &options) {
  const Wishes &b = options.bridge;
  const auto is_topic = [](const std::string &name) {
    return !name.empty() && name.back() != '/' && name.find_first_of(" \t") == std::string::npos;
  };
  for (const std::string *topic : {&b.initialpose, &b.odom, &b.imu, &b.fix, &b.localizer, &b.visual_odom})
    if (!topic->empty() && ((*topic)[0] != '/' || !is_topic(*topic)))
      throw Failure("'" + *topic + "' is not a topic: it has to begin with '/', as /odom", tools::kUsage);
  if (!b.name_space.empty() && (b.name_space[0] == '/' || !is_topic(b.name_space)))
    throw Failure("--namespace: '" + b.name_space + "' is not a namespace; write it as robot1", tools::kUsage);
  if (!b.localizer.empty() && !b.visual_odom.empty())
    throw Failure("--localizer and --visual-odom are one stream of the run: give one of them", tools::kUsage);
  if (b.tf == "robot" && b.odom.empty())
    throw Failure("--tf robot needs the robot's odometry: --odom TOPIC", tools::kUsage);
}

// Two bridges would send each transform twice. The later one ends.
void refuse_second(const Participant &participant, const Peer &self) {
  const auto begin = Clock::now();
  while (stop_asked == 0 && Clock::now() - begin < kDiscovery) {
    for (const Peer &other : participant.others()) {
      const bool is_earlier =
          other.started_ns < self.started_ns || (other.started_ns == self.started_ns && other.pid < self.pid);
      const std::string why = conflict(self, other);
      if (is_earlier && !why.empty()) throw Failure(why);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
}

std::string sources(const Wishes &wishes) {
  std::string out;
  for (const std::string *topic :
       {&wishes.initialpose, &wishes.odom, &wishes.imu, &wishes.fix, &wishes.localizer, &wishes.visual_odom})
    if (!topic->empty()) out += " " + *topic;
  return out.empty() ? " nothing" : out;
}

int run(Options options) {
  check(options);
  Wishes &wishes = options.bridge;
  const int domain = options.domain ? *options.domain : domain_of_environment();
  for (size_t i = 0; i < 3; i++) wishes.origin[i] = i < options.origin.size() ? options.origin[i] : std::nan("");
  const char *url = lcm_connect_url(options.url.c_str()), *why = "";
  const std::unique_ptr<lcm_t, decltype(&lcm_destroy)> lcm(lcm_connect(url, &why), lcm_destroy);
  if (!lcm)
    throw Failure("LCM: no connection on " + std::string(url) + ": " + why +
                  " (`ip route add 224.0.0.0/4 dev lo` makes a route on this computer)");
  std::array<char, 256> host{};
  (void)gethostname(host.data(), host.size() - 1);
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  const Peer self{std::chrono::nanoseconds(now).count(), static_cast<int>(getpid()), host.data(), wishes.name_space,
                  wishes.prefix + "@" + url};
  Participant participant(domain, self);
  refuse_second(participant, self);
  Bridge bridge(wishes, &participant, lcm.get());
  std::printf("%s... on %s -> domain %d: /tf, /waymark/pose, /waymark/odom, /diagnostics; taken:%s\n",
              wishes.prefix.c_str(), url, domain, sources(wishes).c_str());
  (void)std::fflush(stdout);
  const auto begin = Clock::now();
  while (stop_asked == 0) {
    // A signal interrupts it, too.
    if (lcm_handle_timeout(lcm.get(), 100) < 0 && stop_asked == 0)
      throw Failure("LCM: " + std::string(url) + " can't be read any more");
    bridge.look();
    if (options.duration_s > 0 && std::chrono::duration<double>(Clock::now() - begin).count() > options.duration_s)
      break;
  }
  const Counts &counts = bridge.counts();
  std::printf("%llu poses sent, %llu not understood, %llu messages not sent; %llu taken, %llu refused\n",
              static_cast<unsigned long long>(counts.poses), static_cast<unsigned long long>(counts.not_understood),
              static_cast<unsigned long long>(counts.not_sent), static_cast<unsigned long long>(counts.taken.load()),
              static_cast<unsigned long long>(counts.refused.load()));
  return tools::kDone;
}

}  // namespace
}  // namespace wm::ros2

int main(int argc, char **argv) {
  using namespace wm::ros2;
  Options options;
  Wishes &b = options.bridge;
  wm::cli::App app(
      "Gives a run's poses to ROS 2, and data of ROS 2 to the run: LCM on one side, DDS on the other. "
      "No ROS is needed on this computer.",
      "waymark ros2");
  app.add_option("--url", options.url, "LCM's (default: LCM_DEFAULT_URL, else this computer's)");
  app.add_option("--prefix", b.prefix, "of LCM's channels")->capture_default_str();
  const wm::cli::Check domains = wm::cli::range(0, kDomainMax);
  app.add_option("--domain", options.domain, "of DDS (default: ROS_DOMAIN_ID, else 0)")->check(domains);
  app.add_option("--namespace", b.name_space, "before all topics but /diagnostics, as robot1");
  app.add_option("--tf", b.tf,
                 "waymark: map -> odom -> base_link; robot: map -> odom alone, by the poses of --odom, where the robot "
                 "sends odom -> base_link itself; none")
      ->check(wm::cli::one_of({"waymark", "robot", "none"}))
      ->capture_default_str();
  app.add_option("--map-frame", b.frames.map, "its name")->capture_default_str();
  app.add_option("--odom-frame", b.frames.odom, "its name")->capture_default_str();
  app.add_option("--base-frame", b.frames.base, "its name")->capture_default_str();
  app.add_option("--initialpose", b.initialpose,
                 "topic that sets the pose (commands: {lcm: true} in the run's configuration); '' takes none")
      ->capture_default_str();
  app.add_option("--odom", b.odom, "topic of nav_msgs/Odometry: its twist is sent as motion");
  app.add_option("--imu", b.imu, "topic of sensor_msgs/Imu: sent as imu");
  app.add_option("--fix", b.fix, "topic of sensor_msgs/NavSatFix: sent as gnss, in metres of --origin");
  app.add_option("--localizer", b.localizer,
                 "topic of geometry_msgs/PoseWithCovarianceStamped, another localizer's: sent as localizer");
  app.add_option("--visual-odom", b.visual_odom,
                 "topic of nav_msgs/Odometry whose poses are sent as localizer (localizer: {frame: own})");
  app.add_option("--origin", options.origin,
                 "LATITUDE,LONGITUDE[,ALTITUDE] of the map's zero in degrees and m (default: the first fix)")
      ->delimiter(',')
      ->expected(2, 3);
  app.add_option("--duration", options.duration_s, "seconds, then stop")->check(wm::cli::not_negative());
  app.footer(
      "examples:\n"
      "  waymark ros2\n"
      "  waymark ros2 --tf robot --odom /odom --imu /imu/data\n"
      "  waymark ros2 --fix /fix --origin 48.1,11.6,520\n"
      "  waymark ros2 --localizer /amcl_pose\n"
      "\n"
      "The run takes what devices.lcm in its configuration lists (docs/motion-sources.md).");
  struct sigaction action {};
  action.sa_handler = on_signal;
  (void)sigaction(SIGINT, &action, nullptr);
  (void)sigaction(SIGTERM, &action, nullptr);
  return wm::tools::run_program(app, argc, argv, [&] { return run(options); });
}
