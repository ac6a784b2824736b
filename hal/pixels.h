// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

/// Converts rows of pixels from other layouts to kRgb8: `to` gets three bytes per pixel. Private to hal.
namespace twocone::pixels {

void from_bgr8(const std::uint8_t* from, std::size_t pixels, std::uint8_t* to);
void from_grey8(const std::uint8_t* from, std::size_t pixels, std::uint8_t* to);

// ITU-R BT.601, Y from 16 to 235; each pair of pixels shares its U and V.
void from_yuyv(const std::uint8_t* from, std::size_t pairs, std::uint8_t* to);
void from_uyvy(const std::uint8_t* from, std::size_t pairs, std::uint8_t* to);
/// @param light one row of luma
/// @param colours U V U V ..., shared by two rows of luma
void from_nv12(const std::uint8_t* light, const std::uint8_t* colours, std::size_t pairs, std::uint8_t* to);

}  // namespace twocone::pixels
