// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "apps/compare/comparison.h"
#include "apps/report/kit/figure.h"

/// The sections, images, words and numbers of the page. Functions whose names contain _html return the inner HTML of a
/// section. A figure that fails has no SVG, and a note is added. Private to apps/compare/show.
namespace twocone::compare {

/// Returns the sources: first those that differ, with advice, then in a folded part those that agree and those that the
/// data do not determine.
std::string causes_html(const Comparison& comparison);

/// Returns the gaps before and after, as bars and as a table.
std::string gaps_html(const Comparison& comparison);

/// Returns the stages with lights and limits.
std::string stages_html(const Comparison& comparison);

/// Returns the frames: a slider through the exhibits (report::script()) and one for the blend; empty without exhibits.
/// @param notes receives a note for everything that could not be shown
std::string exhibits_html(const Comparison& comparison, std::vector<std::string>& notes);

/// Draws range residuals against time and against range, on one scale: simulated, real as measured, real corrected.
/// Panels without residuals are left out.
std::vector<report::Figure> draw_residuals(const Comparison& comparison, const report::DrawingTools& tools);

/// Draws both paths and the real odometry over the arena from above, or over its plan if the map has no scene or the
/// scene cannot be rendered. Returns nothing without a path.
std::vector<report::Figure> draw_paths(const Comparison& comparison, const report::DrawingTools& tools);

/// The images of one view of an exhibit, CV_8UC3 r g b; empty if missing.
struct ExhibitView {
  vision::Side view = vision::Side::kLower;
  cv::Mat simulated, real;  ///< original images, reduced to the width of the page; of one size if both exist
  /// Unrolled images on one axis of bearings, relative to the real robot's heading. The simulated strip is turned to
  /// it.
  cv::Mat simulated_strip, real_strip;
  /// real_strip - simulated_strip in brightness, coloured by difference_colour().
  cv::Mat difference;
  std::optional<double> mean_difference_grey;  ///< mean of its absolute values
  std::vector<std::string> notes;              ///< a sentence for each part that is missing or was resized

  [[nodiscard]] std::string name() const { return std::string(to_string(view)); }
};

/// Brightness differences of this many grey levels or more have the strongest colour.
inline constexpr int kStrongestDifference_grey = 64;

/// Returns a colour, r g b: warm if the real image is brighter, cool if it is darker, nearly white if both are equal.
/// @param grey real - simulated
cv::Vec3b difference_colour(double grey);

/// Returns the lower view, then the upper one. Notes state missing and unreadable images, and rigs that cannot unroll
/// them.
std::array<ExhibitView, 2> read_images(const Comparison& comparison, const Exhibit& exhibit);

/// Formats with four significant digits; an en dash for no value and for one that is not finite.
std::string plain_number(std::optional<double> value);

/// Formats `value` to the last significant digit of `sigma`.
std::string to_precision_of(double sigma, double value);

/// Formats "+2.00 ± 0.10"; without a finite sigma > 0 the value alone. @param value with its sign
std::string with_sigma(double value, double sigma);

/// Formats "62 %", "−3 %", "< 1 %".
std::string percent(double share);

/// Formats "0.004", "1e-09", "< 1e-99".
std::string chance(double p_value);

/// Returns a component's name without its unit and without the words of its source's name: "rim radius".
std::string short_name(const Source& source, const Component& component);

/// Returns the sources that differ, by descending order of the largest part of a gap that each one explains.
std::vector<const Source*> sources_by_share(const Comparison& comparison);

/// Returns "Differs: ...", with the most certain component of each source, or "No difference found."; if no source
/// could be tested, a sentence that states this.
std::string headline(const Comparison& comparison);
/// Returns a sentence with the numbers of sources that agree and that are not determined; empty if both are 0.
std::string headline_tests(const Comparison& comparison);

/// Returns HTML: shape, colour and word.
std::string light_html(Light light);

}  // namespace twocone::compare
