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
  std::string title{};  ///< text for screen readers
  int width_px = 900;
  int height_px = 420;
  std::string commands{};  ///< appended to the common style
  std::string underlay{};  ///< SVG behind the plot, in its pixels from the upper left corner: svg_image(); may be empty
};

/// gnuplot as a child program. Its drawing depends on the plot alone: the user's own start-up files are not read.
struct Gnuplot {
  std::string program;  ///< a path, or a name looked up in PATH
  /// Folder of the figures and their scripts, with which a figure can be drawn again by hand. draw() requires that it
  /// exists.
  std::filesystem::path folder;

  /// Checks that gnuplot runs, and creates the folder. Error: kUnavailable, which names the package to install.
  [[nodiscard]] Status prepare() const;

  /// Writes STEM.gp, draws it and writes STEM.svg; returns the SVG's text.
  /// Errors: those of run_program and write_file; kBadData with gnuplot's own message.
  [[nodiscard]] Result<std::string> draw(const Plot& plot) const;
};

/// Returns `text` as a gnuplot string constant without special characters; line breaks become blanks.
std::string gnuplot_string(std::string_view text);

/// Returns a value of a data block. A missing value becomes NaN, at which gnuplot draws nothing and breaks a line.
std::string number(std::optional<double> value);

/// Returns a data block that plots can name: "$name". @param rows each ends with a line break
std::string data_block(std::string_view name, std::string_view rows);

/// Returns one plot command for all `plots`; an empty plot without any. @param plots as arguments of gnuplot's `plot`
std::string plot_command(const std::vector<std::string>& plots);

/// Returns the end of an axis on which errors can be read. It is the largest value, or 1.5 times the 98th percentile if
/// a few values exceed 3 times that percentile; the caller must then mark those at the edge.
/// @param values >= 0; values that are not finite are ignored
double readable_limit(std::vector<double> values);

/// Writes the whole file or leaves the old one, as runlog::write_whole.
/// Error: kUnavailable, which names the file and the reason.
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
  std::string number{};  ///< the corresponding figure of the paper: "Figure 7"; empty if the paper has none
  std::string title{};
  std::string caption{};  ///< plain text
  std::string svg{};      ///< stand-alone; empty: nothing to draw, or drawing failed
  bool wide = true;       ///< true: takes the page's width; false: two such figures stand side by side
};

/// The tools that every figure of a page needs.
struct DrawingTools {
  const Gnuplot& gnuplot;
  std::vector<std::string>& notes;  ///< receives a note for each figure that could not be drawn, with the reason
};

/// Draws `plot` into `figure`; a failure becomes a note and an empty figure.
Figure drawn(const DrawingTools& tools, Figure figure, Plot plot);

/// Returns the figures that have an SVG with their captions as HTML; empty if none has.
std::string figures_html(const std::vector<Figure>& figures);

}  // namespace twocone::report
