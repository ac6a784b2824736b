// SPDX-License-Identifier: Apache-2.0
#include "apps/tradeoff/work.h"

#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <exception>
#include <optional>
#include <string_view>
#include <utility>

#include <fmt/format.h>

namespace twocone::tradeoff {
namespace {

using Clock = std::chrono::steady_clock;
constexpr int kLook_ms = 100;

/// A message of a child to its parent; an order to a child is only a shard number. Packets are sent and received
/// completely or not at all.
struct Message {
  enum Kind : std::uint32_t { kProgress, kDone, kFailed, kNotice };
  Kind kind = kProgress;
  ErrorCode code = ErrorCode::kRefused;
  double share = 0;
  std::uint32_t length = 0;
  std::array<char, 2000> text{};
};
constexpr std::size_t kHead = offsetof(Message, text);

/// Ignores failures: a parent that no longer receives is about to end this process.
void send(int fd, Message::Kind kind, double share, std::string_view text = {}, ErrorCode code = ErrorCode::kRefused) {
  Message message;
  message.kind = kind;
  message.code = code;
  message.share = share;
  message.length = std::uint32_t(std::min(text.size(), message.text.size()));
  std::copy_n(text.begin(), message.length, message.text.begin());
  // Progress that does not fit into the socket's buffer is not worth waiting for.
  const int flags = MSG_NOSIGNAL | (kind == Message::kProgress ? MSG_DONTWAIT : 0);
  while (::send(fd, &message, kHead + message.length, flags) < 0 && errno == EINTR) continue;
}

// ---- in the child

std::atomic<bool> child_stop{false};
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler may use it");

void on_signal(int signal) {
  if (signal == SIGTERM) child_stop = true;
}

/// The terminal sends SIGINT and SIGHUP to parent and children alike. The parent decides, and stops the children by
/// SIGTERM.
void take_signals() {
  child_stop = false;
  struct sigaction action {};
  action.sa_handler = on_signal;
  ::sigaction(SIGINT, &action, nullptr);
  ::sigaction(SIGHUP, &action, nullptr);
  ::sigaction(SIGTERM, &action, nullptr);
}

void obey(int fd, const std::function<DoShard(const Notify&)>& start) {
  const Notify notify = [fd](const std::string& line) { send(fd, Message::kNotice, 0, line); };
  const auto progress = [fd](double share) { send(fd, Message::kProgress, share); };
  DoShard work;
  while (!child_stop) {
    std::uint64_t shard = 0;
    const ssize_t got = ::recv(fd, &shard, sizeof shard, 0);
    if (got < 0 && errno == EINTR) continue;
    if (got != ssize_t(sizeof shard)) return;
    try {
      if (!work) work = start(notify);
      const Status done = work(std::size_t(shard), progress, child_stop);
      if (!done) return send(fd, Message::kFailed, 0, done.error().message, done.error().code);
    } catch (const std::exception& error) {
      return send(fd, Message::kFailed, 0, error.what());
    } catch (...) {
      return send(fd, Message::kFailed, 0, "an unknown exception was thrown");
    }
    send(fd, Message::kDone, 1);
  }
}

// ---- in the parent

struct Child {
  pid_t pid = -1;
  int fd = -1;
  std::optional<Piece> piece{};  ///< in progress
  std::optional<std::size_t> last_kind{};
  double share = 0;  ///< of its piece that is done
  Clock::time_point heard = Clock::now();
  bool killed_for_silence = false;
};

std::string end_of(int status) {
  if (WIFSIGNALED(status)) {
    const int signal = WTERMSIG(status);
    return fmt::format("its process was killed by signal {} ({}){}", signal, ::strsignal(signal),
                       signal == SIGKILL ? ", by a user or for lack of memory" : "");
  }
  return fmt::format("its process ended by itself with status {}", WEXITSTATUS(status));
}

class Crew {
 public:
  Crew(const std::vector<Piece>& pieces, const WorkOptions& options, const std::atomic<bool>& stop)
      : options_(options), stop_(stop), left_(pieces) {
    for (const Piece& piece : pieces) weight_ += piece.weight;
  }
  Crew(const Crew&) = delete;
  Crew& operator=(const Crew&) = delete;
  ~Crew() {
    for (const Child& child : children_) {
      ::kill(child.pid, SIGKILL);
      while (::waitpid(child.pid, nullptr, 0) < 0 && errno == EINTR) continue;
      ::close(child.fd);
    }
  }

