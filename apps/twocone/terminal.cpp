// SPDX-License-Identifier: Apache-2.0
#include "apps/twocone/terminal.h"

#include <fcntl.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <utility>

#include <fmt/format.h>

namespace twocone::cli {
namespace {

constexpr std::size_t kWidth = 30;
constexpr std::size_t kLeastWidth = 5;  ///< width below which a bar shows nothing
constexpr int kUsualColumns = 80;
constexpr std::chrono::seconds kQuiet{2};
constexpr std::chrono::milliseconds kInterval{200};

/// Reads the width each time, because the window may become narrower while the bar is shown.
int terminal_columns() {
  winsize size{};
  return ::ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : kUsualColumns;
}

std::atomic<bool> stop_asked{false};
std::atomic<int> signal_received{0};
static_assert(std::atomic<bool>::is_always_lock_free && std::atomic<int>::is_always_lock_free,
              "a signal handler may touch them");

void on_signal(int signal) {
  signal_received = signal;
  stop_asked = true;
}

}  // namespace

void open_missing_streams() noexcept {
  for (const int fd : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fcntl(fd, F_GETFD) >= 0 || errno != EBADF) continue;
    // open() returns the lowest free number, which is this one. Standard input is opened for writing and the others for
    // reading, so that each use fails.
    static_cast<void>(::open("/dev/null", fd == STDIN_FILENO ? O_WRONLY : O_RDONLY));
  }
}

void say(const std::string& line) noexcept {
  std::fputs(line.c_str(), stderr);
  std::fputc('\n', stderr);
}

std::string lost_output() {
  errno = 0;
  for (const auto& [stream, name] : {std::pair{stdout, "output"}, std::pair{stderr, "error"}}) {
    if (std::fflush(stream) == 0 && std::ferror(stream) == 0) continue;
    const std::string why = errno == 0 ? "" : std::string(": ") + std::strerror(errno);
    return std::string("cannot write to standard ") + name + why;
  }
  return "";
}

std::string progress_line(const std::string& what, double done, double spent_s, int columns) {
  const double share = std::clamp(done, 0.0, 1.0);
  const std::string percent = fmt::format(" {:3.0f} %", 100 * share);
  std::string left;
  // Before a fiftieth of the work is done, an estimate would be unstable.
  if (share > 0.02) {
    const auto left_s = std::lround(spent_s / share * (1 - share));
    left = fmt::format(" {}:{:02} left", left_s / 60, left_s % 60);
  }
  // A terminal continues on its next line after the last column, and the carriage return does not undo that.
  const std::size_t room = std::size_t(std::max(columns, 2)) - 1;
  if (what.size() + percent.size() + left.size() > room) left.clear();
  if (what.size() + percent.size() > room) return (what + percent).substr(0, room);
  std::string line = what;
  const std::size_t spare = room - what.size() - percent.size() - left.size();
  constexpr std::size_t kBrackets = 3;  // " []"
  if (spare >= kLeastWidth + kBrackets) {
    const std::size_t bar = std::min(kWidth, spare - kBrackets);
    const auto filled = std::size_t(share * double(bar));
    line += fmt::format(" [{}{}]", std::string(filled, '#'), std::string(bar - filled, '.'));
  }
  return line + percent + left;
}

ProgressBar::ProgressBar(std::string what) : what_(std::move(what)), terminal_(::isatty(STDERR_FILENO) == 1) {}

ProgressBar::~ProgressBar() { clear(); }

void ProgressBar::clear() {
  if (std::exchange(shown_, false)) std::fputs("\r\x1b[K", stderr);
}

void ProgressBar::remove() {
  const std::lock_guard lock(mutex_);
  clear();
}

void ProgressBar::say(const std::string& line) {
  const std::lock_guard lock(mutex_);
  clear();
  cli::say(line);
}

void ProgressBar::show(double done) {
  const std::lock_guard lock(mutex_);
  const auto now = Clock::now();
  if (!terminal_ || now - begin_ < kQuiet || now - last_ < kInterval) return;
  last_ = now;
  shown_ = true;
  const double spent_s = std::chrono::duration<double>(now - begin_).count();
  std::fputs(fmt::format("\r{}\x1b[K", progress_line(what_, done, spent_s, terminal_columns())).c_str(), stderr);
}

const std::atomic<bool>& stop_on_signals() {
  struct sigaction action {};
  action.sa_handler = on_signal;
  action.sa_flags = SA_RESETHAND;
  ::sigaction(SIGINT, &action, nullptr);
  ::sigaction(SIGTERM, &action, nullptr);
  // A program that was started with nohup must outlive the terminal.
  struct sigaction before {};
  ::sigaction(SIGHUP, nullptr, &before);
  if (before.sa_handler != SIG_IGN) ::sigaction(SIGHUP, &action, nullptr);
  return stop_asked;
}

int stop_signal() { return signal_received; }

}  // namespace twocone::cli
