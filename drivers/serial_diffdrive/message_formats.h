// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "drivers/serial_diffdrive/protocol.h"

/// The protocols, and the format of their bytes.
namespace twocone::serial {

// ---- The ASCII protocol of ros_arduino_bridge (hbrobotics, joshnewans): a letter, arguments and CR; each is answered
// by one line.

/// Returns the two counts in a reply to `e`, such as "855 -820"; nothing for any other text.
std::optional<RawCounts> parse_counts(std::string_view line);

std::unique_ptr<Protocol> make_ros_arduino_bridge();

// ---- RoboClaw's packet serial (Basicmicro, RoboClaw Series User Manual).

/// Returns the CRC-16/XMODEM: polynomial 0x1021, initial value 0, no reflection.
std::uint16_t crc16(std::span<const std::uint8_t> bytes, std::uint16_t from = 0);

/// Makes a write packet: address, command, data, CRC over all of them.
std::vector<std::uint8_t> write_packet(std::uint8_t address, std::uint8_t command, std::span<const std::uint8_t> data);

/// Returns the data of a reply to a read packet; nothing if its CRC, which covers address, command and data, is wrong.
std::optional<std::span<const std::uint8_t>> reply_data(std::uint8_t address, std::uint8_t command,
                                                        std::span<const std::uint8_t> reply);

/// @throws std::invalid_argument for an address that is not 0x80 to 0x87
std::unique_ptr<Protocol> make_roboclaw(std::uint8_t address, std::chrono::nanoseconds command_timeout);

// ---- iRobot's Open Interface of Create 2 and Roomba 600.

/// The modes of the Open Interface.
enum class OiMode : std::uint8_t { kOff, kPassive, kSafe, kFull };

/// The content of one stream frame of packets 7, 43, 44 and 35.
struct Create2Sensors {
  std::uint8_t bumps_and_drops = 0;  ///< packet 7: bit 2 right, bit 3 left wheel drop
  RawCounts counts;                  ///< packets 43 and 44, 16 bits each
  OiMode mode = OiMode::kOff;        ///< packet 35
};

/// Finds frames in the robot's bytes: 19, N, (id, data)*, checksum. A frame's bytes and checksum add up to 0 modulo
/// 256. If bytes are not a frame, the search for the next header continues among them, so that no frame is skipped.
class Create2Stream {
 public:
  /// Returns the sensors if the byte completes a frame of all four packets.
  std::optional<Create2Sensors> push(std::uint8_t byte);
  /// Returns the number of bytes so far that belonged to no frame.
  [[nodiscard]] std::uint64_t rubbish() const { return rubbish_; }

 private:
  std::vector<std::uint8_t> waiting_;  // begins with a header, or is empty
  std::uint64_t rubbish_ = 0;
};

std::unique_ptr<Protocol> make_create2();

}  // namespace twocone::serial
