// SPDX-License-Identifier: Apache-2.0
// This program's part of a DDS domain: topics with the names and the quality of service that ROS 2 nodes use.
#pragma once

#include <dds/dds.h>

#include <memory>
#include <string>
#include <vector>

namespace wm::ros2 {

enum class Quality {
  kStream,   // reliable, the last 100: poses, odometry, transforms
  kLatched,  // reliable, and the last one for readers that join late: what nav2 asks of a localizer's pose
  kSensor,   // best effort: a reader that takes senders of either kind
};

// What a bridge tells the others about itself, in its participant's user data.
struct Peer {
  int64_t started_ns = 0;  // UTC
  int pid = 0;
  std::string host, name_space, channels;  // channels: prefix and URL of LCM
};

class Participant {
 public:
  // Throws Failure where the domain can't be joined.
  Participant(int domain, const Peer &self);
  ~Participant();
  Participant(const Participant &) = delete;
  Participant &operator=(const Participant &) = delete;

  // `name`: of ROS, "/tf". Throws Failure.
  dds_entity_t writer(const std::string &name, const dds_topic_descriptor_t &type, Quality quality);
  dds_entity_t reader(const std::string &name, const dds_topic_descriptor_t &type, Quality quality);
  // The bridges that are in the domain now, without this one.
  [[nodiscard]] std::vector<Peer> others() const;

 private:
  dds_entity_t topic(const std::string &name, const dds_topic_descriptor_t &type) const;
  dds_entity_t participant_ = 0, participants_ = 0;
};

// The reason why two bridges can't be in one domain; empty: they can.
[[nodiscard]] std::string conflict(const Peer &self, const Peer &other);

}  // namespace wm::ros2
