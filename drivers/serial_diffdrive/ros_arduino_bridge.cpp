// SPDX-License-Identifier: Apache-2.0
#include "drivers/serial_diffdrive/ros_arduino_bridge.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string>

#include <fmt/format.h>

#include "hal/text.h"

namespace twocone::serial {
namespace {

using std::chrono::milliseconds;

// The firmware's speed unit: counts in each of its control intervals, 1000/30 ms in whole milliseconds.
constexpr double kInterval_s = 0.033;
// The firmware reads 16 bit numbers.
constexpr double kMostPerInterval = 32767;
// Replies take 2 to 8 ms at 57600 baud; USB adapters hold bytes back for 16.
constexpr milliseconds kReplyTime{60};
// While a board boots, which takes a second or two, it is asked again after so long.
constexpr milliseconds kBootSlice{120};
// With the gains that the firmware comes with (20:12:0:50, whole numbers), its control loop changes a wheel's power
// only where the speed is wrong by 2.5 counts in an interval or more, and from rest it changes nothing below that.
constexpr double kUsualDeadBand = 2.5;
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
    while (wire.now() < deadline) {
      if (auto ready = get_in_step(wire, std::min(deadline, wire.in(kBootSlice)))) {
        carry_ = {};
        return fmt::format("ros_arduino_bridge at {} baud", baud_);
      } else if (ready.error().code == ErrorCode::kDisconnected) {
        return ready.error();
      } else {
        last = ready.error();
      }
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

  // The first CR ends what a program may have left half sent; each of the two is answered.
  static constexpr int kLinesOfAStop = 2;
  [[nodiscard]] std::vector<std::uint8_t> stop_bytes() const override {
    const auto bytes = bytes_of("\rm 0 0\r");
    return {bytes.begin(), bytes.end()};
  }
  [[nodiscard]] std::optional<milliseconds> own_timeout() const override { return milliseconds(2000); }
  void note_stops(std::uint32_t times) override { owed_ += int(times) * kLinesOfAStop; }
  // Below one count in an interval zeros would be sent in between, each of which resets the control loop.
  [[nodiscard]] double least_command() const override { return 1 / kInterval_s; }
  [[nodiscard]] double usual_least_rate() const override { return kUsualDeadBand / kInterval_s; }

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
  static std::optional<int> parse_baud(std::string_view line) {
    int rate = 0;
    const auto [end, error] = std::from_chars(line.data(), line.data() + line.size(), rate);
    if (error != std::errc() || end != line.data() + line.size() || rate <= 0) return std::nullopt;
    return rate;
  }

  /// A command and its line, tried again where that is none: whatever is said here may be said twice.
  Result<std::string> ask(Wire& wire, const std::string& command, bool (*fits)(std::string_view)) {
    Error last{};
    for (int i = 0; i < kTries; ++i) {
      if (owed_ > 0) {
        if (auto ready = get_in_step(wire, wire.in(kReplyTime)); !ready) return i > 0 ? last : ready.error();
      }
      auto line = ask_once(wire, command);
      if (line && fits(*line)) return line;
      owed_ = std::max(owed_, 1);  // whatever that line belonged to
      last = line ? unexpected(command, *line) : line.error();
      if (last.code == ErrorCode::kDisconnected) break;
    }
    return last;
  }

  Result<std::string> ask_once(Wire& wire, const std::string& command) {
    if (auto clean = wire.discard_input(); !clean) return clean.error();
    const Deadline deadline = wire.in(kReplyTime);
    ++owed_;
    if (auto sent = wire.write(bytes_of(command + '\r'), deadline); !sent) return sent.error();
    return read_line(wire, deadline);
  }

  /// Finds the place in the controller's answers behind which the next one is that of the next command. Each CR is
  /// answered by one line, in order, but lines get lost, and others write to the port, too; so the number of lines that
  /// are owed proves nothing. What does is a request whose answer nothing else gives: the baud rate, then so many lines
  /// for a CR alone, then the baud rate. How many tells it from the last two such requests, whose answers may come
  /// late. Two rates with one such line between are the end of one request and the beginning of the next.
  Status get_in_step(Wire& wire, Deadline deadline) {
    constexpr int kFewest = 2, kMost = 4;
    between_ = between_ >= kMost ? kFewest : between_ + 1;
    // The first CR ends what was left half sent.
    const std::string request = "\rb\r" + std::string(std::size_t(between_), '\r') + "b\r";
    owed_ += 3 + between_;
    if (auto sent = wire.write(bytes_of(request), deadline); !sent) return sent;
    std::optional<int> rate;  // of the last line that was one, with nothing but `between` such lines after it
    int between = 0;
    bool has_come = false;
    while (true) {
      const auto line = read_line(wire, deadline);
      if (!line && (line.error().code != ErrorCode::kBadData || wire.now() >= deadline)) {
        if (line.error().code != ErrorCode::kTimeout || !has_come) return line.error();
        return Error{ErrorCode::kBadData, "answers that belong to nothing asked"};
      }
      has_come = true;
      const auto found = line ? parse_baud(*line) : std::nullopt;
      if (found && found == rate && between == between_) break;
      if (found) {
        rate = found;
        between = 0;
      } else if (line && *line == kInvalid) {
        ++between;
      } else {
        rate.reset();
      }
    }
    baud_ = *rate;
    owed_ = 0;
    return {};
  }

  static Error unexpected(const std::string& command, const std::string& answer) {
    if (answer == kInvalid) {
      return {ErrorCode::kRefused,
              fmt::format("'{}' in answer to {}; build the firmware with USE_BASE, or look for what disturbs the line",
                          answer, command)};
    }
    return {ErrorCode::kBadData, fmt::format("'{}' in answer to {}", printable(answer), command)};
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
  int owed_ = 0;     // lines that have not come, as far as is known
  int between_ = 0;  // of the last request of get_in_step
  int baud_ = 0;     // as the controller said last
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
