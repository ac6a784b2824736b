// SPDX-License-Identifier: Apache-2.0
#include "apps/web/server.h"

#include <fcntl.h>
#include <netinet/tcp.h>
#include <pthread.h>
#include <sys/random.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <deque>
#include <exception>
#include <limits>
#include <mutex>
#include <system_error>
#include <thread>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>

#include "apps/web/request.h"
#include "base/log.h"

namespace twocone::web {
namespace {

namespace asio = boost::asio;
namespace http = boost::beast::http;
namespace websocket = boost::beast::websocket;
using asio::ip::tcp;
using boost::system::error_code;
using Clock = std::chrono::steady_clock;
/// Messages that browsers share, sent one after the other.
using Batch = std::shared_ptr<const std::vector<Message>>;

constexpr base::Logger kLog{"web"};

/// How much nicer the server's thread is than that of the robot's loop.
constexpr int kNicer = 5;
/// Pause after a connection could not be accepted, for example since the process has no descriptors left.
constexpr std::chrono::milliseconds kAcceptPause{100};
/// Time for a client to read the answer that ends its connection, before a reset discards it.
constexpr std::chrono::milliseconds kLastRead{1'000};
/// Bytes of a stream that may wait in the kernel, unsent. What waits there gets old: the rest is sent as newer offers.
constexpr int kMostUnsent = 65'536;

std::string random_token() {
  std::array<unsigned char, 16> bytes{};
  if (::getrandom(bytes.data(), bytes.size(), 0) != ssize_t(bytes.size())) {
    throw std::system_error(errno, std::generic_category());
  }
  return fmt::format("{:02x}", fmt::join(bytes, ""));
}

Batch text_batch(std::string text) {
  return std::make_shared<const std::vector<Message>>(1, Message{std::move(text), false});
}

/// Calls a part of the site. Returns whether it threw nothing.
template <typename Part>
bool succeeds(const char* what, Part part) {
  try {
    part();
    return true;
  } catch (const std::exception& e) {
    kLog.error(fmt::format("{}: {}", what, e.what()));
  } catch (...) {
    kLog.error(fmt::format("{}: an unknown exception", what));
  }
  return false;
}

}  // namespace

/// The server behind the interface. Everything but the members for other threads belongs to the thread of run().
struct Server::Impl {
  class Connection;

  Impl(const ServerSettings& wanted, Site& shown) : settings(wanted), site(shown), token(random_token()) {}

  void start();
  void run();
  void accept();
  void admit(tcp::socket socket);
  /// Delivers what other threads have put into `texts` and `offered`.
  void deliver();
  /// Makes a call of deliver() follow. Requires `mutex`.
  void wake();
  void close_all();
  [[nodiscard]] std::string own_authority() const;
  /// Returns the newest offer, or nothing if it is the one of that number, which is then brought up to date.
  Batch newest_after(std::uint64_t& number);
  /// Likewise for a program.
  Batch newest_for(Client program, std::uint64_t& number);
  [[nodiscard]] bool is_for_programs(std::string_view path) const {
    return !settings.programs.path.empty() && path == settings.programs.path;
  }

  const ServerSettings settings;
  Site& site;
  const std::string token;
  std::uint16_t port = 0;

  asio::io_context io{1};
  tcp::acceptor acceptor{io};
  asio::steady_timer pause{io};
  std::map<Client, std::shared_ptr<Connection>> connections;
  Client last_client = 0;
  std::function<std::vector<Message>()> make;  ///< of the newest offer, until it is made
  std::function<std::vector<Message>(Client)> make_for;
  Batch newest;
  std::uint64_t newest_number = 0;

  std::mutex mutex;  // protects the next four
  bool is_woken = false;
  std::vector<std::string> texts;
  std::function<std::vector<Message>()> offered;
  std::function<std::vector<Message>(Client)> offered_for;
  std::atomic<std::size_t> watchers{0};

  std::thread thread;
};

/// One browser's connection: requests and answers by turns, until one of them opens the stream. Each operation that
/// waits for the browser has a timeout, and holds a pointer to the connection, so that it lives until the last has
/// ended.
class Server::Impl::Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(Impl& server, Client id, tcp::socket socket) : server_(server), id_(id), stream_(std::move(socket)) {}

  void start() {
    error_code ignored;
    socket().set_option(tcp::no_delay(true), ignored);
    ::fcntl(socket().native_handle(), F_SETFD, FD_CLOEXEC);
    read_request();
  }

