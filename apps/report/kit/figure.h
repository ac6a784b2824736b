// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hal/result.h"

/// Figures: their plots, which gnuplot draws, their colours and their HTML.
namespace twocone::report {

/// A figure for gnuplot.
struct Plot {
  std::string stem{};   ///< names the files: STEM.gp, STEM.svg
  std::string title{};  ///< for readers who use a screen reader
  int width_px = 900;
  int height_px = 420;
  std::string commands{};  ///< appended to the common style
  std::string underlay{};  ///< SVG behind the plot, in its pixels from the upper left corner: svg_image(); may be empty
};

/// gnuplot as a child program. Its drawing depends on the plot alone: the user's own start-up files are not read.
struct Gnuplot {
  std::string program;  ///< a path, or a name looked up in PATH
  /// Receives the scripts, which stay beside the figures so that one can be redrawn by hand; draw() requires that it
  /// exists.
  std::filesystem::path folder;

  /// Checks that gnuplot runs and creates the folder. Error kUnavailable: names the package to install.
  [[nodiscard]] Status prepare() const;

  /// Writes STEM.gp, draws it and writes STEM.svg; returns the SVG's text.
  /// Errors: those of run_program and write_file; kBadData with gnuplot's own message.
  [[nodiscard]] Result<std::string> draw(const Plot& plot) const;
};

/// Returns `text` as a gnuplot string constant without special characters; line breaks become blanks.
std::string gnuplot_string(std::string_view text);

/// Returns a value of a data block. No value becomes NaN, where gnuplot draws nothing and breaks a line.
std::string number(std::optional<double> value);

/// Returns a data block that plots can name: "$name". @param rows each ends with a line break
std::string data_block(std::string_view name, std::string_view rows);

/// Returns one plot of all `plots`; an empty plot if there are none. @param plots as gnuplot's `plot` takes them
std::string plot_command(const std::vector<std::string>& plots);

/// Returns the end of an axis on which errors can be read: the largest value, or 1.5 times the 98th percentile where a
/// few values lie more than 3 times that percentile out; those must then be marked at the edge. @param values >= 0;
/// values that are not finite are ignored
double readable_limit(std::vector<double> values);

/// Writes the whole file or leaves the old one, as runlog::write_whole.
/// Error kUnavailable: names the file and the reason.
Status write_file(const std::filesystem::path& file, std::string_view content);

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
  std::string stem{};    ///< figures/STEM.svg; also its identifier in the page
  std::string number{};  ///< the figure of the paper that it corresponds to: "Figure 7"; empty for one of ours
  std::string title{};
  std::string caption{};  ///< plain text
  std::string svg{};      ///< stand-alone; empty: could not be drawn, or there is nothing to draw
  bool wide = true;       ///< true: takes the page's width; false: two such figures stand side by side
};

/// What every figure of a page is drawn with.
struct DrawingTools {
  const Gnuplot& gnuplot;
  std::vector<std::string>& notes;  ///< what could not be drawn and why
};

/// Draws `plot` into `figure`; a failure becomes a note and an empty figure.
Figure drawn(const DrawingTools& tools, Figure figure, Plot plot);

/// Returns the figures that have an SVG with their captions as HTML; empty if none has.
std::string figures_html(const std::vector<Figure>& figures);

}  // namespace twocone::report
