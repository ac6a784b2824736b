// SPDX-License-Identifier: Apache-2.0
#include "vision/self_rig/image_pose.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <Eigen/Dense>

#include "vision/ranging.h"

namespace twocone::vision {
namespace {

// Bearings are off by a few degrees, and by more where the circle's middle is wrong.
constexpr double kBearingLimit_rad = 0.2;
constexpr double kBearingSigma_rad = 0.03;
constexpr double kRangeSigmas = 2.25;
// Two ranges that are known worse give no pose from which to start.
constexpr double kMostStartSigma = 0.4;
// All threes of more sightings would take seconds; these are enough to find the pose.
constexpr std::size_t kMostForThree = 24;
constexpr int kPoseIterations = 8;

/// Finds the sightings that agree with a pose: of each landmark the nearest in direction.
void find_fitted(const std::vector<Ranged>& sightings, const std::vector<Landmark>& landmarks, ImagePose& pose) {
  pose.fitted.clear();
  double log_scales = 0;
  double weights = 0;
  std::vector<double> best(landmarks.size(), kBearingLimit_rad);
  std::vector<std::size_t> which(landmarks.size(), sightings.size());
  for (std::size_t i = 0; i < sightings.size(); ++i) {
    const Ranged& s = sightings[i];
    const Complex towards = (place_of(landmarks[s.landmark]) - pose.place_m) * unit(-pose.heading_rad);
    const double off_rad = std::abs(base::wrap_angle_rad(std::arg(towards) - s.angle_rad));
    if (off_rad >= best[s.landmark]) continue;
    if (s.range_m > 0 && std::abs(std::log(s.range_m / std::abs(towards))) > kRangeSigmas * s.sigma_log) continue;
    best[s.landmark] = off_rad;
    which[s.landmark] = i;
  }
  for (const std::size_t i : which) {
    if (i == sightings.size()) continue;
    pose.fitted.push_back(i);
    const Ranged& s = sightings[i];
    if (s.range_m <= 0) continue;
    const double weight = 1 / (s.sigma_log * s.sigma_log);
    log_scales += weight * std::log(s.range_m / std::abs(place_of(landmarks[s.landmark]) - pose.place_m));
    weights += weight;
  }
  pose.mean_log_scale = weights > 0 ? log_scales / weights : 0;
  pose.sigma_log_scale = weights > 0 ? 1 / std::sqrt(weights) : std::numeric_limits<double>::infinity();
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
          std::log(s.range_m) - std::log(square) / 2 - pose.mean_log_scale, s.sigma_log);
    }
    const Eigen::Vector3d step = normal.ldlt().solve(right);
    if (!step.allFinite()) return;
    pose.place_m += Complex(step.x(), step.y());
    pose.heading_rad = base::wrap_angle_rad(pose.heading_rad + step.z());
    pose.sigma_heading_rad = std::sqrt(normal.inverse()(2, 2));
    if (step.norm() < 1e-9) break;
  }
}

/// Returns the pose that sees two landmarks in their directions and, as nearly as that allows, at their ranges.
ImagePose pose_from_two(const Ranged& a, const Ranged& b, const std::vector<Landmark>& landmarks) {
  const Complex seen_a = std::polar(a.range_m, a.angle_rad);
  const Complex seen_b = std::polar(b.range_m, b.angle_rad);
  const Complex map_a = place_of(landmarks[a.landmark]);
  const Complex map_b = place_of(landmarks[b.landmark]);
  ImagePose pose;
  pose.heading_rad = base::wrap_angle_rad(std::arg(map_b - map_a) - std::arg(seen_b - seen_a));
  pose.place_m = (map_a + map_b - (seen_a + seen_b) * unit(pose.heading_rad)) / 2.0;
  return pose;
}

/// Returns the pose that sees three landmarks in their directions (resection); nothing near the circle through them.
///
/// With z = 1 / (place - b), (a - place) / (b - place) = 1 - (a - b) z has the argument angle_a - angle_b, and likewise
/// for c: two linear equations in z.
std::optional<ImagePose> pose_from_three(const Ranged& a, const Ranged& b, const Ranged& c,
                                         const std::vector<Landmark>& landmarks) {
  const Complex map_b = place_of(landmarks[b.landmark]);
  const Complex turned_a = (place_of(landmarks[a.landmark]) - map_b) * unit(b.angle_rad - a.angle_rad);
  const Complex turned_c = (place_of(landmarks[c.landmark]) - map_b) * unit(b.angle_rad - c.angle_rad);
  const double sine_a = std::sin(b.angle_rad - a.angle_rad);
  const double sine_c = std::sin(b.angle_rad - c.angle_rad);
  const double determinant = std::imag(turned_a * std::conj(turned_c));
  const Complex scaled_z(sine_a * turned_c.real() - sine_c * turned_a.real(),
                         sine_c * turned_a.imag() - sine_a * turned_c.imag());
  if (std::abs(determinant) < 1e-6 || std::abs(scaled_z) < 1e-6) return std::nullopt;
  ImagePose pose;
  pose.place_m = map_b + determinant / scaled_z;
  pose.heading_rad = base::wrap_angle_rad(std::arg(map_b - pose.place_m) - b.angle_rad);
  return pose;
}