  /// Whether no request had the token yet.
  [[nodiscard]] bool is_stranger() const { return host_.empty(); }
  [[nodiscard]] bool is_watcher() const { return is_watcher_; }
  [[nodiscard]] bool is_program() const { return is_program_; }

  /// Sends messages after all that wait.
  void send(Batch batch) {
    if (waiting_.size() >= kMostWaiting) return end();
    waiting_.push_back(std::move(batch));
    send_next();
  }

  /// Sends the next message, if none is being sent: of the batch that has begun, of those that wait, of the newest
  /// offer.
  void send_next() {
    if (has_ended_ || std::exchange(is_sending_, true)) return;
    while (!batch_ || next_ == batch_->size()) {
      next_ = 0;
      if (waiting_.empty()) {
        batch_ = is_program_ ? server_.newest_for(id_, offer_number_) : server_.newest_after(offer_number_);
      } else {
        batch_ = std::move(waiting_.front());
        waiting_.pop_front();
      }
      if (!batch_) {
        is_sending_ = false;
        return;
      }
    }
    const Message& message = (*batch_)[next_++];
    end_after(server_.settings.timeouts.dead_after);
    stream_.binary(message.is_binary);
    stream_.async_write(asio::buffer(message.bytes), [self = shared_from_this()](error_code error, std::size_t) {
      if (error) return self->end();
      self->end_never();
      self->is_sending_ = false;
      self->send_next();
    });
  }

  /// Closes the connection at once. May be called again.
  void end() {
    if (std::exchange(has_ended_, true)) return;
    const auto self = shared_from_this();
    end_never();
    error_code ignored;
    socket().close(ignored);
    server_.connections.erase(id_);
    if (!is_watcher_) return;
    --server_.watchers;
    succeeds("a browser's end", [this] { server_.site.closed(id_); });
  }

 private:
  tcp::socket& socket() { return stream_.next_layer(); }

  /// Ends the connection after a time, in place of the time that was set before.
  void end_after(std::chrono::milliseconds time) {
    deadline_.expires_after(time);
    deadline_.async_wait([self = shared_from_this()](error_code) {
      if (self->deadline_.expiry() <= Clock::now()) self->end();
    });
  }
  void end_never() { deadline_.expires_at(Clock::time_point::max()); }

  void read_request() {
    end_after(server_.settings.timeouts.request);
    parser_.emplace();
    parser_->header_limit(kMostRequest);
    parser_->body_limit(std::numeric_limits<std::uint64_t>::max());  // a body is refused whatever its size
    http::async_read_header(socket(), buffer_, *parser_,
                            [self = shared_from_this()](error_code error, std::size_t) { self->answer(error); });
  }

  void await_request() {
    if (buffer_.size() > 0) return read_request();
    end_after(server_.settings.timeouts.idle);
    socket().async_wait(tcp::socket::wait_read, [self = shared_from_this()](error_code error) {
      if (error) return self->end();
      self->read_request();
    });
  }

  void answer(error_code error) {
    if (has_ended_ || error == http::error::end_of_stream || error == http::error::partial_message) return end();
    if (error == http::error::header_limit || error == http::error::buffer_overflow) {
      return refuse(http::status::request_header_fields_too_large, "The request is too large.");
    }
    if (error.category() == make_error_code(http::error::bad_method).category()) {
      return refuse(http::status::bad_request, "This is not a request of HTTP.");
    }
    if (error) return end();
    const auto& request = parser_->get();
    if (request.method() != http::verb::get && request.method() != http::verb::head) {
      return refuse(http::status::method_not_allowed, "Only GET is allowed.");
    }
    if (!parser_->is_done()) return refuse(http::status::payload_too_large, "A request must have no body.");
    const auto text = [&](http::field field) { return std::string(request[field].data(), request[field].size()); };
    const std::optional<Target> target = parse_target({request.target().data(), request.target().size()});
    if (!target || request.count(http::field::host) != 1 || request.count(http::field::origin) > 1) {
      return refuse(http::status::bad_request, "The request is not well-formed.");
    }
    const std::string host = text(http::field::host);
    if (!is_own_host(host, server_.settings.address, server_.port) ||
        (request.count(http::field::origin) > 0 && text(http::field::origin) != "http://" + host &&
         !server_.is_for_programs(target->path))) {
      return refuse(http::status::forbidden, "Use the address that the program printed, not that of another site.");
    }
    if (!equal_in_constant_time(target->token, server_.token)) {
      return refuse(http::status::forbidden, "Use the address that the program printed: it contains a token.");
    }
    host_ = host;
    answer(*target);
  }

