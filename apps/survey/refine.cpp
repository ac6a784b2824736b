// SPDX-License-Identifier: Apache-2.0
#include "apps/survey/refine.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/QR>

#include "localisation/odometry.h"
#include "vision/hue_labels.h"
#include "vision/ranging.h"

namespace twocone::survey {
namespace {

// A surveyed hue is that of a landmark within this angle: the survey measures it in the room's light.
constexpr double kSameHue_rad = 20 * std::numbers::pi / 180;
// Price of one more landmark that moved, in chi-squared.
constexpr double kMovedPrice = 18;
// No place is better known than this: it keeps the covariances of exact maps and exact surveys invertible.
constexpr double kLeastSigma_m = 1e-4;
// The comparison is linear in a small turn, and is repeated.
constexpr int kTurns = 3;

/// A landmark of the map, and the surveyed one that it is.
struct Pair {
  std::size_t measured = 0;
  std::size_t surveyed = 0;
};

/// A choice of moved landmarks, as indices into the pairs, and what it leaves.
struct Choice {
  std::vector<std::size_t> moved;
  double chi_squared = 0;
  Eigen::Vector3d motion = Eigen::Vector3d::Zero();  // correction of the overlay, about the pairs' middle
  std::vector<Eigen::Vector2d> by_m;
  std::vector<double> sigma_m;
};

/// The differences of the pairs' places, with their covariance.
class Differences {
 public:
  Differences(const std::vector<Pair>& pairs, const std::vector<Landmark>& surveyed, const Eigen::MatrixXd& covariance,
              const std::vector<Landmark>& measured, const Overlay& overlay)
      : count_(pairs.size()) {
    const auto size = Eigen::Index(2 * pairs.size());
    Eigen::MatrixXd total = Eigen::MatrixXd::Zero(size, size);
    Eigen::VectorXd difference(size);
    Eigen::MatrixXd places(2, Eigen::Index(pairs.size()));
    const Eigen::Matrix2d turn = Eigen::Rotation2Dd(overlay.heading_rad).toRotationMatrix();
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const auto at = Eigen::Index(2 * i);
      const Landmark& is = measured[pairs[i].measured];
      places.col(Eigen::Index(i)) = overlay.moved(vision::place_m(surveyed[pairs[i].surveyed]));
      difference.segment<2>(at) = places.col(Eigen::Index(i)) - vision::place_m(is);
      for (std::size_t k = 0; k < pairs.size(); ++k) {
        total.block<2, 2>(at, Eigen::Index(2 * k)) =
            turn * covariance.block<2, 2>(Eigen::Index(2 * pairs[i].surveyed), Eigen::Index(2 * pairs[k].surveyed)) *
            turn.transpose();
      }
      total(at, at) += is.sigma.x_m * is.sigma.x_m + kLeastSigma_m * kLeastSigma_m;
      total(at + 1, at + 1) += is.sigma.y_m * is.sigma.y_m + kLeastSigma_m * kLeastSigma_m;
    }
    const Eigen::Vector2d middle = places.rowwise().mean();
    Eigen::MatrixXd by_motion(size, 3);
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const Eigen::Vector2d arm = places.col(Eigen::Index(i)) - middle;
      by_motion.middleRows<2>(Eigen::Index(2 * i)) << -1, 0, arm.y(), 0, -1, -arm.x();
    }
    middle_m_ = middle;
    const Eigen::LLT<Eigen::MatrixXd> factor(total);
    const auto lower = factor.matrixL();
    difference_ = lower.solve(difference);
    by_motion_ = lower.solve(by_motion);
    by_place_ = lower.solve(Eigen::MatrixXd::Identity(size, size));
  }

  [[nodiscard]] Choice without(const std::vector<std::size_t>& moved) const {
    Eigen::MatrixXd system(difference_.size(), 3 + Eigen::Index(2 * moved.size()));
    system.leftCols<3>() = by_motion_;
    for (std::size_t i = 0; i < moved.size(); ++i) {
      system.middleCols<2>(3 + Eigen::Index(2 * i)) = by_place_.middleCols<2>(Eigen::Index(2 * moved[i]));
    }
    const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> factor(system);
    const Eigen::VectorXd answer = factor.solve(difference_);
    Choice choice;
    choice.moved = moved;
    choice.chi_squared = (difference_ - system * answer).squaredNorm();
    choice.motion = answer.head<3>();
    const Eigen::MatrixXd covariance =
        (system.transpose() * system).ldlt().solve(Eigen::MatrixXd::Identity(system.cols(), system.cols()));
    for (std::size_t i = 0; i < moved.size(); ++i) {
      const auto at = 3 + Eigen::Index(2 * i);
      choice.by_m.emplace_back(answer.segment<2>(at));
      choice.sigma_m.push_back(std::sqrt(covariance.block<2, 2>(at, at).diagonal().maxCoeff()));
    }
    return choice;
  }

  /// Returns the best choice of each number of landmarks: all pairs of them are tried, and more are added one by one.
  [[nodiscard]] std::vector<Choice> best_choices() const {
    std::vector<Choice> best{without({})};
    while (2 * best.size() + 1 < count_) {
      std::vector<std::vector<std::size_t>> candidates;
      const auto add_to = [&](const std::vector<std::size_t>& others) {
        for (std::size_t i = 0; i < count_; ++i) {
          if (std::ranges::find(others, i) != others.end()) continue;
          candidates.push_back(others);
          candidates.back().push_back(i);
        }
      };
      if (best.size() == 2) {
        for (std::size_t i = 0; i < count_; ++i) add_to({i});
      } else {
        add_to(best.back().moved);
      }
      std::optional<Choice> next;
      for (const auto& candidate : candidates) {
        Choice choice = without(candidate);
        if (!next || choice.chi_squared < next->chi_squared) next = std::move(choice);
      }
      best.push_back(*std::move(next));
    }
    return best;
  }

