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

#include "drivers/serial_diffdrive/transport.h"
#include "tests/emulator/firmware.h"

namespace twocone::emulator {

/// Runs an emulated firmware on a socket, or on a non-blocking terminal, in real time, in its own thread.
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

  /// Calls `look` with the firmware while its thread is blocked.
  template <typename Look>
  auto with(Look look) {
    const std::lock_guard lock(mutex_);
    pass_time();
    return look(*firmware_);
  }
  /// The time at which its wheels last stopped; the clock's zero if they turn, or never turned.
  std::chrono::steady_clock::time_point stopped_at() {
    return with([this](Firmware&) { return stopped_at_; });
  }
  bool turns() {
    return with([](Firmware& firmware) { return firmware.wheels.turn(); });
  }
  /// Processes the bytes that were sent to it now, because its own thread may be late.
  void catch_up() {
    const std::lock_guard lock(mutex_);
    listen();
    pass_time();
  }
  /// Makes the board neither send nor receive, as while it boots.
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
    // Bytes that do not fit are lost, as on a real line.
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
    if (turned_ && !turns) stopped_at_ = std::chrono::steady_clock::now();
    if (turns) stopped_at_ = {};
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
  std::chrono::steady_clock::time_point stopped_at_{};
  std::thread thread_;
};

/// A transport over a descriptor, like a serial port.
class DescriptorTransport final : public serial::Transport {
 public:
  explicit DescriptorTransport(int descriptor) : descriptor_(descriptor) {}
  ~DescriptorTransport() override { ::close(descriptor_); }

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
  static Error gone() { return {ErrorCode::kDisconnected, "the transport is gone"}; }
  const int descriptor_;
};

}  // namespace twocone::emulator
