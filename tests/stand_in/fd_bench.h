// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fcntl.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <mutex>
#include <thread>
#include <vector>

#include "drivers/serial_diffdrive/wire.h"
#include "tests/stand_in/firmware.h"

namespace twocone::stand_in {

/// Lets a firmware answer at a socket, or at a terminal that does not block, in real time, from a thread of its own.
class Server {
 public:
  Server(std::string_view protocol, int descriptor)
      : firmware_(make_firmware(protocol)), descriptor_(descriptor), thread_([this] { serve(); }) {}
  ~Server() {
    stop_ = true;
    thread_.join();
  }
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// Calls `look` with the firmware while it stands still.
  template <typename Look>
  auto with(Look look) {
    const std::lock_guard lock(mutex_);
    pass_time();
    return look(*firmware_);
  }
  /// When its wheels came to rest last; the beginning of time if they turn, or never turned.
  std::chrono::steady_clock::time_point rested_at() {
    return with([this](Firmware&) { return rested_at_; });
  }
  bool turns() {
    return with([](Firmware& firmware) { return firmware.wheels.turn(); });
  }
  /// Takes in what has been sent to it, now: its own thread may be late.
  void catch_up() {
    const std::lock_guard lock(mutex_);
    listen();
    pass_time();
  }
  /// A board that is silent and deaf, as one that boots.
  void set_dead(bool dead) { dead_ = dead; }

 private:
  double now_s() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count(); }
  void pass_time() {
    std::vector<std::uint8_t> out;
    firmware_->pass_time(now_s(), out);
    note();
    answer(out);
  }
  void answer(const std::vector<std::uint8_t>& out) {
    if (dead_ || out.empty()) return;
    // What does not fit is lost, as on a line.
    if (::send(descriptor_, out.data(), out.size(), MSG_NOSIGNAL | MSG_DONTWAIT) < 0 && errno == ENOTSOCK) {
      static_cast<void>(!::write(descriptor_, out.data(), out.size()));
    }
  }
  void listen() {
    std::vector<std::uint8_t> room(4096);
    std::vector<std::uint8_t> out;
    ssize_t got = ::recv(descriptor_, room.data(), room.size(), MSG_DONTWAIT);
    if (got < 0 && errno == ENOTSOCK) got = ::read(descriptor_, room.data(), room.size());
    if (got > 0 && !dead_) firmware_->receive({room.data(), std::size_t(got)}, now_s(), out);
    note();
    answer(out);
  }
  void note() {
    const bool turns = firmware_->wheels.turn();
    if (turned_ && !turns) rested_at_ = std::chrono::steady_clock::now();
    if (turns) rested_at_ = {};
    turned_ = turns;
  }
  void serve() {
    while (!stop_) {
      pollfd entry{descriptor_, POLLIN, 0};
      const int ready = ::poll(&entry, 1, 2);
      const std::lock_guard lock(mutex_);
      if (ready > 0 && (entry.revents & POLLIN) != 0) {
        listen();
      } else if (ready > 0) {
        std::this_thread::sleep_for(std::chrono::milliseconds(2));  // the host has hung up
      }
      pass_time();
    }
  }

  const std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  std::mutex mutex_;
  std::unique_ptr<Firmware> firmware_;
  const int descriptor_;
  std::atomic<bool> stop_{false};
  std::atomic<bool> dead_{false};
  bool turned_ = false;
  std::chrono::steady_clock::time_point rested_at_{};
  std::thread thread_;
};

/// A wire over a descriptor, as a serial port is one.
class DescriptorWire final : public serial::Wire {
 public:
  explicit DescriptorWire(int descriptor) : descriptor_(descriptor) {}
  ~DescriptorWire() override { ::close(descriptor_); }

  Status write(std::span<const std::uint8_t> bytes, serial::Deadline /*deadline*/) override {
    const ssize_t sent = ::send(descriptor_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent != ssize_t(bytes.size())) return gone();
    return {};
  }
  Result<std::size_t> read(std::span<std::uint8_t> room, serial::Deadline deadline) override {
    while (true) {
      const ssize_t got = ::recv(descriptor_, room.data(), room.size(), MSG_DONTWAIT);
      if (got > 0) return std::size_t(got);
      if (got == 0 || (errno != EAGAIN && errno != EINTR)) return gone();
      const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
      if (left.count() <= 0) return Error{ErrorCode::kTimeout, "no answer"};
      pollfd entry{descriptor_, POLLIN, 0};
      ::poll(&entry, 1, int(left.count()));
    }
  }
  Status discard_input() override {
    std::vector<std::uint8_t> room(4096);
    while (::recv(descriptor_, room.data(), room.size(), MSG_DONTWAIT) > 0) {
    }
    return {};
  }

 private:
  static Error gone() { return {ErrorCode::kDisconnected, "the wire is gone"}; }
  const int descriptor_;
};

}  // namespace twocone::stand_in
