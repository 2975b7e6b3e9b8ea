// SPDX-License-Identifier: Apache-2.0
// LCM on one side, DDS on the other. The caller's thread takes LCM's messages; a thread of the bridge takes DDS's.
#pragma once

#include <lcm/lcm.h>

#include <atomic>
#include <functional>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "ros2/incoming.h"
#include "ros2/outgoing.h"
#include "ros2/participant.h"
#include "ros2/track.h"
#include "waymark/lcm_messages.h"

namespace wm::ros2 {

struct Wishes {
  std::string prefix = "WAYMARK_", name_space;
  Frames frames;
  std::string tf = "waymark";  // who has odom -> base_link: "waymark", "robot"; "none": nothing is sent
  std::string initialpose = "/initialpose", odom, imu, fix, localizer, visual_odom;  // topics that are taken; "": not
  double origin[3];  // of fixes: degrees, degrees, m; NaN: the first fix
};

struct Counts {
  uint64_t poses = 0, not_understood = 0, not_sent = 0;
  std::atomic<uint64_t> taken{0}, refused{0};
};

class Bridge {
 public:
  Bridge(const Wishes &wishes, Participant *participant, lcm_t *lcm);
  ~Bridge();
  Bridge(const Bridge &) = delete;
  Bridge &operator=(const Bridge &) = delete;

  // Diagnostics once a second where the run is silent. Called more often than that.
  void look();
  [[nodiscard]] const Counts &counts() const { return counts_; }

 private:
  struct Input {
    std::string topic;
    dds_entity_t reader;
    std::function<Fault(const void *)> take;
  };

  void on_pose(const void *bytes, size_t length);
  void on_bound(const void *bytes, size_t length);
  void on_health(const void *bytes, size_t length);
  void send_transforms(const wm_published &published, int64_t utc_ns);
  void send(dds_entity_t writer, const void *message);
  // Prints a line on standard error, each one once.
  void report(const std::string &line);

  template <typename Message>
  void listen(const std::string &topic, const dds_topic_descriptor_t &type, Quality quality,
              Fault (Bridge::*take)(const Message &));
  void take_inputs();
  void take_messages(const Input &input);
  Fault take_initialpose(const PoseStamped &message);
  Fault take_odometry(const Odometry &message);
  Fault take_imu(const Imu &message);
  Fault take_fix(const Fix &message);
  Fault take_localizer(const PoseStamped &message);
  Fault take_visual_odometry(const Odometry &message);
  Fault send_localized(const Time &stamp, const RosPoseCovariance &pose);
  Fault send_row(const char *stream, const char *channel, const Time &stamp, wm_stream_row *row);
  Fault publish(const std::string &channel, size_t bytes);

  Wishes wishes_;
  Participant *participant_;
  lcm_t *lcm_;
  dds_entity_t pose_, odometry_, diagnostics_, tf_ = 0;
  wm_published published_{};
  wm_health health_{};
  Diagnostics texts_;
  int64_t heard_ns_, looked_ns_ = 0;  // of the last pose and the last diagnostics of a silence, monotonic
  int64_t sent_map_odom_ns_ = 0;      // stamp of the newest map -> odom
  Track in_map_, in_robot_odom_;
  std::mutex lock_;  // of in_robot_odom_ and reported_, which both threads use
  wm_can_gnss gnss_{};
  std::vector<Input> inputs_;
  uint8_t bytes_[WM_LCM_MESSAGE_MAX];
  std::set<std::string> reported_;
  std::atomic<bool> stop_{false};
  Counts counts_;
  std::thread thread_;
};

}  // namespace wm::ros2
