// SPDX-License-Identifier: Apache-2.0
// A participant of Fast DDS, for the judge of waymark-ros2: messages go through as bytes, which the judge reads and
// makes.
//   fastdds_probe listen DOMAIN OUT URL CHANNEL TOPIC TYPE QUALITY [TOPIC TYPE QUALITY ...]
//     until its standard input ends; OUT: records of arrival (monotonic, ns), index (0: LCM's channel), length, bytes
//   fastdds_probe send DOMAIN TOPIC TYPE RATE_HZ
//     standard input: records of length and bytes; sent once a reader is there
#include <lcm/lcm.h>
#include <poll.h>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace fast = eprosima::fastdds::dds;
using Payload = eprosima::fastrtps::rtps::SerializedPayload_t;
using Bytes = std::vector<unsigned char>;

namespace {

constexpr uint32_t kMessageMax = 1 << 18;
constexpr size_t kEncapsulation = 4;

// A type by its name alone, as rosbag2 records one.
class AnyType : public fast::TopicDataType {
 public:
  explicit AnyType(const std::string &name) {
    setName(name.c_str());
    m_typeSize = kMessageMax;
    auto_fill_type_object(false);
    auto_fill_type_information(false);
  }
  bool serialize(void *data, Payload *payload) override {
    const Bytes &bytes = *static_cast<Bytes *>(data);
    payload->encapsulation = bytes[1] == 1 ? CDR_LE : CDR_BE;
    payload->length = static_cast<uint32_t>(bytes.size());
    memcpy(payload->data, bytes.data(), bytes.size());
    return true;
  }
  bool deserialize(Payload *payload, void *data) override {
    static_cast<Bytes *>(data)->assign(payload->data, payload->data + payload->length);
    return true;
  }
  std::function<uint32_t()> getSerializedSizeProvider(void *data) override {
    return [data] { return static_cast<uint32_t>(static_cast<Bytes *>(data)->size() + kEncapsulation); };
  }
  void *createData() override { return new Bytes; }
  void deleteData(void *data) override { delete static_cast<Bytes *>(data); }
  bool getKey(void *, eprosima::fastrtps::rtps::InstanceHandle_t *, bool) override { return false; }
};

struct Records {
  FILE *out;
  std::mutex lock;
  void add(uint32_t index, const unsigned char *bytes, size_t length) {
    const int64_t now_ns = std::chrono::steady_clock::now().time_since_epoch().count();
    const auto count = static_cast<uint32_t>(length);
    const std::lock_guard<std::mutex> hold(lock);
    fwrite(&now_ns, sizeof now_ns, 1, out);
    fwrite(&index, sizeof index, 1, out);
    fwrite(&count, sizeof count, 1, out);
    fwrite(bytes, 1, length, out);
  }
};

class Listener : public fast::DataReaderListener {
 public:
  Listener(Records *records, uint32_t index) : records_(records), index_(index) {}
  void on_data_available(fast::DataReader *reader) override {
    Bytes bytes;
    fast::SampleInfo info;
    while (reader->take_next_sample(&bytes, &info) == ReturnCode_t::RETCODE_OK)
      if (info.valid_data) records_->add(index_, bytes.data(), bytes.size());
  }

 private:
  Records *records_;
  uint32_t index_;
};

fast::Topic *topic_of(fast::DomainParticipant *participant, const char *name, const char *type_name) {
  fast::TypeSupport type(new AnyType(type_name));
  if (type.register_type(participant) != ReturnCode_t::RETCODE_OK) exit(1);
  return participant->create_topic(std::string("rt") + name, type_name, fast::TOPIC_QOS_DEFAULT);
}

int listen(fast::DomainParticipant *participant, int argc, char **argv) {
  Records records{fopen(argv[0], "wb"), {}};
  lcm_t *lcm = lcm_create(argv[1]);
  if (records.out == nullptr || lcm == nullptr) return 1;
  lcm_subscription_t *poses = lcm_subscribe(
      lcm, argv[2],
      [](const lcm_recv_buf_t *message, const char *, void *context) {
        static_cast<Records *>(context)->add(0, static_cast<unsigned char *>(message->data), message->data_size);
      },
      &records);
  lcm_subscription_set_queue_capacity(poses, 10000);  // a judge loses none
  fast::Subscriber *subscriber = participant->create_subscriber(fast::SUBSCRIBER_QOS_DEFAULT);
  uint32_t index = 1;
  for (int i = 3; i + 2 < argc; i += 3) {
    fast::DataReaderQos qos = fast::DATAREADER_QOS_DEFAULT;
    const std::string quality = argv[i + 2];
    qos.reliability().kind = quality == "sensor" ? fast::BEST_EFFORT_RELIABILITY_QOS : fast::RELIABLE_RELIABILITY_QOS;
    qos.durability().kind = quality == "latched" ? fast::TRANSIENT_LOCAL_DURABILITY_QOS : fast::VOLATILE_DURABILITY_QOS;
    qos.history().kind = fast::KEEP_LAST_HISTORY_QOS;
    qos.history().depth = 100;
    qos.endpoint().history_memory_policy = eprosima::fastrtps::rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    if (subscriber->create_datareader(topic_of(participant, argv[i], argv[i + 1]), qos,
                                      new Listener(&records, index++)) == nullptr)
      return 1;
  }
  puts("ready");
  fflush(stdout);
  for (pollfd in{0, POLLIN, 0}; poll(&in, 1, 0) == 0;)
    if (lcm_handle_timeout(lcm, 50) < 0) return 1;
  const std::lock_guard<std::mutex> hold(records.lock);
  fflush(records.out);
  _Exit(0);  // its own threads may still call the listeners
}

int send(fast::DomainParticipant *participant, char **argv) {
  fast::DataWriterQos qos = fast::DATAWRITER_QOS_DEFAULT;
  qos.reliability().kind = fast::RELIABLE_RELIABILITY_QOS;
  qos.history().kind = fast::KEEP_LAST_HISTORY_QOS;
  qos.history().depth = 10;
  qos.endpoint().history_memory_policy = eprosima::fastrtps::rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
  fast::DataWriter *writer = participant->create_publisher(fast::PUBLISHER_QOS_DEFAULT)
                                 ->create_datawriter(topic_of(participant, argv[0], argv[1]), qos);
  if (writer == nullptr) return 1;
  fast::PublicationMatchedStatus matched;
  for (int i = 0; i < 500; i++) {
    writer->get_publication_matched_status(matched);
    if (matched.current_count > 0) break;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  if (matched.current_count == 0) return fputs("no reader came\n", stderr), 1;
  puts("matched");
  fflush(stdout);
  const auto period = std::chrono::nanoseconds(static_cast<int64_t>(1e9 / atof(argv[2])));
  uint32_t length;
  while (fread(&length, sizeof length, 1, stdin) == 1) {
    Bytes bytes(length);
    if (length > kMessageMax || fread(bytes.data(), 1, length, stdin) != length || !writer->write(&bytes)) return 1;
    std::this_thread::sleep_for(period);
  }
  writer->wait_for_acknowledgments(eprosima::fastrtps::Duration_t(2, 0));
  _Exit(0);
}

}  // namespace

int main(int argc, char **argv) {
  if (argc < 6) return 2;
  fast::DomainParticipant *participant = fast::DomainParticipantFactory::get_instance()->create_participant(
      static_cast<uint32_t>(atoi(argv[2])), fast::PARTICIPANT_QOS_DEFAULT);
  if (participant == nullptr) return 1;
  return strcmp(argv[1], "listen") == 0 ? listen(participant, argc - 3, argv + 3) : send(participant, argv + 3);
}
