// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "vision/bands/band_finder.h"
#include "vision/outline/view_fitter.h"
#include "vision/outline_ranging.h"
#include "vision/triangulation.h"

namespace twocone::vision {

/// What is searched for and how sure of it the robot is; the same for all frames.
struct OutlineRanging::Impl {
  Impl(const Rig& the_rig, const std::vector<Landmark>& all, cv::Size lower_size, cv::Size upper_size,
       const std::vector<std::size_t>& which, const BeliefErrors& errors);

  /// Returns how much later than the frame's time a sighting is believed to be exposed, s.
  [[nodiscard]] double late_s(std::size_t view, const Sighting& seen, const FrameMotion& motion) const;
  /// @param lower,upper null where the view does not show the landmark
  [[nodiscard]] Triangulation place(std::size_t k, const Sighting* lower, const Sighting* upper,
                                    const std::optional<double>& top_m, const std::optional<FrameMotion>& motion) const;
  /// Returns the outline of a landmark in one view, at the time at which it is exposed there.
  /// @param at_frame at the frame's time
  [[nodiscard]] Cylinder when_exposed(std::size_t view, const Cylinder& at_frame,
                                      const std::optional<FrameMotion>& motion) const;
  [[nodiscard]] bool is_exact(std::size_t k) const { return belief.is_exact() && by_shared[k].cols() == 0; }
  /// Returns whether another target has the same colour, or one that pixels cannot distinguish from it.
  [[nodiscard]] bool is_same_colour(std::size_t k) const;
  [[nodiscard]] bool shares_hue(std::size_t k) const;
  [[nodiscard]] bool shares_number(std::size_t k) const;
  [[nodiscard]] Surface surface_of(std::size_t k) const;

  UncertainRig belief;
  BySharedErrors<kTimeNumbers> times;                       ///< BeliefErrors::times
  double sighting_px;                                       ///< BeliefErrors::sighting_px
  std::vector<BySharedErrors<kLandmarkNumbers>> by_shared;  ///< of each target
  std::vector<Landmark> targets;
  std::vector<std::size_t> hues;  ///< of each target: index into the table's colours
  ColourTable table;
  std::array<ViewFitter, 2> views;
  std::vector<BandFinder> band_finders;  ///< by Side; none without a banded target
  std::vector<bool> wanted;
  std::vector<bool> wanted_hues;                ///< by the table's colours
  std::vector<std::array<double, 2>> least_px;  ///< least_area_px() of each target in each view

 private:
  [[nodiscard]] double share(std::size_t view, const Sighting& seen) const;
};

}  // namespace twocone::vision
