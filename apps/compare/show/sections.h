// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "apps/compare/comparison.h"
#include "apps/report/kit/figure.h"

/// The parts of the page. Functions with _html return the inner HTML of a section. A figure that fails has no SVG and
/// adds a note. Private to apps/compare/show.
namespace twocone::compare {

/// Returns the sources: those that differ with advice, then, folded, those that agree and those that are not
/// determined.
std::string causes_html(const Comparison& comparison);

/// Returns the gaps before and after, as bars and as a table.
std::string gaps_html(const Comparison& comparison);

/// Returns the stages with lights and limits.
std::string stages_html(const Comparison& comparison);

/// Returns the frames: a slider through the exhibits (report::script()) and one for the blend (page_script()). Empty
/// without exhibits. @param notes receives what could not be shown
std::string exhibits_html(const Comparison& comparison, std::vector<std::string>& notes);

/// Draws range residuals against time and against range, on one scale: simulated, real as measured, real corrected.
/// Panels without residuals are left out.
std::vector<report::Figure> draw_residuals(const Comparison& comparison, const report::DrawingTools& tools);

/// Draws both paths and the real odometry over the arena from above, or over its plan where there is no scene or it
/// cannot be rendered. Returns nothing without a path.
std::vector<report::Figure> draw_paths(const Comparison& comparison, const report::DrawingTools& tools);

}  // namespace twocone::compare
