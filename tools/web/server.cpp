// SPDX-License-Identifier: Apache-2.0
#include "web/server.h"

#include <arpa/inet.h>
#include <microhttpd.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <charconv>
#include <cstdarg>
#include <cstring>

#include "common/failure.h"

namespace wm::tools {
namespace {

// Everything comes from here; pictures are in the JSON. No other site may frame the page or read its answers.
constexpr const char *kPolicy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'; "
    "frame-ancestors 'none'; base-uri 'none'; form-action 'none'";

struct AnyAddress {
  sockaddr_storage storage{};
  socklen_t bytes = 0;
};

bool read_address(const std::string &text, uint16_t port, AnyAddress *out) {
  auto *four = reinterpret_cast<sockaddr_in *>(&out->storage);
  auto *six = reinterpret_cast<sockaddr_in6 *>(&out->storage);
  if (inet_pton(AF_INET, text.c_str(), &four->sin_addr) == 1) {
    four->sin_family = AF_INET;
    four->sin_port = htons(port);
    out->bytes = sizeof *four;
  } else if (inet_pton(AF_INET6, text.c_str(), &six->sin6_addr) == 1) {
    six->sin6_family = AF_INET6;
    six->sin6_port = htons(port);
    out->bytes = sizeof *six;
  }
  return out->bytes > 0;
}

bool is_loopback(const AnyAddress &address) {
  const auto *six = reinterpret_cast<const sockaddr_in6 *>(&address.storage);
  if (address.storage.ss_family == AF_INET6) return IN6_IS_ADDR_LOOPBACK(&six->sin6_addr);
  const auto *four = reinterpret_cast<const sockaddr_in *>(&address.storage);
  return ntohl(four->sin_addr.s_addr) >> 24 == 127;
}

// Paths are letters as they are: there is nothing to decode, and no way round.
size_t as_it_is(void *, MHD_Connection *, char *text) { return std::strlen(text); }

void no_log(void *, const char *, va_list) {}

using Body = std::shared_ptr<const std::string>;
void let_go(void *body) { delete static_cast<Body *>(body); }

MHD_Result send(MHD_Connection *connection, const WebAnswer &answer) {
  auto *kept = new Body(answer.body);  // as long as a client reads it
  MHD_Response *response = MHD_create_response_from_buffer_with_free_callback_cls(
      answer.body->size(), const_cast<char *>(answer.body->data()), let_go, kept);
  if (response == nullptr) {
    let_go(kept);
    return MHD_NO;
  }
  MHD_add_response_header(response, MHD_HTTP_HEADER_CONTENT_TYPE, answer.type.c_str());
  MHD_add_response_header(response, MHD_HTTP_HEADER_CACHE_CONTROL, "no-store");
  MHD_add_response_header(response, "Content-Security-Policy", kPolicy);
  MHD_add_response_header(response, "X-Content-Type-Options", "nosniff");
  MHD_add_response_header(response, "Referrer-Policy", "no-referrer");
  MHD_add_response_header(response, "Cross-Origin-Resource-Policy", "same-origin");
  const MHD_Result queued = MHD_queue_response(connection, static_cast<unsigned>(answer.status), response);
  MHD_destroy_response(response);
  return queued;
}

WebAnswer refusal(int status, const std::string &text) {
  return {status, "text/plain; charset=utf-8", std::make_shared<const std::string>(text + "\n")};
}

MHD_Result take_query(void *request, MHD_ValueKind, const char *key, const char *value) {
  static_cast<WebRequest *>(request)->query[key] = value != nullptr ? value : "";
  return MHD_YES;
}

}  // namespace

int64_t WebRequest::number(const std::string &key, int64_t absent) const {
  const auto at = query.find(key);
  if (at == query.end()) return absent;
  int64_t value = 0;
  const char *end = at->second.data() + at->second.size();
  const auto [stop, error] = std::from_chars(at->second.data(), end, value);
  return error == std::errc() && stop == end ? value : absent;
}

ListenAt listen_at(const std::string &text) {
  ListenAt out;
  std::string port = text;
  const size_t colon = text.rfind(':');
  const bool is_bare_six = colon != std::string::npos && text.find(':') != colon && text.front() != '[';
  if (is_bare_six || (colon == std::string::npos && text.find('.') != std::string::npos)) {
    out.address = text;
    port = std::to_string(out.port);
  } else if (colon != std::string::npos) {
    out.address = text.substr(0, colon);
    port = text.substr(colon + 1);
    if (out.address.size() > 2 && out.address.front() == '[' && out.address.back() == ']')
      out.address = out.address.substr(1, out.address.size() - 2);
  }
  const auto [stop, error] = std::from_chars(port.data(), port.data() + port.size(), out.port);
  AnyAddress made;
  if (error != std::errc() || stop != port.data() + port.size() || !read_address(out.address, out.port, &made))
    throw Failure(
        "--listen: '" + text + "' is not a PORT, ADDRESS or ADDRESS:PORT (127.0.0.1:8080 is this computer alone)",
        kUsage);
  return out;
}

bool is_own_host(const std::string &host) {
  std::string name = host;
  const size_t colon = name.rfind(':');
  if (colon != std::string::npos && name.back() != ']') name.resize(colon);
  return name == "localhost" || name == "127.0.0.1" || name == "[::1]";
}

struct WebServer::Glue {
  static MHD_Result answer(void *self_pointer, MHD_Connection *connection, const char *url, const char *method,
                           const char *, const char *upload, size_t *upload_bytes, void **context) {
    auto *self = static_cast<WebServer *>(self_pointer);
    const bool is_post = self->body_max_ > 0 && std::strcmp(method, MHD_HTTP_METHOD_POST) == 0;
    if (!is_post && std::strcmp(method, MHD_HTTP_METHOD_GET) != 0)
      return send(connection,
                  refusal(405, self->body_max_ > 0 ? "only GET and POST are answered" : "only GET is answered"));
    auto *request = static_cast<WebRequest *>(*context);
    if (request == nullptr) {  // the head is there; a body comes in pieces, if one may come
      *context = new WebRequest{url, {}, is_post, {}, {}};
      return MHD_YES;
    }
    if (*upload_bytes > 0) {
      if (!is_post || request->body.size() + *upload_bytes > self->body_max_) return MHD_NO;
      request->body.append(upload, *upload_bytes);
      *upload_bytes = 0;
      return MHD_YES;
    }
    const char *host = MHD_lookup_connection_value(connection, MHD_HEADER_KIND, MHD_HTTP_HEADER_HOST);
    if (self->is_local_ && (host == nullptr || !is_own_host(host)))
      return send(connection, refusal(403, "this page answers to its own computer's name alone"));
    const char *token = MHD_lookup_connection_value(connection, MHD_HEADER_KIND, "X-Waymark-Token");
    request->token = token != nullptr ? token : "";
    MHD_get_connection_values(connection, MHD_GET_ARGUMENT_KIND, take_query, request);
    try {
      return send(connection, self->handler_(*request));
    } catch (const std::exception &) {
      return send(connection, refusal(500, "this can't be answered"));
    }
  }