  /// Answers a request that was checked.
  void answer(const Target& target) {
    if (server_.is_for_programs(target.path)) return answer_program();
    if (target.path == "/stream") {
      if (websocket::is_upgrade(parser_->get()) && buffer_.size() == 0) return open_stream();
      return refuse(http::status::upgrade_required, "The stream is for WebSockets.");
    }
    if (target.path == "/") return respond(http::status::ok, {"text/html; charset=utf-8", server_.settings.page}, true);
    std::optional<Answer> found;
    if (!succeeds("a request", [&] { found = server_.site.get(target.path, target.query); })) {
      return refuse(http::status::internal_server_error, "The program failed; its log says why.");
    }
    if (found) return respond(http::status::ok, std::move(*found), true);
    respond(http::status::not_found, {"text/plain; charset=utf-8", "There is nothing at this address.\n"}, true);
  }

  /// Answers with a sentence and ends the connection.
  void refuse(http::status status, const char* sentence) {
    respond(status, {"text/plain; charset=utf-8", std::string(sentence) + '\n'}, false);
  }

  void respond(http::status status, Answer content, bool keep) {
    const auto& request = parser_->get();
    response_ = {};
    response_.result(status);
    response_.set(http::field::content_type, content.type);
    response_.set("Content-Security-Policy", security_policy(host_));
    response_.set(http::field::x_frame_options, "DENY");
    response_.set(http::field::cache_control, "no-store");
    response_.set("X-Content-Type-Options", "nosniff");
    response_.set("Referrer-Policy", "no-referrer");
    response_.set("Cross-Origin-Resource-Policy", "same-origin");
    if (status == http::status::method_not_allowed) response_.set(http::field::allow, "GET, HEAD");
    if (status == http::status::upgrade_required) response_.set(http::field::upgrade, "websocket");
    response_.keep_alive(keep && request.keep_alive());
    response_.content_length(content.bytes.size());
    if (request.method() != http::verb::head) response_.body() = std::move(content.bytes);
    end_after(server_.settings.timeouts.answer);
    http::async_write(socket(), response_, [self = shared_from_this()](error_code error, std::size_t) {
      if (error) return self->end();
      if (self->response_.keep_alive()) return self->await_request();
      self->read_last();
    });
  }

  /// Ends the connection after an answer, but first reads what the client is still sending.
  void read_last() {
    error_code ignored;
    socket().shutdown(tcp::socket::shutdown_send, ignored);
    end_after(kLastRead);
    discard();
  }
  void discard() {
    buffer_.clear();
    socket().async_read_some(buffer_.prepare(kMostRequest), [self = shared_from_this()](error_code error, std::size_t) {
      if (error) return self->end();
      self->discard();
    });
  }

  /// Opens the stream for programs in a subprotocol that both know.
  void answer_program() {
    if (!websocket::is_upgrade(parser_->get()) || buffer_.size() > 0) {
      return refuse(http::status::upgrade_required, "The stream is for WebSockets.");
    }
    const auto header = parser_->get()[http::field::sec_websocket_protocol];
    for (const auto& offered : http::token_list(header)) {
      const auto& known = server_.settings.programs.protocols;
      const auto found = std::find(known.begin(), known.end(), std::string(offered.data(), offered.size()));
      if (found == known.end()) continue;
      is_program_ = true;
      stream_.set_option(websocket::stream_base::decorator([protocol = *found](websocket::response_type& response) {
        response.set(http::field::sec_websocket_protocol, protocol);
      }));
      return open_stream();
    }
    refuse(http::status::bad_request, "The program must offer a subprotocol that this stream has.");
  }

  void open_stream() {
    end_never();  // Beast times the handshake, and pings
    const Timeouts& timeouts = server_.settings.timeouts;
    stream_.set_option(websocket::stream_base::timeout{timeouts.request, timeouts.dead_after, true});
    stream_.read_message_max(kMostReceived);
    stream_.auto_fragment(false);
    stream_.control_callback([this](websocket::frame_type, boost::beast::string_view) {
      if (is_too_fast()) end();
    });
    ::setsockopt(socket().native_handle(), IPPROTO_TCP, TCP_NOTSENT_LOWAT, &kMostUnsent, sizeof kMostUnsent);
    stream_.async_accept(parser_->get(), [self = shared_from_this()](error_code error) {
      if (error || self->has_ended_) return self->end();
      self->greet();
    });
  }

