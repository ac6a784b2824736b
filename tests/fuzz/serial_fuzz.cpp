// SPDX-License-Identifier: Apache-2.0
// Feeds damaged answers to the protocols of the serial line. Each call must end, with a value or an error. The exit
// status is 1 if one does not. A crash or a report of a sanitizer ends the program earlier.
//   serial_fuzz PROTOCOL TIMES SEED
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "drivers/serial_diffdrive/message_formats.h"
#include "drivers/serial_diffdrive/protocol.h"

using namespace twocone;          // NOLINT(google-build-using-namespace): this is a separate program
using namespace twocone::serial;  // NOLINT(google-build-using-namespace): this is a separate program

namespace {

using Bytes = std::vector<std::uint8_t>;

class Garbage {
 public:
  explicit Garbage(std::uint64_t seed) : random_(seed) {}

  std::uint64_t below(std::uint64_t end) { return random_() % end; }

  /// Bytes between a controller's valid answer and noise.
  Bytes spoilt(Bytes bytes) {
    switch (below(8)) {
      case 0:
        return {};
      case 1:
        return noise(96);
      case 2:
        bytes.resize(below(bytes.size() + 1));
        break;
      case 3: {
        const Bytes once = bytes;
        bytes.insert(bytes.end(), once.begin(), once.end());
        break;
      }
      case 4: {
        Bytes before = noise(16);
        bytes.insert(bytes.begin(), before.begin(), before.end());
        break;
      }
      case 5:
        for (auto changes = below(4) + 1; changes > 0 && !bytes.empty(); --changes)
          bytes[below(bytes.size())] = value();
        break;
      case 6:
        if (!bytes.empty()) bytes[below(bytes.size())] ^= std::uint8_t(1U << below(8));
        break;
      default:
        break;  // unchanged
    }
    return bytes;
  }

 private:
  std::uint8_t value() {
    constexpr std::uint8_t kEdges[] = {0x00, 0x0A, 0x0D, 0x13, 0x20, 0x2D, 0x30, 0x7F, 0x80, 0xFF};
    return below(2) == 0 ? kEdges[below(std::size(kEdges))] : std::uint8_t(random_());
  }
  Bytes noise(std::uint64_t most) {
    Bytes bytes(below(most) + 1);
    for (auto& byte : bytes) byte = value();
    return bytes;
  }

  std::mt19937_64 random_;
};

/// A controller's valid answer to the bytes sent last, with random counts.
Bytes answer_to(const std::string& protocol, const Bytes& sent, Garbage& garbage) {
  const auto text = [](std::string_view words) { return Bytes(words.begin(), words.end()); };
  if (sent.empty()) return {};
  if (protocol == "ros_arduino_bridge") {
    // Each CR is answered by a line.
    std::string answers, line;
    for (const std::uint8_t byte : sent) {
      if (byte != '\r') {
        line.push_back(char(byte));
        continue;
      }
      const auto count = [&garbage] { return std::to_string(std::int32_t(garbage.below(1ULL << 32))); };
      if (line == "b") {
        answers += "57600\r\n";
      } else if (line.starts_with("m ")) {
        answers += "OK\r\n";
      } else if (line == "e") {
        answers += count() + " " + count() + "\r\n";
      } else {
        answers += "Invalid Command\r\n";
      }
      line.clear();
    }
    return text(answers);
  }
  if (protocol == "create2") {
    Bytes frame{19, 10, 7, std::uint8_t(garbage.below(16)), 43, 0, 0, 44, 0, 0, 35, std::uint8_t(garbage.below(5))};
    for (const std::size_t at : {5, 6, 8, 9}) frame[at] = std::uint8_t(garbage.below(256));
    std::uint8_t sum = 0;
    for (const std::uint8_t byte : frame) sum = std::uint8_t(sum + byte);
    frame.push_back(std::uint8_t(-sum));
    return frame;
  }
  if (sent.size() != 2) return {0xFF};
  Bytes data = sent[1] == 21 ? text(std::string_view("USB Roboclaw\n\0", 14)) : Bytes{5};
  if (sent[1] == 78) {
    data.clear();
    for (int i = 0; i < 8; ++i) data.push_back(std::uint8_t(garbage.below(256)));
  }
  const std::uint16_t crc = crc16(data, crc16(sent));
  data.push_back(std::uint8_t(crc >> 8));
  data.push_back(std::uint8_t(crc));
  return data;
}

/// A transport that damages the answers, without any waiting: if no answer comes, the deadline has already passed.
class SpoiltTransport final : public Transport {
 public:
  SpoiltTransport(std::string protocol, Garbage& garbage) : protocol_(std::move(protocol)), garbage_(garbage) {}

