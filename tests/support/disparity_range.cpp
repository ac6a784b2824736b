// SPDX-License-Identifier: Apache-2.0
#include "tests/support/disparity_range.h"

#include <cmath>
#include <stdexcept>
#include <string>

#include <fmt/format.h>

namespace twocone::vision {
namespace {

void require_positive(std::string& bad, const char* name, double value, const char* unit) {
  if (!(value > 0) || !std::isfinite(value)) bad += fmt::format(" {} is {} {}, must be > 0;", name, value, unit);
}

}  // namespace

InverseRange range_from_disparity(double disparity_px, double sigma_px, const DisparityGeometry& geometry) {
  std::string bad;
  require_positive(bad, "focal_length_px", geometry.focal_length_px, "px");
  require_positive(bad, "mirror_separation_m", geometry.mirror_separation_m, "m");
  require_positive(bad, "lens_to_tip_m", geometry.lens_to_tip_m, "m");
  require_positive(bad, "rim_radius_px", geometry.rim_radius_px, "px");
  require_positive(bad, "sigma_px", sigma_px, "px");
  if (!bad.empty()) throw std::invalid_argument("range_from_disparity:" + bad);

  InverseRange answer;
  if (!std::isfinite(disparity_px) || disparity_px > geometry.rim_radius_px) {
    answer.verdict = RangeVerdict::kImpossible;
    return answer;
  }
  const double scale = geometry.focal_length_px * geometry.mirror_separation_m;  // v s, px m
  answer.inverse_per_m = disparity_px / scale;
  answer.sigma_inverse_per_m = sigma_px / scale;
  if (!std::isfinite(answer.inverse_per_m) || !std::isfinite(answer.sigma_inverse_per_m)) {  // sizes of no real rig
    answer = {};
    answer.verdict = RangeVerdict::kImpossible;
    return answer;
  }
  if (!(disparity_px >= kMinSigmas * sigma_px)) return answer;
  const double from_v_m = scale / disparity_px;
  const double range_m = from_v_m - geometry.lens_to_tip_m;
  if (!(range_m > 0) || !std::isfinite(range_m) || !std::isfinite(from_v_m * (sigma_px / disparity_px))) {
    answer.verdict = RangeVerdict::kImpossible;
    return answer;
  }
  answer.verdict = RangeVerdict::kOk;
  answer.range_m = range_m;
  answer.sigma_range_m = from_v_m * (sigma_px / disparity_px);
  return answer;
}

}  // namespace twocone::vision
