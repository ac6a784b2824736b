// SPDX-License-Identifier: Apache-2.0
#include "vision/self_rig/image_pose.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

#include "vision/ranging.h"

namespace twocone::vision {
namespace {

// Bearings are off by a few degrees, and by more where the circle's middle is wrong. The limit of ranges is twice
// kLogRangeSigma and a little.
constexpr double kBearingLimit_rad = 0.2;
constexpr double kLogRangeLimit = 0.45;
constexpr double kBearingSigma_rad = 0.03;
constexpr int kPoseIterations = 8;

Complex place_of(const Landmark& landmark) { return {landmark.x_m, landmark.y_m}; }

/// Finds the sightings that agree with a pose: of each landmark the nearest in direction.
void find_fitted(const std::vector<Ranged>& sightings, const std::vector<Landmark>& landmarks, ImagePose& pose) {
  pose.fitted.clear();
  double log_scales = 0;
  int scales = 0;
  std::vector<double> best(landmarks.size(), kBearingLimit_rad);
  std::vector<std::size_t> which(landmarks.size(), sightings.size());
  for (std::size_t i = 0; i < sightings.size(); ++i) {
    const Ranged& s = sightings[i];
    const Complex towards = (place_of(landmarks[s.landmark]) - pose.place_m) * unit(-pose.heading_rad);
    const double off_rad = std::abs(base::wrap_angle_rad(std::arg(towards) - s.angle_rad));
    if (off_rad >= best[s.landmark]) continue;
    if (s.range_m > 0 && std::abs(std::log(s.range_m / std::abs(towards))) > kLogRangeLimit) continue;
    best[s.landmark] = off_rad;
    which[s.landmark] = i;
  }
  for (const std::size_t i : which) {
    if (i == sightings.size()) continue;
    pose.fitted.push_back(i);
    const Ranged& s = sightings[i];
    if (s.range_m <= 0) continue;
    log_scales += std::log(s.range_m / std::abs(place_of(landmarks[s.landmark]) - pose.place_m));
    ++scales;
  }
  pose.mean_log_scale = scales > 0 ? log_scales / scales : 0;
}

/// Moves the pose to the least squares of directions and logarithms of ranges.
void refine(const std::vector<Ranged>& sightings, const std::vector<Landmark>& landmarks, ImagePose& pose) {
  for (int iteration = 0; iteration < kPoseIterations; ++iteration) {
    Eigen::Matrix3d normal = 1e-9 * Eigen::Matrix3d::Identity();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    const auto add = [&](const Eigen::Vector3d& row, double residual, double sigma) {
      normal += row * row.transpose() / (sigma * sigma);
      right += row * residual / (sigma * sigma);
    };
    for (const std::size_t i : pose.fitted) {
      const Ranged& s = sightings[i];
      const Complex towards = place_of(landmarks[s.landmark]) - pose.place_m;
      const double square = std::max(std::norm(towards), 1e-6);
      const double off_rad = base::wrap_angle_rad(s.angle_rad - (std::arg(towards) - pose.heading_rad));
      add({towards.imag() / square, -towards.real() / square, -1}, off_rad, kBearingSigma_rad);
      if (s.range_m <= 0) continue;
      // The common scale is the rim's radius, which is not this pose's business.
      add({-towards.real() / square, -towards.imag() / square, 0},
          std::log(s.range_m) - std::log(square) / 2 - pose.mean_log_scale, kLogRangeSigma);
    }
    const Eigen::Vector3d step = normal.ldlt().solve(right);
    if (!step.allFinite()) return;
    pose.place_m += Complex(step.x(), step.y());
    pose.heading_rad = base::wrap_angle_rad(pose.heading_rad + step.z());
    if (step.norm() < 1e-9) break;
  }
}

}  // namespace

std::vector<Ranged> ranged(const std::vector<ColourSighting>& sightings, const Guess& guess, const Rig& rig,
                           double rim_px, const std::vector<Landmark>& landmarks) {
  const MirrorViewSettings& mirror = of_view(rig, guess.mirror).settings();
  // Upright and on the body's axis: tilts and offsets are what nobody knows yet.
  const MirrorView view({.cone = mirror.cone, .lens_height_m = mirror.lens_height_m, .rim_radius_px = rim_px});
  std::vector<Ranged> result;
  for (const ColourSighting& s : sightings) {
    const Landmark& landmark = landmarks[s.landmark];
    const auto ray = view.back_project({s.top_px, 0}, Rim::kGoesOn);
    const auto axis_m = ray ? axis_at_height(view, *ray, landmark.radius_m, landmark.top_m) : std::nullopt;
    const double range_m = !s.at_rim && axis_m ? axis_m->norm() : 0;
    result.push_back({s.landmark, guess.mirrored ? -s.angle_rad : s.angle_rad, range_m});
  }
  return result;
}

std::optional<ImagePose> pose_of(const std::vector<Ranged>& sightings, const std::vector<Landmark>& landmarks) {
  std::optional<ImagePose> best;
  for (std::size_t i = 0; i < sightings.size(); ++i) {
    for (std::size_t j = i + 1; j < sightings.size(); ++j) {
      const Ranged &a = sightings[i], &b = sightings[j];
      if (a.landmark == b.landmark || a.range_m <= 0 || b.range_m <= 0) continue;
      const Complex seen_a = std::polar(a.range_m, a.angle_rad);
      const Complex seen_b = std::polar(b.range_m, b.angle_rad);
      const Complex map_a = place_of(landmarks[a.landmark]);
      const Complex map_b = place_of(landmarks[b.landmark]);
      ImagePose pose;
      pose.heading_rad = base::wrap_angle_rad(std::arg(map_b - map_a) - std::arg(seen_b - seen_a));
      pose.place_m = (map_a + map_b - (seen_a + seen_b) * unit(pose.heading_rad)) / 2.0;
      find_fitted(sightings, landmarks, pose);
      if (best && pose.fitted.size() <= best->fitted.size()) continue;
      best = std::move(pose);
    }
  }
  if (!best || best->fitted.size() < kLeastRigLandmarks) return std::nullopt;
  refine(sightings, landmarks, *best);
  const ImagePose before = *best;
  find_fitted(sightings, landmarks, *best);
  if (best->fitted.size() < kLeastRigLandmarks) return before;
  refine(sightings, landmarks, *best);
  return best;
}

}  // namespace twocone::vision
