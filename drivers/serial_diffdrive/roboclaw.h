// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "drivers/serial_diffdrive/protocol.h"

/// RoboClaw's packet serial (Basicmicro, RoboClaw Series User Manual).
namespace twocone::serial {

/// CRC-16/XMODEM: polynomial 0x1021, initial value 0, no reflection.
std::uint16_t crc16(std::span<const std::uint8_t> bytes, std::uint16_t from = 0);

/// Makes a write packet: address, command, data, CRC over all of them.
std::vector<std::uint8_t> write_packet(std::uint8_t address, std::uint8_t command, std::span<const std::uint8_t> data);

/// The data of a reply to a read packet; nothing if its CRC, which covers address, command and data, is wrong.
std::optional<std::span<const std::uint8_t>> reply_data(std::uint8_t address, std::uint8_t command,
                                                        std::span<const std::uint8_t> reply);

/// @throws std::invalid_argument for an address that is not 0x80 to 0x87
std::unique_ptr<Protocol> make_roboclaw(std::uint8_t address, std::chrono::nanoseconds command_timeout);

}  // namespace twocone::serial
