// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "apps/compare/comparison.h"
#include "apps/compare/images.h"
#include "apps/compare/side.h"
#include "apps/compare/sources.h"

/// The parts of find_sources(). Private to apps/compare.
namespace twocone::compare {

inline constexpr ModelSigmas kModel;

/// Adds a source whose numbers are not known yet. @param view of a cause of one view
Source& add_source(std::vector<Source>& sources, Cause cause, std::optional<vision::Side> view = std::nullopt);

/// Sets chi-squared and p-value of the components' differences under `covariance`, in the components' own units.
void judge(Source& source, const Eigen::MatrixXd& covariance);
/// Sets the same for components without correlation.
void judge(Source& source);

/// Adds the sources of the two calibrations: views, alignment, exposure times, wheels.
void add_rig_sources(const Side& simulated, const Side& real, std::vector<Source>& sources);

}  // namespace twocone::compare
