// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "drivers/serial_diffdrive/protocol.h"

/// iRobot's Open Interface of Create 2 and Roomba 600.
namespace twocone::serial {

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
  /// The number of bytes so far that belonged to no frame.
  [[nodiscard]] std::uint64_t rubbish() const { return rubbish_; }

 private:
  std::optional<Create2Sensors> take_front();

  std::vector<std::uint8_t> waiting_;  // begins with a header, or is empty
  std::uint64_t rubbish_ = 0;
};

std::unique_ptr<Protocol> make_create2();

}  // namespace twocone::serial
