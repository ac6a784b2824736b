// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "vision/full/view_fitter.h"
#include "vision/ranging.h"

namespace twocone::vision {

/// The least that a view shows of a landmark which stands free, in pixels: at Target::greatest_range_m, in the
/// direction in which it appears smallest, its wedge from Finder::kSureRadius_px to its top. Not below
/// Finder::kLeastArea_px, and that where the target has no height or no greatest range.
double least_area_px(const MirrorView& view, const Target& target);

/// Whether a view shows a landmark's colour where the first candidate is not, as much of it as half a landmark would
/// show: in shadow a landmark loses its colour, and things hide it.
enum class Rivals {
  kNone,
  kApart,   ///< elsewhere
  kBeside,  ///< in the candidate, which is wider than a landmark whose top is there
};
/// What lies within the width of one landmark is none, as parts of a landmark do before which a mast stands.
/// @param found with a candidate @param least_px least_area_px()
Rivals rivals_of(const ViewFitter& fitter, const Target& target, const Found& found, double least_px);

}  // namespace twocone::vision
