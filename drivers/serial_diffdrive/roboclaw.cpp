// SPDX-License-Identifier: Apache-2.0
#include "drivers/serial_diffdrive/message_formats.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <fmt/format.h>
#include <boost/crc.hpp>
#include <boost/endian/conversion.hpp>

#include "base/errors.h"
#include "base/log.h"
#include "hal/device_info.h"

namespace twocone::serial {
namespace {

using std::chrono::milliseconds;

constexpr std::uint8_t kSetTimeout = 14;
constexpr std::uint8_t kReadTimeout = 15;
constexpr std::uint8_t kReadVersion = 21;
constexpr std::uint8_t kReadVoltage = 24;
constexpr std::uint8_t kDriveBoth = 37;
constexpr std::uint8_t kReadCounts = 78;
constexpr std::uint8_t kAccepted = 0xFF;
constexpr std::size_t kCrcBytes = 2;
constexpr std::size_t kLongestVersion = 48;
constexpr std::size_t kLongestNoise = 256;
constexpr milliseconds kTimeoutUnit{100};
// The unit answers within 10 ms; at 9600 baud and behind a USB adapter it takes longer.
constexpr milliseconds kRoboclawReplyTime{50};
// The unit discards a packet whose next byte takes more than 10 ms.
constexpr milliseconds kForgets{12};
constexpr int kRoboclawTries = 3;
constexpr unsigned kReadingsPerCheck = 16;

std::int32_t whole(double rate) {
  constexpr double kMost = std::numeric_limits<std::int32_t>::max();
  return static_cast<std::int32_t>(std::lround(std::clamp(rate, -kMost, kMost)));
}

class Roboclaw final : public Protocol {
 public:
  Roboclaw(std::uint8_t address, std::chrono::nanoseconds command_timeout)
      : address_(address),
        timeout_(
            std::clamp<std::int64_t>(command_timeout / kTimeoutUnit, 1, std::numeric_limits<std::uint8_t>::max())) {}

  [[nodiscard]] int usual_baud() const override { return 38400; }
  [[nodiscard]] int counter_bits() const override { return 32; }

  Result<std::string> greet(Transport& transport, Deadline deadline) override {
    // After this pause the unit has discarded a packet that another program left half sent.
    transport.pause(kForgets);
    auto version = read_version(transport);
    while (!version && version.error().code != ErrorCode::kDisconnected && transport.now() < deadline) {
      version = read_version(transport);
    }
    if (!version) return version.error();
    is_in_step_ = true;  // the version's answer has a checksum too
    const std::array<std::uint8_t, 1> timeout{static_cast<std::uint8_t>(timeout_)};
    if (auto set = command(transport, kSetTimeout, timeout); !set) return set.error();
    readings_ = 0;
    if (auto kept = check_timeout(transport, ErrorCode::kRefused); !kept) return kept.error();
    return version;
  }

  Status drive(Transport& transport, const CountRates& rates) override {
    std::array<std::uint8_t, 8> data{};
    boost::endian::store_big_s32(data.data(), whole(rates.left));
    boost::endian::store_big_s32(data.data() + 4, whole(rates.right));
    return command(transport, kDriveBoth, data);
  }

  Result<RawCounts> read_counts(Transport& transport) override {
    const auto data = ask(transport, kReadCounts, 8);
    if (!data) return data.error();
    // After an unnoticed reset the unit would be without its time-out.
    if (++readings_ % kReadingsPerCheck == 0) {
      if (auto kept = check_timeout(transport, ErrorCode::kDisconnected); !kept) return kept.error();
    }
    return RawCounts{boost::endian::load_big_u32(data->data()), boost::endian::load_big_u32(data->data() + 4)};
  }