  Status write(std::span<const std::uint8_t> bytes, Deadline /*deadline*/) override {
    if (const auto ends = end()) return *ends;
    sent_.assign(bytes.begin(), bytes.end());
    come(garbage_.spoilt(answer_to(protocol_, sent_, garbage_)));
    return {};
  }
  Result<std::size_t> read(std::span<std::uint8_t> room, Deadline /*deadline*/) override {
    if (const auto ends = end()) return *ends;
    if (come_.empty()) return Error{ErrorCode::kTimeout, "no answer"};
    const std::size_t count = std::min({room.size(), come_.size(), std::size_t(garbage_.below(16) + 1)});
    std::copy_n(come_.begin(), count, room.begin());
    come_.erase(come_.begin(), come_.begin() + std::ptrdiff_t(count));
    return count;
  }
  Status discard_input() override {
    if (const auto ends = end()) return *ends;
    come_.clear();
    // Create 2 sends without a request, and other answers may be late.
    if (protocol_ == "create2" || garbage_.below(4) == 0) come(garbage_.spoilt(answer_to(protocol_, sent_, garbage_)));
    return {};
  }
  void pause(std::chrono::milliseconds /*time*/) override {}
  [[nodiscard]] std::uint64_t calls() const { return calls_; }

 private:
  std::optional<Error> end() {
    ++calls_;
    if (garbage_.below(256) != 0) return std::nullopt;
    return Error{garbage_.below(2) == 0 ? ErrorCode::kDisconnected : ErrorCode::kTimeout, "the transport"};
  }
  void come(const Bytes& bytes) { come_.insert(come_.end(), bytes.begin(), bytes.end()); }

  const std::string protocol_;
  Garbage& garbage_;
  Bytes sent_;
  Bytes come_;
  std::uint64_t calls_ = 0;
};

struct Tally {
  std::uint64_t values = 0;
  std::uint64_t errors = 0;

  template <typename T>
  void note(const Result<T>& result) {
    ++(result ? values : errors);
  }
};

/// Checks the rule of each decoder below the protocols.
bool decoders_hold(const std::string& protocol, Garbage& garbage, Create2Stream& stream) {
  Bytes sent(2);
  sent[0] = 0x80;
  sent[1] = 78;
  if (protocol == "ros_arduino_bridge") sent = {'e'};
  const Bytes bytes = garbage.spoilt(answer_to(protocol, sent, garbage));
  if (protocol == "ros_arduino_bridge") {
    std::string line(bytes.begin(), bytes.end());
    if (line.size() >= 2) line.resize(line.size() - 2);
    const auto counts = parse_counts(line);
    return !counts ||
           parse_counts(std::to_string(std::int32_t(counts->left)) + " " + std::to_string(std::int32_t(counts->right)));
  }
  if (protocol == "roboclaw") {
    const auto data = reply_data(0x80, 78, bytes);
    return !data || data->size() + 2 == bytes.size();
  }
  for (const std::uint8_t byte : bytes) {
    const auto sensors = stream.push(byte);
    if (sensors && (sensors->counts.left > 0xFFFF || sensors->counts.right > 0xFFFF || sensors->mode > OiMode::kFull)) {
      return false;
    }
  }
  return true;
}

int fuzz(const std::string& name, std::uint64_t times, std::uint64_t seed) {
  Garbage garbage(seed);
  Create2Stream stream;
  Tally tally;
  std::uint64_t most_calls = 0;
  auto protocol = make_protocol({.name = name});
  SpoiltTransport transport(name, garbage);
  for (std::uint64_t i = 0; i < times; ++i) {
    const std::uint64_t before = transport.calls();
    const auto what = garbage.below(8);
    if (what == 0)
      tally.note(protocol->greet(transport, std::chrono::steady_clock::now() + std::chrono::microseconds(5)));
    if (what == 1) tally.note(protocol->drive(transport, {double(i), -double(i)}));
    if (what > 1) tally.note(protocol->read_counts(transport));
    most_calls = std::max(most_calls, transport.calls() - before);
    if (!decoders_hold(name, garbage, stream)) return std::fputs("a decoder made up a value\n", stderr), 1;
  }
  constexpr std::uint64_t kMostCalls = 2'000;
  if (most_calls > kMostCalls) return std::fputs("an exchange does not end\n", stderr), 1;
  std::printf("%s: %llu inputs: %llu values, %llu errors; at most %llu calls of the transport in an exchange\n",
              name.c_str(), static_cast<unsigned long long>(times), static_cast<unsigned long long>(tally.values),
              static_cast<unsigned long long>(tally.errors), static_cast<unsigned long long>(most_calls));
  return tally.values == 0 || tally.errors == 0 ? 1 : 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) return std::fputs("serial_fuzz PROTOCOL TIMES SEED\n", stderr), 2;
  return fuzz(argv[1], std::strtoull(argv[2], nullptr, 10), std::strtoull(argv[3], nullptr, 10));
}
