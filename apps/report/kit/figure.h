// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "apps/report/kit/gnuplot.h"

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

/// A drawn figure.
struct Figure {
  std::string stem;    ///< figures/STEM.svg; also its identifier in the page
  std::string number;  ///< the figure of the paper that it corresponds to: "Figure 7"; empty for one of ours
  std::string title;
  std::string caption;  ///< plain text
  std::string svg;      ///< stand-alone; empty: could not be drawn
  bool wide = true;     ///< true: takes the page's width; false: two such figures stand side by side
};

/// What every figure of a page is drawn with.
struct DrawingTools {
  const Gnuplot& gnuplot;
  std::filesystem::path folder;     ///< figures/
  std::vector<std::string>& notes;  ///< what could not be drawn and why
};

/// Draws `plot` into `figure`; a failure becomes a note and an empty figure.
Figure drawn(const DrawingTools& tools, Figure figure, Plot plot);

/// Returns the figures that have an SVG with their captions as HTML; empty if none has.
std::string figures_html(const std::vector<Figure>& figures);

}  // namespace twocone::report