  // Leading zeros could be taken as the end of a half-sent packet, so the stop packet is sent twice instead. If the
  // first copy completes a half-sent packet, that packet's CRC is wrong, and the unit discards both.
  [[nodiscard]] std::vector<std::uint8_t> stop_bytes() const override {
    std::vector<std::uint8_t> bytes = write_packet(address_, kDriveBoth, std::array<std::uint8_t, 8>{});
    const std::vector<std::uint8_t> once = bytes;
    bytes.insert(bytes.end(), once.begin(), once.end());
    return bytes;
  }
  [[nodiscard]] std::optional<milliseconds> own_timeout() const override { return timeout_ * kTimeoutUnit; }
  void note_stops(std::uint32_t times) override { is_in_step_ = is_in_step_ && times == 0; }

 private:
  Status check_timeout(Transport& transport, ErrorCode otherwise) {
    const auto kept = ask(transport, kReadTimeout, 1);
    if (!kept) return kept.error();
    if (kept->front() == timeout_) return {};
    return Error{otherwise,
                 fmt::format("its serial time-out was set to {} ms, and it reports {} ms; set it in packet serial "
                             "mode, and check whether it was reset",
                             timeout_ * kTimeoutUnit.count(), int(kept->front()) * kTimeoutUnit.count())};
  }

  /// Sends a command. Speeds and settings may safely be sent again.
  Status command(Transport& transport, std::uint8_t number, std::span<const std::uint8_t> data) {
    const auto packet = write_packet(address_, number, data);
    Status last;
    for (int i = 0; i < kRoboclawTries; ++i) {
      if (auto ready = get_in_step(transport); !ready) return ready;
      const Deadline deadline = transport.in(kRoboclawReplyTime);
      if (auto sent = transport.write(packet, deadline); !sent) return sent;
      const auto answer = read(transport, 1, deadline);
      if (answer && answer->front() == kAccepted) return {};
      is_in_step_ = false;
      last = answer ? Error(ErrorCode::kBadData, "command {}: answer 0x{:02X}, where 0xFF was expected", number,
                            answer->front())
                    : answer.error();
      if (last.error().code == ErrorCode::kDisconnected) break;
    }
    return last;
  }

  Result<std::vector<std::uint8_t>> ask(Transport& transport, std::uint8_t number, std::size_t bytes) {
    Status last;
    for (int i = 0; i < kRoboclawTries; ++i) {
      if (auto ready = get_in_step(transport); !ready) return ready.error();
      if (auto sent = send_question(transport, number); !sent) return sent.error();
      const auto reply = read(transport, bytes + kCrcBytes, transport.in(kRoboclawReplyTime));
      if (reply) {
        if (const auto data = reply_data(address_, number, *reply)) return std::vector(data->begin(), data->end());
      }
      is_in_step_ = false;
      last = reply ? Error(ErrorCode::kBadData, "command {}: the answer's checksum is wrong", number) : reply.error();
      if (last.error().code == ErrorCode::kDisconnected) break;
    }
    return last.error();
  }

  /// Synchronises with the unit's answers. After a failed exchange, and after stops that another process wrote, answers
  /// may be in transit that look like those of any command. A question is therefore sent whose answer has a checksum
  /// over the question, and which differs from the last one: all bytes before that answer are old.
  Status get_in_step(Transport& transport) {
    if (is_in_step_) return transport.discard_input();
    base::Logger("serial").warning("an answer is missing or wrong; synchronising again");
    transport.pause(kForgets);
    question_ = question_ == kReadTimeout ? kReadVoltage : kReadTimeout;
    if (auto sent = send_question(transport, question_); !sent) return sent;
    const std::size_t size = (question_ == kReadTimeout ? 1 : 2) + kCrcBytes;
    const Deadline deadline = transport.in(kRoboclawReplyTime);
    std::vector<std::uint8_t> received;
    while (true) {
      const auto byte = read(transport, 1, deadline);
      if (!byte && byte.error().code == ErrorCode::kTimeout && !received.empty()) {
        return Error(ErrorCode::kBadData, "command {}: {} bytes came, and no answer", question_, received.size());
      }
      if (!byte) return byte.error();
      received.push_back(byte->front());
      if (received.size() >= size && reply_data(address_, question_, std::span(received).last(size))) break;
      if (received.size() == kLongestNoise) return Error{ErrorCode::kBadData, "bytes without end, and no answer"};
    }
    is_in_step_ = true;
    return {};
  }

