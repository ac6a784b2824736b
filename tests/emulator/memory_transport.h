// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <chrono>
#include <deque>
#include <functional>
#include <memory>
#include <thread>

#include "drivers/serial_diffdrive/transport.h"
#include "tests/emulator/firmware.h"

namespace twocone::emulator {

/// Faults of the transport. Each number counts the next answers that have the fault.
struct TransportFaults {
  int lose_answers = 0;      ///< answers that never arrive
  int delay_answers = 0;     ///< answers that arrive together with the answer after them
  int double_answers = 0;    ///< answers that arrive twice
  int truncate_answers = 0;  ///< answers that arrive without their last byte
  int garble_answers = 0;    ///< answers that arrive with a bit inverted in each byte
  bool unplugged = false;
};

/// An emulator at the other end of a transport in memory, in real time. The two ends of the transport share it.
struct Bench {
  explicit Bench(std::string_view protocol) : firmware(make_firmware(protocol)) {}

  std::unique_ptr<Firmware> firmware;
  TransportFaults faults;
  std::deque<std::uint8_t> to_host;
  std::vector<std::uint8_t> held;
  std::vector<std::uint8_t> received;  ///< all bytes that the host has sent
  const std::chrono::steady_clock::time_point begin = std::chrono::steady_clock::now();

  [[nodiscard]] double now_s() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  }
  void pass_time() {
    std::vector<std::uint8_t> out;
    firmware->pass_time(now_s(), out);
    send(out);
  }
  void send(std::vector<std::uint8_t> out) {
    if (out.empty()) return;
    const auto due = [](int& count) { return count > 0 && count-- > 0; };
    if (due(faults.lose_answers)) return;
    if (due(faults.truncate_answers)) out.pop_back();
    if (due(faults.garble_answers)) {
      for (auto& byte : out) byte ^= 0x10;
    }
    if (due(faults.delay_answers)) {
      held.insert(held.end(), out.begin(), out.end());
      return;
    }
    to_host.insert(to_host.end(), held.begin(), held.end());
    held.clear();
    to_host.insert(to_host.end(), out.begin(), out.end());
    if (due(faults.double_answers)) to_host.insert(to_host.end(), out.begin(), out.end());
  }
};

class MemoryTransport final : public serial::Transport {
 public:
  explicit MemoryTransport(std::shared_ptr<Bench> bench) : bench_(std::move(bench)) {}

  Status write(std::span<const std::uint8_t> bytes, serial::Deadline /*deadline*/) override {
    if (bench_->faults.unplugged) return gone();
    bench_->received.insert(bench_->received.end(), bytes.begin(), bytes.end());
    bench_->pass_time();
    std::vector<std::uint8_t> out;
    bench_->firmware->receive(bytes, bench_->now_s(), out);
    bench_->send(out);
    return {};
  }
  Result<std::size_t> read(std::span<std::uint8_t> room, serial::Deadline deadline) override {
    while (true) {
      if (bench_->faults.unplugged) return gone();
      bench_->pass_time();
      const std::size_t count = std::min(room.size(), bench_->to_host.size());
      if (count > 0) {
        std::copy_n(bench_->to_host.begin(), count, room.begin());
        bench_->to_host.erase(bench_->to_host.begin(), bench_->to_host.begin() + std::ptrdiff_t(count));
        return count;
      }
      if (std::chrono::steady_clock::now() >= deadline) return Error{ErrorCode::kTimeout, "no answer"};
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }
  Status discard_input() override {
    if (bench_->faults.unplugged) return gone();
    bench_->pass_time();
    bench_->to_host.clear();
    return {};
  }

 private:
  static Error gone() { return {ErrorCode::kDisconnected, "the transport is gone"}; }
  std::shared_ptr<Bench> bench_;
};

}  // namespace twocone::emulator
