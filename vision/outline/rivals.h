// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "vision/outline/view_fitter.h"

namespace twocone::vision {

/// The least area, in pixels, of an unobstructed landmark in a view: that of its wedge from Finder::kSureRadius_px to
/// its top, at Landmark::greatest_range_m, in the direction in which it appears smallest. It is at least
/// Finder::kLeastArea_px, and equal to that where the target has no greatest range.
double least_area_px(const MirrorView& view, const Landmark& target);

/// Whether a view shows a landmark's colour outside the first candidate, with at least half of a landmark's least area.
/// Half of it, because a landmark loses its colour in shadow and objects may hide a part of it.
enum class Rivals {
  kNone,
  kApart,   ///< elsewhere
  kBeside,  ///< in the candidate, which is wider than a landmark with its top there
};
/// Colour within the width of one landmark is no rival: it may be a part of a landmark that a mast splits.
/// @param found with a candidate @param least_px least_area_px()
Rivals rivals_of(const ViewFitter& fitter, const Landmark& target, const Found& found, double least_px);

}  // namespace twocone::vision