  Result<std::size_t> run(const std::function<DoShard(const Notify&)>& start) {
    const std::size_t most = std::min(std::size_t(options_.jobs), left_.size());
    while (children_.size() < most && !error_ && !stop_) add_child(start);
    while (!children_.empty()) {
      if (stop_ && !stop_until_) ask_to_stop();
      listen();
      reap();
      end_the_silent();
      if (options_.progress) options_.progress(share_done());
    }
    if (error_) return *error_;
    return done_;
  }

 private:
  void fail(Error error) {
    // Stopped pieces fail too; that is not an error.
    if (!error_ && !stop_) error_ = std::move(error);
    left_.clear();
  }

  void add_child(const std::function<DoShard(const Notify&)>& start) {
    std::array<int, 2> ends{};
    if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends.data()) != 0) {
      return fail({ErrorCode::kUnavailable, fmt::format("cannot make a socket: {}", std::strerror(errno))});
    }
    // Otherwise the child would write the pending text of both streams a second time.
    std::fflush(stdout);
    std::fflush(stderr);
    const pid_t parent = ::getpid();
    // The parent's handlers would receive a signal between fork and the installation of the child's own, without
    // effect.
    sigset_t handled, before;
    ::sigemptyset(&handled);
    ::sigaddset(&handled, SIGINT);
    ::sigaddset(&handled, SIGHUP);
    ::sigaddset(&handled, SIGTERM);
    ::sigprocmask(SIG_BLOCK, &handled, &before);
    const pid_t pid = ::fork();
    if (pid == 0) {
      ::prctl(PR_SET_PDEATHSIG, SIGKILL);
      // If the parent died between fork and prctl, the signal never comes.
      if (::getppid() != parent) ::_exit(1);
      take_signals();
      ::sigprocmask(SIG_SETMASK, &before, nullptr);
      ::close(ends[0]);
      for (const Child& other : children_) ::close(other.fd);
      obey(ends[1], start);
      ::_exit(0);
    }
    const int error = errno;
    ::sigprocmask(SIG_SETMASK, &before, nullptr);
    ::close(ends[1]);
    if (pid < 0) {
      ::close(ends[0]);
      return fail({ErrorCode::kUnavailable, fmt::format("cannot start a process: {}", std::strerror(error))});
    }
    children_.push_back({.pid = pid, .fd = ends[0]});
    give(children_.back());
  }

  /// Returns the next piece: of the kind that the child ran last; else of a kind that no other child runs; else any.
  std::vector<Piece>::iterator next_for(const Child& child) {
    const auto same =
        std::find_if(left_.begin(), left_.end(), [&](const Piece& p) { return child.last_kind == p.kind; });
    if (same != left_.end()) return same;
    const auto fresh = std::find_if(left_.begin(), left_.end(), [&](const Piece& piece) {
      return std::none_of(children_.begin(), children_.end(),
                          [&](const Child& other) { return other.piece && other.last_kind == piece.kind; });
    });
    return fresh != left_.end() ? fresh : left_.begin();
  }

  /// Gives the child a piece, or closes its orders if none is left, so that it ends.
  void give(Child& child) {
    child.piece.reset();
    child.share = 0;
    child.heard = Clock::now();
    const auto next = next_for(child);
    if (next == left_.end()) {
      ::shutdown(child.fd, SHUT_WR);
      return;
    }
    child.piece = *next;
    child.last_kind = next->kind;
    left_.erase(next);
    const std::uint64_t shard = child.piece->shard;
    // Sending to a child that has died has no effect; reap() handles it.
    [[maybe_unused]] const ssize_t sent = ::send(child.fd, &shard, sizeof shard, MSG_NOSIGNAL);
  }

