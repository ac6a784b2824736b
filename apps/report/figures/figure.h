// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "apps/report/figures/gnuplot.h"
#include "apps/runs/run_data.h"
#include "apps/runs/summary.h"

namespace twocone::report {

/// A drawn figure.
struct Figure {
  std::string stem;    ///< figures/STEM.svg; also its identifier in the page
  std::string number;  ///< which figure of the paper it stands for: "Figure 7"; empty for one of ours
  std::string title;
  std::string caption;  ///< plain text
  std::string svg;      ///< stand-alone; empty: there is none
  bool wide = true;     ///< needs the page's width; otherwise two stand side by side
};

/// What every figure is drawn from and with.
struct Drawing {
  const runs::RunData& run;
  const runs::Summary& summary;
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
