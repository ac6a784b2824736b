// SPDX-License-Identifier: Apache-2.0
#include "apps/design/sight.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include <fmt/format.h>
#include <Eigen/Dense>

#include "apps/behaviours/behaviour.h"
#include "apps/config/to_layers.h"
#include "apps/runlog/summary/bounds.h"
#include "base/errors.h"
#include "localisation/least_squares_fix.h"
#include "vision/dense_ranging.h"
#include "vision/ranging.h"

namespace twocone::design {
namespace {

using vision::Side;

constexpr std::array kSides{Side::kLower, Side::kUpper};
constexpr double kFarthest_m = 6;
constexpr double kTallest_m = 10;
constexpr double kHeightStep_m = 0.01;
constexpr double kDistanceStep_m = 0.02;

/// Returns the place between `good` and `bad` where `holds` ends, to a tenth of a millimetre.
template <typename Holds>
double edge_between(double good, double bad, const Holds& holds) {
  constexpr double kPrecise_m = 1e-4;
  while (std::abs(bad - good) > kPrecise_m) {
    const double middle = (good + bad) / 2;
    (holds(middle) ? good : bad) = middle;
  }
  return good;
}

std::string unit_of(int number) {
  if (number == vision::kLensHeight || number == vision::kSeparation) return "m";
  switch (number % vision::kViewNumbers) {
    case vision::kColumn:
    case vision::kRow:
    case vision::kRim:
      return "px";
    case vision::kAzimuth:
    case vision::kTiltX:
    case vision::kTiltY:
    case vision::kApex:
      return "rad";
    case vision::kK1:
    case vision::kK2:
      return "";
    default:
      return "m";
  }
}

/// Whether a nearer landmark stands before the axis of another one.
bool is_hidden(const std::vector<Landmark>& landmarks, std::size_t which, const Eigen::Vector2d& from_m) {
  const Eigen::Vector2d way = vision::place_m(landmarks[which]) - from_m;
  return std::ranges::any_of(landmarks, [&](const Landmark& other) {
    if (&other == &landmarks[which]) return false;
    const Eigen::Vector2d to = vision::place_m(other) - from_m;
    const double along = to.dot(way) / way.squaredNorm();
    return along > 0 && along < 1 && (to - along * way).norm() < other.radius_m;
  });
}

/// @param covariance of x, y and heading
double position_sigma_m(const Eigen::Matrix3d& covariance) { return std::sqrt(covariance(0, 0) + covariance(1, 1)); }

RoomSigmas room_sigmas(const config::Robot& robot, const config::Map& map, const vision::Rig& rig,
                       const AnalysisSettings& settings) {
  const config::BeliefErrors errors = config::to_belief_errors(robot, map);
  const vision::UncertainRig belief(rig, errors.vision.rig);
  const std::vector<Landmark> targets = config::to_targets(map);
  const std::vector<Eigen::Vector2d> places_m = config::to_landmark_positions(map);
  const bool is_exact = errors.vision.rig.isZero() &&
                        std::ranges::all_of(errors.vision.landmarks, [](const auto& of) { return of.isZero(); });
  const behaviours::Arena arena = config::to_arena(map);
  const config::Bounds& bounds = map.bounds;
  RoomSigmas room{settings.room_step_m, {}};
  const double half_room_m = std::min(bounds.max_x_m - bounds.min_x_m, bounds.max_y_m - bounds.min_y_m) / 2;
  const auto count = [&](double length_m) { return static_cast<int>(std::floor(length_m / settings.room_step_m)); };
  const int columns = count(bounds.max_x_m - bounds.min_x_m);
  const int rows = count(bounds.max_y_m - bounds.min_y_m);
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const Eigen::Vector2d at_m(bounds.min_x_m + (column + 0.5) * settings.room_step_m,
                                 bounds.min_y_m + (row + 0.5) * settings.room_step_m);
      if (arena.clearance_m(at_m) < robot.body_radius_m) continue;
      const localisation::Pose pose{at_m.x(), at_m.y(), 0};
      auto information = runlog::landmark_information(
          rig, targets, places_m, pose,
          [&](const std::string&, const std::string&) { return std::optional(settings.edge_noise_px); });
      RoomCell cell{at_m.x(), at_m.y(), 0, {}, {}, {}};
      std::vector<Eigen::Matrix2d> of_both;
      for (std::size_t k = 0; k < targets.size(); ++k) {
        auto& [lower, upper] = information[k];
        if (is_hidden(targets, k, at_m)) lower = upper = Eigen::Matrix2d::Zero();
        if (!lower.isZero() && !upper.isZero()) ++cell.landmarks;
        of_both.emplace_back(lower + upper);
      }
      // A sigma of more than the room's half says no more than that the robot is in the room.
      const auto bound = localisation::pose_bound(pose, places_m, of_both);
      if (bound && position_sigma_m(*bound) < half_room_m) {
        cell.sigma_m = position_sigma_m(*bound);
        cell.heading_rad = std::sqrt((*bound)(2, 2));
      }
      if (is_exact) {
        cell.whole_sigma_m = cell.sigma_m;
      } else if (const auto whole = runlog::whole_bound(belief, errors, targets, pose, information)) {
        cell.whole_sigma_m = position_sigma_m(*whole);
      }
      room.cells.push_back(cell);
    }
  }
  return room;
}

