// SPDX-License-Identifier: Apache-2.0
#include "drivers/serial_diffdrive/message_formats.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string>

#include <fmt/format.h>

#include "base/log.h"
#include "hal/device_info.h"

namespace twocone::serial {
namespace {

using std::chrono::milliseconds;

// The firmware's speed unit is counts per control interval. The interval is 1000/30 ms in whole milliseconds.
constexpr double kInterval_s = 0.033;
// The firmware reads 16-bit numbers.
constexpr double kMostPerInterval = 32767;
// Replies take 2 to 8 ms at 57600 baud; USB adapters delay bytes by up to 16 ms.
constexpr milliseconds kBridgeReplyTime{60};
// While a board boots, which takes a second or two, the request is repeated after this time.
constexpr milliseconds kBootSlice{120};
// With the firmware's default gains (20:12:0:50, integers), its control loop changes a wheel's power only if the speed
// error is 2.5 counts per interval or more. So it does not start a stopped wheel below that.
constexpr double kUsualDeadBand = 2.5;
constexpr std::size_t kLongestLine = 64;
constexpr int kBridgeTries = 2;
constexpr std::string_view kDone = "OK";
constexpr std::string_view kInvalid = "Invalid Command";

std::span<const std::uint8_t> bytes_of(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

/// Returns the number that is the whole text.
std::optional<std::int32_t> parse_number(std::string_view text) {
  std::int32_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

class RosArduinoBridge final : public Protocol {
 public:
  [[nodiscard]] int usual_baud() const override { return 57600; }
  [[nodiscard]] int counter_bits() const override { return 32; }

  Result<std::string> greet(Transport& transport, Deadline deadline) override {
    Error last{ErrorCode::kTimeout, "no answer"};
    while (transport.now() < deadline) {
      if (auto ready = get_in_step(transport, std::min(deadline, transport.in(kBootSlice)))) {
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

  Status drive(Transport& transport, const CountRates& rates) override {
    const int left = per_interval(rates.left, carry_.left);
    const int right = per_interval(rates.right, carry_.right);
    const auto answer = ask(transport, fmt::format("m {} {}", left, right), is_done);
    if (!answer) return answer.error();
    return {};
  }

  Result<RawCounts> read_counts(Transport& transport) override {
    const auto answer = ask(transport, "e", is_counts);
    if (!answer) return answer.error();
    return *parse_counts(*answer);
  }

  // The first CR ends a line that a program may have left half sent. Each of the two CRs is answered.
  static constexpr int kLinesOfAStop = 2;
  [[nodiscard]] std::vector<std::uint8_t> stop_bytes() const override {
    const auto bytes = bytes_of("\rm 0 0\r");
    return {bytes.begin(), bytes.end()};
  }
  [[nodiscard]] std::optional<milliseconds> own_timeout() const override { return milliseconds(2000); }
  void note_stops(std::uint32_t times) override { owed_ += int(times) * kLinesOfAStop; }
  // Below one count per interval, zeros would be sent in between, and each zero resets the control loop.
  [[nodiscard]] double least_command() const override { return 1 / kInterval_s; }
  [[nodiscard]] double usual_least_rate() const override { return kUsualDeadBand / kInterval_s; }

 private:
  /// Returns whole counts per interval. The remainder is carried into the next command, so that the mean is correct.
  static int per_interval(double rate, double& carry) {
    if (rate == 0) return static_cast<int>(carry = 0);
    const double wanted = std::clamp(rate * kInterval_s, -kMostPerInterval, kMostPerInterval) + carry;
    const double sent = std::clamp(std::round(wanted), -kMostPerInterval, kMostPerInterval);
    carry = wanted - sent;
    return static_cast<int>(sent);
  }

  static bool is_done(std::string_view line) { return line == kDone; }
  static bool is_counts(std::string_view line) { return parse_counts(line).has_value(); }

  /// Sends a command and reads its line; tries again if the line does not fit. It is safe to send any command here
  /// twice.
  Result<std::string> ask(Transport& transport, const std::string& command, bool (*fits)(std::string_view)) {
    Status last;
    for (int i = 0; i < kBridgeTries; ++i) {
      if (owed_ > 0) {
        base::Logger("serial").warning("an answer is missing or wrong; synchronising again");
        if (auto ready = get_in_step(transport, transport.in(kBridgeReplyTime)); !ready)
          return i > 0 ? last.error() : ready.error();
      }
      auto line = ask_once(transport, command);
      if (line && fits(*line)) return line;
      owed_ = std::max(owed_, 1);  // that line may have belonged to an earlier command
      last = line ? unexpected(command, *line) : line.error();
      if (last.error().code == ErrorCode::kDisconnected) break;
    }
    return last.error();
  }

  Result<std::string> ask_once(Transport& transport, const std::string& command) {
    if (auto clean = transport.discard_input(); !clean) return clean.error();
    const Deadline deadline = transport.in(kBridgeReplyTime);
    ++owed_;
    if (auto sent = transport.write(bytes_of(command + '\r'), deadline); !sent) return sent.error();
    return read_line(transport, deadline);
  }

  /// Synchronises with the controller's answers: afterwards, the next line answers the next command. Each CR is
  /// answered by one line, in order, but lines get lost, and other processes write to the port too. The number of
  /// outstanding lines therefore proves nothing. A request with a unique answer does: baud rate, several lines for a CR
  /// alone, baud rate. The number of these lines differs from the last two such requests, whose answers may come late.
  /// Two rates with only one such line between them are the end of one request and the beginning of the next.
  Status get_in_step(Transport& transport, Deadline deadline) {
    constexpr int kFewest = 2, kMost = 4;
    between_ = between_ >= kMost ? kFewest : between_ + 1;
    // The first CR ends a line that was left half sent.
    const std::string request = "\rb\r" + std::string(std::size_t(between_), '\r') + "b\r";
    owed_ += 3 + between_;
    if (auto sent = transport.write(bytes_of(request), deadline); !sent) return sent;
    int rate = 0;  // the last rate, if only the `between` lines for a CR alone came after it; 0: none
    int between = 0;
    bool has_come = false;
    while (true) {
      const auto line = read_line(transport, deadline);
      if (!line && (line.error().code != ErrorCode::kBadData || transport.now() >= deadline)) {
        if (line.error().code != ErrorCode::kTimeout || !has_come) return line.error();
        return Error{ErrorCode::kBadData, "answers that belong to no request"};
      }
      has_come = true;
      const int found = line ? parse_number(*line).value_or(0) : 0;
      const bool is_rate = found > 0;
      if (is_rate && found == rate && between == between_) {
        baud_ = found;
        owed_ = 0;
        return {};
      }
      if (is_rate) {
        rate = found;
        between = 0;
      } else if (line && *line == kInvalid) {
        ++between;
      } else {
        rate = 0;
      }
    }
  }

  static Error unexpected(const std::string& command, const std::string& answer) {
    if (answer == kInvalid) {
      return Error(ErrorCode::kRefused,
                   "'{}' in answer to {}; build the firmware with USE_BASE, or look for what disturbs the line", answer,
                   command);
    }
    return Error(ErrorCode::kBadData, "'{}' in answer to {}", printable(answer), command);
  }

  /// Reads a line up to CR LF, and returns it without them.
  Result<std::string> read_line(Transport& transport, Deadline deadline) {
    std::string line;
    while (true) {
      std::uint8_t byte = 0;
      const auto got = transport.read({&byte, 1}, deadline);
      if (!got) {
        if (got.error().code != ErrorCode::kTimeout || line.empty()) return got.error();
        return Error(ErrorCode::kBadData, "only '{}' of an answer came", printable(line));
      }
      if (byte == '\n') {
        owed_ = std::max(owed_ - 1, 0);
        if (!line.empty() && line.back() == '\r') line.pop_back();
        return line;
      }
      if (line.size() == kLongestLine) {
        return Error(ErrorCode::kBadData, "a line without end: '{}'", printable(line));
      }
      line.push_back(static_cast<char>(byte));
    }
  }

  CountRates carry_;
  int owed_ = 0;     // answers that have not come yet, as far as is known
  int between_ = 0;  // lines for a CR alone in the last request of get_in_step()
  int baud_ = 0;     // as the controller last reported it
};

}  // namespace

std::optional<RawCounts> parse_counts(std::string_view line) {
  const auto space = line.find(' ');
  if (space == std::string_view::npos) return std::nullopt;
  const auto left = parse_number(line.substr(0, space));
  const auto right = parse_number(line.substr(space + 1));
  if (!left || !right) return std::nullopt;
  return RawCounts{std::uint32_t(*left), std::uint32_t(*right)};
}

std::unique_ptr<Protocol> make_ros_arduino_bridge() { return std::make_unique<RosArduinoBridge>(); }

}  // namespace twocone::serial
