// SPDX-License-Identifier: Apache-2.0
#include "apps/error_budget/viewpoint.h"

#include <cmath>

#include <fmt/format.h>

namespace twocone::error_budget {
namespace {

using View = vision::MirrorViewSettings;

std::string millimetres(double metres) { return fmt::format("{:g} mm", metres * 1000); }
std::string degrees(double rad) { return fmt::format("{:g} degree", std::round(rad * 180e9 / std::numbers::pi) / 1e9); }
std::string pixels(double px) { return fmt::format("{:.3g} px", px); }

/// Scales v = (d / R + cot(apex / 2)) r_m by means of a wrong R alone.
void scale_focal_length(View& view, double factor) {
  vision::ConeMirror& cone = view.cone;
  const double cotangent = 1 / std::tan(cone.apex_rad / 2);
  cone.rim_radius_m = cone.lens_to_tip_m / (factor * (cone.lens_to_tip_m / cone.rim_radius_m + cotangent) - cotangent);
}

/// Returns a part that moves one number by `size`.
Part shift(double size, const std::function<double&(World&)>& number, int landmark = -1) {
  return {landmark, [=](World& world, double sigmas) { number(world) += size * sigmas; }};
}

/// Returns the part that changes both mirrors alike.
Part in_both(const std::function<void(View& view, double sigmas)>& change) {
  return {-1, [=](World& world, double sigmas) {
            change(world.lower, sigmas);
            change(world.upper, sigmas);
          }};
}

void add_rig(const ErrorBudgetSettings& s, std::vector<Source>& sources) {
  const Part focal = in_both([=](View& v, double sigmas) { scale_focal_length(v, 1 + s.focal_share * sigmas); });
  const Part rim = in_both([=](View& v, double sigmas) { v.rim_radius_px += s.rim_radius_px * sigmas; });
  const Part tip = in_both([=](View& v, double sigmas) { v.cone.lens_to_tip_m += s.lens_to_tip_m * sigmas; });
  const Part height = shift(s.separation_m, [](World& w) -> double& { return w.upper.lens_height_m; });
  sources.push_back({"focal length v, both mirrors", fmt::format("{:g} %", s.focal_share * 100), {focal}});
  sources.push_back({"rim radius r_m, both mirrors", pixels(s.rim_radius_px), {rim}});
  sources.push_back({"lens to tip d, both mirrors", millimetres(s.lens_to_tip_m), {tip}});
  sources.push_back({"mirror separation s", millimetres(s.separation_m), {height}});
}

void add_mirror(const ErrorBudgetSettings& s, const std::string& name, View World::*view,
                std::vector<Source>& sources) {
  const std::string of = ", " + name + " mirror";
  const auto both_axes = [=](double size, Eigen::Vector2d View::*vector) -> std::vector<Part> {
    return {shift(size, [=](World& w) -> double& { return (w.*view.*vector).x(); }),
            shift(size, [=](World& w) -> double& { return (w.*view.*vector).y(); })};
  };
  const Part apex = shift(s.apex_rad, [=](World& w) -> double& { return (w.*view).cone.apex_rad; });
  const Part azimuth = shift(s.azimuth_rad, [=](World& w) -> double& { return (w.*view).azimuth_rad; });
  sources.push_back({"centre" + of, pixels(s.centre_px), both_axes(s.centre_px, &View::centre_px)});
  sources.push_back({"tilt" + of, degrees(s.tilt_rad), both_axes(s.tilt_rad, &View::tilt_rad)});
  sources.push_back(
      {"axis offset" + of, millimetres(s.axis_offset_m), both_axes(s.axis_offset_m, &View::axis_offset_m)});
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
