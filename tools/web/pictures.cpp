// SPDX-License-Identifier: Apache-2.0
#include "web/pictures.h"

#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <nlohmann/json.hpp>

namespace wm::tools {
namespace {

constexpr int kWait_ms = 200;  // time until the end of the last viewer is noticed
constexpr std::chrono::seconds kTryAgain{1};
constexpr std::chrono::milliseconds kPoseComes{1000};  // how long a picture waits for the pose of its stamp

struct Socket {
  int fd = -1;
  ~Socket() {
    if (fd >= 0) (void)close(fd);
  }
};

// -1 and the reason in *why where there is no run.
int connect_to(const std::string &path, std::string *why) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof address.sun_path) {
    *why = path + ": the path is too long for a socket";
    return -1;
  }
  std::memcpy(address.sun_path, path.c_str(), path.size());
  const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (fd >= 0 && connect(fd, reinterpret_cast<sockaddr *>(&address), sizeof address) == 0) return fd;
  *why = path + ": " + std::strerror(errno) + " (is the run up, and may this user read it?)";
  if (fd >= 0) (void)close(fd);
  return -1;
}

// True when all of it came; false at the end, an error, or where `goes_on` is false.
template <typename GoesOn>
bool read_all(int fd, void *out, size_t bytes, const GoesOn &goes_on) {
  auto *at = static_cast<uint8_t *>(out);
  while (bytes > 0) {
    pollfd ready{fd, POLLIN, 0};
    if (!goes_on()) return false;
    if (poll(&ready, 1, kWait_ms) <= 0) continue;
    const ssize_t got = read(fd, at, bytes);
    if (got <= 0) return false;
    at += got;
    bytes -= static_cast<size_t>(got);
  }
  return true;
}

}  // namespace

Pictures::Pictures(const WebSite &site, std::function<Around(int64_t)> around)
    : site_(site), around_(std::move(around)) {
  if (site.raster() != nullptr && site.raster()->edges != nullptr) edges_ = std::make_unique<MapEdges>(*site.raster());
  if (!site.picture_socket.empty()) thread_ = std::thread(&Pictures::work, this);
}

Pictures::~Pictures() {
  {
    const std::lock_guard<std::mutex> hold(lock_);
    stop_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

bool Pictures::somebody_looks() {
  const std::lock_guard<std::mutex> hold(lock_);
  return !stop_ && std::chrono::steady_clock::now() - looked_ < kStay;
}

std::shared_ptr<const std::string> Pictures::newest(int64_t source, int64_t has_number) {
  const auto text = [](const std::string &why) {
    return std::make_shared<const std::string>(
        nlohmann::json({{"why", why}}).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
  };
  if (site_.picture_socket.empty())
    return text("no live picture: the configuration has no publish.picture_socket, or none was given here");
  const std::lock_guard<std::mutex> hold(lock_);
  looked_ = std::chrono::steady_clock::now();
  const auto wanted = static_cast<uint32_t>(source < 0 || source > 1000 ? 0 : source);
  if (wanted != source_) newest_ = nullptr;
  source_ = wanted;
  changed_.notify_all();
  if (!why_not_.empty()) return text(why_not_);
  return number_ > has_number ? newest_ : nullptr;
}

void Pictures::take_from_run(int fd) {
  const auto looks = [this] { return somebody_looks(); };
  while (looks()) {
    wm_picture_request request{WM_PICTURE_MAGIC, 0, 0};
    {
      const std::lock_guard<std::mutex> hold(lock_);
      request.source = source_;
    }
    if (send(fd, &request, sizeof request, MSG_NOSIGNAL) != sizeof request) return;
    wm_picture_head head;
    if (!read_all(fd, &head, sizeof head, looks)) return;
    const size_t bytes = wm_picture_body_bytes(&head);
    if (bytes == SIZE_MAX) return;
    std::vector<uint8_t> body(bytes);
    if (!read_all(fd, body.data(), bytes, looks)) return;
    const auto looked = read_picture(head, body);
    if (!looked) return;
    // A recording's pictures are looked at before they are due.
    Around around = around_(head.t_ns);
    const auto until = std::chrono::steady_clock::now() + kPoseComes;
    while (!around.pose && looks() && std::chrono::steady_clock::now() < until) {
      std::this_thread::sleep_for(kPoseComes / 20);
      around = around_(head.t_ns);
    }
    encoded_++;
    auto made =
        std::make_shared<const std::string>(picture_json(*looked, site_, edges_.get(), around, encoded_.load()));
    const std::lock_guard<std::mutex> hold(lock_);
    newest_ = std::move(made);
    number_ = encoded_.load();
  }
}

void Pictures::work() {
  for (;;) {
    {
      std::unique_lock<std::mutex> hold(lock_);
      changed_.wait(hold, [this] { return stop_ || std::chrono::steady_clock::now() - looked_ < kStay; });
      if (stop_) return;
    }
    std::string why;
    Socket run;
    run.fd = connect_to(site_.picture_socket, &why);
    {
      const std::lock_guard<std::mutex> hold(lock_);
      why_not_ = why;
    }
    if (run.fd >= 0) take_from_run(run.fd);
    std::unique_lock<std::mutex> hold(lock_);
    if (run.fd < 0) changed_.wait_for(hold, kTryAgain, [this] { return stop_; });
  }
}

}  // namespace wm::tools
