// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>
#include <string_view>

namespace twocone::report {

// Okabe and Ito's colours, told apart by every common kind of colour vision.
inline constexpr std::string_view kTruthColour = "#222222";
inline constexpr std::string_view kFixColour = "#d55e00";
inline constexpr std::string_view kOdometryColour = "#0072b2";
inline constexpr std::string_view kBoundColour = "#009e73";
inline constexpr std::string_view kPaperColour = "#888888";

/// A landmark's colour as it is: "#rrggbb", sRGB. @param colour linear rgb, cut to [0, 1]
std::string own_colour(const std::array<double, 3>& colour);

/// The same hue, dark enough for a thin line on white.
std::string line_colour(const std::array<double, 3>& colour);

/// One colour for each reason why there is no answer, the same in every figure and table.
std::string verdict_colour(std::string_view verdict);

/// The verdict of that method in plain words; empty for one that is not known here.
std::string_view verdict_meaning(std::string_view verdict, std::string_view method);

}  // namespace twocone::report
