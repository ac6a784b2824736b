// SPDX-License-Identifier: Apache-2.0
#include "apps/survey/widths.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include "vision/alike_radii.h"
#include "vision/unhidden_width.h"

namespace twocone::survey {
namespace {

// All widths of a view are widened by the same amount, whose prior sigma this is. The stated sigma of a radius is never
// less than kLeastRadiusShare of the radius.
constexpr double kWidening_px = 0.3;
constexpr double kLeastRadiusShare = 0.005;
// A width has an error besides its noise. For a wide landmark it is kWidthError_px. For one that is narrower than about
// kThin_px it is larger: blur mixes the light of both edges there, so that light which changes across the landmark
// looks like another width. Both values were measured in rendered images of rooms of 8 m.
constexpr double kWidthError_px = 0.1;
constexpr double kThin_px = 7;

/// Returns the variance of a width, px^2.
double variance_px2(const vision::OutlineWidth& width) {
  const double thin = kThin_px / std::max(width.expected_px, 1.0);
  const double light_px = kWidthError_px * (1 + thin * thin);
  return width.sigma_px * width.sigma_px + light_px * light_px;
}

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
  std::vector<double> information(landmarks.size(), 0);
  std::vector<double> squared_information(landmarks.size(), 0);
  for (Eigen::Index view = count; view < count + 2; ++view) normal(view, view) = 1 / (kWidening_px * kWidening_px);
  for (const vision::CalibrationFrame& frame : frames) {
    for (const vision::LandmarkSighting& seen : frame.sightings) {
      const auto& width = seen.sighting.width;
      if (!width) continue;
      const auto i = Eigen::Index(seen.landmark);
      const Eigen::Index view = count + (seen.side == vision::Side::kLower ? 0 : 1);
      const double weight = 1 / variance_px2(*width);
      const double of_radius = weight * width->expected_px * width->expected_px;
      normal(i, i) += of_radius;
      information[seen.landmark] += of_radius;
      squared_information[seen.landmark] += of_radius * of_radius;
      normal(i, view) += weight * width->expected_px;
      normal(view, i) += weight * width->expected_px;
      normal(view, view) += weight;
      right[i] += weight * width->expected_px * width->seen_px;
      right[view] += weight * width->seen_px;
    }
  }
  for (Eigen::Index i = 0; i < count; ++i) {
    if (information[std::size_t(i)] == 0) normal(i, i) = 1;
  }
  const auto factor = normal.ldlt();
  const Eigen::VectorXd answer = factor.solve(right);
  const Eigen::MatrixXd covariance = factor.solve(Eigen::MatrixXd::Identity(count + 2, count + 2));
  std::vector<vision::LogRadius> measured(landmarks.size());
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    if (information[i] == 0) continue;
    const auto at = Eigen::Index(i);
    // Few widths, and a widening of their own size, may give anything.
    const double share = std::clamp(answer[at], 0.5, 2.0);
    // The errors of one landmark's widths are those of its light, so that they do not average away over frames: the
    // number of its widths, each counted by its part in the answer, is taken out again.
    const double own = covariance(at, at) * information[i] * information[i] / squared_information[i];
    measured[i] = {std::log(landmarks[i].radius_m * share), own / (share * share)};
  }
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    auto [mean, variance] = measured[i];
    if (variance == 0) continue;
    if (const auto others = vision::as_the_others(measured, i)) {
      const double part = variance / (variance + others->variance);
      mean += part * (others->mean - mean);
      variance *= 1 - part;
    }
    landmarks[i].radius_m = std::exp(mean);
    landmarks[i].sigma.radius_m = landmarks[i].radius_m * std::max(kLeastRadiusShare, std::sqrt(variance));
  }
}

}  // namespace twocone::survey
