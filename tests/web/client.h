// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/time.h>

#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

#include "base/unique_fd.h"

namespace twocone::web {

/// What Server::address() names: http://127.0.0.1:8080/?token=00ff
struct Address {
  std::string ip;
  std::uint16_t port = 0;
  std::string host;  ///< 127.0.0.1:8080
  std::string token;
};

/// @throws std::invalid_argument if it is not such an address
inline Address parse_served(const std::string& url) {
  const std::string start = "http://";
  const std::string mark = "/?token=";
  const std::size_t slash = url.find(mark);
  const std::size_t colon = url.rfind(':', slash);
  if (!url.starts_with(start) || slash == std::string::npos || colon < start.size()) {
    throw std::invalid_argument(url + ": not an address such as http://127.0.0.1:8080/?token=...");
  }
  Address result;
  result.host = url.substr(start.size(), slash - start.size());
  result.ip = url.substr(start.size(), colon - start.size());
  if (result.ip.front() == '[') result.ip = result.ip.substr(1, result.ip.size() - 2);
  result.port = std::uint16_t(std::atoi(url.c_str() + colon + 1));
  result.token = url.substr(slash + mark.size());
  return result;
}

struct Reply {
  int status = 0;
  std::string head;  ///< status line and headers, as they came
  std::string body;
};

/// A frame of a WebSocket from a server: RFC 6455, section 5.2.
struct Frame {
  int opcode = 0;
  std::string payload;
};
constexpr int kText = 1;
constexpr int kBinary = 2;
constexpr int kClose = 8;
constexpr int kPing = 9;
constexpr int kPong = 10;

/// Returns a frame as a browser sends it, masked with a constant key. @param first_byte FIN, reserved bits and opcode
inline std::string browser_frame(int first_byte, std::string_view payload) {
  constexpr std::string_view kMask = "\x37\xfa\x21\x3d";
  std::string result(1, char(first_byte));
  if (payload.size() < 126) {
    result += char(0x80 | int(payload.size()));
  } else {
    result += char(0x80 | 126);
    result += char(payload.size() >> 8U);
    result += char(payload.size() & 0xFFU);
  }
  result += kMask;
  for (std::size_t i = 0; i < payload.size(); ++i) result += char(payload[i] ^ kMask[i % 4]);
  return result;
}
inline std::string browser_text(std::string_view text) { return browser_frame(0x80 | kText, text); }

/// A client of plain sockets, which can send what no library would. A wait that takes too long returns nothing.
class RawClient {
 public:
  static constexpr std::chrono::milliseconds kPatience{10'000};

  /// @param receive_buffer bytes that the kernel takes unread; 0: its own choice
  explicit RawClient(const Address& address, int receive_buffer = 0) : RawClient(unconnected(address)) {
    if (receive_buffer > 0) {
      ::setsockopt(socket_.get(), SOL_SOCKET, SO_RCVBUF, &receive_buffer, sizeof receive_buffer);
    }
    connect(address);
  }

  /// Returns a client that has its descriptor only.
  static RawClient unconnected(const Address& address) {
    const int family = address.ip.find(':') == std::string::npos ? AF_INET : AF_INET6;
    return RawClient(base::UniqueFd(::socket(family, SOCK_STREAM | SOCK_CLOEXEC, 0)));
  }
  /// @throws std::runtime_error
  void connect(const Address& address) {
    sockaddr_in v4{};
    sockaddr_in6 v6{};
    v4.sin_family = AF_INET;
    v6.sin6_family = AF_INET6;
    v4.sin_port = v6.sin6_port = htons(address.port);
    const bool is_v4 = ::inet_pton(AF_INET, address.ip.c_str(), &v4.sin_addr) == 1;
    if (!is_v4) ::inet_pton(AF_INET6, address.ip.c_str(), &v6.sin6_addr);
    const timeval patience{10, 0};
    ::setsockopt(socket_.get(), SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience);
    const int status = is_v4 ? ::connect(socket_.get(), reinterpret_cast<const sockaddr*>(&v4), sizeof v4)
                             : ::connect(socket_.get(), reinterpret_cast<const sockaddr*>(&v6), sizeof v6);
    if (status != 0) throw std::runtime_error("no connection to " + address.host);
  }

  /// Returns whether all bytes were taken by the kernel.
  bool send(std::string_view bytes) {
    while (!bytes.empty()) {
      const ssize_t sent = ::send(socket_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
      if (sent <= 0) return false;
      bytes.remove_prefix(std::size_t(sent));
    }
    return true;
  }
  void end_sending() { ::shutdown(socket_.get(), SHUT_WR); }
  /// Closes by a reset, as a program that is killed with unread bytes.
  void reset() {
    const linger now{1, 0};
    ::setsockopt(socket_.get(), SOL_SOCKET, SO_LINGER, &now, sizeof now);
    socket_.reset();
  }

  /// Returns the next answer of HTTP, or nothing if there is none. @param has_body false after HEAD
  std::optional<Reply> reply(bool has_body = true, std::chrono::milliseconds patience = kPatience) {
    const auto deadline = std::chrono::steady_clock::now() + patience;
    std::size_t end = std::string::npos;
    while ((end = received_.find("\r\n\r\n")) == std::string::npos) {
      if (!receive(deadline)) return std::nullopt;
    }
    Reply result;
    result.head = received_.substr(0, end + 4);
    received_.erase(0, end + 4);
    if (result.head.starts_with("HTTP/1.1 ")) result.status = std::atoi(result.head.c_str() + 9);
    const std::size_t length = result.head.find("Content-Length: ");
    if (length == std::string::npos || !has_body) return result;
    auto body = take(std::size_t(std::atoll(result.head.c_str() + length + 16)), deadline);
    if (!body) return std::nullopt;
    result.body = std::move(*body);
    return result;
  }

  /// Returns the next frame of a WebSocket.
  std::optional<Frame> frame(std::chrono::milliseconds patience = kPatience) {
    const auto deadline = std::chrono::steady_clock::now() + patience;
    const auto head = take(2, deadline);
    if (!head) return std::nullopt;
    std::uint64_t length = static_cast<unsigned char>((*head)[1]);
    if (length >= 126) {
      const auto bytes = take(length == 126 ? 2 : 8, deadline);
      if (!bytes) return std::nullopt;
      length = 0;
      for (const char byte : *bytes) length = length << 8U | static_cast<unsigned char>(byte);
    }
    auto payload = take(std::size_t(length), deadline);
    if (!payload) return std::nullopt;
    return Frame{(*head)[0] & 0x0F, std::move(*payload)};
  }

  /// Returns all that the server sends until it ends the connection, or nothing if it does not in time.
  std::optional<std::string> rest(std::chrono::milliseconds patience = kPatience) {
    const auto deadline = std::chrono::steady_clock::now() + patience;
    while (receive(deadline)) {
    }
    if (!has_ended_) return std::nullopt;
    return std::exchange(received_, {});
  }

  /// Returns whether the server ends the connection in time. Discards what it sends before.
  bool is_ended(std::chrono::milliseconds patience = kPatience) { return rest(patience).has_value(); }

 private:
  explicit RawClient(base::UniqueFd socket) : socket_(std::move(socket)) {}

  /// Receives some bytes. Returns false at the end, and at the deadline.
  bool receive(std::chrono::steady_clock::time_point deadline) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now()).count();
    pollfd entry{socket_.get(), POLLIN, 0};
    if (left < 0 || ::poll(&entry, 1, int(left)) <= 0) return false;
    char bytes[65'536];
    const ssize_t size = ::recv(socket_.get(), bytes, sizeof bytes, 0);
    has_ended_ = size <= 0;
    if (size > 0) received_.append(bytes, std::size_t(size));
    return size > 0;
  }
  std::optional<std::string> take(std::size_t size, std::chrono::steady_clock::time_point deadline) {
    while (received_.size() < size) {
      if (!receive(deadline)) return std::nullopt;
    }
    std::string result = received_.substr(0, size);
    received_.erase(0, size);
    return result;
  }

  base::UniqueFd socket_;
  std::string received_;
  bool has_ended_ = false;
};

/// Returns a request with the right Host. @param headers more of them, each with its line end
inline std::string request(const Address& address, const std::string& target, const std::string& headers = "",
                           const std::string& method = "GET") {
  return method + " " + target + " HTTP/1.1\r\nHost: " + address.host + "\r\n" + headers + "\r\n";
}

/// Returns the headers that a WebSocket needs: the example of RFC 6455, section 1.3.
inline std::string upgrade_headers() {
  return "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
         "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n";
}

}  // namespace twocone::web
