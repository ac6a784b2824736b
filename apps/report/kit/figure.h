// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "apps/report/kit/gnuplot.h"

namespace twocone::report {

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
