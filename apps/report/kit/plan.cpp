// SPDX-License-Identifier: Apache-2.0
#include "apps/report/kit/plan.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <Eigen/Geometry>

#include "apps/report/kit/figure.h"
#include "apps/report/kit/html.h"
#include "apps/runlog/storage/image_file.h"
#include "drivers/sim_povray/scene_views.h"

namespace twocone::report {
namespace {

// Space for axis labels and tick marks around a plot.
constexpr double kLeft_px = 76, kRight_px = 22, kTop_px = 44, kBottom_px = 58;
constexpr int kOverheadWidth_px = 1000;

std::string point(const config::Point& p) { return fmt::format("{:.6g},{:.6g}", p.x_m, p.y_m); }

std::string outline(const config::Obstacle& obstacle) {
  if (const auto* circle = std::get_if<Disc>(&obstacle)) {
    return fmt::format("circle at {} size {:.6g}", point(circle->centre), circle->radius_m);
  }
  const auto& corners = std::get<config::Polygon>(obstacle);
  std::string text = "polygon from " + point(corners.front());
  for (std::size_t i = 1; i < corners.size(); ++i) text += " to " + point(corners[i]);
  return text + " to " + point(corners.front());
}

/// Returns the longest of 1, 2, 5 times a power of ten that fits into a fifth of the sheet's width.
double scale_bar_m(double width_m) {
  const double power = std::pow(10, std::floor(std::log10(width_m / 5)));
  for (const double factor : {5.0, 2.0}) {
    if (factor * power <= width_m / 5) return factor * power;
  }
  return power;
}

bool fits(const Image& image, const config::Bounds& bounds) {
  const double wanted = (bounds.max_x_m - bounds.min_x_m) / (bounds.max_y_m - bounds.min_y_m);
  // A difference of one pixel in either direction is rounding.
  return std::abs(image.width_px - wanted * image.height_px) <= 1 + wanted;
}

/// Returns gnuplot commands: walls and obstacles in grey.
std::string plan_commands(const config::Map& map) {
  const config::Bounds& b = map.bounds;
  std::string text = fmt::format(
      "set object rectangle from {:.6g},{:.6g} to {:.6g},{:.6g} behind fs empty border lc rgb '#555555' lw 2\n",
      b.min_x_m, b.min_y_m, b.max_x_m, b.max_y_m);
  for (const config::Obstacle& obstacle : map.obstacles) {
    text += fmt::format("set object {} behind fc rgb '#dcdcdc' fs solid border lc rgb '#aaaaaa'\n", outline(obstacle));
  }
  return text;
}

/// Returns gnuplot commands: the landmarks with their names.
/// @param boxed draws the names on white, for use over an image
std::string landmark_commands(const config::Map& map, bool boxed) {
  std::string text;
  const double middle_y_m = (map.bounds.min_y_m + map.bounds.max_y_m) / 2;
  for (const config::Landmark& landmark : map.landmarks) {
    const bool above = landmark.y_m < middle_y_m;  // towards the middle, where there is space
    if (!boxed) {
      text +=
          fmt::format("set object circle at {:.6g},{:.6g} size {:.6g} fc rgb '{}' fs solid border lc rgb '#555555'\n",
                      landmark.x_m, landmark.y_m, landmark.radius_m, own_colour(landmark.colour));
    }
    text += label_command(landmark.name, landmark.x_m, landmark.y_m + (above ? 1 : -1) * landmark.radius_m,
                          fmt::format("center offset 0,{} {}", above ? 0.7 : -0.7, boxed ? "boxed" : ""));
  }
  return text;
}

/// Errors: kNotFound (no scene), kUnavailable (the disk), those of sim_povray::render_overhead.
Result<Image> rendered_or_kept(const config::Map& map, const std::filesystem::path& cache) {
  if (!map.scene) return Error{ErrorCode::kNotFound, "the map names no scene"};
  if (auto kept = runlog::read_image(cache); kept && fits(*kept, map.bounds)) return kept;
  const config::Bounds& b = map.bounds;
  if (!(b.min_x_m < b.max_x_m && b.min_y_m < b.max_y_m)) return Error{ErrorCode::kNotFound, "the map has no extent"};
  sim_povray::OverheadView view{b.min_x_m, b.max_x_m, b.min_y_m, b.max_y_m};
  view.width_px = kOverheadWidth_px;
  Result<Image> rendered = sim_povray::render_overhead(*map.scene, map.unit_m, view, {}, map.scene_paths);
  if (!rendered) return rendered;
  try {
    runlog::write_image(cache, *rendered);
  } catch (const runlog::DiskError& error) {
    return Error{ErrorCode::kUnavailable, error.what()};
  }
  return rendered;
}

}  // namespace

Sheet lay_out(config::Bounds world, int width_px, int tallest_px) {
  const auto mend = [](double& low, double& high) {
    if (!std::isfinite(low) || !std::isfinite(high)) low = high = 0;
    if (high - low < 1e-3) low -= 0.5, high += 0.5;
  };
  mend(world.min_x_m, world.max_x_m);
  mend(world.min_y_m, world.max_y_m);
  const double aspect = (world.max_y_m - world.min_y_m) / (world.max_x_m - world.min_x_m);
  Sheet sheet{world, width_px, 0, kLeft_px, kTop_px, width_px - kLeft_px - kRight_px, 0};
  const double tallest = tallest_px - kTop_px - kBottom_px;
  sheet.plot_height_px = std::min(sheet.plot_width_px * aspect, tallest);
  sheet.plot_width_px = sheet.plot_height_px / aspect;
  sheet.width_px = int(std::ceil(sheet.plot_width_px + kLeft_px + kRight_px));
  sheet.height_px = int(std::ceil(sheet.plot_height_px + kTop_px + kBottom_px));
  return sheet;
}

std::string sheet_commands(const Sheet& sheet, double unit_m) {
  const config::Bounds& w = sheet.world;
  const double width = sheet.width_px, height = sheet.height_px;
  std::string text = fmt::format(
      "set style textbox opaque noborder fillcolor rgb '#ffffff' margins 0.6,0.4\n"
      "set lmargin at screen {:.6f}\nset rmargin at screen {:.6f}\n"
      "set tmargin at screen {:.6f}\nset bmargin at screen {:.6f}\n"
      "set xrange [{:.6g}:{:.6g}]\nset yrange [{:.6g}:{:.6g}]\n"
      "set xlabel 'x / m' offset 0,0.5\nset ylabel 'y / m' offset 0.8,0\n",
      sheet.left_px / width, (sheet.left_px + sheet.plot_width_px) / width, 1 - sheet.top_px / height,
      1 - (sheet.top_px + sheet.plot_height_px) / height, w.min_x_m, w.max_x_m, w.min_y_m, w.max_y_m);
  const double bar_m = scale_bar_m(w.max_x_m - w.min_x_m);
  const double x_m = w.min_x_m + 0.03 * (w.max_x_m - w.min_x_m);
  const double y_m = w.min_y_m + 0.03 * (w.max_y_m - w.min_y_m);
  const std::string caption = fmt::format("{:g} m = {:g} units", bar_m, std::round(bar_m / unit_m * 100) / 100);
  for (const auto& [colour, line] : {std::pair{"#ffffff", 6}, std::pair{"#222222", 3}}) {
    text += fmt::format("set arrow from {0:.6g},{1:.6g} to {2:.6g},{1:.6g} nohead front lw {3} lc rgb '{4}'\n", x_m,
                        y_m, x_m + bar_m, line, colour);
  }
  return text + label_command(caption, x_m, y_m, "offset 0,0.8 left boxed");
}

std::string label_command(const std::string& text, double x_m, double y_m, const std::string& options) {
  return fmt::format("set label {} at {:.6g},{:.6g} front textcolor rgb '#222222' {}\n", gnuplot_string(text), x_m, y_m,
                     options);
}

std::string pose_block(const std::string& name, const std::vector<runlog::PoseRow>& poses) {
  std::string rows;
  for (const runlog::PoseRow& pose : poses) rows += fmt::format("{} {}\n", number(pose.x_m), number(pose.y_m));
  return data_block(name, rows);
}

Plot plot_over(const Sheet& sheet, const config::Map& map, const std::optional<Image>& overhead) {
  constexpr int kJpegQuality = 82;
  Plot plot{.width_px = sheet.width_px, .height_px = sheet.height_px, .commands = sheet_commands(sheet, map.unit_m)};
  if (overhead) {
    plot.underlay = svg_image(sheet.left_px, sheet.top_px, sheet.plot_width_px, sheet.plot_height_px,
                              jpeg_uri(*overhead, kJpegQuality));
    plot.commands += "unset grid\n";
  } else {
    plot.commands += plan_commands(map);
  }
  plot.commands += landmark_commands(map, overhead.has_value()) + "set key outside top center horizontal maxrows 1\n";
  return plot;
}

std::optional<config::Bounds> extent_of(std::initializer_list<const std::vector<runlog::PoseRow>*> paths) {
  constexpr double kMargin_m = 0.35;
  Eigen::AlignedBox2d box;
  for (const std::vector<runlog::PoseRow>* const path : paths) {
    for (const runlog::PoseRow& pose : *path) {
      if (std::isfinite(pose.x_m) && std::isfinite(pose.y_m)) box.extend(Eigen::Vector2d(pose.x_m, pose.y_m));
    }
  }
  if (box.isEmpty()) return std::nullopt;
  return config::Bounds{box.min().x() - kMargin_m, box.max().x() + kMargin_m, box.min().y() - kMargin_m,
                        box.max().y() + kMargin_m};
}

std::optional<Image> overhead_image(const DrawingTools& tools, const config::Map& map, std::string_view what_is) {
  Result<Image> image = rendered_or_kept(map, tools.gnuplot.folder / "overhead.png");
  if (image) return *std::move(image);
  tools.notes.push_back(fmt::format("{} drawn over a plan instead of an image of the arena from above: {}", what_is,
                                    image.error().message));
  return std::nullopt;
}

}  // namespace twocone::report
