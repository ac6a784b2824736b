// SPDX-License-Identifier: Apache-2.0
#include "apps/survey/widths.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include "vision/unhidden_width.h"

namespace twocone::survey {
namespace {

// All widths of a view are widened by the same amount, whose prior sigma this is. One width has an error of its own
// besides its noise. The stated sigma of a radius is never less than kLeastRadiusShare of the radius.
constexpr double kWidening_px = 0.3;
constexpr double kWidthError_px = 0.1;
constexpr double kLeastRadiusShare = 0.005;

}  // namespace

void remove_narrow(std::vector<vision::CalibrationFrame>& frames, const std::vector<Landmark>& landmarks) {
  std::vector<vision::UnhiddenWidth> unhidden(landmarks.size());
  for (const vision::CalibrationFrame& frame : frames) {
    for (const vision::LandmarkSighting& seen : frame.sightings) {
      const auto& width = seen.sighting.width;
      if (width) unhidden[seen.landmark].add(*width, landmarks[seen.landmark].radius_m);
    }
  }
  for (vision::CalibrationFrame& frame : frames) {
    std::vector<bool> is_hidden(landmarks.size(), false);
    for (const vision::LandmarkSighting& seen : frame.sightings) {
      const auto& width = seen.sighting.width;
      if (width && unhidden[seen.landmark].is_hidden(*width, landmarks[seen.landmark].radius_m)) {
        is_hidden[seen.landmark] = true;
      }
    }
    std::erase_if(frame.sightings, [&](const vision::LandmarkSighting& seen) { return is_hidden[seen.landmark]; });
  }
}

void measure_radii(const std::vector<vision::CalibrationFrame>& frames, std::vector<Landmark>& landmarks) {
  const auto count = Eigen::Index(landmarks.size());
  // Unknowns: the true radius over the believed one, of each landmark; the widening of both views, px.
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(count + 2, count + 2);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(count + 2);
  std::vector<std::size_t> widths(landmarks.size(), 0);
  for (Eigen::Index view = count; view < count + 2; ++view) normal(view, view) = 1 / (kWidening_px * kWidening_px);
  for (const vision::CalibrationFrame& frame : frames) {
    for (const vision::LandmarkSighting& seen : frame.sightings) {
      const auto& width = seen.sighting.width;
      if (!width) continue;
      const auto i = Eigen::Index(seen.landmark);
      const Eigen::Index view = count + (seen.side == vision::Side::kLower ? 0 : 1);
      const double weight = 1 / (width->sigma_px * width->sigma_px + kWidthError_px * kWidthError_px);
      normal(i, i) += weight * width->expected_px * width->expected_px;
      normal(i, view) += weight * width->expected_px;
      normal(view, i) += weight * width->expected_px;
      normal(view, view) += weight;
      right[i] += weight * width->expected_px * width->seen_px;
      right[view] += weight * width->seen_px;
      ++widths[seen.landmark];
    }
  }
  for (Eigen::Index i = 0; i < count; ++i) {
    if (widths[std::size_t(i)] == 0) normal(i, i) = 1;
  }
  const auto factor = normal.ldlt();
  const Eigen::VectorXd answer = factor.solve(right);
  const Eigen::MatrixXd covariance = factor.solve(Eigen::MatrixXd::Identity(count + 2, count + 2));
  for (Eigen::Index i = 0; i < count; ++i) {
    if (widths[std::size_t(i)] == 0) continue;
    Landmark& landmark = landmarks[std::size_t(i)];
    // Few widths, and a widening of their own size, may give anything.
    landmark.radius_m *= std::clamp(answer[i], 0.5, 2.0);
    // The errors of one landmark's widths are those of its light, so that they do not average away over frames.
    const double own = std::sqrt(covariance(i, i) * double(widths[std::size_t(i)]));
    landmark.sigma.radius_m = landmark.radius_m * std::max(kLeastRadiusShare, own);
  }
}

}  // namespace twocone::survey