  void greet() {
    is_watcher_ = true;
    ++server_.watchers;
    is_sending_ = true;  // what send() receives meanwhile waits
    std::vector<Message> first;
    if (!succeeds("a browser's start",
                  [&] { first = is_program_ ? server_.site.program_opened(id_) : server_.site.opened(id_); }))
      return end();
    if (has_ended_) return;
    waiting_.push_front(std::make_shared<const std::vector<Message>>(std::move(first)));
    is_sending_ = false;
    send_next();
    read_message();
  }

  void read_message() {
    buffer_.clear();
    stream_.async_read(buffer_, [self = shared_from_this()](error_code error, std::size_t) {
      if (error || self->has_ended_ || !self->stream_.got_text() || self->is_too_fast()) return self->end();
      const std::string_view text(static_cast<const char*>(self->buffer_.data().data()), self->buffer_.size());
      if (!succeeds("a message", [&] { self->server_.site.received(self->id_, text); })) return self->end();
      if (!self->has_ended_) self->read_message();
    });
  }

  /// Counts a message. Returns whether there are more than allowed in the second that began with the first of them.
  bool is_too_fast() {
    const Clock::time_point now = Clock::now();
    if (now - second_ >= std::chrono::seconds(1)) {
      second_ = now;
      messages_ = 0;
    }
    return ++messages_ > kMostMessages_perS;
  }

  Impl& server_;
  const Client id_;
  websocket::stream<tcp::socket, false> stream_;  ///< its next layer carries HTTP at first
  asio::steady_timer deadline_{server_.io};
  bool has_ended_ = false;

  boost::beast::flat_buffer buffer_{kMostRequest};
  std::optional<http::request_parser<http::buffer_body>> parser_;  ///< leaves a body unread
  http::response<http::string_body> response_;
  std::string host_;  ///< Host header of the last request that had the token