  Status send_question(Transport& transport, std::uint8_t number) {
    if (auto clean = transport.discard_input(); !clean) return clean;
    const std::array<std::uint8_t, 2> question{address_, number};
    return transport.write(question, transport.in(kRoboclawReplyTime));
  }

  /// Reads the version: text of any length up to LF NUL.
  Result<std::string> read_version(Transport& transport) {
    if (auto sent = send_question(transport, kReadVersion); !sent) return sent.error();
    const Deadline deadline = transport.in(2 * kRoboclawReplyTime);
    std::vector<std::uint8_t> reply;
    while (reply.empty() || reply.back() != 0) {
      if (reply.size() == kLongestVersion) return Error{ErrorCode::kBadData, "a version text without end"};
      const auto byte = read(transport, 1, deadline);
      if (!byte) return byte.error();
      reply.push_back(byte->front());
    }
    const auto crc = read(transport, kCrcBytes, deadline);
    if (!crc) return crc.error();
    reply.insert(reply.end(), crc->begin(), crc->end());
    const auto data = reply_data(address_, kReadVersion, reply);
    if (!data) return Error{ErrorCode::kBadData, "the checksum of its version is wrong"};
    const std::string version(data->begin(), data->end());
    return printable(version.substr(0, version.find_first_of(std::string_view("\n\0", 2))));
  }

  static Result<std::vector<std::uint8_t>> read(Transport& transport, std::size_t bytes, Deadline deadline) {
    std::vector<std::uint8_t> reply(bytes);
    std::size_t got = 0;
    while (got < bytes) {
      const auto more = transport.read(std::span(reply).subspan(got), deadline);
      if (!more) {
        if (more.error().code != ErrorCode::kTimeout || got == 0) return more.error();
        return Error(ErrorCode::kBadData, "{} of {} bytes of an answer came", got, bytes);
      }
      got += *more;
    }
    return reply;
  }

  const std::uint8_t address_;
  const std::int64_t timeout_;  // in units of 100 ms
  unsigned readings_ = 0;       // since greet()
  bool is_in_step_ = true;      // no answer is in transit
  std::uint8_t question_ = kReadTimeout;
};

}  // namespace

std::uint16_t crc16(std::span<const std::uint8_t> bytes, std::uint16_t from) {
  boost::crc_optimal<16, 0x1021> crc(from);
  crc.process_bytes(bytes.data(), bytes.size());
  return crc.checksum();
}

std::vector<std::uint8_t> write_packet(std::uint8_t address, std::uint8_t command, std::span<const std::uint8_t> data) {
  std::vector<std::uint8_t> packet;
  packet.reserve(2 + data.size() + kCrcBytes);
  packet.push_back(address);
  packet.push_back(command);
  packet.insert(packet.end(), data.begin(), data.end());
  const std::uint16_t crc = crc16(packet);
  packet.resize(packet.size() + kCrcBytes);
  boost::endian::store_big_u16(packet.data() + packet.size() - kCrcBytes, crc);
  return packet;
}

std::optional<std::span<const std::uint8_t>> reply_data(std::uint8_t address, std::uint8_t command,
                                                        std::span<const std::uint8_t> reply) {
  if (reply.size() < kCrcBytes) return std::nullopt;
  const auto data = reply.first(reply.size() - kCrcBytes);
  const std::array<std::uint8_t, 2> question{address, command};
  if (crc16(data, crc16(question)) != boost::endian::load_big_u16(reply.last(kCrcBytes).data())) return std::nullopt;
  return data;
}

std::unique_ptr<Protocol> make_roboclaw(std::uint8_t address, std::chrono::nanoseconds command_timeout) {
  if (address < 0x80 || address > 0x87) {
    throw base::InvalidArgument("roboclaw: address is 0x{:02X}, must be 0x80 to 0x87", address);
  }
  return std::make_unique<Roboclaw>(address, command_timeout);
}

}  // namespace twocone::serial