  static void connected(void *self_pointer, MHD_Connection *connection, void **, MHD_ConnectionNotificationCode what) {
    auto *self = static_cast<WebServer *>(self_pointer);
    const std::lock_guard<std::mutex> hold(self->lock_);
    if (what == MHD_CONNECTION_NOTIFY_CLOSED) {
      self->clients_.erase(connection);
      return;
    }
    const MHD_ConnectionInfo *info = MHD_get_connection_info(connection, MHD_CONNECTION_INFO_CONNECTION_FD);
    if (info != nullptr) self->clients_[connection] = {info->connect_fd, std::chrono::steady_clock::now()};
  }

  static void completed(void *self_pointer, MHD_Connection *connection, void **context, MHD_RequestTerminationCode) {
    delete static_cast<WebRequest *>(*context);
    *context = nullptr;
    auto *self = static_cast<WebServer *>(self_pointer);
    const std::lock_guard<std::mutex> hold(self->lock_);
    const auto at = self->clients_.find(connection);
    if (at != self->clients_.end()) at->second.since = std::chrono::steady_clock::now();
  }
};

WebServer::WebServer(const ListenAt &at, Handler handler, std::chrono::milliseconds patience, size_t body_max)
    : handler_(std::move(handler)), patience_(patience), body_max_(body_max) {
  AnyAddress address;
  if (!read_address(at.address, at.port, &address)) throw Failure("'" + at.address + "' is not an address", kUsage);
  is_local_ = is_loopback(address);
  const unsigned flags = MHD_USE_EPOLL_INTERNAL_THREAD | MHD_USE_ERROR_LOG |
                         (address.storage.ss_family == AF_INET6 ? static_cast<unsigned>(MHD_USE_IPv6) : 0U);
  daemon_ = MHD_start_daemon(flags, at.port, nullptr, nullptr, Glue::answer, this,  //
                             MHD_OPTION_UNESCAPE_CALLBACK, as_it_is, nullptr, MHD_OPTION_EXTERNAL_LOGGER, no_log,
                             nullptr,  // first: the others may log
                             MHD_OPTION_SOCK_ADDR, reinterpret_cast<sockaddr *>(&address.storage),  //
                             MHD_OPTION_LISTENING_ADDRESS_REUSE, 1U,                                //
                             MHD_OPTION_CONNECTION_LIMIT, kConnections,                             //
                             MHD_OPTION_CONNECTION_TIMEOUT, static_cast<unsigned>(kPatience.count()),
                             MHD_OPTION_CONNECTION_MEMORY_LIMIT, size_t{2} * kHeadBytes, MHD_OPTION_NOTIFY_CONNECTION,
                             Glue::connected, this,  //
                             MHD_OPTION_NOTIFY_COMPLETED, Glue::completed, this, MHD_OPTION_END);
  if (daemon_ == nullptr)
    throw Failure(at.address + ":" + std::to_string(at.port) + ": can't listen there: " + std::strerror(errno));
  const MHD_DaemonInfo *bound = MHD_get_daemon_info(daemon_, MHD_DAEMON_INFO_BIND_PORT);
  port_ = bound != nullptr ? bound->port : at.port;
}

WebServer::~WebServer() {
  if (daemon_ != nullptr) MHD_stop_daemon(daemon_);
}

void WebServer::end_slow_clients() {
  const auto now = std::chrono::steady_clock::now();
  const std::lock_guard<std::mutex> hold(lock_);
  for (const auto &[connection, client] : clients_)
    if (now - client.since > patience_) (void)shutdown(client.socket, SHUT_RDWR);  // libmicrohttpd closes it
}

}  // namespace wm::tools
