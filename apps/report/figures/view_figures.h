// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/report/figures/figure.h"

namespace twocone::report {

/// Figure 9: the upper mirror's image on the lower one's, with the paper's matches circled, of the frame with the most
/// ranges. Nothing, and a note, without pictures.
std::optional<Figure> draw_superimposed(const Drawing& drawing);

/// Both mirrors' images unrolled, one above the other on the same bearings, of three frames of the run, with the
/// landmarks named at their measured bearings. Nothing without pictures.
std::optional<Figure> draw_strips(const Drawing& drawing);

/// One frame of the run for the page's slider.
struct FrameView {
  std::uint64_t frame = 0;
  double t_s = 0;
  std::string svg;
};

/// At most `count` frames, evenly spaced over the run, those without pictures left out.
std::vector<FrameView> frame_views(const runs::RunData& run, int count);

}  // namespace twocone::report
