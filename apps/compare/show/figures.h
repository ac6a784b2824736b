// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/compare/comparison.h"
#include "apps/report/figures/figure.h"
#include "drivers/sim_povray/render_settings.h"

/// Figures that gnuplot draws. A figure that fails has no SVG and adds a note. Private to apps/compare/show.
namespace twocone::compare {

struct Drawing {
  const Comparison& comparison;
  const report::Gnuplot& gnuplot;
  std::filesystem::path folder;     ///< figures/
  std::vector<std::string>& notes;  ///< what could not be drawn and why
};

/// Draws range residuals against time and against range, on one scale: simulated, real as measured, real corrected.
/// Panels without residuals are left out.
std::vector<report::Figure> draw_residuals(const Drawing& drawing);

/// Draws both paths and the real odometry over the arena from above, or over its plan where there is no scene or it
/// cannot be rendered. Returns nothing without a path.
std::optional<report::Figure> draw_paths(const Drawing& drawing, const sim_povray::RenderSettings& render);

}  // namespace twocone::compare
