// SPDX-License-Identifier: Apache-2.0
#include "apps/report/page.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include <fmt/format.h>
#include <Eigen/Core>

#include "apps/config/to_layers.h"
#include "apps/report/kit/figure.h"
#include "apps/report/kit/plan.h"
#include "apps/report/paper.h"

namespace twocone::report {
namespace {

/// Smaller errors are drawn here, because a logarithmic axis has no zero.
constexpr double kLeastDrawnError_mm = 1;

using Point2 = Eigen::Vector2d;  // distance from the axis, height above the floor, metres

double cross(const Point2& a, const Point2& b) { return a.x() * b.y() - a.y() * b.x(); }

/// One mirror in the half-plane right of the axis. Every ray that it shows seems to come from `viewpoint` (see
/// vision::MirrorView), between the ray through the tip and the ray through the rim.
struct SideView {
  Point2 lens, tip, rim, viewpoint;
};

SideView side_view(const vision::MirrorView& view) {
  const vision::ConeMirror& cone = view.settings().cone;
  const double lens_m = view.settings().lens_height_m;
  const double d = cone.lens_to_tip_m;
  return {{0, lens_m},
          {0, lens_m + d},
          {cone.rim_radius_m, lens_m + d + cone.rim_radius_m / std::tan(cone.apex_rad / 2)},
          {-d * std::sin(cone.apex_rad), lens_m + d * (1 - std::cos(cone.apex_rad))}};
}

/// Returns the part of a convex polygon left of the ray from `origin` through `through` (one step of Sutherland-Hodgman
/// clipping).
std::vector<Point2> keep_left(const std::vector<Point2>& polygon, const Point2& origin, const Point2& through) {
  const auto side = [&](const Point2& p) { return cross(through - origin, p - origin); };
  std::vector<Point2> kept;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Point2& a = polygon[i];
    const Point2& b = polygon[(i + 1) % polygon.size()];
    const double side_a = side(a), side_b = side(b);
    if (side_a >= 0) kept.push_back(a);
    if ((side_a >= 0) != (side_b >= 0)) kept.push_back(a + (b - a) * (side_a / (side_a - side_b)));
  }
  return kept;
}

std::vector<Point2> seen_by(const std::vector<Point2>& polygon, const SideView& view) {
  return keep_left(keep_left(polygon, view.viewpoint, view.tip), view.rim, view.viewpoint);
}

std::string place(const Point2& p) { return fmt::format("{:.6g},{:.6g}", p.x(), p.y()); }

std::string polygon_command(const std::vector<Point2>& corners, const std::string& style) {
  if (corners.size() < 3) return "";
  std::string text = "set object polygon from ";
  for (const Point2& corner : corners) text += place(corner) + " to ";
  return text + fmt::format("{} {}\n", place(corners.front()), style);
}

/// Returns the point where the ray from `origin` through `through` leaves the sheet: to the right, upwards or
/// downwards.
Point2 leave(const Point2& origin, const Point2& through, const config::Bounds& world) {
  const Point2 direction = through - origin;
  double reach = direction.x() > 0 ? (world.max_x_m - origin.x()) / direction.x() : 0;
  if (direction.y() > 0) reach = std::min(reach > 0 ? reach : INFINITY, (world.max_y_m - origin.y()) / direction.y());
  if (direction.y() < 0) reach = std::min(reach > 0 ? reach : INFINITY, (world.min_y_m - origin.y()) / direction.y());
  return origin + direction * reach;
}

std::string line_command(const Point2& from, const Point2& to, const std::string& style) {
  return fmt::format("set arrow from {} to {} nohead {}\n", place(from), place(to), style);
}

/// Returns gnuplot commands for a mirror with its lens, viewpoint and outer rays; `colour` distinguishes the two
/// mirrors.
std::string mirror_commands(const SideView& view, const config::Bounds& world, std::string_view colour,
                            const std::string& name) {
  const Point2 other_rim(-view.rim.x(), view.rim.y());
  std::string text =
      polygon_command({view.tip, view.rim, other_rim}, "front fc rgb '#b9c4cc' fs solid border lc rgb '#444444'");
  for (const Point2& through : {view.tip, view.rim}) {
    text += line_command(view.viewpoint, through, fmt::format("back lw 1 dt (4,4) lc rgb '{}'", colour));
    text +=
        line_command(through, leave(view.viewpoint, through, world), fmt::format("back lw 1.5 lc rgb '{}'", colour));
  }
  return text + line_command(view.lens, view.rim, "back lw 1 dt (1,3) lc rgb '#999999'") +
         label_command(name, view.rim.x(), view.tip.y(), "left offset 0.5,-0.8");
}

/// Returns all heights of tops if there are at most three, else the lowest and the highest.
std::vector<double> shown_tops_m(const config::Map& map) {
  std::set<double> tops;
  for (const config::Landmark& landmark : map.landmarks) tops.insert(landmark.top_m);
  if (tops.size() > 3) return {*tops.begin(), *tops.rbegin()};
  return {tops.begin(), tops.end()};
}

/// Returns the farthest range to draw: the longest one of the run, or the arena's diagonal.
double farthest_m(const runlog::RunData& run) {
  double farthest = 0;
  for (const runlog::RangeRow& row : run.ranges) farthest = std::max(farthest, row.true_range_m.value_or(0));
  const config::Bounds& b = run.map.bounds;
  if (!(farthest > 0)) farthest = std::hypot(b.max_x_m - b.min_x_m, b.max_y_m - b.min_y_m);
  return farthest > 0 && std::isfinite(farthest) ? farthest : 1;
}

}  // namespace

