// SPDX-License-Identifier: Apache-2.0
// Any bytes as a message of another participant (CDR) and as a run's LCM message. What the bridge takes of a DDS
// message is finite and a row that a run can read; what it makes of LCM's is CDR that decodes to the same bytes. The
// first byte picks the kind.
#include <dds/ddsi/ddsi_cdrstream.h>

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <vector>

#include "fuzz.h"

extern "C" {
#include "waymark/lcm_messages.h"
#include "waymark/lcm_streams.h"
}

#include "ros2/incoming.h"
#include "ros2/outgoing.h"

namespace wm::ros2 {
namespace {

constexpr uint32_t kXcdr1 = 1;
constexpr size_t kHead = 4;  // representation and options, as ROS 2's messages begin

std::vector<unsigned char> encode(const dds_topic_descriptor_t &type, const void *message) {
  dds_ostream_t out;
  dds_ostream_init(&out, 64, kXcdr1);
  check(dds_stream_write(&out, static_cast<const char *>(message), type.m_ops) != nullptr);
  std::vector<unsigned char> bytes(out.m_buffer, out.m_buffer + out.m_index);
  dds_ostream_fini(&out);
  return bytes;
}

// False: these bytes are no message of the type. As a reader does it: checked and put into this computer's order, then
// read.
bool decode(const dds_topic_descriptor_t &type, std::vector<unsigned char> bytes, bool is_swapped, void *message) {
  uint32_t end = 0;
  const auto size = static_cast<uint32_t>(bytes.size());
  if (size == 0) return false;
  auto *raw = reinterpret_cast<char *>(bytes.data());
  if (dds_stream_normalize_data(raw, &end, size, is_swapped, kXcdr1, type.m_ops) == nullptr) return false;
  dds_istream_t in;
  dds_istream_init(&in, end, bytes.data(), kXcdr1);
  (void)dds_stream_read(&in, static_cast<char *>(message), type.m_ops);
  dds_istream_fini(&in);
  return true;
}

template <typename Message, typename Take>
void incoming(const dds_topic_descriptor_t &type, const uint8_t *data, size_t size, Take take) {
  if (size < kHead) return;
  Message message{};
  if (!decode(type, {data + kHead, data + size}, data[1] == 0, &message)) return;
  take(message);
  Message again{};
  const std::vector<unsigned char> first = encode(type, &message);
  check(decode(type, first, false, &again) && encode(type, &again) == first);
  dds_sample_free(&message, &type, DDS_FREE_CONTENTS);
  dds_sample_free(&again, &type, DDS_FREE_CONTENTS);
}

// A row as it goes over LCM, read by a run.
void check_row(const char *stream, wm_stream_row *row) {
  uint8_t bytes[512];
  wm_stream_row read;
  const size_t length = wm_lcm_row(stream, row, bytes, sizeof bytes);
  check(length > 0 && wm_lcm_read_row(stream, bytes, length, &read) == nullptr && read.t_ns == row->t_ns);
  for (size_t i = 0; i < 3; i++)  // an absent altitude stays absent
    check(read.number[i] == row->number[i] || (std::isnan(read.number[i]) && std::isnan(row->number[i])));
}

void take_initialpose(const PoseStamped &message) {
  wm_set_pose out{};
  if (set_pose_of(message, "map", &out)) return;
  const double *q = out.pose_map_base.q_xyzw;
  check(std::fabs(std::hypot(std::hypot(q[0], q[1]), std::hypot(q[2], q[3])) - 1) < 1e-6);
  check(std::isfinite(out.pose_map_base.p_m[0]) && out.sigma_xy_m > 0 && out.sigma_heading_rad > 0);
  uint8_t bytes[512];
  wm_event event;
  const size_t length = wm_lcm_set_pose(&out, 1, bytes, sizeof bytes);
  check(length > 0);
  (void)wm_lcm_read_set_pose(bytes, length, &event);  // the run may refuse the size of its numbers
}

void take_odometry(const Odometry &message) {
  Eigen::Isometry3d at;
  if (!pose_of(message, &at)) check(at.matrix().allFinite());
  wm_stream_row row{};
  if (motion_of(message, &row)) return;
  row.t_ns = monotonic_stamp(message.header.stamp, 5);
  check_row("motion", &row);
}

void take_imu(const Imu &message) {
  wm_stream_row row{};
  if (imu_of(message, &row)) return;
  row.t_ns = monotonic_stamp(message.header.stamp, -5);
  check_row("imu", &row);
}

void take_localizer(const PoseStamped &message) {
  wm_stream_row row{};
  if (localized_of(message.pose, &row)) return;
  row.t_ns = monotonic_stamp(message.header.stamp, 5);
  check_row("localizer", &row);
}

void take_fix(const Fix &message) {
  const double origin[3] = {48, 11, 500};
  wm_can_gnss gnss;
  wm_can_gnss_init(&gnss, origin);
  wm_stream_row row{};
  if (position_of(message, &gnss, &row)) return;
  check(std::isfinite(row.number[0]) && std::isfinite(row.number[1]));
  check_row("gnss", &row);
}

// The text fields of a message are this program's own: a message that was encoded has to decode to the same bytes.
void outgoing(const dds_topic_descriptor_t &type, const void *message, void *again) {
  const std::vector<unsigned char> bytes = encode(type, message);
  check(decode(type, bytes, false, again) && encode(type, again) == bytes);
  dds_sample_free(again, &type, DDS_FREE_CONTENTS);
}

void send_pose(const uint8_t *data, size_t size) {
  static wm_published published;
  if (wm_lcm_read_pose(data, size, &published) != nullptr) return;
  const Frames frames;
  const PoseStamped pose = pose_message(published, published.now.t_ns, frames);
  const Odometry odometry = odometry_message(published, published.now.t_ns, frames);
  TransformStamped transform = transform_message(frames.map, frames.odom, base_in_odom(published), published.now.t_ns);
  const TransformMessage tf{{1, 1, &transform, false}};
  PoseStamped pose_again{};
  Odometry odometry_again{};
  TransformMessage tf_again{};
  outgoing(geometry_msgs_msg_dds__PoseWithCovarianceStamped__desc, &pose, &pose_again);
  outgoing(nav_msgs_msg_dds__Odometry__desc, &odometry, &odometry_again);
  outgoing(tf2_msgs_msg_dds__TFMessage__desc, &tf, &tf_again);
}

void send_health(const uint8_t *data, size_t size) {
  static wm_health health;
  if (wm_lcm_read_health(data, size, &health) != nullptr) return;
  Diagnostics texts;
  const DiagnosticArray message = texts.message(health, size % 2 == 0 ? "" : "no poses for 3 s", 1);
  DiagnosticArray again{};
  outgoing(diagnostic_msgs_msg_dds__DiagnosticArray__desc, &message, &again);
}

}  // namespace
}  // namespace wm::ros2

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  using namespace wm::ros2;
  if (size == 0) return 0;
  const unsigned kind = data[0] % 7;
  data++, size--;
  switch (kind) {
    case 0:
      incoming<PoseStamped>(geometry_msgs_msg_dds__PoseWithCovarianceStamped__desc, data, size, take_initialpose);
      break;
    case 1: incoming<Odometry>(nav_msgs_msg_dds__Odometry__desc, data, size, take_odometry); break;
    case 2: incoming<Imu>(sensor_msgs_msg_dds__Imu__desc, data, size, take_imu); break;
    case 3: incoming<Fix>(sensor_msgs_msg_dds__NavSatFix__desc, data, size, take_fix); break;
    case 4: send_pose(data, size); break;
    case 5:
      incoming<PoseStamped>(geometry_msgs_msg_dds__PoseWithCovarianceStamped__desc, data, size, take_localizer);
      break;
    default: send_health(data, size); break;
  }
  return 0;
}
