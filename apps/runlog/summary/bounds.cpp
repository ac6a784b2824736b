// SPDX-License-Identifier: Apache-2.0
#include "apps/runlog/summary/bounds.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <tuple>
#include <utility>

#include <Eigen/Dense>

#include "base/quantile.h"
#include "localisation/least_squares_fix.h"
#include "vision/bound.h"

namespace twocone::runlog {
namespace {

/// The noise of each landmark's outline in each view and frame.
class EdgeNoise {
 public:
  explicit EdgeNoise(const std::vector<SightingRow>& sightings) {
    std::map<std::pair<std::string, std::string>, std::vector<double>> all;
    for (const SightingRow& row : sightings) {
      if (!row.edge_noise_px || !(*row.edge_noise_px > 0) || !std::isfinite(*row.edge_noise_px)) continue;
      own_px_[{row.frame, row.landmark, row.view}] = *row.edge_noise_px;
      all[{row.landmark, row.view}].push_back(*row.edge_noise_px);
    }
    for (auto& [place, values] : all) median_px_[place] = base::median(std::move(values));
  }

  /// Returns nothing if the landmark was never sighted in that view.
  [[nodiscard]] std::optional<double> find(std::uint64_t frame, const std::string& landmark,
                                           const std::string& view) const {
    if (const auto own = own_px_.find({frame, landmark, view}); own != own_px_.end()) return own->second;
    if (const auto usual = median_px_.find({landmark, view}); usual != median_px_.end()) return usual->second;
    return std::nullopt;
  }

 private:
  std::map<std::tuple<std::uint64_t, std::string, std::string>, double> own_px_;
  std::map<std::pair<std::string, std::string>, double> median_px_;
};

constexpr std::array kSides{vision::Side::kLower, vision::Side::kUpper};

std::optional<FrameBound::Landmark> bound_of(const Eigen::Matrix2d& information) {
  // Range and bearing have different units, so the determinant is compared with the product of the diagonal.
  const double product = information(0, 0) * information(1, 1);
  const double determinant = information.determinant();
  constexpr double kLeastShare = 1e-12;  // below this, rounding of the sums leaves fewer than half of the digits
  if (!(product > 0) || !(determinant > kLeastShare * product)) return std::nullopt;
  return FrameBound::Landmark{std::sqrt(information(1, 1) / determinant), std::sqrt(information(0, 0) / determinant)};
}

}  // namespace

std::vector<std::array<Eigen::Matrix2d, 2>> landmark_information(const vision::Rig& rig,
                                                                 const std::vector<Landmark>& targets,
                                                                 const std::vector<Eigen::Vector2d>& places_m,
                                                                 const localisation::Pose& pose,
                                                                 const EdgeNoiseOf& edge_noise_px) {
  const Eigen::Matrix2d none = Eigen::Matrix2d::Zero();
  std::vector<std::array<Eigen::Matrix2d, 2>> information(targets.size(), {none, none});
  for (std::size_t k = 0; k < targets.size(); ++k) {
    const Eigen::Vector2d p_BL_m = localisation::in_body(pose, places_m[k]);
    for (const vision::Side side : kSides) {
      const auto noise_px = edge_noise_px(targets[k].name, std::string(to_string(side)));
      if (!noise_px) continue;
      const auto seen = vision::sighting_information(of_view(rig, side), targets[k], p_BL_m, *noise_px);
      if (seen) information[k][std::size_t(side)] = *seen;
    }
  }
  return information;
}

std::optional<Eigen::Matrix3d> whole_bound(const vision::UncertainRig& rig, const config::BeliefErrors& errors,
                                           const std::vector<Landmark>& targets, const localisation::Pose& pose,
                                           const std::vector<std::array<Eigen::Matrix2d, 2>>& information) {
  std::vector<localisation::InformedMeasurement> measurements;
  for (std::size_t k = 0; k < targets.size(); ++k) {
    const Eigen::Vector2d place_m = vision::place_m(targets[k]);
    for (const vision::Side side : kSides) {
      measurements.push_back(
          {place_m, information[k][std::size_t(side)],
           rig.place_by_shared(side, localisation::in_body(pose, place_m), targets[k], errors.vision.landmarks[k]),
           errors.places[k]});
    }
  }
  return localisation::shared_pose_bound(pose, measurements);
}

std::vector<FrameBound> bounds(const RunData& run) {
  if (run.sightings.empty()) return {};
  const vision::Rig rig = config::to_rig(run.robot);
  const config::BeliefErrors errors = config::to_belief_errors(run.robot, run.map);
  const vision::UncertainRig belief(rig, errors.vision.rig);
  const std::vector<Landmark> targets = config::to_targets(run.map);
  const std::vector<Eigen::Vector2d> places_m = config::to_landmark_positions(run.map);
  const EdgeNoise noise(run.sightings);
  const auto poses = at_frames(run, run.truth.empty() ? run.estimate : run.truth);

  std::vector<FrameBound> result;
  for (std::size_t i = 0; i < run.frames.size(); ++i) {
    FrameBound& bound = result.emplace_back();
    bound.frame = run.frames[i].frame;
    bound.landmarks.resize(targets.size());
    if (!poses[i]) continue;
    const localisation::Pose pose{poses[i]->x_m, poses[i]->y_m, poses[i]->heading_rad};
    const auto information = landmark_information(
        rig, targets, places_m, pose,
        [&](const std::string& landmark, const std::string& view) { return noise.find(bound.frame, landmark, view); });
    std::vector<Eigen::Matrix2d> of_both;
    of_both.reserve(information.size());
    for (const auto& [lower, upper] : information) of_both.emplace_back(lower + upper);
    std::transform(of_both.begin(), of_both.end(), bound.landmarks.begin(), bound_of);
    bound.covariance = localisation::pose_bound(pose, places_m, of_both);
    if (!belief.is_exact()) bound.whole_covariance = whole_bound(belief, errors, targets, pose, information);
  }
  return result;
}

}  // namespace twocone::runlog
