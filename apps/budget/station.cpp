// SPDX-License-Identifier: Apache-2.0
#include "apps/budget/station.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

#include "localisation/least_squares_fix.h"
#include "vision/bound.h"

namespace twocone::budget {
namespace {

/// Stated sigmas are those of the outlines' noise times this, so that an error many times the noise is still taken for
/// noise and answered: 300 * 0.01 px, the least that a lab's pillar has, passes three whole pixels.
constexpr double kInflation = 300;
/// Likewise of ranges and bearings into a fix: 100 * 1 mm passes a range that is wrong by 0.1 m. No more, so that
/// the bearings go on telling one of two mirror places from the other.
constexpr double kFixInflation = 100;
/// Where the height is not known, a disparity must stand out of its inflated sigma by this (vision::kMinSigmas) or
/// more.
constexpr double kDisparitySigmas = 2 * vision::kMinSigmas;

vision::Sighting scaled(vision::Sighting sighting, double factor) {
  sighting.covariance_px2 *= factor * factor;
  return sighting;
}

}  // namespace

vision::Rig rig_of(const World& world) { return {vision::MirrorView(world.lower), vision::MirrorView(world.upper)}; }

Station::Station(const World& truth, const localisation::Pose& pose, const Motion& motion, double edge_noise_px,
                 bool tops_known)
    : truth_(&truth), rig_(rig_of(truth)), pose_(pose), motion_(motion), tops_known_(tops_known) {
  for (int i = 0; i < int(truth.pillars.size()); ++i) {
    auto& views = views_.emplace_back();
    views = {look(rig_.lower, i, edge_noise_px), look(rig_.upper, i, edge_noise_px)};
    inflation_.push_back(kInflation);
    const bool both = views[0] && views[1];
    if (!both && !(tops_known && (views[0] || views[1]))) continue;
    if (!tops_known) {
      // By its own sigmas at their true size, how far may they grow?
      const auto plain =
          vision::triangulate(rig_, &views[0]->sighting, &views[1]->sighting, truth.pillars[i].radius_m, std::nullopt);
      if (!plain.disparity_px) continue;
      const double sigma_px = std::hypot(views[0]->root_px.norm(), views[1]->root_px.norm());
      inflation_.back() = std::clamp(*plain.disparity_px / (kDisparitySigmas * sigma_px), 1.0, kInflation);
    }
    if (answer(truth, rig_, i)) seen_.push_back(i);
  }
}

Eigen::Vector2d Station::p_BL_m(const localisation::Pose& pose, int pillar) const {
  return Eigen::Rotation2Dd(-pose.heading_rad) *
         (truth_->pillars[std::size_t(pillar)].place_m - Eigen::Vector2d(pose.x_m, pose.y_m));
}

Eigen::Vector2d Station::true_range_bearing(int pillar) const {
  const Eigen::Vector2d p_m = p_BL_m(pose_, pillar);
  return {p_m.norm(), std::atan2(p_m.y(), p_m.x())};
}

std::optional<Eigen::Vector2d> Station::pixel(const vision::MirrorView& view, const localisation::Pose& pose,
                                              int pillar) const {
  const Pillar& p = truth_->pillars[std::size_t(pillar)];
  const auto near_m = vision::near_top_point(view, p_BL_m(pose, pillar), p.radius_m, p.top_m);
  return near_m ? view.project(*near_m) : std::nullopt;
}

std::optional<Station::View> Station::look(const vision::MirrorView& view, int pillar, double edge_noise_px) const {
  const auto here_px = pixel(view, pose_, pillar);
  if (!here_px) return std::nullopt;
  const Pillar& p = truth_->pillars[std::size_t(pillar)];
  const vision::Target target{"", {1, 0, 0}, p.radius_m, p.top_m};
  const Eigen::Vector2d place_m = p_BL_m(pose_, pillar);
  const auto information = vision::sighting_information(view, target, place_m, edge_noise_px);
  if (!information) return std::nullopt;

  // How the near point's pixel goes with range and bearing, by central differences: their error is (step / range)^2.
  constexpr double kStep = 1e-4;  // m, rad
  const Eigen::Vector2d outwards = place_m.normalized();
  const std::array<Eigen::Vector2d, 2> steps_m{kStep * outwards,
                                               kStep * place_m.norm() * Eigen::Vector2d(-outwards.y(), outwards.x())};
  Eigen::Matrix2d slope;
  for (int i = 0; i < 2; ++i) {
    std::array<std::optional<Eigen::Vector2d>, 2> ends;
    for (const int side : {0, 1}) {
      const Eigen::Vector2d moved_m = place_m + (side == 0 ? -1 : 1) * steps_m[std::size_t(i)];
      const auto near_m = vision::near_top_point(view, moved_m, p.radius_m, p.top_m);
      ends[std::size_t(side)] = near_m ? view.project(*near_m) : std::nullopt;
    }
    if (!ends[0] || !ends[1]) return std::nullopt;  // at the very edge of what the mirror shows
    slope.col(i) = (*ends[1] - *ends[0]) / (2 * kStep);
  }
  const Eigen::LLT<Eigen::Matrix2d> root(*information);
  if (root.info() != Eigen::Success) return std::nullopt;
  const Eigen::Matrix2d half = slope * root.matrixL().solve(Eigen::Matrix2d::Identity()).transpose();
  const Eigen::Matrix2d covariance_px2 = half * half.transpose();
  if (!(covariance_px2.determinant() > 0)) return std::nullopt;
  return View{{*here_px, covariance_px2, edge_noise_px}, half};
}

std::optional<Answer> Station::answer(const World& believed, const vision::Rig& rig, int pillar) const {
  const std::size_t k = std::size_t(pillar);
  const Pillar& p = believed.pillars[k];
  if (!(p.radius_m > 0)) return std::nullopt;  // a draw that no map can hold
  const double inflation = inflation_[k];
  std::array<std::optional<vision::Sighting>, 2> sightings;
  for (const std::size_t view : {0U, 1U}) {
    if (!views_[k][view]) continue;
    vision::Sighting& sighting = sightings[view].emplace(scaled(views_[k][view]->sighting, inflation));
    if (view == 1 && believed.skew_s != 0) {
      const double turn_rad = motion_.turn_rate_radps * believed.skew_s;
      const double way_m = motion_.speed_mps * believed.skew_s;
      const double course_rad = pose_.heading_rad + turn_rad / 2;
      const auto moved_px = pixel(rig_.upper,
                                  {pose_.x_m + way_m * std::cos(course_rad), pose_.y_m + way_m * std::sin(course_rad),
                                   pose_.heading_rad + turn_rad},
                                  pillar);
      if (!moved_px) return std::nullopt;
      sighting.pixel_px = *moved_px;
    }
    if (!believed.noise.empty()) sighting.pixel_px += views_[k][view]->root_px * believed.noise[k][view];
  }
  const auto found =
      vision::triangulate(rig, sightings[0] ? &*sightings[0] : nullptr, sightings[1] ? &*sightings[1] : nullptr,
                          p.radius_m, tops_known_ ? std::optional(p.top_m) : std::nullopt);
  if (!found.range_m || !found.bearing_rad || !found.covariance) return std::nullopt;
  return Answer{{*found.range_m, *found.bearing_rad}, *found.covariance / (inflation * inflation)};
}

std::optional<localisation::Fix> Station::fix(const World& believed, const vision::Rig& rig) const {
  std::vector<localisation::LandmarkMeasurement> measurements;
  for (const int pillar : seen_) {
    const auto found = answer(believed, rig, pillar);
    if (!found) continue;
    measurements.push_back({believed.pillars[std::size_t(pillar)].place_m, found->range_bearing.x(),
                            found->range_bearing.y(), found->covariance * (kFixInflation * kFixInflation)});
  }
  localisation::Fix fix = localisation::fix_by_least_squares(measurements);
  if (!fix.position_m || fix.other_position_m) return std::nullopt;
  return fix;
}

}  // namespace twocone::budget
