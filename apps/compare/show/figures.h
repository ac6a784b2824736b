// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/compare/comparison.h"
#include "apps/report/figures/figure.h"
#include "drivers/sim_povray/sim_povray.h"

/// Figures that gnuplot draws. One that fails has no SVG, and a note. Private to apps/compare/show.
namespace twocone::compare {

struct Drawing {
  const Comparison& comparison;
  const report::Gnuplot& gnuplot;
  std::filesystem::path folder;     ///< figures/
  std::vector<std::string>& notes;  ///< what could not be drawn and why
};

/// Range residuals against time and against range: simulated, real as it was, real put right, on one scale. Those for
/// which there are no residuals are left out.
std::vector<report::Figure> draw_residuals(const Drawing& drawing);

/// Both paths and the real odometry over the arena from above, or over its plan where there is no scene or it cannot be
/// rendered. Nothing without a path.
std::optional<report::Figure> draw_paths(const Drawing& drawing, const sim_povray::RenderSettings& render);

}  // namespace twocone::compare
