// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hal/result.h"

/// HTTP and WebSocket for browsers on this machine.
namespace twocone::web {

/// A message to a browser.
struct Message {
  std::string bytes;
  bool is_binary = false;  ///< false: text, UTF-8
};

/// The answer to a GET request.
struct Answer {
  std::string type;  ///< its media type: image/png
  std::string bytes;
};

/// Arguments of a request: /image?run=0&frame=12 -> {run: 0, frame: 12}. Without the token; printable ASCII.
using Query = std::map<std::string, std::string, std::less<>>;

/// Number of a browser's connection, unique within a server.
using Client = std::uint64_t;

/// What a server shows. All calls come from the server's thread, one after the other, so none may take long. An
/// exception of any of them is logged, and ends the connection that it was for.
class Site {
 public:
  virtual ~Site() = default;
  /// Returns the first messages to a browser that has opened the stream. Server::watchers() counts it already.
  virtual std::vector<Message> opened(Client /*client*/) { return {}; }
  /// Returns the first messages to a program that has opened the stream for programs.
  virtual std::vector<Message> program_opened(Client /*client*/) { return {}; }
  /// Receives a text message of a browser or a program, of at most kMostReceived bytes of UTF-8. It is not checked in
  /// any other way.
  virtual void received(Client /*client*/, std::string_view /*text*/) {}
  /// Called exactly once for each call of opened() and program_opened(), when the connection has ended for whatever
  /// reason; for connections that are open at the end of the server, during its destructor. Server::watchers() does not
  /// count it any more.
  virtual void closed(Client /*client*/) {}
  /// Answers a GET request other than for the page itself and the stream. Returns nothing for a path that does not
  /// exist: status 404.
  /// @param path begins with '/', decoded, without the query; printable ASCII without parts "." and ".."
  virtual std::optional<Answer> get(std::string_view /*path*/, const Query& /*query*/) { return std::nullopt; }
};

/// After which a connection is closed.
struct Timeouts {
  std::chrono::milliseconds request{10'000};     ///< from the connection, or a request's first byte, to its last byte
  std::chrono::milliseconds answer{10'000};      ///< until an answer is sent
  std::chrono::milliseconds idle{30'000};        ///< from an answer to the next request
  std::chrono::milliseconds dead_after{20'000};  ///< until a browser takes a message of the stream, or answers a ping
};

/// A stream for programs that are no browsers, which is at a path of its own.
struct ProgramStream {
  std::string path;                    ///< "/foxglove"; empty: there is none
  std::vector<std::string> protocols;  ///< subprotocols of WebSocket; a program must offer one of them
};

struct ServerSettings {
  std::string address = "127.0.0.1";  ///< numeric, of the interface on which the server listens; 0.0.0.0 or ::, of all
  std::uint16_t port = 0;             ///< 0: any that is free
  std::string page;                   ///< the document at /
  ProgramStream programs;
  Timeouts timeouts;
};

/// Serves a page, what it requests, and a stream of messages at /stream, by a thread of its own; and, where the
/// settings have one, a stream for programs.
///
/// Every request needs the token of address(): it is new for each server, of 128 random bits, so that neither other
/// users of the machine nor pages of other sites reach it. Requests whose Host is not the server's own address (DNS
/// rebinding), or whose Origin is another site, are refused with status 403. There is no TLS. A program that is not a
/// browser sends no Origin, and needs the token only. So does the stream for programs, whatever the Origin: such a
/// program may be a page of its maker's site. No request reads a file: a server has its page and its site.
///
/// Limits: kMostConnections connections, kMostReceived bytes in a message, kMostRequest bytes in a request,
/// kMostMessages_perS messages (and pings) a second from a browser, and Timeouts. What exceeds them is closed.
/// Connections that have not yet sent the token are at most half of all; for one more, the oldest of them is closed. So
/// those who do not know the token cannot keep out who does, since a browser sends it at once.
///
/// A stream never delays its sender. offer() keeps only the newest offer; each browser takes it when it has received
/// the one before, and the texts that were sent meanwhile. A browser that takes nothing for Timeouts::dead_after is
/// forgotten.
///
/// The thread has a lower priority than the thread that opened the server, and handles no signals.
class Server {
 public:
  static constexpr std::size_t kMostConnections = 64;
  static constexpr std::size_t kMostRequest = 8'192;
  static constexpr std::size_t kMostReceived = 1'024;
  static constexpr int kMostMessages_perS = 100;
  /// Messages of send() that wait for one browser; beyond them it is closed.
  static constexpr std::size_t kMostWaiting = 256;

  /// Begins to listen. Errors: kRefused (an address that is not numeric), kUnavailable (the port is in use, or another
  /// failure of the system); the message names address and port.
  /// @param site must outlive the server
  static Result<std::unique_ptr<Server>> open(const ServerSettings& settings, Site& site);
  /// Closes all connections and ends the thread, without waiting for any browser. Not from the server's thread.
  ~Server();

  /// Returns the address of the page with its token: http://127.0.0.1:8080/?token=... For a server that listens on all
  /// interfaces it is that of the loopback; other machines use their route to this one, by a numeric address.
  [[nodiscard]] std::string address() const;
  /// Returns the address of the stream for programs: ws://127.0.0.1:8080/foxglove?token=...
  [[nodiscard]] std::string program_address() const;

  /// Offers messages to all browsers in place of the offer before. Returns at once; any thread may call it. `make` is
  /// called in the server's thread, at most once, and only if a browser is ready for it: a browser that comes later
  /// gets the newest offer too. So what `make` refers to must live until the next offer, or the end of the server. If
  /// it throws, that is logged, and the offer is empty.
  /// @param make_for likewise for programs, once for each that is ready; may be empty
  void offer(std::function<std::vector<Message>()> make, std::function<std::vector<Message>(Client)> make_for = {});
  /// Sends a text to all browsers, after the texts that were sent before and ahead of offers that they have not begun
  /// to take. Returns at once; any thread may call it.
  void send(std::string text);
  /// Sends a text to one browser or program, likewise; during its opened(), after the first messages. Only from the
  /// server's thread, that is from a call of Site.
  void send(Client client, std::string text);
  /// Returns the number of browsers and programs that receive a stream. Any thread may call it.
  [[nodiscard]] std::size_t watchers() const;

 private:
  struct Impl;
  explicit Server(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace twocone::web
