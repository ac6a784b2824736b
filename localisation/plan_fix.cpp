// SPDX-License-Identifier: Apache-2.0
#include "localisation/plan_fix.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <Eigen/Dense>

#include "base/errors.h"

namespace twocone::localisation {
namespace {

constexpr int kRoundsPerWidth = 6;
constexpr double kLeastWidth = 2;        // of Cauchy's weights, in sigmas
constexpr double kShrink = 0.5;          // of the width, from one set of rounds to the next
constexpr double kConverged_m = 1e-6;    // of a step; the heading counts for a metre's distance
constexpr double kOnPlanSigmas = 3;      // a point on the plan is no farther from it
constexpr std::size_t kNeighbours = 30;  // points whose errors have to do with each other: those of one thing
// A direction is open where its standard deviation would exceed this.
constexpr double kOpen_m = 0.2;

/// A point of a scan against the plan.
struct Match {
  double distance_m = 0;  ///< to the plan
  Eigen::Vector3d slope;  ///< of distance_m by (x, y, heading)
  double sigma_m = 0;
};

struct Nearest {
  double distance_m = std::numeric_limits<double>::infinity();
  Eigen::Vector2d normal = Eigen::Vector2d::Zero();
};

Nearest nearest_on(const FloorPlan& plan, const Eigen::Vector2d& place_m) {
  Nearest nearest;
  const auto consider = [&](const Eigen::Vector2d& off_m, double distance_m, const Eigen::Vector2d& normal) {
    if (std::abs(distance_m) >= std::abs(nearest.distance_m)) return;
    nearest = {distance_m, off_m.isZero() ? normal : Eigen::Vector2d(off_m.normalized())};
  };
  for (const FloorPlan::Edge& edge : plan.edges) {
    const Eigen::Vector2d along_m = edge.to_m - edge.from_m;
    const double t = std::clamp((place_m - edge.from_m).dot(along_m) / along_m.squaredNorm(), 0.0, 1.0);
    const Eigen::Vector2d off_m = place_m - edge.from_m - t * along_m;
    consider(off_m, off_m.norm(), Eigen::Vector2d(-along_m.y(), along_m.x()).normalized());
  }
  for (const Disc& disc : plan.discs) {
    const Eigen::Vector2d off_m = place_m - Eigen::Vector2d(disc.centre.x_m, disc.centre.y_m);
    consider(off_m, off_m.norm() - disc.radius_m, Eigen::Vector2d::UnitX());
  }
  return nearest;
}

std::vector<Match> matches_at(const FloorPlan& plan, const std::vector<ScanPoint>& points, const Pose& pose,
                              double plan_sigma_m) {
  std::vector<Match> matches;
  matches.reserve(points.size());
  const Eigen::Rotation2Dd turn(pose.heading_rad);
  for (const ScanPoint& point : points) {
    const Eigen::Vector2d from_body_m = turn * point.place_m;
    const Nearest nearest = nearest_on(plan, Eigen::Vector2d(pose.x_m, pose.y_m) + from_body_m);
    const Eigen::Vector2d& n = nearest.normal;
    const double along_ray = n.dot(from_body_m.normalized());
    matches.push_back({nearest.distance_m,
                       {n.x(), n.y(), n.dot(Eigen::Vector2d(-from_body_m.y(), from_body_m.x()))},
                       std::hypot(along_ray * point.sigma_m, plan_sigma_m)});
  }
  return matches;
}

/// Cauchy's weight over the variance.
double weight_of(const Match& m, double width) {
  const double sigmas = m.distance_m / (width * m.sigma_m);
  return 1 / (m.sigma_m * m.sigma_m * (1 + sigmas * sigmas));
}

}  // namespace

std::optional<PlanFix> fix_by_plan(const FloorPlan& plan, const std::vector<ScanPoint>& points, const Pose& expected,
                                   double reach_m, const PlanSettings& settings) {
  base::Complaints bad;
  bad.positive("reach_m", reach_m, "m");
  bad.require(settings.plan_sigma_m >= 0, "plan_sigma_m is {} m, must be >= 0", settings.plan_sigma_m);
  bad.require(settings.least_points >= 3, "least_points is {}, must be >= 3", settings.least_points);
  bad.require(std::ranges::all_of(points, [](const ScanPoint& p) { return p.sigma_m > 0; }),
              "a point has no sigma > 0");
  bad.raise("fix_by_plan");
  if (points.empty() || (plan.edges.empty() && plan.discs.empty())) return std::nullopt;
  Pose pose = expected;
  for (double width_m = reach_m;; width_m = kShrink * width_m) {
    bool is_last = false;
    for (int round = 0; round < kRoundsPerWidth; ++round) {
      Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
      Eigen::Vector3d right = Eigen::Vector3d::Zero();
      is_last = true;
      for (const Match& m : matches_at(plan, points, pose, settings.plan_sigma_m)) {
        const double width = std::max(kLeastWidth, width_m / m.sigma_m);
        is_last = is_last && width <= kLeastWidth;
        const double weight = weight_of(m, width);
        normal += weight * m.slope * m.slope.transpose();
        right -= weight * m.distance_m * m.slope;
      }
      const Eigen::Vector3d step = normal.ldlt().solve(right);
      if (!step.allFinite()) return std::nullopt;
      pose = {pose.x_m + step.x(), pose.y_m + step.y(), wrap_angle_rad(pose.heading_rad + step.z())};
      if (step.norm() < kConverged_m) break;
    }
    if (is_last) break;
  }

  PlanFix fix{pose, {}, 0, 0};
  const std::vector<Match> matches = matches_at(plan, points, pose, settings.plan_sigma_m);
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d of_scores = Eigen::Matrix3d::Zero();
  std::vector<Eigen::Vector3d> pulls;  // of a common error, and so the scores by their distances
  pulls.reserve(matches.size());
  for (const Match& m : matches) {
    const double weight = weight_of(m, kLeastWidth);
    pulls.emplace_back(weight * m.slope);
    information += weight * m.slope * m.slope.transpose();
    if (std::abs(m.distance_m) > kOnPlanSigmas * m.sigma_m) continue;
    ++fix.used;
    fix.rms_m += m.distance_m * m.distance_m;
  }
  if (fix.used < settings.least_points || fix.used < settings.least_share * double(points.size())) return std::nullopt;
  fix.rms_m = std::sqrt(fix.rms_m / fix.used);
  // An edge that is not where the plan has it moves all its points.
  for (std::size_t first = 0; first < pulls.size(); first += kNeighbours) {
    Eigen::Vector3d pull = Eigen::Vector3d::Zero();
    for (std::size_t k = first; k < std::min(first + kNeighbours, pulls.size()); ++k) pull += pulls[k];
    of_scores += settings.plan_sigma_m * settings.plan_sigma_m * pull * pull.transpose();
  }
  const auto score = [&](std::size_t k) -> Eigen::Vector3d { return matches[k].distance_m * pulls[k]; };
  for (std::size_t k = 0; k < pulls.size(); ++k) {
    of_scores += score(k) * score(k).transpose();
    for (std::size_t lag = 1; lag <= std::min(kNeighbours, k); ++lag) {
      const double share = 1 - double(lag) / (kNeighbours + 1);
      const Eigen::Matrix3d product = score(k) * score(k - lag).transpose();
      of_scores += share * (product + product.transpose());
    }
  }
  const Eigen::Matrix3d inverse = information.inverse();
  // Not below what the sigmas say: a few edges may fit by chance.
  fix.covariance = inverse * of_scores * inverse + inverse;
  const double most_m2 = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(fix.covariance).eigenvalues()[2];
  if (!(most_m2 < kOpen_m * kOpen_m)) return std::nullopt;
  return fix;
}

std::optional<PlanFix> find_by_plan(const FloorPlan& plan, const std::vector<ScanPoint>& points, const Pose& expected,
                                    double off_m, double off_rad, const PlanSettings& settings) {
  std::optional<PlanFix> best;
  constexpr std::array kSteps{0.0, -1.0, 1.0};
  for (const double x : kSteps) {
    for (const double y : kSteps) {
      for (const double heading : {0.0, -1.0, -0.5, 0.5, 1.0}) {
        const Pose start{expected.x_m + x * off_m, expected.y_m + y * off_m,
                         wrap_angle_rad(expected.heading_rad + heading * off_rad)};
        const auto fix = fix_by_plan(plan, points, start, 0.3, settings);
        if (fix && (!best || fix->used > best->used)) best = fix;
      }
    }
  }
  return best;
}

}  // namespace twocone::localisation