AtDistance at_distance(const Sight& sight, double distance_m, double sigma_px) {
  AtDistance at{distance_m, sight.shared_heights(distance_m), {}, {}};
  if (!at.shared) return at;
  constexpr int kSteps = 20;
  for (int k = 0; k <= kSteps; ++k) {
    const double height_m = std::lerp(at.shared->lowest_m, at.shared->highest_m, double(k) / kSteps);
    const auto sigma_m = sight.range_sigma_m(distance_m, height_m, sigma_px);
    if (!sigma_m) continue;
    at.least_sigma_m = std::min(at.least_sigma_m.value_or(*sigma_m), *sigma_m);
    at.most_sigma_m = std::max(at.most_sigma_m.value_or(*sigma_m), *sigma_m);
  }
  return at;
}

std::vector<SigmaLine> sigma_lines(const Sight& sight, double sigma_px) {
  std::vector<SigmaLine> lines;
  for (const double sigma_m : {0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1}) lines.push_back({sigma_m, {}});
  constexpr double kDrawn_m = 2.5;
  constexpr double kStep_m = 0.05;
  for (int row = 0; row * kStep_m <= kDrawn_m; ++row) {
    const double height_m = row * kStep_m;
    std::optional<double> before_m;
    for (int column = 1; column * kStep_m <= kFarthest_m; ++column) {
      const auto here_m = sight.range_sigma_m(column * kStep_m, height_m, sigma_px);
      for (SigmaLine& line : lines) {
        if (!before_m || !here_m || (*before_m < line.sigma_m) == (*here_m < line.sigma_m)) continue;
        const double share = (line.sigma_m - *before_m) / (*here_m - *before_m);
        line.points_m.emplace_back((column - 1 + share) * kStep_m, height_m);
      }
      before_m = here_m;
    }
  }
  std::erase_if(lines, [](const SigmaLine& line) { return line.points_m.size() < 2; });
  return lines;
}

std::vector<Sensitivity> sensitivities(const config::Robot& robot, const Sight& sight, double distance_m,
                                       double height_m) {
  config::BeliefErrors errors = config::to_belief_errors(robot, config::Map{});
  if (errors.vision.rig.isZero()) {
    // A rig that is exact by construction will be built with a ruler.
    config::Robot ruled = robot;
    ruled.rig.sigma = config::ruler_sigma(robot.rig);
    errors = config::to_belief_errors(ruled, config::Map{});
  }
  const auto per_number = sight.range_per_number(distance_m, height_m);
  if (!per_number || errors.vision.rig.cols() == 0) return {};
  std::vector<Sensitivity> all;
  for (int number = 0; number < vision::kRigNumbers; ++number) {
    const double sigma = errors.vision.rig.row(number).norm();
    const double range_m = std::abs((*per_number)[number]) * sigma;
    constexpr double kNothing_m = 1e-6;
    if (range_m > kNothing_m) all.push_back({vision::rig_number_name(number), sigma, unit_of(number), range_m});
  }
  std::ranges::sort(all, std::greater{}, &Sensitivity::range_m);
  return all;
}

}  // namespace

Elevations elevations_of(const vision::MirrorView& view) {
  return {view.elevation_rad(vision::kInnermost_px), view.elevation_rad(view.settings().rim_radius_px)};
}

bool Sight::shows(Side side, double distance_m, double height_m) const {
  const vision::MirrorView& view = of_view(rig_, side);
  const auto pixel = view.project({distance_m, 0, height_m});
  if (!pixel) return false;
  const auto straight = view.undistort_px(*pixel);
  return straight && (*straight - view.settings().centre_px).norm() >= vision::kInnermost_px;
}

std::optional<Heights> Sight::shared_heights(double distance_m) const {
  const auto both = [&](double height_m) {
    return shows(Side::kLower, distance_m, height_m) && shows(Side::kUpper, distance_m, height_m);
  };
  // Either view shows one interval of heights, so both of them do.
  std::optional<Heights> found;
  const int steps = static_cast<int>(kTallest_m / kHeightStep_m);
  for (int k = 0; k <= steps; ++k) {
    const double height_m = k * kHeightStep_m;
    if (!both(height_m)) continue;
    if (!found) found = {height_m, height_m};
    found->highest_m = height_m;
  }
  if (!found) return found;
  if (found->lowest_m > 0) found->lowest_m = edge_between(found->lowest_m, found->lowest_m - kHeightStep_m, both);
  found->highest_m = edge_between(found->highest_m, found->highest_m + kHeightStep_m, both);
  return found;
}