  /// Returns the choice to believe.
  [[nodiscard]] Choice choose() const {
    const std::vector<Choice> best = best_choices();
    double excess = std::numeric_limits<double>::infinity();
    for (const Choice& choice : best) {
      const double freedom = 2.0 * double(count_) - 3 - 2.0 * double(choice.moved.size());
      excess = std::min(excess, choice.chi_squared / freedom);
    }
    const auto price = [scale = std::max(1.0, excess)](const Choice& choice) {
      return choice.chi_squared / scale + kMovedPrice * double(choice.moved.size());
    };
    return *std::ranges::min_element(best, {}, price);
  }

  /// Corrects an overlay by a choice's motion.
  [[nodiscard]] Overlay corrected(const Overlay& overlay, const Eigen::Vector3d& motion) const {
    Overlay better = overlay;
    better.heading_rad = localisation::wrap_angle_rad(overlay.heading_rad + motion.z());
    better.shift_m = middle_m_ + motion.head<2>() + Eigen::Rotation2Dd(motion.z()) * (overlay.shift_m - middle_m_);
    return better;
  }

 private:
  std::size_t count_;
  Eigen::Vector2d middle_m_ = Eigen::Vector2d::Zero();
  // Whitened.
  Eigen::VectorXd difference_;
  Eigen::MatrixXd by_motion_, by_place_;
};

/// Returns the landmarks with the colours of the surveyed ones of their hue.
std::vector<Landmark> with_colours_of(std::vector<Landmark> landmarks, const std::vector<Landmark>& surveyed) {
  for (Landmark& landmark : landmarks) {
    if (landmark.bands) continue;
    const auto apart = [&](const Landmark& other) {
      return other.bands ? std::numeric_limits<double>::infinity()
                         : vision::hue_distance_rad(other.colour, landmark.colour);
    };
    const auto nearest = std::ranges::min_element(surveyed, {}, apart);
    if (nearest != surveyed.end() && apart(*nearest) < kSameHue_rad) landmark.colour = nearest->colour;
  }
  return landmarks;
}

/// Finds the landmarks that are the same: of one colour at one place, and of the rest those whose colour no other has.
std::vector<Pair> pairs_of(const std::vector<Landmark>& surveyed, const Overlay& overlay,
                           const std::vector<Landmark>& measured) {
  std::vector<Pair> pairs;
  const auto is_taken = [&](std::size_t i) { return std::ranges::find(pairs, i, &Pair::surveyed) != pairs.end(); };
  std::vector<Landmark> moved;
  moved.reserve(surveyed.size());
  for (const Landmark& landmark : surveyed) moved.push_back(overlay.moved(landmark));
  for (std::size_t i = 0; i < measured.size(); ++i) {
    const auto same = same_landmark(measured[i], moved);
    if (same && !is_taken(*same)) pairs.push_back({i, *same});
  }
  for (std::size_t i = 0; i < measured.size(); ++i) {
    if (std::ranges::find(pairs, i, &Pair::measured) != pairs.end()) continue;
    std::vector<std::size_t> like;
    for (std::size_t k = 0; k < surveyed.size(); ++k) {
      if (look_alike(surveyed[k], measured[i]) && !is_taken(k)) like.push_back(k);
    }
    if (like.size() == 1) pairs.push_back({i, like.front()});
  }
  return pairs;
}

}  // namespace

Result<MapMatch> match_to_map(const std::vector<Landmark>& surveyed, const Eigen::MatrixXd& covariance,
                              const std::vector<Landmark>& measured) {
  const std::vector<Landmark> like = with_colours_of(measured, surveyed);
  MapMatch match{.overlay = best_overlay(surveyed, like), .landmarks = {}, .moved = {}, .missing = {}};
  if (match.overlay.agree < kLeastShared) {
    return Error(ErrorCode::kBadData,
                 "only {} of the map's {} landmarks were found where it has them, and a comparison needs {}",
                 match.overlay.agree, measured.size(), kLeastShared);
  }
  const std::vector<Pair> pairs = pairs_of(surveyed, match.overlay, like);
  Choice choice;
  for (int i = 0; i < kTurns; ++i) {
    const Differences differences(pairs, surveyed, covariance, measured, match.overlay);
    choice = differences.choose();
    match.overlay = differences.corrected(match.overlay, choice.motion);
  }
  constexpr double kUnknown = std::numeric_limits<double>::infinity();
  for (const Landmark& landmark : surveyed) {
    match.landmarks.push_back(match.overlay.moved(landmark));
    match.landmarks.back().sigma = {kUnknown, kUnknown, kUnknown, kUnknown};
  }
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    Landmark& landmark = match.landmarks[pairs[i].surveyed];
    const Landmark& is = measured[pairs[i].measured];
    const auto found = std::ranges::find(choice.moved, i);
    const Landmark there = landmark;
    landmark = is;
    if (found == choice.moved.end()) continue;
    landmark.x_m = there.x_m;
    landmark.y_m = there.y_m;
    landmark.sigma.x_m = landmark.sigma.y_m = kUnknown;
    const auto at = std::size_t(found - choice.moved.begin());
    match.moved.push_back({is.name, choice.by_m[at], choice.sigma_m[at]});
  }
  for (std::size_t i = 0; i < measured.size(); ++i) {
    if (std::ranges::find(pairs, i, &Pair::measured) == pairs.end()) match.missing.push_back(measured[i].name);
  }
  return match;
}

}  // namespace twocone::survey
