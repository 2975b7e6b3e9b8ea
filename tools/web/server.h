// SPDX-License-Identifier: Apache-2.0
// Answers to requests of browsers, by libmicrohttpd: one thread, no request waits for another. Who sends slowly or does
// not read occupies one of kConnections, for kPatience at most; a request's head is limited to kHeadBytes. GET alone is
// answered, and POST where a body may have some bytes.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>

struct MHD_Daemon;

namespace wm::tools {

struct WebRequest {
  std::string path;
  std::map<std::string, std::string> query;
  bool is_post = false;
  std::string body, token;  // of a POST; the head X-Waymark-Token
  // A whole number of the query; `absent` where it is missing, no number, or too large.
  [[nodiscard]] int64_t number(const std::string &key, int64_t absent) const;
};

struct WebAnswer {
  int status = 200;
  std::string type = "text/plain; charset=utf-8";
  std::shared_ptr<const std::string> body = std::make_shared<const std::string>();
};

struct ListenAt {
  std::string address = "127.0.0.1";  // numeric, IPv4 or IPv6
  uint16_t port = 8080;               // 0: any free one
};

// "8080", "0.0.0.0:8080", "[::]:8080"; an address alone keeps the port. Throws Failure.
ListenAt listen_at(const std::string &text);
// Whether the head `Host:` names this computer: where a page of another site was made to point here, it does not.
bool is_own_host(const std::string &host);

class WebServer {
 public:
  static constexpr unsigned kConnections = 64, kHeadBytes = 8192;
  static constexpr std::chrono::seconds kPatience{20};  // for a request with its answer: a map over a slow radio link

  using Handler = std::function<WebAnswer(const WebRequest &)>;
  // `handler` is called by the server's thread. `body_max`: bytes of a POST's body; 0: GET alone. Throws Failure where
  // it cannot listen there.
  WebServer(const ListenAt &at, Handler handler, std::chrono::milliseconds patience = kPatience, size_t body_max = 0);
  ~WebServer();
  WebServer(const WebServer &) = delete;
  WebServer &operator=(const WebServer &) = delete;

  [[nodiscard]] uint16_t port() const { return port_; }
  // Ends connections whose request is older than the patience. Called about once a second, by any thread.
  void end_slow_clients();

 private:
  struct Glue;  // libmicrohttpd's callbacks
  struct Client {
    int socket;
    std::chrono::steady_clock::time_point since;
  };

  Handler handler_;
  std::chrono::milliseconds patience_;
  size_t body_max_;
  bool is_local_ = false;  // listens on the loopback alone
  uint16_t port_ = 0;
  MHD_Daemon *daemon_ = nullptr;
  std::mutex lock_;  // of clients_
  std::map<const void *, Client> clients_;
};

}  // namespace wm::tools
