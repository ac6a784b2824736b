// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "apps/report/figures/gnuplot.h"
#include "apps/runlog/run_data.h"
#include "apps/runlog/summary/summary.h"

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

/// The data and tools that every figure is drawn with.
struct Drawing {
  const runlog::RunData& run;
  const runlog::Summary& summary;
  const Gnuplot& gnuplot;
  std::filesystem::path folder;     ///< figures/
  std::vector<std::string>& notes;  ///< what could not be drawn and why
};

/// Draws `plot` into `figure`; a failure becomes a note and an empty figure.
inline Figure drawn(const Gnuplot& gnuplot, std::vector<std::string>& notes, Figure figure, Plot plot) {
  plot.stem = figure.stem;
  plot.title = figure.title;
  Result<std::string> svg = gnuplot.draw(plot);
  if (svg) {
    figure.svg = std::move(*svg);
  } else {
    notes.push_back("The figure \"" + figure.title + "\" is missing: " + svg.error().message);
  }
  return figure;
}

inline Figure drawn(const Drawing& drawing, Figure figure, Plot plot) {
  return drawn(drawing.gnuplot, drawing.notes, std::move(figure), std::move(plot));
}

}  // namespace twocone::report
