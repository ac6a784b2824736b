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

/// What a child says; an order to it is a bare shard number. Packets: each is sent and received whole or not at all.
struct Message {
  enum Kind : std::uint32_t { kProgress, kDone, kFailed, kTold };
  Kind kind = kProgress;
  ErrorCode code = ErrorCode::kRefused;
  double share = 0;
  std::uint32_t length = 0;
  std::array<char, 2000> text{};
};
constexpr std::size_t kHead = offsetof(Message, text);

/// Fails silently: a parent that does not hear any more is about to end this process.
void send(int fd, Message::Kind kind, double share, std::string_view text = {}, ErrorCode code = ErrorCode::kRefused) {
  Message message;
  message.kind = kind;
  message.code = code;
  message.share = share;
  message.length = std::uint32_t(std::min(text.size(), message.text.size()));
  std::copy_n(text.begin(), message.length, message.text.begin());
  // Progress that finds no room is not worth waiting for.
  const int flags = MSG_NOSIGNAL | (kind == Message::kProgress ? MSG_DONTWAIT : 0);
  while (::send(fd, &message, kHead + message.length, flags) < 0 && errno == EINTR) continue;
}

// ---- in the child

std::atomic<bool> child_stop{false};
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler may touch it");

void on_signal(int signal) {
  if (signal == SIGTERM) child_stop = true;
}

/// SIGINT and SIGHUP come from the terminal to parent and children alike: the parent decides, and notifies by SIGTERM.
void take_signals() {
  child_stop = false;
  struct sigaction action {};
  action.sa_handler = on_signal;
  ::sigaction(SIGINT, &action, nullptr);
  ::sigaction(SIGHUP, &action, nullptr);
  ::sigaction(SIGTERM, &action, nullptr);
}

void obey(int fd, const std::function<DoShard(const Tell&)>& start) {
  const Tell tell = [fd](const std::string& line) { send(fd, Message::kTold, 0, line); };
  const auto progress = [fd](double share) { send(fd, Message::kProgress, share); };
  DoShard work;
  while (!child_stop) {
    std::uint64_t shard = 0;
    const ssize_t got = ::recv(fd, &shard, sizeof shard, 0);
    if (got < 0 && errno == EINTR) continue;
    if (got != ssize_t(sizeof shard)) return;
    try {
      if (!work) work = start(tell);
      const Status done = work(std::size_t(shard), progress, child_stop);
      if (!done) return send(fd, Message::kFailed, 0, done.error().message, done.error().code);
    } catch (const std::exception& error) {
      return send(fd, Message::kFailed, 0, error.what());
    } catch (...) {
      return send(fd, Message::kFailed, 0, "something was thrown that is no exception");
    }
    send(fd, Message::kDone, 1);
  }
}

// ---- in the parent

struct Child {
  pid_t pid = -1;
  int fd = -1;
  std::optional<Piece> piece{};  ///< that it is at
  std::optional<std::size_t> last_kind{};
  double share = 0;  ///< of its piece
  Clock::time_point heard = Clock::now();
  bool killed_for_silence = false;
};

std::string end_of(int status) {
  if (WIFSIGNALED(status)) {
    const int signal = WTERMSIG(status);
    return fmt::format("its process was killed by signal {} ({}){}", signal, ::strsignal(signal),
                       signal == SIGKILL ? ": by hand, or for lack of memory" : "");
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

  Result<std::size_t> run(const std::function<DoShard(const Tell&)>& start) {
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
    // What is stopped fails; that is no news.
    if (!error_ && !stop_) error_ = std::move(error);
    left_.clear();
  }

  void add_child(const std::function<DoShard(const Tell&)>& start) {
    std::array<int, 2> ends{};
    if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends.data()) != 0) {
      return fail({ErrorCode::kUnavailable, fmt::format("cannot make a socket: {}", std::strerror(errno))});
    }
    // Neither stream's pending text is to be written twice.
    std::fflush(stdout);
    std::fflush(stderr);
    const pid_t parent = ::getpid();
    // A signal between fork and the child's own handlers would be noted by the parent's, to no effect.
    sigset_t handled, before;
    ::sigemptyset(&handled);
    ::sigaddset(&handled, SIGINT);
    ::sigaddset(&handled, SIGHUP);
    ::sigaddset(&handled, SIGTERM);
    ::sigprocmask(SIG_BLOCK, &handled, &before);
    const pid_t pid = ::fork();
    if (pid == 0) {
      ::prctl(PR_SET_PDEATHSIG, SIGKILL);
      // The parent may have died between fork and prctl: then the signal never comes.
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

  /// The next piece of the kind that the child did last; else of one that nobody is at; else any.
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

  /// A piece, or word that there is none left, at which the child ends.
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
    // Into a child that has died it goes nowhere; reap() notices.
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
      // One that has been told to end says no more, and its end of file would wake at once, again and again.
      if (child.piece) entries.push_back({child.fd, POLLIN, 0});
    }
    if (::poll(entries.data(), nfds_t(entries.size()), kLook_ms) <= 0) return;
    // A child that is about to die wakes poll again and again until it can be reaped.
    if (std::any_of(entries.begin(), entries.end(), [](const pollfd& e) { return (e.revents & POLLHUP) != 0; })) {
      ::poll(nullptr, 0, 1);
    }
    for (Child& child : children_) hear(child);
  }

  /// All that the child has said by now.
  void hear(Child& child) {
    Message message;
    while (::recv(child.fd, &message, sizeof message, MSG_DONTWAIT) >= ssize_t(kHead)) {
      child.heard = Clock::now();
      const std::string text(message.text.data(), message.length);
      switch (message.kind) {
        case Message::kProgress:
          child.share = std::clamp(message.share, 0.0, 1.0);
          break;
        case Message::kTold:
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
                                    ? fmt::format("its process told nothing for {} s and was killed",
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
  std::optional<Clock::time_point> stop_until_;  ///< once stop was seen
};

}  // namespace

Result<std::size_t> run_in_children(const std::vector<Piece>& pieces, const WorkOptions& options,
                                    const std::function<DoShard(const Tell& tell)>& start,
                                    const std::atomic<bool>& stop) {
  return Crew(pieces, options, stop).run(start);
}

}  // namespace twocone::tradeoff