/// The poses from which the search of one frame starts, and the best of them.
class Starts {
 public:
  Starts(const std::vector<Ranged>& sightings, const std::vector<Landmark>& landmarks)
      : sightings_(sightings), landmarks_(landmarks) {}

  /// @param needed landmarks that must agree: one more than the pose is made of
  void try_pose(ImagePose pose, std::size_t needed) {
    find_fitted(sightings_, landmarks_, pose);
    if (pose.fitted.size() < std::max(needed, kLeastRigLandmarks) || pose.fitted.size() - needed < surplus_) return;
    if (best_ && pose.fitted.size() - needed == surplus_) return;
    surplus_ = pose.fitted.size() - needed;
    best_ = std::move(pose);
  }

  std::optional<ImagePose> take() { return std::move(best_); }

 private:
  const std::vector<Ranged>& sightings_;
  const std::vector<Landmark>& landmarks_;
  std::optional<ImagePose> best_;
  std::size_t surplus_ = 0;
};

}  // namespace

MirrorView upright_view(const Rig& rig, Side mirror, double rim_px) {
  // Tilts and offsets are what nobody knows yet.
  const MirrorViewSettings& s = of_view(rig, mirror).settings();
  return MirrorView({.cone = s.cone, .lens_height_m = s.lens_height_m, .rim_radius_px = rim_px});
}

std::optional<double> slope_error(const MirrorView& view, const ColourSighting& sighting, const Landmark& landmark,
                                  double distance_m) {
  const Complex at = std::polar(sighting.top_px, sighting.angle_rad);
  const auto ray = view.back_project({at.real(), at.imag()}, Rim::kGoesOn);
  if (!ray) return std::nullopt;
  const Eigen::Vector2d along = ray->direction.head<2>();
  const double edge_m = distance_m + (ray->looks_down() ? landmark.radius_m : -landmark.radius_m);
  const double way_m = edge_m - ray->origin_m.head<2>().dot(along.normalized());
  return (ray->origin_m.z() + ray->direction.z() / along.norm() * way_m - landmark.top_m) / distance_m;
}

std::vector<Ranged> ranged(const std::vector<ColourSighting>& sightings, const MirrorView& view, bool mirrored,
                           const std::vector<Landmark>& landmarks) {
  std::vector<Ranged> result;
  for (const ColourSighting& s : sightings) {
    const Landmark& landmark = landmarks[s.landmark];
    const auto ray = view.back_project({s.top_px, 0}, Rim::kGoesOn);
    const auto axis_m = ray ? axis_at_height(view, *ray, landmark.radius_m, landmark.top_m) : std::nullopt;
    const double range_m = !s.at_rim && axis_m ? axis_m->norm() : 0;
    const double rise_m = std::abs(landmark.top_m - view.tip_m().z());
    const double by_elevation =
        rise_m > 0 && range_m > 0 ? kElevationSigma_rad * (range_m / rise_m + rise_m / range_m) : 0;
    result.push_back(
        {s.landmark, mirrored ? -s.angle_rad : s.angle_rad, range_m, std::max(kLogRangeSigma, by_elevation)});
  }
  return result;
}

std::optional<ImagePose> pose_of(const std::vector<Ranged>& sightings, const std::vector<Landmark>& landmarks) {
  Starts starts(sightings, landmarks);
  const auto is_sure = [](const Ranged& s) { return s.range_m > 0 && s.sigma_log <= kMostStartSigma; };
  for (std::size_t i = 0; i < sightings.size(); ++i) {
    for (std::size_t j = i + 1; j < sightings.size(); ++j) {
      const Ranged &a = sightings[i], &b = sightings[j];
      if (a.landmark == b.landmark) continue;
      const bool are_sure = is_sure(a) && is_sure(b);
      if (are_sure) starts.try_pose(pose_from_two(a, b, landmarks), 3);
      for (std::size_t k = j + 1; k < std::min(sightings.size(), kMostForThree) && !are_sure; ++k) {
        const Ranged& c = sightings[k];
        if (c.landmark == a.landmark || c.landmark == b.landmark) continue;
        if (const auto pose = pose_from_three(a, b, c, landmarks)) starts.try_pose(*pose, 4);
      }
    }
  }
  std::optional<ImagePose> best = starts.take();
  if (!best) return std::nullopt;
  refine(sightings, landmarks, *best);
  const ImagePose before = *best;
  find_fitted(sightings, landmarks, *best);
  if (best->fitted.size() < kLeastRigLandmarks) return before;
  refine(sightings, landmarks, *best);
  return best;
}

}  // namespace twocone::vision