Figure draw_geometry(const Drawing& drawing) {
  const config::Rig& rig = drawing.run.robot.rig;
  Figure figure{"fig08_geometry", "Figure 8", "What the two mirrors see"};
  const vision::Rig views = config::to_rig(drawing.run.robot);
  const SideView lower = side_view(views.lower);
  const SideView upper = side_view(views.upper);
  const std::vector<double> tops_m = shown_tops_m(drawing.run.map);
  const double tallest_m = std::max(upper.rim.y(), tops_m.empty() ? 0.0 : tops_m.back());
  // The figure is wide enough to show where the highest top enters the lower mirror's view.
  double width_m = 1.6 * tallest_m;
  if (is_right_angled(rig) && !tops_m.empty()) {
    width_m = std::clamp(1.25 * nearest_top_m(rig, tops_m.back()), 1.2 * tallest_m, 4 * tallest_m);
  }
  const double left_m = std::min(lower.viewpoint.x(), upper.viewpoint.x()) - 0.12 * tallest_m;
  const Sheet sheet = lay_out({left_m, width_m, 0, 1.25 * tallest_m}, 900, 900);
  const config::Bounds& world = sheet.world;

  Plot plot{.width_px = sheet.width_px, .height_px = sheet.height_px};
  plot.commands = sheet_commands(sheet, drawing.run.map.unit_m);
  plot.commands +=
      "set xlabel 'distance from the axis / m' offset 0,0.5\nset ylabel 'height above the floor / m' offset "
      "0.8,0\nunset grid\n";
  const std::vector<Point2> right_half{
      {0, world.min_y_m}, {world.max_x_m, world.min_y_m}, {world.max_x_m, world.max_y_m}, {0, world.max_y_m}};
  plot.commands +=
      polygon_command(seen_by(seen_by(right_half, lower), upper), "behind fc rgb '#cfe8dc' fs solid noborder");
  plot.commands += mirror_commands(lower, world, kFixColour, "lower mirror");
  plot.commands += mirror_commands(upper, world, kOdometryColour, "upper mirror");
  plot.commands += line_command({0, 0}, {0, world.max_y_m}, "back lw 1 dt (8,3,1,3) lc rgb '#999999'");
  for (const double top_m : tops_m) {
    plot.commands += line_command({0, top_m}, {world.max_x_m, top_m}, "back lw 1.5 dt (1,3) lc rgb '#333333'");
    plot.commands +=
        label_command(fmt::format("landmark tops, {:.2f} m", top_m), world.max_x_m, top_m, "right offset -1,-0.7");
  }
  const auto points = [](const Point2& a, const Point2& b) {
    return fmt::format("{:.6g} {:.6g}\n{:.6g} {:.6g}\n", a.x(), a.y(), b.x(), b.y());
  };
  plot.commands += data_block("lenses", points(lower.lens, upper.lens)) +
                   data_block("viewpoints", points(lower.viewpoint, upper.viewpoint)) +
                   "set key outside top center horizontal maxrows 1\n";
  plot.commands +=
      "plot $lenses using 1:2 with points pt 7 ps 0.9 lc rgb '#222222' title 'camera lens', "
      "$viewpoints using 1:2 with points pt 1 ps 1.2 lw 2 lc rgb '#222222' title 'virtual viewpoint', "
      "NaN with filledcurves lc rgb '#cfe8dc' title 'common region'\n";

  figure.caption = fmt::format(
      "This rig from the side, to scale: mirror radius R = {:.0f} mm, lens to tip d = {:.0f} mm, distance of the "
      "mirrors s = {:.0f} mm. Each mirror shows the region between its horizon (the ray at the tip) and its rim ray, "
      "as seen from a virtual viewpoint beyond the axis. A range requires the top of a landmark in the common region.",
      rig.lower.mirror_radius_m * kMmPerM, rig.lower.lens_to_tip_m * kMmPerM, rig.mirror_separation_m * kMmPerM);
  if (is_right_angled(rig)) {
    figure.caption += fmt::format(" This region begins {:.2f} m from the axis", nearest_common_m(rig));
    if (!tops_m.empty())
      figure.caption += fmt::format("; the lower mirror shows tops at {:.2f} m from a range of {:.2f} m", tops_m.back(),
                                    nearest_top_m(rig, tops_m.back()));
    figure.caption += ".";
  }
  return drawn(drawing, std::move(figure), std::move(plot));
}

