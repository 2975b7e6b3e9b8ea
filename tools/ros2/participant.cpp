// SPDX-License-Identifier: Apache-2.0
#include "ros2/participant.h"

#include <array>
#include <cstring>
#include <sstream>

#include "common/failure.h"

namespace wm::ros2 {
namespace {

using tools::Failure;
using Qos = std::unique_ptr<dds_qos_t, decltype(&dds_delete_qos)>;

constexpr int kDepth = 100;                             // messages: 2 s of poses, as long as tf2's listeners ask for
constexpr dds_duration_t kBlocked_ns = DDS_MSECS(100);  // of a writer with a slow reader; ROS 2's default
// ROS 2 keeps "enclave=/;" in a participant's user data; further fields with ';' are ignored by it.
constexpr const char *kEnclave = "enclave=/;", *kMark = "waymark-ros2=";

dds_entity_t need(dds_entity_t entity, const std::string &what) {
  if (entity < 0) throw Failure("DDS: " + what + ": " + dds_strretcode(entity));
  return entity;
}

// SHA-256 of a type's canonical description (REP 2016), the same from Iron to Lyrical; tests/ros2 compares them with
// those of rosbags. Nodes read them in the user data of writers and readers, and warn of each one that has none.
constexpr std::array<std::pair<const char *, const char *>, 6> kHashes{{
    {"geometry_msgs::msg::dds_::PoseWithCovarianceStamped_",
     "26432f9803e43727d3c8f668d1fdb3c630f548af631e2f4e31382371bfea3b6e"},
    {"tf2_msgs::msg::dds_::TFMessage_", "e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087"},
    {"nav_msgs::msg::dds_::Odometry_", "3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0"},
    {"diagnostic_msgs::msg::dds_::DiagnosticArray_",
     "5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e"},
    {"sensor_msgs::msg::dds_::Imu_", "7d9a00ff131080897a5ec7e26e315954b8eae3353c3f995c55faf71574000b5b"},
    {"sensor_msgs::msg::dds_::NavSatFix_", "62223ab3fe210a15976021da7afddc9e200dc9ec75231c1b6a557fc598a65404"},
}};

Qos quality_of(Quality quality, const dds_topic_descriptor_t &type) {
  Qos qos(dds_create_qos(), dds_delete_qos);
  for (const auto &[name, hash] : kHashes) {
    if (strcmp(name, type.m_typename) != 0) continue;
    const std::string about = "typehash=RIHS01_" + std::string(hash) + ";";
    dds_qset_userdata(qos.get(), about.data(), about.size());
  }
  dds_qset_reliability(qos.get(), quality == Quality::kSensor ? DDS_RELIABILITY_BEST_EFFORT : DDS_RELIABILITY_RELIABLE,
                       kBlocked_ns);
  dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, kDepth);
  dds_qset_durability(qos.get(),
                      quality == Quality::kLatched ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  if (quality == Quality::kLatched)
    dds_qset_durability_service(qos.get(), 0, DDS_HISTORY_KEEP_LAST, 1, DDS_LENGTH_UNLIMITED, DDS_LENGTH_UNLIMITED,
                                DDS_LENGTH_UNLIMITED);
  const dds_data_representation_id_t plain = DDS_DATA_REPRESENTATION_XCDR1;  // the only one of ROS 2
  dds_qset_data_representation(qos.get(), 1, &plain);
  return qos;
}

// Fields between ' ', none of which has one.
std::string user_data(const Peer &self) {
  std::ostringstream out;
  out << kEnclave << kMark << self.started_ns << ' ' << self.pid << ' ' << self.host << " /" << self.name_space << ' '
      << self.channels << ';';
  return out.str();
}

bool read_user_data(const std::string &text, Peer *out) {
  const size_t at = text.find(kMark);
  if (at == std::string::npos) return false;
  std::istringstream in(text.substr(at + std::string(kMark).size()));
  in >> out->started_ns >> out->pid >> out->host >> out->name_space >> out->channels;
  if (!in || out->channels.back() != ';' || out->name_space[0] != '/') return false;
  out->channels.pop_back();
  out->name_space.erase(0, 1);
  return true;
}

}  // namespace

Participant::Participant(int domain, const Peer &self) {
  const Qos qos(dds_create_qos(), dds_delete_qos);
  const std::string about = user_data(self);
  dds_qset_userdata(qos.get(), about.data(), about.size());
  participant_ = dds_create_participant(static_cast<dds_domainid_t>(domain), qos.get(), nullptr);
  if (participant_ < 0)
    throw Failure("DDS: domain " + std::to_string(domain) + " can't be joined: " + dds_strretcode(participant_) +
                  ". Its ports may be in use, or CYCLONEDDS_URI names a network interface or a participant index that "
                  "is not free; `ROS_DOMAIN_ID` or --domain takes another domain");
  participants_ = dds_create_reader(participant_, DDS_BUILTIN_TOPIC_DCPSPARTICIPANT, nullptr, nullptr);
  if (participants_ < 0) {
    (void)dds_delete(participant_);
    (void)need(participants_, "the list of participants");
  }
}

Participant::~Participant() { (void)dds_delete(participant_); }

dds_entity_t Participant::topic(const std::string &name, const dds_topic_descriptor_t &type) const {
  return need(dds_create_topic(participant_, &type, ("rt" + name).c_str(), nullptr, nullptr), name);
}

dds_entity_t Participant::writer(const std::string &name, const dds_topic_descriptor_t &type, Quality quality) {
  return need(dds_create_writer(participant_, topic(name, type), quality_of(quality, type).get(), nullptr), name);
}

dds_entity_t Participant::reader(const std::string &name, const dds_topic_descriptor_t &type, Quality quality) {
  return need(dds_create_reader(participant_, topic(name, type), quality_of(quality, type).get(), nullptr), name);
}

std::vector<Peer> Participant::others() const {
  std::vector<Peer> out;
  dds_guid_t self;
  (void)dds_get_guid(participant_, &self);
  std::array<void *, 256> samples{};
  std::array<dds_sample_info_t, 256> infos{};
  const int count = dds_read(participants_, samples.data(), infos.data(), samples.size(), samples.size());
  for (int i = 0; i < count; i++) {
    const auto &found = *static_cast<const dds_builtintopic_participant_t *>(samples[i]);
    if (!infos[i].valid_data || infos[i].instance_state != DDS_IST_ALIVE) continue;
    if (memcmp(&found.key, &self, sizeof self) == 0) continue;
    void *data = nullptr;
    size_t bytes = 0;
    Peer other;
    if (!dds_qget_userdata(found.qos, &data, &bytes)) continue;
    if (read_user_data({static_cast<const char *>(data), bytes}, &other)) out.push_back(other);
    dds_free(data);
  }
  if (count > 0) (void)dds_return_loan(participants_, samples.data(), count);
  return out;
}

std::string conflict(const Peer &self, const Peer &other) {
  const std::string who = "process " + std::to_string(other.pid) + " on '" + other.host + "'";
  if (other.name_space == self.name_space)
    return "another bridge (" + who + ") sends /" + self.name_space + (self.name_space.empty() ? "" : "/") +
           "waymark/pose in this domain already; --namespace gives this one topics of its own";
  if (other.host == self.host && other.channels == self.channels)
    return "another bridge (" + who + ") takes the same channels (" + self.channels + ") already";
  return "";
}

}  // namespace wm::ros2
