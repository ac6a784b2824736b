// SPDX-License-Identifier: Apache-2.0
#include "drivers/serial_diffdrive/ros_arduino_bridge.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string>

#include <fmt/format.h>

namespace twocone::serial {
namespace {

using std::chrono::milliseconds;

// The firmware's speed unit: counts in each of its control intervals, 1000/30 ms in whole milliseconds.
constexpr double kInterval_s = 0.033;
// The firmware reads 16 bit numbers.
constexpr double kMostPerInterval = 32767;
// Replies take 2 to 8 ms at 57600 baud; USB adapters hold bytes back for 16.
constexpr milliseconds kReplyTime{60};
// Opening an Uno's or a Mega's port resets it, and its boot loader is silent for so long.
constexpr milliseconds kBootSlice{250};
constexpr std::size_t kLongestLine = 64;
constexpr int kTries = 2;
constexpr std::string_view kDone = "OK";
constexpr std::string_view kInvalid = "Invalid Command";

std::span<const std::uint8_t> bytes_of(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

class RosArduinoBridge final : public Protocol {
 public:
  [[nodiscard]] int usual_baud() const override { return 57600; }
  [[nodiscard]] int counter_bits() const override { return 32; }

  Result<std::string> greet(Wire& wire, Deadline deadline) override {
    Error last{ErrorCode::kTimeout, "no answer"};
    while (std::chrono::steady_clock::now() < deadline) {
      if (auto quiet = resynchronise(wire, std::min(deadline, in(kBootSlice))); !quiet) {
        if (quiet.error().code == ErrorCode::kDisconnected) return quiet.error();
        last = quiet.error();
        continue;
      }
      const auto baud = ask(wire, "b", is_baud);
      if (baud) {
        carry_ = {};
        return fmt::format("ros_arduino_bridge at {} baud", *baud);
      }
      if (baud.error().code == ErrorCode::kDisconnected) return baud.error();
      last = baud.error();
    }
    return last;
  }

  Status drive(Wire& wire, const CountRates& rates) override {
    const int left = per_interval(rates.left, carry_.left);
    const int right = per_interval(rates.right, carry_.right);
    const auto answer = ask(wire, fmt::format("m {} {}", left, right), is_done);
    if (!answer) return answer.error();
    return {};
  }

  Result<RawCounts> read_counts(Wire& wire) override {
    const auto answer = ask(wire, "e", is_counts);
    if (!answer) return answer.error();
    return *parse_counts(*answer);
  }

  // The first CR ends what a program may have left half sent.
  [[nodiscard]] std::vector<std::uint8_t> stop_bytes() const override {
    const auto bytes = bytes_of("\rm 0 0\r");
    return {bytes.begin(), bytes.end()};
  }
  [[nodiscard]] std::optional<milliseconds> own_timeout() const override { return milliseconds(2000); }

 private:
  /// Counts in an interval, whole ones: what is left over is carried into the next command, so that the mean is right.
  static int per_interval(double rate, double& carry) {
    if (rate == 0) return static_cast<int>(carry = 0);
    const double wanted = std::clamp(rate * kInterval_s, -kMostPerInterval, kMostPerInterval) + carry;
    const double sent = std::clamp(std::round(wanted), -kMostPerInterval, kMostPerInterval);
    carry = wanted - sent;
    return static_cast<int>(sent);
  }

  static bool is_done(std::string_view line) { return line == kDone; }
  static bool is_counts(std::string_view line) { return parse_counts(line).has_value(); }
  static bool is_baud(std::string_view line) {
    int rate = 0;
    const auto [end, error] = std::from_chars(line.data(), line.data() + line.size(), rate);
    return error == std::errc() && end == line.data() + line.size() && rate > 0;
  }

  /// A command and its line, tried again where that is none: whatever is said here may be said twice. Leaves the wire
  /// clean.
  Result<std::string> ask(Wire& wire, const std::string& command, bool (*fits)(std::string_view)) {
    Error last{};
    for (int i = 0; i < kTries; ++i) {
      auto line = ask_once(wire, command);
      if (line && fits(*line)) return line;
      last = line ? unexpected(command, *line) : line.error();
      if (last.code == ErrorCode::kDisconnected || !resynchronise(wire, in(kReplyTime))) break;
    }
    return last;
  }

  Result<std::string> ask_once(Wire& wire, const std::string& command) {
    if (auto clean = wire.discard_input(); !clean) return clean.error();
    const Deadline deadline = in(kReplyTime);
    if (auto sent = say(wire, command, deadline); !sent) return sent.error();
    return read_line(wire, deadline);
  }

  /// Each CR is answered by one line, in order: what a CR alone is answered comes after all that is late. Answers that
  /// were lost are given up with the deadline.
  Status resynchronise(Wire& wire, Deadline deadline) {
    if (auto sent = say(wire, "", deadline); !sent) return sent;
    bool is_clean = false;
    while (owed_ > 0) {
      const auto line = read_line(wire, deadline);
      if (line) {
        is_clean = *line == kInvalid;
      } else if (line.error().code != ErrorCode::kBadData || std::chrono::steady_clock::now() >= deadline) {
        owed_ = 0;
        if (!is_clean || line.error().code == ErrorCode::kDisconnected) return line.error();
      }
    }
    if (!is_clean) return Error{ErrorCode::kBadData, "answers that belong to nothing asked"};
    return wire.discard_input();
  }

  Status say(Wire& wire, const std::string& command, Deadline deadline) {
    ++owed_;
    return wire.write(bytes_of(command + '\r'), deadline);
  }

  static Error unexpected(const std::string& command, const std::string& answer) {
    if (answer == kInvalid) {
      return {ErrorCode::kRefused,
              fmt::format("'{}' in answer to {}: firmware without USE_BASE, or a disturbed line", answer, command)};
    }
    return {ErrorCode::kBadData, fmt::format("'{}' in answer to {}", printable(answer), command)};
  }

  static std::string printable(std::string text) {
    std::replace_if(
        text.begin(), text.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
    return text;
  }

  /// Up to CR LF, without it.
  Result<std::string> read_line(Wire& wire, Deadline deadline) {
    std::string line;
    while (true) {
      std::uint8_t byte = 0;
      const auto got = wire.read({&byte, 1}, deadline);
      if (!got) {
        if (got.error().code != ErrorCode::kTimeout || line.empty()) return got.error();
        return Error{ErrorCode::kBadData, fmt::format("only '{}' of an answer came", printable(line))};
      }
      if (byte == '\n') {
        owed_ = std::max(owed_ - 1, 0);
        if (!line.empty() && line.back() == '\r') line.pop_back();
        return line;
      }
      if (line.size() == kLongestLine) {
        return Error{ErrorCode::kBadData, fmt::format("a line without end: '{}'", printable(line))};
      }
      line.push_back(static_cast<char>(byte));
    }
  }

  CountRates carry_;
  int owed_ = 0;  // lines that have not come
};

}  // namespace

std::optional<RawCounts> parse_counts(std::string_view line) {
  const auto number = [](std::string_view text) -> std::optional<std::uint32_t> {
    std::int32_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (text.empty() || error != std::errc() || end != text.data() + text.size()) return std::nullopt;
    return static_cast<std::uint32_t>(value);
  };
  const auto space = line.find(' ');
  if (space == std::string_view::npos) return std::nullopt;
  const auto left = number(line.substr(0, space));
  const auto right = number(line.substr(space + 1));
  if (!left || !right) return std::nullopt;
  return RawCounts{*left, *right};
}

std::unique_ptr<Protocol> make_ros_arduino_bridge() { return std::make_unique<RosArduinoBridge>(); }

}  // namespace twocone::serial