  bool is_watcher_ = false, is_program_ = false;
  std::deque<Batch> waiting_;  ///< first messages, and texts that were sent
  Batch batch_;                ///< what is being sent
  std::size_t next_ = 0;       ///< message of the batch
  bool is_sending_ = false;
  std::uint64_t offer_number_ = 0;  ///< of the last offer that was taken
  Clock::time_point second_;
  int messages_ = 0;  ///< received in that second
};

void Server::Impl::start() {
  acceptor = tcp::acceptor(io, {asio::ip::make_address(settings.address), settings.port});
  ::fcntl(acceptor.native_handle(), F_SETFD, FD_CLOEXEC);
  port = acceptor.local_endpoint().port();
  accept();
  thread = std::thread([this] { run(); });
}

void Server::Impl::run() {
  sigset_t all;  // signals are for the other threads
  ::sigfillset(&all);
  ::pthread_sigmask(SIG_SETMASK, &all, nullptr);
  ::pthread_setname_np(::pthread_self(), "twocone-web");
  (void)::nice(kNicer);  // on Linux, of the thread
  const auto work = asio::make_work_guard(io);
  while (!io.stopped()) succeeds("the server", [this] { io.run(); });
}

void Server::Impl::accept() {
  acceptor.async_accept([this](error_code error, tcp::socket socket) {
    if (!error) {
      accept();
      return admit(std::move(socket));
    }
    if (error == asio::error::operation_aborted) return;
    kLog.warning("no further connection: " + error.message());
    pause.expires_after(kAcceptPause);
    pause.async_wait([this](error_code cancelled) {
      if (!cancelled) accept();
    });
  });
}

void Server::Impl::admit(tcp::socket socket) {
  const auto is_stranger = [](const auto& entry) { return entry.second->is_stranger(); };
  const auto strangers = std::count_if(connections.begin(), connections.end(), is_stranger);
  if (connections.size() >= kMostConnections || std::size_t(strangers) >= kMostConnections / 2) {
    const auto oldest = std::find_if(connections.begin(), connections.end(), is_stranger);
    if (oldest == connections.end()) return;
    oldest->second->end();
  }
  const auto connection = std::make_shared<Connection>(*this, ++last_client, std::move(socket));
  connections.emplace(last_client, connection);
  connection->start();
}

void Server::Impl::wake() {
  if (is_woken) return;
  asio::post(io, [this] { deliver(); });
  is_woken = true;
}

void Server::Impl::deliver() {
  std::vector<std::string> sent;
  {
    const std::lock_guard lock(mutex);
    is_woken = false;
    sent.swap(texts);
    if (offered) {
      make = std::exchange(offered, nullptr);
      make_for = std::exchange(offered_for, nullptr);
      newest = nullptr;
      ++newest_number;
    }
  }
  std::vector<std::shared_ptr<Connection>> present;  // a call below may end any of them, and so change the list of all
  for (const auto& [client, connection] : connections) {
    if (connection->is_watcher()) present.push_back(connection);
  }
  for (std::string& text : sent) {
    const Batch batch = text_batch(std::move(text));
    for (const auto& connection : present) {
      if (!connection->is_program()) connection->send(batch);
    }
  }
  for (const auto& connection : present) connection->send_next();
}

Batch Server::Impl::newest_after(std::uint64_t& number) {
  if (std::exchange(number, newest_number) == newest_number) return nullptr;
  if (!newest) {
    std::vector<Message> messages;
    succeeds("an offer", [&] { messages = std::exchange(make, nullptr)(); });
    newest = std::make_shared<const std::vector<Message>>(std::move(messages));
  }
  return newest;
}

Batch Server::Impl::newest_for(Client program, std::uint64_t& number) {
  if (std::exchange(number, newest_number) == newest_number || !make_for) return nullptr;
  std::vector<Message> messages;
  succeeds("an offer", [&] { messages = make_for(program); });
  if (messages.empty()) return nullptr;
  return std::make_shared<const std::vector<Message>>(std::move(messages));
}

void Server::Impl::close_all() {
  error_code ignored;
  acceptor.close(ignored);
  while (!connections.empty()) connections.begin()->second->end();
  io.stop();
}

Server::Server(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

Result<std::unique_ptr<Server>> Server::open(const ServerSettings& settings, Site& site) {
  if (!is_numeric_address(settings.address)) {
    return Error(ErrorCode::kRefused,
                 "{}: not a numeric address; give that of an interface of this machine, such as 127.0.0.1 or ::1",
                 authority(settings.address, settings.port));
  }
  const auto failed = [&](const std::string& why) {
    return Error(ErrorCode::kUnavailable, "{}: {}", authority(settings.address, settings.port), why);
  };
  try {
    auto impl = std::make_unique<Impl>(settings, site);
    impl->start();
    return std::unique_ptr<Server>(new Server(std::move(impl)));
  } catch (const boost::system::system_error& e) {
    return failed(e.code().message());
  } catch (const std::system_error& e) {
    return failed(e.code().message());
  }
}

Server::~Server() {
  asio::post(impl_->io, [this] { impl_->close_all(); });
  impl_->thread.join();
}

std::string Server::Impl::own_authority() const {
  const auto listening = asio::ip::make_address(settings.address);
  const char* loopback = listening.is_v6() ? "::1" : "127.0.0.1";
  return authority(listening.is_unspecified() ? loopback : settings.address, port);
}

std::string Server::address() const { return fmt::format("http://{}/?token={}", impl_->own_authority(), impl_->token); }

std::string Server::program_address() const {
  return fmt::format("ws://{}{}?token={}", impl_->own_authority(), impl_->settings.programs.path, impl_->token);
}

void Server::offer(std::function<std::vector<Message>()> make, std::function<std::vector<Message>(Client)> make_for) {
  const std::lock_guard lock(impl_->mutex);
  impl_->offered.swap(make);  // the arguments, with the offer before, are destroyed after the lock
  impl_->offered_for.swap(make_for);
  impl_->wake();
}

void Server::send(std::string text) {
  const std::lock_guard lock(impl_->mutex);
  impl_->texts.push_back(std::move(text));
  impl_->wake();
}

void Server::send(Client client, std::string text) {
  const auto found = impl_->connections.find(client);
  if (found == impl_->connections.end() || !found->second->is_watcher()) return;
  found->second->send(text_batch(std::move(text)));
}

std::size_t Server::watchers() const { return impl_->watchers; }

}  // namespace twocone::web
