// SPDX-License-Identifier: Apache-2.0
#include "ros2/bridge.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <ctime>

#include "waymark/lcm_streams.h"

namespace wm::ros2 {
namespace {

constexpr int64_t kSilent_ns = 3 * kSecond_ns;       // poses come 50 times a second, health once
constexpr dds_duration_t kWait_ns = DDS_MSECS(200);  // how soon the thread ends
constexpr size_t kBatch = 32;                        // messages of a topic that are taken at once
constexpr int kQueued = 1000;  // of LCM's, 20 s of poses: its own 30 are 0.6 s on a loaded computer

int64_t clock_ns(clockid_t clock) {
  timespec now{};
  (void)clock_gettime(clock, &now);
  return now.tv_sec * kSecond_ns + now.tv_nsec;
}

int64_t utc_offset_ns() { return clock_ns(CLOCK_REALTIME) - clock_ns(CLOCK_MONOTONIC); }

// A run at another speed than real time has no offset: its stamps are then as long ago as the pose was old when made.
int64_t utc_of(const wm_published &published) {
  if (published.utc_uncertainty_ns >= 0) return published.now.t_ns + published.utc_offset_ns;
  return clock_ns(CLOCK_REALTIME) - (published.made_ns - published.now.t_ns);
}

bool is_finite(const wm_published &published) {
  const wm_pose3 &at = published.now.pose_map_base;
  const wm_pose2 &odom = published.pose_odom_base;
  double sum = odom.x_m + odom.y_m + odom.heading_rad, norm = 0;
  for (const double p : at.p_m) sum += p;
  for (const double q : at.q_xyzw) norm += q * q;
  return std::isfinite(sum) && norm > 0.5 && norm < 2;
}

// LCM's channels are patterns: the prefix is taken as it is.
std::string pattern_of(const std::string &channel) {
  std::string out;
  for (const char c : channel)
    out += isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' ? std::string(1, c) : std::string("\\") + c;
  return out;
}

}  // namespace

Bridge::Bridge(const Wishes &wishes, Participant *participant, lcm_t *lcm)
    : wishes_(wishes), participant_(participant), lcm_(lcm), heard_ns_(clock_ns(CLOCK_MONOTONIC)) {
  const std::string space = wishes.name_space.empty() ? "" : "/" + wishes.name_space;
  pose_ = participant->writer(space + "/waymark/pose", geometry_msgs_msg_dds__PoseWithCovarianceStamped__desc,
                              Quality::kLatched);
  odometry_ = participant->writer(space + "/waymark/odom", nav_msgs_msg_dds__Odometry__desc, Quality::kStream);
  diagnostics_ = participant->writer("/diagnostics", diagnostic_msgs_msg_dds__DiagnosticArray__desc, Quality::kStream);
  if (wishes.tf != "none")
    tf_ = participant->writer(space + "/tf", tf2_msgs_msg_dds__TFMessage__desc, Quality::kStream);
  wm_can_gnss_init(&gnss_, wishes.origin);

  listen(wishes.initialpose, geometry_msgs_msg_dds__PoseWithCovarianceStamped__desc, Quality::kStream,
         &Bridge::take_initialpose);
  listen(wishes.odom, nav_msgs_msg_dds__Odometry__desc, Quality::kSensor, &Bridge::take_odometry);
  listen(wishes.imu, sensor_msgs_msg_dds__Imu__desc, Quality::kSensor, &Bridge::take_imu);
  listen(wishes.fix, sensor_msgs_msg_dds__NavSatFix__desc, Quality::kSensor, &Bridge::take_fix);
  listen(wishes.localizer, geometry_msgs_msg_dds__PoseWithCovarianceStamped__desc, Quality::kSensor,
         &Bridge::take_localizer);
  listen(wishes.visual_odom, nav_msgs_msg_dds__Odometry__desc, Quality::kSensor, &Bridge::take_visual_odometry);

  const auto on_message = [](const lcm_recv_buf_t *message, const char *channel, void *context) {
    auto *self = static_cast<Bridge *>(context);
    if (self->wishes_.prefix + "POSE" == channel) self->on_pose(message->data, message->data_size);
    if (self->wishes_.prefix + "POSE_BOUND" == channel) self->on_bound(message->data, message->data_size);
    if (self->wishes_.prefix + "HEALTH" == channel) self->on_health(message->data, message->data_size);
  };
  for (const char *channel : {"POSE", "POSE_BOUND", "HEALTH"}) {
    lcm_subscription_t *taken = lcm_subscribe(lcm_, pattern_of(wishes.prefix + channel).c_str(), on_message, this);
    if (taken != nullptr) (void)lcm_subscription_set_queue_capacity(taken, kQueued);
  }
  if (!inputs_.empty()) thread_ = std::thread([this] { take_inputs(); });
}

Bridge::~Bridge() {
  stop_ = true;
  if (thread_.joinable()) thread_.join();
}

void Bridge::report(const std::string &line) {
  const std::lock_guard<std::mutex> hold(lock_);
  if (reported_.insert(line).second) std::fprintf(stderr, "waymark ros2: %s\n", line.c_str());
}

// ── from the run ────────────────────────────────────────────────────────────────────────────────────────────────────

void Bridge::send(dds_entity_t writer, const void *message) {
  const dds_return_t result = dds_write(writer, message);
  if (result == DDS_RETCODE_OK) return;
  counts_.not_sent++;
  report(std::string("DDS: a message was not sent: ") + dds_strretcode(result));
}

void Bridge::on_pose(const void *bytes, size_t length) {
  const char *why = wm_lcm_read_pose(bytes, length, &published_);
  if (why == nullptr && !is_finite(published_)) why = "is not finite";
  if (why != nullptr) {
    counts_.not_understood++;
    report(wishes_.prefix + "POSE: " + why);
    return;
  }
  counts_.poses++;
  heard_ns_ = clock_ns(CLOCK_MONOTONIC);
  const int64_t utc_ns = utc_of(published_);
  send_transforms(published_, utc_ns);
  const Odometry odometry = odometry_message(published_, utc_ns, wishes_.frames);
  send(odometry_, &odometry);
  if (published_.now.state == WM_STATE_SEARCHING) return;  // there is no pose yet
  const PoseStamped pose = pose_message(published_, utc_ns, wishes_.frames);
  send(pose_, &pose);
}

// map -> odom takes the corrections (REP 105). With the robot's own odometry both are at its newest stamp.
void Bridge::send_transforms(const wm_published &published, int64_t utc_ns) {
  if (wishes_.tf == "none") return;
  const bool is_robot_s = wishes_.tf == "robot", is_known = published.now.state != WM_STATE_SEARCHING;
  Eigen::Isometry3d in_map = base_in_map(published), in_odom = base_in_odom(published);
  int64_t t_ns = utc_ns;
  if (is_robot_s) {
    const std::lock_guard<std::mutex> hold(lock_);
    in_map_.add(utc_ns, in_map);
    t_ns = std::min(utc_ns, in_robot_odom_.newest_ns().value_or(0));
    const auto map = in_map_.at(t_ns), odom = in_robot_odom_.at(t_ns);
    if (!map || !odom || t_ns == sent_map_odom_ns_) return;
    in_map = *map;
    in_odom = *odom;
  }
  sent_map_odom_ns_ = t_ns;
  std::array<TransformStamped, 2> transforms{};
  uint32_t count = 0;
  const Frames &f = wishes_.frames;
  if (is_known) transforms[count++] = transform_message(f.map, f.odom, odom_in_map(in_map, in_odom), t_ns);
  if (!is_robot_s) transforms[count++] = transform_message(f.odom, f.base, in_odom, t_ns);
  if (count == 0) return;
  const TransformMessage message{{count, count, transforms.data(), false}};
  send(tf_, &message);
}

void Bridge::on_bound(const void *bytes, size_t length) {
  wm_bound bound;
  if (const char *why = wm_lcm_read_bound(bytes, length, &bound)) {
    counts_.not_understood++;
    report(wishes_.prefix + "POSE_BOUND: " + why);
    return;
  }
  texts_.take(bound);
}

void Bridge::on_health(const void *bytes, size_t length) {
  if (const char *why = wm_lcm_read_health(bytes, length, &health_)) {
    counts_.not_understood++;
    report(wishes_.prefix + "HEALTH: " + why);
    return;
  }
  const DiagnosticArray message = texts_.message(health_, "", clock_ns(CLOCK_REALTIME));
  send(diagnostics_, &message);
}

void Bridge::look() {
  const int64_t now_ns = clock_ns(CLOCK_MONOTONIC);
  if (now_ns - heard_ns_ < kSilent_ns || now_ns - looked_ns_ < kSecond_ns) return;
  looked_ns_ = now_ns;
  report("no poses come on " + wishes_.prefix +
         "POSE: is `waymark run` running, with this publish.channel_prefix and publish.lcm_url?");
  const DiagnosticArray message = texts_.message(
      {}, "no poses for " + std::to_string((now_ns - heard_ns_) / kSecond_ns) + " s", clock_ns(CLOCK_REALTIME));
  send(diagnostics_, &message);
}

// ── to the run ──────────────────────────────────────────────────────────────────────────────────────────────────────

template <typename Message>
void Bridge::listen(const std::string &topic, const dds_topic_descriptor_t &type, Quality quality,
                    Fault (Bridge::*take)(const Message &)) {
  if (topic.empty()) return;
  const std::string name = wishes_.name_space.empty() ? topic : "/" + wishes_.name_space + topic;
  inputs_.push_back({name, participant_->reader(name, type, quality), [this, take](const void *message) {
                       return (this->*take)(*static_cast<const Message *>(message));
                     }});
}

void Bridge::take_inputs() {
  const dds_entity_t waits = dds_create_waitset(DDS_CYCLONEDDS_HANDLE);
  for (const Input &input : inputs_) {
    (void)dds_set_status_mask(input.reader, DDS_DATA_AVAILABLE_STATUS);
    (void)dds_waitset_attach(waits, input.reader, 0);
  }
  while (!stop_) {
    (void)dds_waitset_wait(waits, nullptr, 0, kWait_ns);
    for (const Input &input : inputs_) take_messages(input);
  }
  (void)dds_delete(waits);
}

void Bridge::take_messages(const Input &input) {
  std::array<void *, kBatch> messages{};
  std::array<dds_sample_info_t, kBatch> infos{};
  for (;;) {
    const int count = dds_take(input.reader, messages.data(), infos.data(), kBatch, kBatch);
    if (count <= 0) return;
    for (int i = 0; i < count; i++) {
      if (!infos[i].valid_data) continue;
      const Fault fault = input.take(messages[i]);
      (fault ? counts_.refused : counts_.taken)++;
      if (fault && !fault->empty()) report(input.topic + ": " + *fault);
    }
    (void)dds_return_loan(input.reader, messages.data(), count);
  }
}

Fault Bridge::publish(const std::string &channel, size_t bytes) {
  if (bytes == 0 || lcm_publish(lcm_, (wishes_.prefix + channel).c_str(), bytes_, static_cast<unsigned>(bytes)) != 0)
    return "LCM: a message was not sent on " + wishes_.prefix + channel;
  return std::nullopt;
}

Fault Bridge::send_row(const char *stream, const char *channel, const Time &stamp, wm_stream_row *row) {
  row->t_ns = monotonic_stamp(stamp, utc_offset_ns());
  if (row->t_ns == 0) return "its messages have no stamp";
  return publish(channel, wm_lcm_row(stream, row, bytes_, sizeof bytes_));
}

Fault Bridge::take_initialpose(const PoseStamped &message) {
  wm_set_pose pose{};
  if (Fault fault = set_pose_of(message, wishes_.frames.map, &pose)) return fault;
  int64_t t_ns = 0;
  if (Fault fault = given_now(monotonic_stamp(message.header.stamp, utc_offset_ns()), clock_ns(CLOCK_MONOTONIC), &t_ns))
    return fault;
  return publish("SET_POSE", wm_lcm_set_pose(&pose, t_ns, bytes_, sizeof bytes_));
}

Fault Bridge::take_odometry(const Odometry &message) {
  wm_stream_row row{};
  Eigen::Isometry3d in_odom;
  if (!pose_of(message, &in_odom)) {
    const std::lock_guard<std::mutex> hold(lock_);
    in_robot_odom_.add(from_time(message.header.stamp), in_odom);
  }
  if (Fault fault = motion_of(message, &row)) return fault;
  return send_row("motion", "MOTION", message.header.stamp, &row);
}

Fault Bridge::take_imu(const Imu &message) {
  wm_stream_row row{};
  if (Fault fault = imu_of(message, &row)) return fault;
  return send_row("imu", "IMU", message.header.stamp, &row);
}

Fault Bridge::take_fix(const Fix &message) {
  wm_stream_row row{};
  if (Fault fault = position_of(message, &gnss_, &row)) return fault;
  return send_row("gnss", "GNSS", message.header.stamp, &row);
}

Fault Bridge::send_localized(const Time &stamp, const RosPoseCovariance &pose) {
  wm_stream_row row{};
  if (Fault fault = localized_of(pose, &row)) return fault;
  return send_row("localizer", "LOCALIZER", stamp, &row);
}

Fault Bridge::take_localizer(const PoseStamped &message) { return send_localized(message.header.stamp, message.pose); }

// A camera's pose is not the robot's.
Fault Bridge::take_visual_odometry(const Odometry &message) {
  const std::string child = message.child_frame_id;
  if (child != wishes_.frames.base && child != "/" + wishes_.frames.base)
    return "its child_frame_id is '" + child + "', not '" + wishes_.frames.base +
           "' (--base-frame): the poses are not the robot's";
  return send_localized(message.header.stamp, message.pose);
}

}  // namespace wm::ros2
