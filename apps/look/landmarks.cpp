// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <utility>

#include <fmt/format.h>
#include <Eigen/Dense>

#include "apps/look/checks.h"
#include "vision/bands/band_code.h"
#include "vision/hue_labels.h"

namespace twocone::look {
namespace {

using sim_povray::Rgb;

/// Rays around the axis at each height, and where these heights are, as shares of the top's.
constexpr int kBearings = 48;
constexpr std::array kHeights{0.31, 0.83};
/// A side is looked for up to this many radii from the axis.
constexpr double kReach = 4;
/// Share of the rays that must meet one object, so that it counts as the landmark.
constexpr double kMost = 0.9;
/// The top is looked for up to this many times its height on the map.
constexpr double kTopReach = 4;
/// Rays at each height that is tried for the top.
constexpr int kTopBearings = 8;
constexpr double kTopAccuracy_m = 1e-5;

double hue_difference_deg(const Rgb& a, const Rgb& b) {
  return vision::hue_distance_rad(a, b) * 180 / std::numbers::pi;
}

bool is_coloured(const Rgb& c) { return vision::saturation(c) >= vision::HueLabels::kMinSaturation; }

sim_povray::Vec3 level(double bearing_rad) { return {std::cos(bearing_rad), std::sin(bearing_rad), 0}; }

struct Side {
  FloorPoint centre{};
  double radius_m = 0;
  double worst_m = 0;  ///< of the points of the side, off the circle
  Rgb colour{};        ///< mean over the rays
  int object = 0;
};

/// Returns the farthest surface of the object that a ray from the axis meets first.
std::optional<sim_povray::SurfacePoint> side_along(const sim_povray::SceneGeometry& scene, const sim_povray::Vec3& axis,
                                                   double bearing_rad, double reach_m) {
  std::optional<sim_povray::SurfacePoint> found;
  sim_povray::Vec3 from = axis;
  while (const auto hit = scene.cast(from, level(bearing_rad), reach_m)) {
    if (found && hit->object != found->object) break;
    reach_m -= hit->distance_m;
    from = hit->point;
    found = hit;
  }
  return found;
}

/// Fits a circle to points by x^2 + y^2 = 2 a x + 2 b y + c, in least squares (Kasa 1976). For points all around it is
/// the best circle.
Side fit_circle(const std::vector<Eigen::Vector2d>& points) {
  Eigen::MatrixX3d rows(points.size(), 3);
  Eigen::VectorXd squares(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    rows.row(Eigen::Index(i)) << 2 * points[i].x(), 2 * points[i].y(), 1;
    squares[Eigen::Index(i)] = points[i].squaredNorm();
  }
  const Eigen::Vector3d answer = rows.colPivHouseholderQr().solve(squares);
  const Eigen::Vector2d centre = answer.head<2>();
  Side side{.centre = {centre.x(), centre.y()}, .radius_m = std::sqrt(answer.z() + centre.squaredNorm())};
  for (const Eigen::Vector2d& point : points) {
    side.worst_m = std::max(side.worst_m, std::abs((point - centre).norm() - side.radius_m));
  }
  return side;
}

/// Returns the side of what stands around the landmark's axis; nothing if no object surrounds it.
std::optional<Side> side_of(const sim_povray::SceneGeometry& scene, const Landmark& landmark) {
  std::map<int, std::pair<std::vector<Eigen::Vector2d>, Rgb>> by_object;
  for (const double share : kHeights) {
    for (int i = 0; i < kBearings; ++i) {
      const double bearing_rad = 2 * std::numbers::pi * (i + 0.5) / kBearings;
      const auto seen = side_along(scene, {landmark.x_m, landmark.y_m, share * landmark.top_m}, bearing_rad,
                                   kReach * landmark.radius_m);
      if (!seen) continue;
      auto& [points, colour] = by_object[seen->object];
      // Relative to the axis, so that no digits cancel in the squares.
      points.emplace_back(seen->point.x - landmark.x_m, seen->point.y - landmark.y_m);
      for (std::size_t c = 0; c < 3; ++c) colour[c] += seen->colour[c];
    }
  }
  const auto most =
      std::ranges::max_element(by_object, {}, [](const auto& entry) { return entry.second.first.size(); });
  if (most == by_object.end()) return std::nullopt;
  const auto& [points, colours] = most->second;
  if (double(points.size()) < kMost * kBearings * kHeights.size()) return std::nullopt;
  Side side = fit_circle(points);
  side.centre = {landmark.x_m + side.centre.x_m, landmark.y_m + side.centre.y_m};
  side.object = most->first;
  for (std::size_t c = 0; c < 3; ++c) side.colour[c] = colours[c] / double(points.size());
  return side;
}

/// Returns the height at which the side ends, seen from its axis.
double top_of(const sim_povray::SceneGeometry& scene, const Landmark& landmark, const Side& side) {
  const auto has_side = [&](double height_m) {
    int met = 0;
    for (int i = 0; i < kTopBearings; ++i) {
      const double bearing_rad = 2 * std::numbers::pi * (i + 0.5) / kTopBearings;
      const auto hit =
          scene.cast({side.centre.x_m, side.centre.y_m, height_m}, level(bearing_rad), side.radius_m + kMap_m);
      met += hit && hit->distance_m > side.radius_m - kMap_m && hue_difference_deg(hit->colour, side.colour) < kHue_deg;
    }
    return met > kTopBearings / 2;
  };
  double low = kHeights.back() * landmark.top_m;
  double high = kTopReach * landmark.top_m;
  while (high - low > kTopAccuracy_m) (has_side((low + high) / 2) ? low : high) = (low + high) / 2;
  return (low + high) / 2;
}

/// Returns the number of the bands that a side shows; nothing where it shows none.
std::optional<int> number_on(const sim_povray::SceneGeometry& scene, const Landmark& landmark, const Side& side) {
  std::array<double, vision::kBandCells> grey{};
  for (std::size_t k = 0; k < grey.size(); ++k) {
    const double height_m =
        landmark.top_m + (double(vision::kCellsOverLine) - double(k) - 0.5) * landmark.bands->cell_m;
    const auto seen = side_along(scene, {side.centre.x_m, side.centre.y_m, height_m}, 0, kReach * side.radius_m);
    if (!seen) return std::nullopt;
    grey[k] = (seen->colour[0] + seen->colour[1] + seen->colour[2]) / 3;
  }
  const auto [least, greatest] = std::ranges::minmax_element(grey);
  vision::BandCells cells{};
  for (std::size_t k = 0; k < grey.size(); ++k) cells[k] = grey[k] > (*least + *greatest) / 2;
  return vision::band_number(cells);
}

double apart_m(const FloorPoint& a, double x_m, double y_m) { return std::hypot(a.x_m - x_m, a.y_m - y_m); }

/// Describes the nearest upright cylinder of the landmark's colour.
std::string nearest_of_colour(const sim_povray::SceneGeometry& scene, const Landmark& landmark,
                              std::optional<Disc>& shown) {
  const sim_povray::SceneCylinder* nearest = nullptr;
  double least_m = std::numeric_limits<double>::infinity();
  const std::vector<sim_povray::SceneCylinder> cylinders = scene.upright_cylinders();
  for (const auto& cylinder : cylinders) {
    const double distance_m = std::hypot(cylinder.x_m - landmark.x_m, cylinder.y_m - landmark.y_m);
    const bool fits = cylinder.colour && is_coloured(*cylinder.colour) &&
                      hue_difference_deg(*cylinder.colour, landmark.colour) < kHue_deg && distance_m < least_m;
    if (!fits) continue;
    least_m = distance_m;
    nearest = &cylinder;
  }
  if (nearest == nullptr) return "the scene has no upright cylinder of its colour";
  shown = Disc{{nearest->x_m, nearest->y_m}, nearest->radius_m};
  return fmt::format(
      "the nearest upright cylinder of its colour, {}, is {:.3f} m away at ({:.3f}, {:.3f}), with radius {:.3f} and "
      "top "
      "{:.3f}",
      scene.objects()[std::size_t(nearest->object)].describe(), least_m, nearest->x_m, nearest->y_m, nearest->radius_m,
      nearest->top_m);
}

}  // namespace

void check_landmarks(const Subject& subject, const sim_povray::SceneGeometry& scene, Look& look) {
  const std::vector<Landmark>& landmarks = subject.map.landmarks;
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    const Landmark& landmark = landmarks[i];
    const std::string who = fmt::format("{}: landmark {}", subject.place_of("landmarks", i), landmark.name);
    const auto add = [&](Disagreement kind, const std::string& text, std::optional<Disc> shown = {}) {
      look.findings.push_back({kind, who + text, {landmark.x_m, landmark.y_m}, shown});
    };
    const auto side = side_of(scene, landmark);
    if (!side) {
      std::optional<Disc> shown;
      const std::string nearest = nearest_of_colour(scene, landmark, shown);
      add(Disagreement::kLandmarkMissing,
          fmt::format(": nothing stands around ({:.3f}, {:.3f}) in the scene; {}", landmark.x_m, landmark.y_m, nearest),
          shown);
      continue;
    }
    const std::string object = scene.objects()[std::size_t(side->object)].describe();
    const std::optional<Disc> shown = Disc{side->centre, side->radius_m};
    if (side->worst_m > kMap_m) {
      add(Disagreement::kLandmarkRadius,
          fmt::format(": {} is no upright cylinder: its side is up to {:.1f} mm off the best circle", object,
                      1000 * side->worst_m),
          shown);
      continue;
    }
    if (const double off_m = apart_m(side->centre, landmark.x_m, landmark.y_m); off_m > kMap_m) {
      add(Disagreement::kLandmarkPlace,
          fmt::format(" is at ({:.3f}, {:.3f}), but {} at ({:.3f}, {:.3f}): {:.1f} mm apart", landmark.x_m,
                      landmark.y_m, object, side->centre.x_m, side->centre.y_m, 1000 * off_m),
          shown);
    }
    if (std::abs(side->radius_m - landmark.radius_m) > kMap_m) {
      add(Disagreement::kLandmarkRadius,
          fmt::format(" has radius_m {:.3f}, but {} has {:.4f}", landmark.radius_m, object, side->radius_m), shown);
    }
    if (landmark.bands) {
      const auto number = number_on(scene, landmark, *side);
      if (number == landmark.bands->number) continue;
      add(Disagreement::kLandmarkColour,
          fmt::format(" has bands {} with their line at {:.3f} m, but {} has {} there", landmark.bands->number,
                      landmark.top_m, object, number ? fmt::format("bands {}", *number) : "none"));
      continue;
    }
    if (const double top_m = top_of(scene, landmark, *side); std::abs(top_m - landmark.top_m) > kMap_m) {
      add(Disagreement::kLandmarkTop,
          fmt::format(" has top_m {:.3f}, but {} ends at {:.4f}", landmark.top_m, object, top_m));
    }
    const double hue_off_deg = hue_difference_deg(side->colour, landmark.colour);
    if (!is_coloured(side->colour) || hue_off_deg > kHue_deg) {
      add(Disagreement::kLandmarkColour,
          fmt::format(" has colour [{:.3g}, {:.3g}, {:.3g}], but {} has [{:.3g}, {:.3g}, {:.3g}]: {}",
                      landmark.colour[0], landmark.colour[1], landmark.colour[2], object, side->colour[0],
                      side->colour[1], side->colour[2],
                      is_coloured(side->colour) ? fmt::format("its hue is {:.0f} degrees off", hue_off_deg)
                                                : "too grey for a landmark"));
    }
  }
  look.checked.push_back(fmt::format("{} landmarks: place, radius and top to {:.0f} mm, hue to {:.0f} degrees",
                                     landmarks.size(), 1000 * kMap_m, kHue_deg));
}

}  // namespace twocone::look
