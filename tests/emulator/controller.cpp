// SPDX-License-Identifier: Apache-2.0
// An emulated motor controller as a program, at the far end of a serial port:
//   emulated_controller PROTOCOL TTY|pty
// With pty it makes a pseudo-terminal, whose other end it names in its first line. Whenever its wheels start or stop,
// it writes a line to standard output, with the monotonic clock's seconds. It reads commands from standard input, one
// per line:
//   counts LEFT RIGHT | reset | dead | alive | lose N | late N | twice N | cut N | garble N | garbage N
#include <fcntl.h>
#include <poll.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <iterator>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "tests/emulator/firmware.h"

namespace twocone::emulator {
namespace {

double now_s() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

int open_tty(const char* path) {
  const int tty = ::open(path, O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (tty < 0) return -1;
  termios settings{};
  if (::tcgetattr(tty, &settings) == 0) {
    ::cfmakeraw(&settings);
    ::cfsetspeed(&settings, B115200);
    ::tcsetattr(tty, TCSANOW, &settings);
  }
  return tty;
}

/// Opens the near end of a new pseudo-terminal.
int open_pty() {
  const int pty = ::posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (pty < 0 || ::grantpt(pty) != 0 || ::unlockpt(pty) != 0) return -1;
  std::printf("pty %s\n", ::ptsname(pty));
  std::fflush(stdout);
  return pty;
}

class Controller {
 public:
  Controller(const std::string& protocol, std::string path)
      : firmware_(make_firmware(protocol)), path_(std::move(path)), is_pty_(path_ == "pty") {
    if (is_pty_) tty_ = open_pty();
  }

  int run() {
    std::string commands;
    while (true) {
      if (tty_ < 0) tty_ = open_tty(path_.c_str());
      pollfd entries[2]{{tty_, POLLIN, 0}, {STDIN_FILENO, POLLIN, 0}};
      ::poll(entries, 2, 2);
      std::vector<std::uint8_t> out;
      if (tty_ >= 0 && entries[0].revents != 0) listen(out);
      firmware_->pass_time(now_s() - begin_s_, out);
      send(out);
      report();
      if (entries[1].revents != 0 && !take_commands(commands)) return 0;
    }
  }

 private:
  /// Returns whether more commands may come.
  bool take_commands(std::string& commands) {
    char room[256];
    const ssize_t got = ::read(STDIN_FILENO, room, sizeof room);
    if (got <= 0) return false;
    commands.append(room, std::size_t(got));
    for (auto end = commands.find('\n'); end != std::string::npos; end = commands.find('\n')) {
      obey(commands.substr(0, end));
      commands.erase(0, end + 1);
    }
    return true;
  }

  void listen(std::vector<std::uint8_t>& out) {
    std::uint8_t room[4096];
    const ssize_t got = ::read(tty_, room, sizeof room);
    if (got > 0) {
      if (!dead_) firmware_->receive({room, std::size_t(got)}, now_s() - begin_s_, out);
    } else if (got == 0 || (errno != EAGAIN && errno != EINTR)) {
      ::usleep(10'000);  // unplugged, or no program at the other end of a pty
      if (is_pty_) return;
      ::close(tty_);
      tty_ = -1;
    }
  }

  void send(std::vector<std::uint8_t> out) {
    if (out.empty() || dead_ || tty_ < 0) return;
    const auto due = [](int& count) { return count > 0 && count-- > 0; };
    if (due(lose_)) return;
    if (due(cut_)) out.pop_back();
    if (due(garble_)) {
      for (auto& byte : out) byte ^= 0x10;
    }
    if (due(late_)) {
      held_.insert(held_.end(), out.begin(), out.end());
      return;
    }
    std::vector<std::uint8_t> all = std::exchange(held_, {});
    for (int times = due(twice_) ? 2 : 1; times > 0; --times)
      std::copy(out.begin(), out.end(), std::back_inserter(all));
    static_cast<void>(!::write(tty_, all.data(), all.size()));
  }

  void report() {
    const bool turns = firmware_->wheels.turn();
    if (turns == turned_) return;
    turned_ = turns;
    std::printf("%.4f %s %.0f %.0f\n", now_s(), turns ? "turn" : "stop", firmware_->wheels.left_rate(),
                firmware_->wheels.right_rate());
    std::fflush(stdout);
  }

  void obey(const std::string& line) {
    std::istringstream words(line);
    std::string word;
    double first = 0, second = 0;
    words >> word >> first >> second;
    const int count = int(first);
    if (word == "counts") firmware_->wheels.set_counts(first, second);
    if (word == "reset") firmware_->reset();
    if (word == "dead") dead_ = true;
    if (word == "alive") dead_ = false;
    if (word == "lose") lose_ = count;
    if (word == "late") late_ = count;
    if (word == "twice") twice_ = count;
    if (word == "cut") cut_ = count;
    if (word == "garble") garble_ = count;
    if (word == "garbage") {
      std::vector<std::uint8_t> noise;
      for (int i = 0; i < count; ++i) noise.push_back(std::uint8_t(i * 167 + 13));
      send(noise);
    }
  }

  const double begin_s_ = now_s();
  std::unique_ptr<Firmware> firmware_;
  const std::string path_;
  const bool is_pty_;
  int tty_ = -1;
  bool turned_ = false;
  bool dead_ = false;
  int lose_ = 0, late_ = 0, twice_ = 0, cut_ = 0, garble_ = 0;
  std::vector<std::uint8_t> held_;
};

}  // namespace
}  // namespace twocone::emulator

int main(int argc, char** argv) {
  if (argc != 3) {
    std::cerr << "usage: emulated_controller PROTOCOL TTY|pty\n";
    return 2;
  }
  return twocone::emulator::Controller(argv[1], argv[2]).run();
}
