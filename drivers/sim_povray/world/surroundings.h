// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "drivers/sim_povray/place.h"

/// The obstacles of a place: the stationary ones, divided into convex parts, and those that move along a path. The
/// distance from a convex part to a point is a convex function of the point; the search for the first touch depends on
/// this (first_touch).
namespace twocone::sim_povray {

/// A half-plane that is free where x_n x + y_n y > offset_m; (x_n, y_n) is a unit vector.
struct HalfPlane {
  double x_n = 0, y_n = 0;
  double offset_m = 0;
};
/// A side of an outline, from corner to corner.
struct Edge {
  FloorPoint from, to;
};

/// Distance from a part to a point (below 0 inside a disc and beyond a wall; an edge has no inside) and the unit vector
/// in that direction; the zero vector if no direction is the nearest.
struct Facing {
  double distance_m = 0;
  double x = 0, y = 0;
};
Facing facing(const HalfPlane& wall, const FloorPoint& point);
Facing facing(const Disc& disc, const FloorPoint& point);
Facing facing(const Edge& edge, const FloorPoint& point);

/// One convex part and the index of its owner.
struct Part {
  std::variant<HalfPlane, Disc, Edge> shape;
  std::size_t owner = 0;
};
inline Facing facing(const Part& part, const FloorPoint& point) {
  return std::visit([&point](const auto& shape) { return facing(shape, point); }, part.shape);
}

/// The walls and solids of a place.
class Surroundings {
 public:
  explicit Surroundings(const PlaceSettings& place);  // requires a checked place

  [[nodiscard]] const std::vector<Part>& parts() const { return parts_; }
  /// Returns "wall", or the solid's name.
  [[nodiscard]] const std::string& name(const Part& part) const { return names_[part.owner]; }
  /// Returns the name of an outline that contains the point, however far its edges are away; nullptr: none.
  [[nodiscard]] const std::string* outline_around(const FloorPoint& point) const;

 private:
  struct NamedOutline {
    Outline outline;
    std::size_t owner;
  };
  std::vector<std::string> names_;
  std::vector<Part> parts_;
  std::vector<NamedOutline> outlines_;
};

/// Two bodies nearer than this touch. A body that a touch stops keeps half of this distance or more.
inline constexpr double kTouch_m = 1e-9;
/// A contact is over once the bodies are farther apart than this.
inline constexpr double kGap_m = 1e-6;

/// Motion of a point from some moment on, at constant speeds: on a line or an arc.
struct Stretch {
  FloorPoint at;
  double x_mps = 0, y_mps = 0;
  double bend_mps2 = 0;  ///< greatest acceleration over the stretch
  double until_s = std::numeric_limits<double>::infinity();
};

/// Pose of a moving thing at any time, in closed form. No error accumulates, so a run of a day ends at the right place.
/// At a corner the thing already faces along the next segment.
class MovingPath {
 public:
  explicit MovingPath(const MovingThing& thing);  // requires a checked thing

  [[nodiscard]] Pose2 pose(double time_s) const;
  /// Returns the straight stretch that it is on at a time of the world.
  [[nodiscard]] Stretch stretch(double time_s) const;

 private:
  struct Segment {
    FloorPoint from;
    double begin_m = 0;  ///< path length from path_m[0] to `from`
    double length_m = 0;
    double x = 0, y = 0;  ///< unit vector along it
  };
  struct Place {
    const Segment* segment;
    double along_m;  ///< from the segment's beginning
    bool ended;

    [[nodiscard]] FloorPoint point() const {
      return {segment->from.x_m + along_m * segment->x, segment->from.y_m + along_m * segment->y};
    }
  };
  [[nodiscard]] Place place(double time_s) const;

  std::vector<Segment> segments_;
  double total_m_ = 0;
  double speed_mps_;
  bool loop_;
};

/// Returns how long a convex distance that is `gap_m` > 0 above its floor now and grows at `rate_mps` stays above it.
/// Along p(t + s) = p + v s + c, |c| <= bend s^2 / 2, a distance that is convex in p, with gradient g, |g| = 1, has
///     d(t + s) >= d(p + v s) - |c| >= d + g v s - bend s^2 / 2.
/// So no time step is too long, at any speed, and time steps towards a touch shrink quadratically.
inline double safe_time(double gap_m, double rate_mps, double bend_mps2) {
  if (bend_mps2 == 0) return rate_mps >= 0 ? std::numeric_limits<double>::infinity() : gap_m / -rate_mps;
  const double root = std::sqrt(rate_mps * rate_mps + 2 * bend_mps2 * gap_m);
  return rate_mps > 0 ? (rate_mps + root) / bend_mps2 : 2 * gap_m / (root - rate_mps);
}

/// A touch that the motion of at least one body causes.
struct Touch {
  double at_s = 0;
  bool a_approaches = false;
  bool b_approaches = false;
};

/// Returns the first time in [from_s, to_s) at which `a` and `b` touch, come nearer to each other, and one of those
/// that may be stopped moves towards the other. A body is free to move away, and to move towards a body that retreats.
///
/// @param stretch_a, stretch_b (time) -> Stretch of the centre
/// @param facing_b  (centre of b, point) -> Facing from b to the point
/// @param radius_m  of a
/// @param fastest_mps  bound on both speeds' sum: bodies that are too far apart are skipped
/// @param can_stop_b  whether b can be stopped; a always can. A b on rails runs over an a that stands or retreats
template <typename StretchA, typename StretchB, typename FacingB>
std::optional<Touch> first_touch(const StretchA& stretch_a, double radius_m, const StretchB& stretch_b,
                                 const FacingB& facing_b, bool can_stop_b, double fastest_mps, double from_s,
                                 double to_s) {
  constexpr double kStopGap_m = kTouch_m / 2;
  constexpr double kSink_m = 1e-12;   // gap that a motion along a touching face may lose by its bend
  constexpr double kWatch_m = 1e-3;   // relative path after which a body that is being run over is checked again
  constexpr double kLeast_s = 1e-12;  // time advances despite rounding; below 1e-10 m at 100 m/s
  double t_s = from_s;
  while (t_s < to_s) {
    const Stretch a = stretch_a(t_s);
    const Stretch b = stretch_b(t_s);
    const Facing face = facing_b(b.at, a.at);
    const double gap_m = face.distance_m - radius_m;
    if (gap_m > kTouch_m && gap_m - kTouch_m > fastest_mps * (to_s - t_s)) return std::nullopt;
    const double a_mps = face.x * a.x_mps + face.y * a.y_mps;
    const double b_mps = face.x * b.x_mps + face.y * b.y_mps;
    double safe_s = 0;
    if (gap_m <= kTouch_m && a_mps < b_mps) {
      const Touch touch{t_s, a_mps < 0, can_stop_b && b_mps > 0};
      if (touch.a_approaches || touch.b_approaches) return touch;
      safe_s = kWatch_m / std::hypot(a.x_mps - b.x_mps, a.y_mps - b.y_mps);
    } else {
      safe_s = safe_time(gap_m - std::min(kStopGap_m, gap_m - kSink_m), a_mps - b_mps, a.bend_mps2 + b.bend_mps2);
    }
    const double until_s = std::min(a.until_s, b.until_s);
    t_s = std::max(std::min(t_s + safe_s, until_s), t_s + kLeast_s);
  }
  return std::nullopt;
}

}  // namespace twocone::sim_povray
