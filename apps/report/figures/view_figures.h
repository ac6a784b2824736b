// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/report/figures/drawing.h"

namespace twocone::report {

/// Draws figure 9: the upper mirror's image on the lower one's, with the matches of the paper's method circled, for the
/// frame with the most ranges. Returns nothing, and adds a note, without images.
std::optional<Figure> draw_superimposed(const Drawing& drawing);

/// Draws both mirrors' images unrolled, one above the other on the same bearings, for three frames of the run, with the
/// landmarks named at their measured bearings. Returns nothing without images.
std::optional<Figure> draw_strips(const Drawing& drawing);

/// One frame of the run for the page's slider.
struct FrameView {
  std::uint64_t frame = 0;
  double t_s = 0;
  std::string svg;
};

/// Returns at most `count` frames, evenly spaced over the run; frames without images are left out.
std::vector<FrameView> frame_views(const runlog::RunData& run, int count);

}  // namespace twocone::report
