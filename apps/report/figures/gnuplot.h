// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hal/result.h"

namespace twocone::report {

/// A picture behind a plot, in the plot's own pixels from its upper left corner.
struct Underlay {
  double x_px = 0, y_px = 0, width_px = 0, height_px = 0;
  std::vector<std::uint8_t> jpeg;
};

/// One figure to be drawn.
struct Plot {
  std::string stem;   ///< of the files' names
  std::string title;  ///< for readers who hear the page
  int width_px = 900;
  int height_px = 420;
  std::string commands;  ///< after the common style
  std::optional<Underlay> underlay;
};

/// gnuplot as a child program. What it draws depends on the plot alone: the user's own start-up files are not read.
class Gnuplot {
 public:
  /// @param program a path, or a name looked up in PATH
  /// @param folder for the scripts, which stay beside the figures so that one can be redrawn by hand; draw() wants it
  /// to exist
  /// @param timeout for one figure, > 0
  Gnuplot(std::string program, std::filesystem::path folder, std::chrono::milliseconds timeout);

  /// It is there. Error kUnavailable: says what to install.
  [[nodiscard]] Status check() const;

  /// check(), and makes the folder. Error kUnavailable.
  [[nodiscard]] Status prepare() const;

  /// Writes STEM.gp, draws it and writes STEM.svg; returns the SVG's text.
  /// Errors: those of run_program and write_file; kBadData with gnuplot's own words.
  [[nodiscard]] Result<std::string> draw(const Plot& plot) const;

 private:
  std::string program_;
  std::filesystem::path folder_;
  std::chrono::milliseconds timeout_;
};

/// `text` as a gnuplot string constant in which nothing is special; line breaks become blanks.
std::string gnuplot_string(std::string_view text);

/// A value of a data block; NaN, which gnuplot leaves out and breaks a line at, for none.
std::string number(std::optional<double> value);

/// A data block that plots can name: "$name". @param rows each ended by a line break
std::string data_block(std::string_view name, std::string_view rows);

/// One plot of all that is given; an empty one for nothing. @param plots as gnuplot's `plot` takes them
std::string plot_command(const std::vector<std::string>& plots);

/// Writes the whole file or leaves the old one: a neighbour is written first and renamed.
/// Error kUnavailable: names the file and the reason.
Status write_file(const std::filesystem::path& file, std::string_view content);

}  // namespace twocone::report
