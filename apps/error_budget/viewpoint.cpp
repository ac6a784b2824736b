// SPDX-License-Identifier: Apache-2.0
#include "apps/error_budget/viewpoint.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <fmt/format.h>
#include <Eigen/Dense>

#include "localisation/least_squares_fix.h"
#include "vision/bound.h"
#include "vision/triangulation.h"

namespace twocone::error_budget {
namespace {

/// Factor of the stated sigmas over those of the outlines' noise. With it, an error of many times the noise still
/// passes as noise and gets an answer: with the smallest sigma of a landmark in the lab, 0.01 px, errors of 3 px pass.
constexpr double kInflation = 300;
/// The same factor for ranges and bearings in a fix: with a sigma of 1 mm, a range with an error of 0.1 m passes. With
/// a larger factor, the bearings could not distinguish the two mirror-image positions.
constexpr double kFixInflation = 100;
/// If the height is unknown, a disparity must be at least this many of its inflated sigmas (vision::kMinSigmas).
constexpr double kDisparitySigmas = 2 * vision::kMinSigmas;

// ---- sources of error

using Mirror = vision::MirrorViewSettings;

std::string millimetres(double metres) { return fmt::format("{:g} mm", metres * 1000); }
std::string degrees(double rad) { return fmt::format("{:g} degree", std::round(rad * 180e9 / std::numbers::pi) / 1e9); }
std::string pixels(double px) { return fmt::format("{:.3g} px", px); }

/// Scales v = (d / R + cot(apex / 2)) r_m by changing R alone.
void scale_focal_length(Mirror& view, double factor) {
  vision::ConeMirror& cone = view.cone;
  const double cotangent = 1 / std::tan(cone.apex_rad / 2);
  cone.rim_radius_m = cone.lens_to_tip_m / (factor * (cone.lens_to_tip_m / cone.rim_radius_m + cotangent) - cotangent);
}

/// Returns a part with standard deviation `size` of one number.
Part shift(double size, const std::function<double&(World&)>& number, int landmark = -1) {
  return {landmark, [=](World& world, double sigmas) { number(world) += size * sigmas; }};
}

/// Returns a part that changes both mirrors equally.
Part in_both(const std::function<void(Mirror& view, double sigmas)>& change) {
  return {-1, [=](World& world, double sigmas) {
            change(world.lower, sigmas);
            change(world.upper, sigmas);
          }};
}

void add_rig(const ErrorBudgetSettings& s, std::vector<Source>& sources) {
  const Part focal = in_both([=](Mirror& v, double sigmas) { scale_focal_length(v, 1 + s.focal_share * sigmas); });
  const Part rim = in_both([=](Mirror& v, double sigmas) { v.rim_radius_px += s.rim_radius_px * sigmas; });
  const Part tip = in_both([=](Mirror& v, double sigmas) { v.cone.lens_to_tip_m += s.lens_to_tip_m * sigmas; });
  const Part height = shift(s.separation_m, [](World& w) -> double& { return w.upper.lens_height_m; });
  sources.push_back({"focal length v, both mirrors", fmt::format("{:g} %", s.focal_share * 100), {focal}});
  sources.push_back({"rim radius r_m, both mirrors", pixels(s.rim_radius_px), {rim}});
  sources.push_back({"lens to tip d, both mirrors", millimetres(s.lens_to_tip_m), {tip}});
  sources.push_back({"mirror separation s", millimetres(s.separation_m), {height}});
}

void add_mirror(const ErrorBudgetSettings& s, const std::string& name, Mirror World::*view,
                std::vector<Source>& sources) {
  const std::string of = ", " + name + " mirror";
  const auto both_axes = [=](double size, Eigen::Vector2d Mirror::*vector) -> std::vector<Part> {
    return {shift(size, [=](World& w) -> double& { return (w.*view.*vector).x(); }),
            shift(size, [=](World& w) -> double& { return (w.*view.*vector).y(); })};
  };
  const Part apex = shift(s.apex_rad, [=](World& w) -> double& { return (w.*view).cone.apex_rad; });
  const Part azimuth = shift(s.azimuth_rad, [=](World& w) -> double& { return (w.*view).azimuth_rad; });
  sources.push_back({"centre" + of, pixels(s.centre_px), both_axes(s.centre_px, &Mirror::centre_px)});
  sources.push_back({"tilt" + of, degrees(s.tilt_rad), both_axes(s.tilt_rad, &Mirror::tilt_rad)});
  sources.push_back(
      {"axis offset" + of, millimetres(s.axis_offset_m), both_axes(s.axis_offset_m, &Mirror::axis_offset_m)});
  sources.push_back({"apex angle" + of, degrees(s.apex_rad), {apex}});
  sources.push_back({"azimuth" + of, degrees(s.azimuth_rad), {azimuth}});
}

void add_map(const ErrorBudgetSettings& s, int landmarks, std::vector<Source>& sources) {
  Source place{"landmark's place in the map", millimetres(s.landmark_place_m), {}};
  Source top{"landmark's top height", millimetres(s.landmark_top_m), {}};
  Source radius{"landmark's radius", millimetres(s.landmark_radius_m), {}};
  for (int i = 0; i < landmarks; ++i) {
    const auto moved = [i](double size, double Landmark::*number) {
      return shift(
          size, [=](World& w) -> double& { return w.landmarks[std::size_t(i)].*number; }, i);
    };
    place.parts.push_back(moved(s.landmark_place_m, &Landmark::x_m));
    place.parts.push_back(moved(s.landmark_place_m, &Landmark::y_m));
    top.parts.push_back(moved(s.landmark_top_m, &Landmark::top_m));
    radius.parts.push_back(moved(s.landmark_radius_m, &Landmark::radius_m));
  }
  sources.insert(sources.end(), {std::move(place), std::move(top), std::move(radius)});
}

Source pixel_noise(const ErrorBudgetSettings& s, int landmarks) {
  Source noise{"pixel noise along the outlines", pixels(s.edge_noise_px), {}};
  for (int i = 0; i < landmarks; ++i) {
    for (const std::size_t view : {0U, 1U}) {
      for (const int axis : {0, 1}) {
        noise.parts.push_back(
            {i, [=](World& world, double sigmas) {
               if (world.noise.empty()) {
                 world.noise.resize(world.landmarks.size(), {Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero()});
               }
               world.noise[std::size_t(i)][view][axis] += sigmas;
             }});
      }
    }
  }
  return noise;
}

}  // namespace

vision::Rig rig_of(const World& world) { return {vision::MirrorView(world.lower), vision::MirrorView(world.upper)}; }

Viewpoint::Viewpoint(const World& truth, const localisation::Pose& pose, const behaviours::Motion& motion,
                     double edge_noise_px, bool tops_known)
    : truth_(&truth), rig_(rig_of(truth)), pose_(pose), motion_(motion), tops_known_(tops_known) {
  for (int i = 0; i < int(truth.landmarks.size()); ++i) {
    auto& views = views_.emplace_back();
    views = {look(rig_.lower, i, edge_noise_px), look(rig_.upper, i, edge_noise_px)};
    inflation_.push_back(kInflation);
    const bool both = views[0] && views[1];
    if (!both && !(tops_known && (views[0] || views[1]))) continue;
    if (!tops_known) {
      // The true sigmas limit the factor, because the disparity must stay above kDisparitySigmas inflated sigmas.
      const auto plain = vision::triangulate(rig_, &views[0]->sighting, &views[1]->sighting,
                                             truth.landmarks[i].radius_m, std::nullopt);
      if (!plain.disparity_px) continue;
      const double sigma_px = std::hypot(views[0]->root_px.norm(), views[1]->root_px.norm());
      inflation_.back() = std::clamp(*plain.disparity_px / (kDisparitySigmas * sigma_px), 1.0, kInflation);
    }
    if (answer(truth, rig_, i)) seen_.push_back(i);
  }
}

Eigen::Vector2d Viewpoint::p_BL_m(const localisation::Pose& pose, int landmark) const {
  return localisation::in_body(pose, vision::place_m(truth_->landmarks[std::size_t(landmark)]));
}

std::optional<Eigen::Vector2d> Viewpoint::pixel(const vision::MirrorView& view, const Eigen::Vector2d& p_BL_m,
                                                int landmark) const {
  const Landmark& p = truth_->landmarks[std::size_t(landmark)];
  const auto near_m = vision::near_top_point(view, p_BL_m, p.radius_m, p.top_m);
  return near_m ? view.project(*near_m) : std::nullopt;
}

std::optional<Viewpoint::View> Viewpoint::look(const vision::MirrorView& view, int landmark,
                                               double edge_noise_px) const {
  const Eigen::Vector2d place_m = p_BL_m(pose_, landmark);
  const auto here_px = pixel(view, place_m, landmark);
  if (!here_px) return std::nullopt;
  const auto information =
      vision::sighting_information(view, truth_->landmarks[std::size_t(landmark)], place_m, edge_noise_px);
  if (!information) return std::nullopt;

  // Computes the derivative of the near point's pixel by range and bearing, by central differences. Their relative
  // error is (step / range)^2.
  constexpr double kStep = 1e-4;  // m, rad
  const Eigen::Vector2d outwards = place_m.normalized();
  const std::array<Eigen::Vector2d, 2> steps_m{kStep * outwards,
                                               kStep * place_m.norm() * Eigen::Vector2d(-outwards.y(), outwards.x())};
  Eigen::Matrix2d slope;
  for (int i = 0; i < 2; ++i) {
    const auto behind_px = pixel(view, place_m - steps_m[std::size_t(i)], landmark);
    const auto ahead_px = pixel(view, place_m + steps_m[std::size_t(i)], landmark);
    if (!behind_px || !ahead_px) return std::nullopt;  // at the very edge of the mirror's view
    slope.col(i) = (*ahead_px - *behind_px) / (2 * kStep);
  }
  const Eigen::LLT<Eigen::Matrix2d> root(*information);
  if (root.info() != Eigen::Success) return std::nullopt;
  const Eigen::Matrix2d half = slope * root.matrixL().solve(Eigen::Matrix2d::Identity()).transpose();
  const Eigen::Matrix2d covariance_px2 = half * half.transpose();
  if (!(covariance_px2.determinant() > 0)) return std::nullopt;
  return View{{*here_px, covariance_px2, edge_noise_px}, half};
}

std::optional<Answer> Viewpoint::answer(const World& believed, const vision::Rig& rig, int landmark) const {
  const std::size_t k = std::size_t(landmark);
  const Landmark& p = believed.landmarks[k];
  if (!(p.radius_m > 0)) return std::nullopt;  // a draw that no map can contain
  const double inflation = inflation_[k];
  std::array<std::optional<vision::Sighting>, 2> sightings;
  for (const std::size_t view : {0U, 1U}) {
    if (!views_[k][view]) continue;
    vision::Sighting& sighting = sightings[view].emplace(views_[k][view]->sighting);
    sighting.covariance_px2 *= inflation * inflation;
    if (view == 1 && believed.skew_s != 0) {
      const double turn_rad = motion_.turn_rate_radps * believed.skew_s;
      const double way_m = motion_.speed_mps * believed.skew_s;
      const double course_rad = pose_.heading_rad + turn_rad / 2;
      const localisation::Pose moved{pose_.x_m + way_m * std::cos(course_rad), pose_.y_m + way_m * std::sin(course_rad),
                                     pose_.heading_rad + turn_rad};
      const auto moved_px = pixel(rig_.upper, p_BL_m(moved, landmark), landmark);
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

std::optional<localisation::Fix> Viewpoint::fix(const World& believed, const vision::Rig& rig) const {
  std::vector<localisation::LandmarkMeasurement> measurements;
  for (const int landmark : seen_) {
    const auto found = answer(believed, rig, landmark);
    if (!found) continue;
    measurements.push_back({vision::place_m(believed.landmarks[std::size_t(landmark)]), found->range_bearing.x(),
                            found->range_bearing.y(), found->covariance * (kFixInflation * kFixInflation)});
  }
  localisation::Fix fix = localisation::fix_by_least_squares(measurements);
  if (!fix.position_m || fix.other_position_m) return std::nullopt;
  return fix;
}

std::vector<Source> all_sources(const ErrorBudgetSettings& s, int landmarks) {
  std::vector<Source> sources{pixel_noise(s, landmarks)};
  add_rig(s, sources);
  add_mirror(s, "lower", &World::lower, sources);
  add_mirror(s, "upper", &World::upper, sources);
  sources.push_back({"skew between the views",
                     fmt::format("{:g} ms", s.skew_s * 1000),
                     {{-1, [=](World& world, double sigmas) { world.skew_s += s.skew_s * sigmas; }}}});
  add_map(s, landmarks, sources);
  return sources;
}

}  // namespace twocone::error_budget
