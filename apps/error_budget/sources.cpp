// SPDX-License-Identifier: Apache-2.0
#include "apps/error_budget/sources.h"

#include <cmath>

#include <fmt/format.h>

namespace twocone::error_budget {
namespace {

using ViewPointer = vision::MirrorViewSettings World::*;

std::string millimetres(double metres) { return fmt::format("{:g} mm", metres * 1000); }
std::string degrees(double rad) { return fmt::format("{:g} degree", std::round(rad * 180e9 / std::numbers::pi) / 1e9); }
std::string pixels(double px) { return fmt::format("{:.3g} px", px); }

/// Scales v = (d / R + cot(apex / 2)) r_m by means of a wrong R alone.
void scale_focal_length(vision::MirrorViewSettings& view, double factor) {
  vision::ConeMirror& cone = view.cone;
  const double cotangent = 1 / std::tan(cone.apex_rad / 2);
  cone.rim_radius_m = cone.lens_to_tip_m / (factor * (cone.lens_to_tip_m / cone.rim_radius_m + cotangent) - cotangent);
}

/// Returns parts that move x and y of a vector by `size` each.
template <typename Vector>
std::vector<Part> both_axes(double size, Vector vector) {
  std::vector<Part> parts;
  for (const int axis : {0, 1}) {
    parts.push_back({-1, [=](World& world, double sigmas) { vector(world)[axis] += size * sigmas; }});
  }
  return parts;
}

void add_rig(const ErrorBudgetSettings& s, std::vector<Source>& sources) {
  sources.push_back({"focal length v, both mirrors",
                     fmt::format("{:g} %", s.focal_share * 100),
                     {{-1, [=](World& world, double sigmas) {
                         scale_focal_length(world.lower, 1 + s.focal_share * sigmas);
                         scale_focal_length(world.upper, 1 + s.focal_share * sigmas);
                       }}}});
  sources.push_back({"rim radius r_m, both mirrors", pixels(s.rim_radius_px), {{-1, [=](World& world, double sigmas) {
                                                                                  world.lower.rim_radius_px +=
                                                                                      s.rim_radius_px * sigmas;
                                                                                  world.upper.rim_radius_px +=
                                                                                      s.rim_radius_px * sigmas;
                                                                                }}}});
  sources.push_back({"lens to tip d, both mirrors",
                     millimetres(s.lens_to_tip_m),
                     {{-1, [=](World& world, double sigmas) {
                         world.lower.cone.lens_to_tip_m += s.lens_to_tip_m * sigmas;
                         world.upper.cone.lens_to_tip_m += s.lens_to_tip_m * sigmas;
                       }}}});
  sources.push_back({"mirror separation s", millimetres(s.separation_m), {{-1, [=](World& world, double sigmas) {
                                                                             world.upper.lens_height_m +=
                                                                                 s.separation_m * sigmas;
                                                                           }}}});
}

void add_mirror(const ErrorBudgetSettings& s, const std::string& name, ViewPointer view, std::vector<Source>& sources) {
  const std::string of = ", " + name + " mirror";
  sources.push_back({"centre" + of, pixels(s.centre_px),
                     both_axes(
                         s.centre_px, [view](World & w) -> auto& { return (w.*view).centre_px; })});
  sources.push_back({"tilt" + of, degrees(s.tilt_rad),
                     both_axes(
                         s.tilt_rad, [view](World & w) -> auto& { return (w.*view).tilt_rad; })});
  sources.push_back({"axis offset" + of, millimetres(s.axis_offset_m),
                     both_axes(
                         s.axis_offset_m, [view](World & w) -> auto& { return (w.*view).axis_offset_m; })});
  sources.push_back({"apex angle" + of, degrees(s.apex_rad), {{-1, [=](World& world, double sigmas) {
                                                                 (world.*view).cone.apex_rad += s.apex_rad * sigmas;
                                                               }}}});
  sources.push_back({"azimuth" + of, degrees(s.azimuth_rad), {{-1, [=](World& world, double sigmas) {
                                                                 (world.*view).azimuth_rad += s.azimuth_rad * sigmas;
                                                               }}}});
}

void add_map(const ErrorBudgetSettings& s, int landmarks, std::vector<Source>& sources) {
  Source place{"landmark's place in the map", millimetres(s.landmark_place_m), {}};
  Source top{"landmark's top height", millimetres(s.landmark_top_m), {}};
  Source radius{"landmark's radius", millimetres(s.landmark_radius_m), {}};
  for (int i = 0; i < landmarks; ++i) {
    const std::size_t k = std::size_t(i);
    place.parts.push_back({i, [=](World& w, double sigmas) { w.landmarks[k].x_m += s.landmark_place_m * sigmas; }});
    place.parts.push_back({i, [=](World& w, double sigmas) { w.landmarks[k].y_m += s.landmark_place_m * sigmas; }});
    top.parts.push_back({i, [=](World& w, double sigmas) { w.landmarks[k].top_m += s.landmark_top_m * sigmas; }});
    radius.parts.push_back(
        {i, [=](World& w, double sigmas) { w.landmarks[k].radius_m += s.landmark_radius_m * sigmas; }});
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
