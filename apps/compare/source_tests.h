// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include "apps/compare/comparison.h"
#include "apps/compare/pictures.h"
#include "apps/compare/side.h"
#include "apps/compare/sources.h"

/// The parts of find_sources(). Private to apps/compare.
namespace twocone::compare {

inline constexpr ModelSigmas kModel;

/// chi-squared and its tail of the components' differences under `covariance`, in the components' own units.
void judge(Source& source, const Eigen::MatrixXd& covariance);
/// The same for components that do not hang together.
void judge(Source& source);

/// What the two calibrations tell: views, alignment, times of exposure, wheels.
void add_rig_sources(const Side& simulated, const Side& real, std::vector<Source>& sources);

/// Colours, noise and sharpness of one view. @param where lower or upper
void add_picture_sources(const ViewPictures& view, const char* where, std::vector<Source>& sources);

}  // namespace twocone::compare
