// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>
#include <string_view>

namespace twocone::report {

// The colours of Okabe and Ito, which people with any common kind of colour vision can distinguish.
inline constexpr std::string_view kTruthColour = "#222222";
inline constexpr std::string_view kFixColour = "#d55e00";
inline constexpr std::string_view kOdometryColour = "#0072b2";
inline constexpr std::string_view kBoundColour = "#009e73";
inline constexpr std::string_view kPaperColour = "#888888";

/// Returns a landmark's own colour: "#rrggbb", sRGB. @param colour linear rgb, limited to [0, 1]
std::string own_colour(const std::array<double, 3>& colour);

/// Returns the same hue, dark enough for a thin line on white.
std::string line_colour(const std::array<double, 3>& colour);

}  // namespace twocone::report