Figure draw_resolution(const Drawing& drawing) {
  const runlog::RunData& run = drawing.run;
  const config::Rig& rig = run.robot.rig;
  if (!is_right_angled(rig)) {
    drawing.notes.emplace_back("The figure of range resolution is missing: its formula requires 90 degree cones.");
    return {};
  }
  const double farthest = 1.1 * std::max(farthest_m(run), nearest_common_m(rig));
  constexpr int kSteps = 200;
  std::string curve;
  for (int i = 0; i <= kSteps; ++i) {
    const double range_m = farthest * i / kSteps;
    curve += fmt::format("{:.6g} {:.6g}\n", range_m, range_per_pixel_m(rig, range_m) * kMmPerM);
  }
  Plot plot{.height_px = 440};
  plot.commands = data_block("curve", curve);
  plot.commands += fmt::format(
      "set xrange [0:{:.6g}]\nset yrange [{:g}:*]\nset logscale y\nset format y '%g'\nset xlabel 'true range / m' "
      "offset 0,0.3\n"
      "set key outside top center horizontal\n",
      farthest, kLeastDrawnError_mm);
  std::vector<std::string> plots;
  constexpr std::array<int, 6> kShapes{7, 5, 9, 11, 13, 3};
  for (const config::Landmark& landmark : run.map.landmarks) {
    std::string points;
    for (const runlog::RangeRow* row : rows_of(run, landmark.name)) {
      if (!row->range_m || !row->true_range_m) continue;
      const double error_mm = std::abs(*row->range_m - *row->true_range_m) * kMmPerM;
      points += fmt::format("{} {}\n", number(*row->true_range_m), number(std::max(error_mm, kLeastDrawnError_mm)));
    }
    if (points.empty()) continue;
    const std::size_t k = plots.size();
    plot.commands += data_block(fmt::format("errors{}", k), points);
    const std::string style =
        fmt::format("pt {} lc rgb '{}'", kShapes.at(k % kShapes.size()), line_colour(landmark.colour));
    // The key gets points of its own, because points this small cannot be distinguished in it.
    plots.push_back(
        fmt::format("$errors{0} using 1:2 with points {1} ps 0.3 notitle, keyentry with points {1} ps 0.9 title {2}", k,
                    style, gnuplot_string(landmark.name)));
  }
  const bool has_errors = !plots.empty();
  plot.commands += fmt::format("set ylabel '{}'\n", has_errors ? "range error / mm" : "range / mm per pixel");
  const auto mark = [&](double range_m, const std::string& text, double height) {
    plot.commands += fmt::format(
        "set arrow from {0:.6g},graph 0 to {0:.6g},graph 1 nohead back lw 1 dt (4,3) lc rgb '#888888'\n"
        "set label {1} at {0:.6g},graph {2} left offset 0.6,0 textcolor rgb '#555555' font ',12'\n",
        range_m, gnuplot_string(text), height);
  };
  mark(nearest_common_m(rig), fmt::format("common region from {:.2f} m", nearest_common_m(rig)), 0.96);
  double height = 0.89;
  for (const double top_m : shown_tops_m(run.map)) {
    const double nearest = nearest_top_m(rig, top_m);
    if (nearest > nearest_common_m(rig))
      mark(nearest, fmt::format("tops at {:.2f} m inside the lower rim from {:.2f} m", top_m, nearest), height);
    height -= 0.07;
  }
  plots.push_back(
      fmt::format("$curve using 1:2 with lines lw 2.5 lc rgb '{}' title 'one pixel of disparity'", kTruthColour));
  plot.commands += plot_command(plots);

  const std::string caption = fmt::format(
      "Change of range for one pixel of disparity, (range + d)\u00b2 / (v s) by equation 1: it grows with the square "
      "of the range.{} Ranges are measured to the axis of a landmark.",
      has_errors ? " Points: the errors of this run, by landmark; errors below 1 mm are drawn at 1 mm." : "");
  return drawn(drawing, {"fig08_resolution", "", "Range of one pixel of disparity", caption}, std::move(plot));
}

}  // namespace twocone::report
