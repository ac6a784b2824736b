// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "drivers/serial_diffdrive/protocol.h"

/// iRobot's Open Interface as Create 2 and Roomba 600 speak it.
namespace twocone::serial {

enum class OiMode : std::uint8_t { kOff, kPassive, kSafe, kFull };

/// What one stream frame of packets 7, 43, 44 and 35 says.
struct Create2Sensors {
  std::uint8_t bumps_and_drops = 0;  ///< packet 7: bit 2 right, bit 3 left wheel drop
  RawCounts counts;                  ///< packets 43 and 44, 16 bits each
  OiMode mode = OiMode::kOff;        ///< packet 35
};

/// Finds frames in what the robot sends: 19, N, (id, data)*, checksum; a frame's bytes and checksum add up to 0 in
/// eight bits. After bytes that are no frame it looks for the next header among them, so that none is skipped.
class Create2Stream {
 public:
  /// What the byte completed, if it completed a frame of all four packets.
  std::optional<Create2Sensors> push(std::uint8_t byte);
  /// Bytes that belonged to no frame, so far.
  [[nodiscard]] std::uint64_t rubbish() const { return rubbish_; }

 private:
  std::optional<Create2Sensors> take_front();

  std::vector<std::uint8_t> waiting_;  // begins with a header, or is empty
  std::uint64_t rubbish_ = 0;
};

std::unique_ptr<Protocol> make_create2();

}  // namespace twocone::serial