std::optional<double> Sight::floor_from_m(double farthest_m) const {
  const auto both = [&](double distance_m) {
    return shows(Side::kLower, distance_m, 0) && shows(Side::kUpper, distance_m, 0);
  };
  for (int k = 1; k * kDistanceStep_m <= farthest_m; ++k) {
    if (both(k * kDistanceStep_m)) return edge_between(k * kDistanceStep_m, (k - 1) * kDistanceStep_m, both);
  }
  return std::nullopt;
}

/// Least squares for (range, bearing, height) from the four coordinates of both pixels.
struct Sight::Solution {
  Eigen::Matrix<double, 3, 4> of_pixels;  ///< change of the answer by the pixels
  Eigen::Vector3d point_m;
};

std::optional<Sight::Solution> Sight::solve(double distance_m, double height_m) const {
  if (!shows(Side::kLower, distance_m, height_m) || !shows(Side::kUpper, distance_m, height_m)) return std::nullopt;
  const Eigen::Vector3d point_m(distance_m, 0, height_m);
  Eigen::Matrix<double, 4, 3> jacobian;
  for (const Side side : kSides) {
    const auto seen = of_view(rig_, side).project_with_jacobian(point_m);
    if (!seen) return std::nullopt;
    jacobian.middleRows<2>(2 * Eigen::Index(side)) = seen->jacobian;
  }
  // Straight ahead, x is the range and y the bearing times the range.
  const Eigen::ColPivHouseholderQR<Eigen::Matrix<double, 4, 3>> qr(jacobian);
  if (qr.rank() < 3) return std::nullopt;
  return Solution{qr.solve(Eigen::Matrix4d::Identity()), point_m};
}

std::optional<double> Sight::range_sigma_m(double distance_m, double height_m, double sigma_px) const {
  const auto solution = solve(distance_m, height_m);
  if (!solution) return std::nullopt;
  return solution->of_pixels.row(0).norm() * sigma_px / std::numbers::sqrt2;
}

std::optional<Eigen::VectorXd> Sight::range_per_number(double distance_m, double height_m) const {
  const auto solution = solve(distance_m, height_m);
  if (!solution) return std::nullopt;
  // Each number has an error of its own, of 1. A point is a landmark without a radius.
  const vision::UncertainRig each(
      rig_, BySharedErrors<vision::kRigNumbers>::Identity(vision::kRigNumbers, vision::kRigNumbers));
  Eigen::Matrix<double, 4, vision::kRigNumbers> by_number;
  for (const Side side : kSides) {
    by_number.middleRows<2>(2 * Eigen::Index(side)) =
        each.pixel_by_shared(side, solution->point_m.head<2>(), 0, solution->point_m.z());
  }
  // The pixels stay. A rig that expects them elsewhere moves its answer the other way.
  return -(solution->of_pixels.row(0) * by_number).transpose();
}

Reach reach_of(const Sight& sight) {
  Reach reach{{}, sight.floor_from_m(kFarthest_m), {}};
  for (int k = 1; k * kDistanceStep_m <= kFarthest_m; ++k) {
    const double distance_m = k * kDistanceStep_m;
    const auto shared = sight.shared_heights(distance_m);
    if (!shared) continue;
    if (!reach.nearest_m) reach.nearest_m = distance_m;
    reach.least_height_m = std::min(reach.least_height_m.value_or(shared->lowest_m), shared->lowest_m);
  }
  return reach;
}

std::string words_of(const Reach& reach) {
  if (!reach.nearest_m) return "the mirrors have nothing in common up to 6 m: nothing is ranged";
  const std::string from = fmt::format("both mirrors range from {:.2f} m on, ", *reach.nearest_m);
  if (reach.floor_from_m) {
    return from + fmt::format("and the floor from {:.2f} m on: nearer they are blind to it", *reach.floor_from_m);
  }
  return from + fmt::format("and nothing lower than {:.2f} m", reach.least_height_m.value_or(0));
}

Analysis analyse(const config::Robot& robot, const std::optional<config::Map>& map, const AnalysisSettings& settings) {
  base::Complaints bad;
  bad.positive("sigma_px", settings.sigma_px, "px");
  bad.positive("edge_noise_px", settings.edge_noise_px, "px");
  bad.positive("at_m", settings.at_m, "m");
  bad.positive("room_step_m", settings.room_step_m, "m");
  bad.raise("design::analyse");
  const Sight sight(config::to_rig(robot));
  Analysis analysis;
  analysis.reach = reach_of(sight);
  for (const double distance_m : {0.5, 0.75, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, kFarthest_m}) {
    analysis.distances.push_back(at_distance(sight, distance_m, settings.sigma_px));
  }
  analysis.lines = sigma_lines(sight, settings.sigma_px);
  if (const auto shared = sight.shared_heights(settings.at_m)) {
    analysis.at_height_m = (shared->lowest_m + std::min(shared->highest_m, shared->lowest_m + 2)) / 2;
    analysis.sensitivities = sensitivities(robot, sight, settings.at_m, *analysis.at_height_m);
  }
  if (map) analysis.room = room_sigmas(robot, *map, sight.rig(), settings);
  return analysis;
}

}  // namespace twocone::design