  void ask_to_stop() {
    stop_until_ = Clock::now() + options_.patience;
    left_.clear();
    for (const Child& child : children_) {
      ::shutdown(child.fd, SHUT_WR);
      ::kill(child.pid, SIGTERM);
    }
  }

  void listen() {
    std::vector<pollfd> entries;
    for (const Child& child : children_) {
      // A child without a piece sends nothing more, and its end of file would wake poll() again and again.
      if (child.piece) entries.push_back({child.fd, POLLIN, 0});
    }
    if (::poll(entries.data(), nfds_t(entries.size()), kLook_ms) <= 0) return;
    // A child that is about to die wakes poll() again and again until it can be reaped.
    if (std::any_of(entries.begin(), entries.end(), [](const pollfd& e) { return (e.revents & POLLHUP) != 0; })) {
      ::poll(nullptr, 0, 1);
    }
    for (Child& child : children_) hear(child);
  }

  /// Handles all messages that the child has sent so far.
  void hear(Child& child) {
    Message message;
    while (::recv(child.fd, &message, sizeof message, MSG_DONTWAIT) >= ssize_t(kHead)) {
      child.heard = Clock::now();
      const std::string text(message.text.data(), message.length);
      switch (message.kind) {
        case Message::kProgress:
          child.share = std::clamp(message.share, 0.0, 1.0);
          break;
        case Message::kNotice:
          if (options_.tell) options_.tell(text);
          break;
        case Message::kDone:
          ++done_;
          weight_done_ += child.piece->weight;
          give(child);
          break;
        case Message::kFailed:
          fail({message.code, fmt::format("shard {}: {}", child.piece->shard, text)});
          child.piece.reset();
          break;
      }
    }
  }

  void reap() {
    for (auto child = children_.begin(); child != children_.end();) {
      int status = 0;
      const pid_t ended = ::waitpid(child->pid, &status, WNOHANG);
      if (ended == 0 || (ended < 0 && errno == EINTR)) {
        ++child;
        continue;
      }
      hear(*child);
      if (child->piece) {
        const std::string why = child->killed_for_silence
                                    ? fmt::format("its process was silent for {} s and was killed",
                                                  std::chrono::duration<double>(options_.silence).count())
                                    : end_of(status);
        fail({ErrorCode::kDisconnected, fmt::format("shard {}: {}", child->piece->shard, why)});
      } else if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) {
        fail({ErrorCode::kDisconnected, fmt::format("after the last shard of a process: {}", end_of(status))});
      }
      ::close(child->fd);
      child = children_.erase(child);
    }
  }

  void end_the_silent() {
    const auto now = Clock::now();
    for (Child& child : children_) {
      child.killed_for_silence = child.killed_for_silence || now - child.heard > options_.silence;
      if (child.killed_for_silence || (stop_until_ && now > *stop_until_)) ::kill(child.pid, SIGKILL);
    }
  }

  [[nodiscard]] double share_done() const {
    double sum = weight_done_;
    for (const Child& child : children_) {
      if (child.piece) sum += child.share * child.piece->weight;
    }
    return weight_ > 0 ? sum / weight_ : 1;
  }

  const WorkOptions& options_;
  const std::atomic<bool>& stop_;
  std::vector<Piece> left_;
  std::vector<Child> children_;
  std::size_t done_ = 0;
  double weight_ = 0, weight_done_ = 0;
  std::optional<Error> error_;
  std::optional<Clock::time_point> stop_until_;  ///< set when stop was seen
};

}  // namespace

Result<std::size_t> run_in_children(const std::vector<Piece>& pieces, const WorkOptions& options,
                                    const std::function<DoShard(const Notify& notify)>& start,
                                    const std::atomic<bool>& stop) {
  return Crew(pieces, options, stop).run(start);
}

}  // namespace twocone::tradeoff
