// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include <fmt/format.h>

#include "tests/numerics/judge.h"
#include "tests/support/disparity_range.h"
#include "tests/support/hyperboloid_mirror.h"
#include "vision/mirror_view.h"
#include "vision/ranging.h"
#include "vision/triangulation.h"

namespace twocone::exact {
namespace {

using Values = std::vector<double>;

// Bounds on error / (growth eps). The growth counts one rounding of every input and of the answer. Inside, each
// operation on the path from an input to the answer adds at most half an eps of the value that passes through it (a
// library function like sin adds one eps), so the bound is half the operations on the longest path.
constexpr double kRadiusBound = 4;       // sin of the apex, 2 products, 3 sums, quotient, product
constexpr double kProjectBound = 8;      // + rotation 5, hypot, atan2, sum, cos, product, sum
constexpr double kLensBound = 8;         // + a polynomial's 8, a quotient, 4 products and sums, the inverse
constexpr double kRayBound = 8;          // as for projecting
constexpr double kAngleBound = 2;        // atan2, a sum and a wrap; or a sum, cos, a product
constexpr double kHyperboloidBound = 4;  // b^2 3, hypot, 2 products, sum, quotient, product, sum, quotient
constexpr double kDisparityBound = 2;    // product, quotient, product, difference
constexpr double kTriangulateBound = 8;  // a projection and its inverse by QR, which is accurate to a few eps

struct ViewCase {
  vision::MirrorViewSettings settings;
  Values fields;
};

enum class Rig { kUpright, kMoved, kMovedWithLens };

ViewCase draw_view(Draw& draw, Rig rig) {
  vision::MirrorViewSettings s;
  s.cone = {draw.uniform(0.3, 2.8), draw.scales(1e-3, 10), draw.scales(1e-3, 10)};
  s.lens_height_m = draw.scales(1e-3, 10);
  s.centre_px = {draw.uniform(-50, 2000), draw.uniform(-50, 2000)};
  s.rim_radius_px = draw.scales(10, 3000);
  s.azimuth_rad = draw.uniform(-std::numbers::pi, std::numbers::pi);
  s.mirrored = draw.coin();
  if (rig != Rig::kUpright) {
    s.tilt_rad = {draw.scales(1e-9, 0.3) * (draw.coin() ? 1 : -1), draw.uniform(-0.3, 0.3)};
    s.axis_offset_m = {draw.scales(1e-9, 0.1) * (draw.coin() ? 1 : -1), draw.uniform(-0.1, 0.1)};
  }
  Values lens(12, 0.0);
  if (rig == Rig::kMovedWithLens) {
    // The lens's polynomial does not fold within the mirror's image: |x|, |y| are below 0.4.
    const double focal = 3 * s.rim_radius_px;
    s.distortion = vision::LensDistortion{
        {draw.uniform(-0.2, 0.2), draw.uniform(-0.1, 0.1), draw.uniform(-1e-2, 1e-2), draw.uniform(-1e-2, 1e-2),
         draw.uniform(-0.05, 0.05), draw.uniform(-0.1, 0.1), draw.uniform(-0.1, 0.1), draw.uniform(-0.05, 0.05)},
        {focal, focal * draw.uniform(0.9, 1.1)},
        {s.centre_px.x() + draw.uniform(-9, 9), s.centre_px.y() + draw.uniform(-9, 9)}};
    const auto& d = *s.distortion;
    lens = d.coefficients;
    lens.insert(lens.end(), {d.focal_px.x(), d.focal_px.y(), d.principal_px.x(), d.principal_px.y()});
  }
  Values fields = {s.cone.apex_rad, s.cone.rim_radius_m, s.cone.lens_to_tip_m, s.lens_height_m,
                   s.centre_px.x(), s.centre_px.y(),     s.rim_radius_px,      s.azimuth_rad,
                   s.tilt_rad.x(),  s.tilt_rad.y(),      s.axis_offset_m.x(),  s.axis_offset_m.y()};
  fields.insert(fields.end(), lens.begin(), lens.end());
  return {s, fields};
}

View view_of(const Vector& x, bool mirrored, bool lens) {
  return View(Vector(x.begin(), x.begin() + kViewFields), mirrored, lens);
}

Values doubles(const Vector& v) {
  Values out;
  for (const Real& r : v) out.push_back(static_cast<double>(r));
  return out;
}

/// Draws a pixel inside the rim, also very near to the tip.
Values draw_pixel(Draw& draw, const vision::MirrorViewSettings& s) {
  const double radius = s.rim_radius_px * (draw.coin() ? draw.scales(1e-9, 0.999) : draw.uniform(0.01, 0.999));
  const double turn = draw.uniform(-std::numbers::pi, std::numbers::pi);
  return {s.centre_px.x() + radius * std::cos(turn), s.centre_px.y() + radius * std::sin(turn)};
}

Values joined(Values a, const Values& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

void measure_view(std::vector<Record>& records, int cases, Rig rig) {
  const char* const name = rig == Rig::kUpright ? "upright"
                           : rig == Rig::kMoved ? "tilted and off the axis"
                                                : "also behind a lens";
  const bool lens = rig == Rig::kMovedWithLens;
  const std::string of = std::string("any cone, ") + name + ", from the tip to the rim";
  const double more = lens ? kLensBound : 0;
  Record radius{"MirrorView::image_radius_px", of, 0, 0, kRadiusBound, 0, 0, {}};
  Record pixel{"MirrorView::project", of, 0, 0, kProjectBound + more, 0, 0, {}};
  Record origin{"MirrorView::back_project, origin", of, 0, 0, kRayBound + more, 0, 0, {}};
  Record direction{"MirrorView::back_project, direction", of, 0, 0, kRayBound + more, 0, 0, {}};
  Record bearing{"MirrorView::bearing_rad", of, 0, 0, kAngleBound, 0, 0, {}};
  Record offset{"MirrorView::offset_px", of, 0, 0, kAngleBound, 0, 0, {}};

  Draw draw(40600 + static_cast<unsigned>(rig));
  for (int i = 0; i < cases; ++i) {
    const ViewCase c = draw_view(draw, rig);
    const bool mirrored = c.settings.mirrored;
    const vision::MirrorView view(c.settings);
    const Values at = draw_pixel(draw, c.settings);
    const View exact = view_of(numbers(c.fields), mirrored, lens);
    const Values shown = lens ? doubles(exact.distort(numbers(at))) : at;

    const auto ray_of = [&](const Vector& x) {
      return view_of(x, mirrored, lens).back_project({x[kViewFields], x[kViewFields + 1]});
    };
    const Values ray_case = joined(c.fields, shown);
    if (const auto ray = view.back_project({shown[0], shown[1]})) {
      const Answer answer = evaluate(ray_of, numbers(ray_case));
      origin.take(answer, 0, {ray->origin_m.x(), ray->origin_m.y(), ray->origin_m.z()}, describe(ray_case));
      direction.take(answer, 3, {ray->direction.x(), ray->direction.y(), ray->direction.z()}, describe(ray_case));
    }

    // Take a point that this pixel shows, rounded to doubles.
    const Vector ray = exact.back_project(numbers(shown));
    const double way = draw.coin() ? draw.scales(0.1, 1e6) : draw.uniform(0.5, 20);
    const Values p = doubles({ray[0] + way * ray[3], ray[1] + way * ray[4], ray[2] + way * ray[5]});
    const Values point_case = joined(c.fields, p);
    if (const auto seen = view.project({p[0], p[1], p[2]})) {
      const auto pixel_of = [&](const Vector& x) {
        return view_of(x, mirrored, lens).project({x[kViewFields], x[kViewFields + 1], x[kViewFields + 2]});
      };
      pixel.take(evaluate(pixel_of, numbers(point_case)), 0, {seen->x(), seen->y()}, describe(point_case));
    }
    if (rig != Rig::kUpright) continue;

    const Values place_case = joined(c.fields, {std::hypot(p[0], p[1]), p[2]});
    if (const auto got = view.image_radius_px(place_case[kViewFields], place_case[kViewFields + 1])) {
      const auto radius_of = [&](const Vector& x) {
        return Vector{view_of(x, mirrored, false).image_radius_px(x[kViewFields], x[kViewFields + 1])};
      };
      radius.take(evaluate(radius_of, numbers(place_case)), 0, {*got}, describe(place_case));
    }
    const Values offset_case =
        joined(c.fields, {draw.scales(1e-300, 1e9) * (draw.coin() ? 1 : -1), draw.scales(1e-3, 1e9)});
    const auto bearing_of = [&](const Vector& x) {
      return Vector{view_of(x, mirrored, false).bearing_rad({x[kViewFields], x[kViewFields + 1]})};
    };
    bearing.take_angle(evaluate(bearing_of, numbers(offset_case)), 0,
                       view.bearing_rad({offset_case[kViewFields], offset_case[kViewFields + 1]}),
                       describe(offset_case));
    const Values polar = {c.settings.azimuth_rad, draw.uniform(-std::numbers::pi, std::numbers::pi),
                          draw.scales(1e-9, 1e9)};
    const auto offset_of = [&](const Vector& x) {
      const Real turn = (x[1] - x[0]) * (mirrored ? -1 : 1);
      return Vector{x[2] * cos(turn), x[2] * sin(turn)};
    };
    const Eigen::Vector2d got = view.offset_px(polar[1], polar[2]);
    offset.take(evaluate(offset_of, numbers(polar)), 0, {got.x(), got.y()}, describe(polar));
  }
  if (rig == Rig::kUpright) records.insert(records.end(), {radius, bearing, offset});
  records.insert(records.end(), {pixel, origin, direction});
}

void measure_hyperboloid(std::vector<Record>& records, int cases) {
  const std::string of = "eccentricities of 1.0001 to 1e4, from straight down to the rim";
  Record slope{"HyperboloidMirror::slope", of, 0, 0, kHyperboloidBound, 0, 0, {}};
  Record elevation{"HyperboloidMirror::elevation_rad", of, 0, 0, kHyperboloidBound, 0, 0, {}};
  Record rim{"HyperboloidMirror::rim_slope", of, 0, 0, kHyperboloidBound, 0, 0, {}};
  Draw draw(40610);
  for (int i = 0; i < cases; ++i) {
    const double a = draw.scales(1e-3, 1);
    const double c = a * (1 + draw.scales(1e-4, 1e4));
    const double rim_radius = a * draw.scales(0.1, 10);
    const vision::HyperboloidMirror mirror({a, c, rim_radius});
    const Values rim_case = {a, c, rim_radius};
    const auto rim_of = [](const Vector& x) {
      const Real b2 = x[1] * x[1] - x[0] * x[0];
      return Vector{x[2] / (x[1] + x[0] * sqrt(1 + x[2] * x[2] / b2))};
    };
    rim.take(evaluate(rim_of, numbers(rim_case)), 0, {mirror.rim_slope()}, describe(rim_case));

    const Values slope_case = {a, c, mirror.rim_slope() * draw.scales(1e-6, 0.999)};
    const auto elevation_of = [](const Vector& x) { return Vector{hyperboloid_elevation(x[0], x[1], x[2])}; };
    const Answer answer = evaluate(elevation_of, numbers(slope_case));
    elevation.take_angle(answer, 0, mirror.elevation_rad(slope_case[2]).value_or(NAN), describe(slope_case));

    const double e = static_cast<double>(answer.value[0]);
    const double way = c * draw.scales(10, 1e6);
    const Values place_case = {a, c, way * std::cos(e), 2 * c + way * std::sin(e)};
    const auto slope_of = [](const Vector& x) { return Vector{hyperboloid_slope(x[0], x[1], x[2], x[3])}; };
    if (const auto got = mirror.slope(place_case[2], place_case[3])) {
      slope.take(evaluate(slope_of, numbers(place_case)), 0, {*got}, describe(place_case));
    }
  }
  records.insert(records.end(), {rim, elevation, slope});
}

void measure_disparity(std::vector<Record>& records, int cases) {
  const std::string of = "disparities of 1e-12 px to the rim, sigmas of down to 1e-15 px";
  Record inverse{"range_from_disparity, inverse range", of, 0, 0, kDisparityBound, 0, 0, {}};
  Record range{"range_from_disparity, range", of, 0, 0, kDisparityBound, 0, 0, {}};
  Record sigma{"range_from_disparity, sigmas", of, 0, 0, kDisparityBound, 0, 0, {}};
  Draw draw(40670);
  for (int i = 0; i < cases; ++i) {
    const vision::DisparityGeometry g{draw.scales(10, 1e4), draw.scales(1e-3, 10), draw.scales(1e-3, 1),
                                      draw.scales(10, 3000)};
    const double disparity = draw.scales(1e-12, g.rim_radius_px);
    const Values x = {disparity, disparity * draw.scales(1e-3, 0.3), g.focal_length_px, g.mirror_separation_m,
                      g.lens_to_tip_m};
    const vision::InverseRange got = vision::range_from_disparity(x[0], x[1], g);
    const Answer answer = evaluate(exact::range_from_disparity, numbers(x));
    inverse.take(answer, 0, {got.inverse_per_m}, describe(x));
    sigma.take(answer, 1, {got.sigma_inverse_per_m}, describe(x));
    if (got.verdict != vision::RangeVerdict::kOk) continue;
    range.take(answer, 2, {*got.range_m}, describe(x));
    sigma.take(answer, 3, {*got.sigma_range_m}, describe(x));
  }
  records.insert(records.end(), {inverse, range, sigma});
}

Vector near_top(const Vector& fields, const Vector& landmark, const Real& radius, const Real& top) {
  const Real dx = landmark[0] - fields[kOffsetX];
  const Real dy = landmark[1] - fields[kOffsetY];
  const Real distance = sqrt(dx * dx + dy * dy);
  return {landmark[0] - dx * radius / distance, landmark[1] - dy * radius / distance, top};
}

/// Both views of a landmark: x holds the two views' fields, then radius and top, then column, row and covariance (cc,
/// cr, rr) of each sighting.
constexpr std::size_t kRadiusAt = 2 * kViewFields;
constexpr std::size_t kTopAt = kRadiusAt + 1;
constexpr std::size_t kSightingsAt = kTopAt + 1;
constexpr std::size_t kSightingFields = 5;

/// Chi-squared of a place, which triangulate() must minimise.
class TriangulationProblem {
 public:
  TriangulationProblem(const Vector& x, std::array<bool, 2> mirrored, std::array<bool, 2> used, bool top_known)
      : x_(x), used_(used), top_known_(top_known) {
    for (std::size_t i = 0; i < 2; ++i) {
      fields_[i] =
          Vector(x.begin() + std::ptrdiff_t(i * kViewFields), x.begin() + std::ptrdiff_t((i + 1) * kViewFields));
      views_.emplace_back(fields_[i], mirrored[i], false);
    }
  }
  /// Whitened residual of a view. @param place range, bearing and, where it is not known, top
  [[nodiscard]] Vector residual(std::size_t i, const Vector& place) const {
    const Vector landmark = {place[0] * cos(place[1]), place[0] * sin(place[1])};
    const Vector pixel =
        views_[i].project(near_top(fields_[i], landmark, x_[kRadiusAt], top_known_ ? x_[kTopAt] : place[2]));
    const Real* const s = &x_[kSightingsAt + i * kSightingFields];
    const Real column = s[0] - pixel[0];
    const Real row = s[1] - pixel[1];
    const Real q = sqrt(s[4] - s[3] * s[3] / s[2]);
    return {column / sqrt(s[2]), (row - s[3] / s[2] * column) / q};
  }
  [[nodiscard]] Real operator()(const Vector& place) const {
    Real sum = 0;
    for (std::size_t i = 0; i < 2; ++i) {
      if (!used_[i]) continue;
      for (const Real& r : residual(i, place)) sum += r * r;
    }
    return sum;
  }
  /// J^T W J by differences.
  [[nodiscard]] Matrix information(const Vector& place) const {
    static const Real step("1e-12");
    const std::size_t n = place.size();
    Matrix sum(n, Vector(n));
    for (std::size_t i = 0; i < 2; ++i) {
      if (!used_[i]) continue;
      Matrix slopes;
      for (std::size_t k = 0; k < n; ++k) {
        Vector up = place;
        Vector down = place;
        up[k] += step;
        down[k] -= step;
        const Vector above = residual(i, up);
        const Vector below = residual(i, down);
        slopes.push_back({(above[0] - below[0]) / (2 * step), (above[1] - below[1]) / (2 * step)});
      }
      for (std::size_t k = 0; k < n; ++k) {
        for (std::size_t j = 0; j < n; ++j) sum[k][j] += slopes[k][0] * slopes[j][0] + slopes[k][1] * slopes[j][1];
      }
    }
    return sum;
  }

 private:
  const Vector& x_;
  std::array<bool, 2> used_;
  bool top_known_;
  std::array<Vector, 2> fields_;
  std::vector<View> views_;
};

void measure_triangulation(std::vector<Record>& records, int cases, std::array<bool, 2> used, bool top_known,
                           const char* name) {
  const std::string of =
      std::string(name) + ": landmarks at 1 to 30 m, cones of 70 to 110 degrees, tilted and off the axis";
  Record range{std::string("triangulate, ") + name + ": range", of, 0, 0, kTriangulateBound, 0, 0, {}};
  Record bearing{std::string("triangulate, ") + name + ": bearing", of, 0, 0, kTriangulateBound, 0, 0, {}};
  Record covariance{std::string("triangulate, ") + name + ": covariance", of, 0, 0, kTriangulateBound, 0, 0, {}};
  Draw draw(40680 + (used[1] ? 1U : 0U) + (top_known ? 2U : 0U));
  for (int i = 0; i < cases; ++i) {
    Values x;
    std::array<bool, 2> mirrored{};
    std::vector<vision::MirrorView> views;
    for (std::size_t v = 0; v < 2; ++v) {
      ViewCase c = draw_view(draw, Rig::kMoved);
      c.settings.cone = {draw.uniform(1.22, 1.92), draw.uniform(0.04, 0.08), draw.uniform(0.08, 0.16)};
      c.settings.lens_height_m = draw.uniform(0.2, 0.3) + 0.3 * double(v);
      c.settings.rim_radius_px = draw.uniform(200, 300);
      c.settings.tilt_rad = {draw.uniform(-0.02, 0.02), draw.uniform(-0.02, 0.02)};
      c.settings.axis_offset_m = {draw.uniform(-0.005, 0.005), draw.uniform(-0.005, 0.005)};
      const auto& s = c.settings;
      Values fields = {s.cone.apex_rad, s.cone.rim_radius_m, s.cone.lens_to_tip_m, s.lens_height_m,
                       s.centre_px.x(), s.centre_px.y(),     s.rim_radius_px,      s.azimuth_rad,
                       s.tilt_rad.x(),  s.tilt_rad.y(),      s.axis_offset_m.x(),  s.axis_offset_m.y()};
      fields.resize(kViewFields);
      x.insert(x.end(), fields.begin(), fields.end());
      mirrored[v] = s.mirrored;
      views.emplace_back(s);
    }
    const double radius = draw.uniform(0.02, 0.2);
    const double top = draw.uniform(1.2, 2.5);
    x.insert(x.end(), {radius, top});
    const double distance = draw.scales(1, 30);
    const double turn = draw.uniform(-std::numbers::pi, std::numbers::pi);
    std::array<vision::Sighting, 2> sightings;
    bool shown = true;
    for (std::size_t v = 0; v < 2; ++v) {
      const auto near =
          vision::near_top_point(views[v], {distance * std::cos(turn), distance * std::sin(turn)}, radius, top);
      const auto pixel = near ? views[v].project(*near) : std::nullopt;
      shown = shown && (pixel || !used[v]);
      const double sigma[2] = {draw.uniform(0.02, 0.1), draw.uniform(0.02, 0.1)};
      const double both = draw.uniform(-0.8, 0.8) * sigma[0] * sigma[1];
      sightings[v].pixel_px = pixel.value_or(Eigen::Vector2d(0, 0));
      if (i % 4 != 0)
        sightings[v].pixel_px += Eigen::Vector2d(draw.uniform(-1, 1) * sigma[0], draw.uniform(-1, 1) * sigma[1]) / 2;
      sightings[v].covariance_px2 << sigma[0] * sigma[0], both, both, sigma[1] * sigma[1];
      x.insert(x.end(),
               {sightings[v].pixel_px.x(), sightings[v].pixel_px.y(), sigma[0] * sigma[0], both, sigma[1] * sigma[1]});
    }
    if (!shown) continue;
    const vision::Triangulation got =
        vision::triangulate({views[0], views[1]}, used[0] ? &sightings[0] : nullptr, used[1] ? &sightings[1] : nullptr,
                            radius, top_known ? std::optional(top) : std::nullopt);
    if (!got.range_m) continue;
    const Vector exact_x = numbers(x);
    const TriangulationProblem here(exact_x, mirrored, used, top_known);
    Vector start = numbers({*got.range_m, *got.bearing_rad});
    if (!top_known) start.push_back(*got.top_m);
    const std::size_t n = start.size();
    const Vector scale(n, Real(1));
    const Vector best = minimise(here, start, scale, 4);
    Matrix hessian(n, Vector(n));
    static const Real step("1e-12");
    for (std::size_t k = 0; k < n; ++k) {
      Vector up = best;
      Vector down = best;
      up[k] += step;
      down[k] -= step;
      const Vector above = half_gradient(here, up, scale);
      const Vector below = half_gradient(here, down, scale);
      for (std::size_t j = 0; j < n; ++j) hessian[j][k] = (above[j] - below[j]) / (2 * step);
    }
    const Matrix solver = exact::inverse(hessian);
    const auto answer_of = [&](const Vector& v) {
      const TriangulationProblem changed(v, mirrored, used, top_known);
      const Vector g = half_gradient(changed, best, scale);
      Vector place = best;
      for (std::size_t k = 0; k < n; ++k) {
        for (std::size_t j = 0; j < n; ++j) place[k] -= solver[k][j] * g[j];
      }
      const Matrix c = exact::inverse(changed.information(place));
      return Vector{place[0], place[1], c[0][0], c[0][1], c[1][1]};
    };
    Answer answer = evaluate(answer_of, exact_x);
    // The last step, of at most a millionth of a sigma, is taken; the covariance is that of the place before it. The
    // error that Gauss-Newton leaves of that step is the ratio of the residual, a sigma, to the radius of curvature:
    // below a thousandth here.
    constexpr double kLastStep = 1e-6 / std::numeric_limits<double>::epsilon();
    const double sigma_m = std::sqrt(static_cast<double>(answer.value[2]));
    for (const std::size_t k : {2, 3, 4}) answer.growth[k] *= 1 + kLastStep * sigma_m / *got.range_m;
    answer.growth[0] += kLastStep / 1000 * sigma_m;
    answer.growth[1] += kLastStep / 1000 * std::sqrt(static_cast<double>(answer.value[4]));
    const std::string what = fmt::format("case {} of {}: {}", i, name, describe(x));
    range.take(answer, 0, {*got.range_m}, what);
    bearing.take_angle(answer, 1, *got.bearing_rad, what);
    covariance.take(answer, 2, {(*got.covariance)(0, 0)}, what);
    covariance.take(answer, 3, {(*got.covariance)(0, 1)}, what);
    covariance.take(answer, 4, {(*got.covariance)(1, 1)}, what);
  }
  records.insert(records.end(), {range, bearing, covariance});
}

}  // namespace

std::vector<Record> measure_views(int cases) {
  std::vector<Record> records;
  measure_view(records, cases, Rig::kUpright);
  measure_view(records, cases / 2, Rig::kMoved);
  measure_view(records, cases / 4, Rig::kMovedWithLens);
  measure_hyperboloid(records, cases);
  return records;
}

std::vector<Record> measure_ranges(int cases) {
  std::vector<Record> records;
  measure_disparity(records, cases);
  // Each case needs some fifty gradients in 50 digits.
  measure_triangulation(records, cases / 8, {true, true}, true, "both views, known top");
  measure_triangulation(records, cases / 8, {true, true}, false, "both views, unknown top");
  measure_triangulation(records, cases / 8, {false, true}, true, "one view, known top");
  return records;
}

}  // namespace twocone::exact
