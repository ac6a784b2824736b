// SPDX-License-Identifier: Apache-2.0
#include "apps/report/page.h"

#include <algorithm>
#include <cmath>
#include <map>

#include <fmt/format.h>

#include "apps/report/kit/figure.h"
#include "apps/report/kit/plan.h"
#include "apps/report/paper.h"

namespace twocone::report {
namespace {

std::optional<double> in_mm(std::optional<double> metres) {
  return metres ? std::optional(*metres * kMmPerM) : std::nullopt;
}

constexpr int kPath_px = 640;
constexpr int kTallest_px = 760;

/// Returns gnuplot commands that name the start and the end of a path, on sides that keep the two words apart.
std::string ends(const std::vector<runlog::PoseRow>& path, bool boxed) {
  if (path.empty()) return "";
  const runlog::PoseRow& start = path.front();
  const runlog::PoseRow& end = path.back();
  const bool start_above = start.y_m >= end.y_m;
  const auto offset = [&](bool above) {
    return fmt::format("left offset 1,{}{}", above ? 0.9 : -0.9, boxed ? " boxed" : "");
  };
  return pose_block("start", {start}) + pose_block("end", {end}) +
         label_command("start", start.x_m, start.y_m, offset(start_above)) +
         label_command("end", end.x_m, end.y_m, offset(!start_above));
}

std::string end_marks() {
  return "$start using 1:2 with points pt 7 ps 1.1 lc rgb '#222222' notitle, "
         "$start using 1:2 with points pt 7 ps 0.7 lc rgb '#ffffff' notitle, "
         "$end using 1:2 with points pt 5 ps 0.9 lc rgb '#222222' notitle";
}

/// The marks of frames in figures 17 and 18; a frame without a position has the reason.
struct FixData {
  std::string points;                          ///< frame, x, y, error in mm
  std::map<std::string, std::string> missing;  ///< frames without a position by verdict
  int count = 0;
  std::vector<double> errors_mm;
};

FixData collect_fixes(const runlog::RunData& run) {
  FixData data;
  for (const runlog::FixRow& fix : run.fixes) {
    if (!fix.x_m || !fix.y_m || is_out_of_bounds(fix)) {
      data.missing[fix.verdict] += fmt::format("{} 1\n", fix.frame);
      continue;
    }
    ++data.count;
    if (fix.error_m) data.errors_mm.push_back(*fix.error_m * kMmPerM);
    data.points +=
        fmt::format("{} {} {} {}\n", fix.frame, number(fix.x_m), number(fix.y_m), number(in_mm(fix.error_m)));
  }
  return data;
}

}  // namespace

std::pair<double, double> frame_span(const runlog::RunData& run) {
  if (run.frames.empty()) return {-0.5, 0.5};
  const auto [first, last] = std::ranges::minmax_element(run.frames, {}, &runlog::FrameRow::frame);
  return {double(first->frame) - 0.5, double(last->frame) + 0.5};
}

std::vector<std::optional<double>> odometry_errors_m(const runlog::RunData& run) {
  const auto truth = runlog::at_frames(run, run.truth);
  const auto odometry = runlog::at_frames(run, run.odometry);
  std::vector<std::optional<double>> errors(run.frames.size());
  for (std::size_t i = 0; i < errors.size(); ++i) {
    if (truth[i] && odometry[i]) {
      errors[i] = std::hypot(odometry[i]->x_m - truth[i]->x_m, odometry[i]->y_m - truth[i]->y_m);
    }
  }
  return errors;
}

std::ptrdiff_t count_beyond(const std::vector<double>& errors, double limit) {
  return std::count_if(errors.begin(), errors.end(), [limit](double error) { return error > limit; });
}

void add_error_plots(std::string_view block, int column, double limit, bool is_beyond, std::string_view beyond_title,
                     std::vector<std::string>& plots) {
  plots.push_back(
      fmt::format("{0} using 1:(${1} <= {2:.9g} ? ${1} : NaN) with points pt 7 ps 0.4 lc rgb '{3}' title 'fix'", block,
                  column, limit, kFixColour));
  if (!is_beyond) return;
  plots.push_back(
      fmt::format("{0} using 1:(${1} > {2:.9g} ? {2:.9g} : NaN) with points pt 9 ps 0.9 lc rgb '{3}' title '{4}'",
                  block, column, limit, kFixColour, beyond_title));
}

Figure draw_trajectory(const Drawing& drawing, const std::optional<Image>& overhead) {
  const runlog::RunData& run = drawing.run;
  const bool truth = !run.truth.empty();
  const bool wheels = runlog::has_odometry(run);
  const std::vector<runlog::PoseRow>& path = truth ? run.truth : wheels ? run.odometry : run.estimate;
  const char* const by = wheels ? "odometry" : "the fixes";

  Plot plot = plot_over(lay_out(run.map.bounds, kPath_px, kTallest_px), run.map, overhead);
  std::vector<std::string> plots;
  if (!path.empty()) {
    plot.commands += pose_block("path", path) + ends(path, true);
    plots = {"$path using 1:2 with lines lw 5 lc rgb '#ffffff' notitle",
             fmt::format("$path using 1:2 with lines lw 2.5 lc rgb '{}' title {}", kOdometryColour,
                         gnuplot_string(truth ? "true trajectory" : fmt::format("trajectory by {}", by))),
             end_marks()};
  }
  plot.commands += plot_command(plots);

  Figure figure{"fig07_trajectory", "Figure 7",
                truth ? "The robot's true trajectory" : fmt::format("The trajectory by {}", by)};
  figure.wide = false;
  figure.caption = fmt::format("{} {} Axes in metres; 1 POV-Ray unit is {:g} cm.",
                               truth    ? "The path that the robot really drove."
                               : wheels ? "Dead reckoning alone, because there is no ground truth."
                                        : "There is neither ground truth nor odometry.",
                               overhead ? "The arena from above as POV-Ray sees it, with the robot at its start."
                                        : "Plan drawn from the map: walls, obstacles, landmarks.",
                               run.map.unit_m * 100);
  return drawn(drawing, std::move(figure), std::move(plot));
}

Figure draw_position_error(const Drawing& drawing) {
  const runlog::RunData& run = drawing.run;
  const std::vector<std::optional<double>> odometry_m = odometry_errors_m(run);
  const FixData fixes = collect_fixes(run);
  const bool any_odometry = std::any_of(odometry_m.begin(), odometry_m.end(), [](const auto& e) { return bool(e); });
  if (fixes.errors_mm.empty() && !any_odometry) return {};

  std::string odometry;
  for (std::size_t i = 0; i < odometry_m.size(); ++i) {
    odometry += fmt::format("{} {}\n", run.frames[i].frame, number(in_mm(odometry_m[i])));
  }
  const auto [first, last] = frame_span(run);
  Plot plot{.height_px = 400};
  plot.commands = data_block("fixes", fixes.points) + data_block("odometry", odometry);
  plot.commands += fmt::format(
      "set xrange [{:g}:{:g}]\nset yrange [0:*]\nset offsets 0,0,graph 0.08,0\nset y2range [0:1]\nset boxwidth 1\n"
      "set xlabel 'frame' offset 0,0.3\nset ylabel 'position error / mm'\nset key outside top center horizontal "
      "maxrows 1\n",
      first, last);
  std::vector<std::string> plots;
  int k = 0;
  for (const auto& [verdict, frames] : fixes.missing) {
    plot.commands += data_block(fmt::format("missing{}", k), frames);
    plots.push_back(fmt::format("$missing{} using 1:(0.04) axes x1y2 with boxes lc rgb '{}' title {}", k++,
                                verdict_colour(verdict), gnuplot_string("no fix: " + verdict)));
  }
  if (any_odometry) {
    plots.push_back(fmt::format("$odometry using 1:2 with lines lw 2 lc rgb '{}' title 'odometry'", kOdometryColour));
  }
  const double limit_mm = std::max(readable_limit(fixes.errors_mm), 1.2 * paper::kPositionMean_mm);
  const auto beyond = count_beyond(fixes.errors_mm, limit_mm);
  if (!fixes.errors_mm.empty()) add_error_plots("$fixes", 4, limit_mm, beyond > 0, "fix beyond the axis", plots);
  plots.push_back(fmt::format("{} with lines lw 1 dt (6,4) lc rgb '{}' title 'the paper''s mean'",
                              paper::kPositionMean_mm, kPaperColour));
  if (last > paper::kFigure17Frames) {
    plot.commands += fmt::format(
        "set arrow from {0},graph 0 to {0},graph 1 nohead back lw 1 dt (2,3) lc rgb '{1}'\n"
        "set label 'the paper shows the first {0} frames' at {0},graph 0.96 right offset -0.6,0 "
        "textcolor rgb '#666666' font ',12'\n",
        paper::kFigure17Frames, kPaperColour);
  }
  plot.commands += plot_command(plots);

  Figure figure{"fig17_error", "Figure 17", "Position error"};
  figure.caption =
      "Distance from the true position, frame by frame. Each fix uses one stereo frame, the map and the rig only, so "
      "its error does not grow with time; that of odometry does.";
  if (beyond > 0) {
    figure.caption += fmt::format(" {} of the errors lie beyond the axis, up to {:.0f} mm: triangles at its edge.",
                                  beyond, *std::max_element(fixes.errors_mm.begin(), fixes.errors_mm.end()));
  }
  if (!fixes.missing.empty()) figure.caption += " Marks along the bottom: frames without a position.";
  return drawn(drawing, std::move(figure), std::move(plot));
}

Figure draw_paths(const Drawing& drawing) {
  const runlog::RunData& run = drawing.run;
  const FixData fixes = collect_fixes(run);
  const config::Bounds world = extent_of({&run.truth, &run.odometry}).value_or(run.map.bounds);
  const auto outside = std::count_if(run.fixes.begin(), run.fixes.end(), [&](const runlog::FixRow& fix) {
    return fix.x_m && fix.y_m &&
           !(*fix.x_m >= world.min_x_m && *fix.x_m <= world.max_x_m && *fix.y_m >= world.min_y_m &&
             *fix.y_m <= world.max_y_m);
  });

  Plot plot = plot_over(lay_out(world, kPath_px, kTallest_px), run.map, std::nullopt);
  std::vector<std::string> plots;
  const auto path = [&](const char* name, const std::vector<runlog::PoseRow>& poses, const std::string& style) {
    if (poses.empty()) return;
    plot.commands += pose_block(name, poses);
    plots.push_back(fmt::format("${} using 1:2 with lines {}", name, style));
  };
  path("truth", run.truth, fmt::format("lw 2 lc rgb '{}' title 'true'", kTruthColour));
  path("odometry", run.odometry, fmt::format("lw 1.5 dt (8,4) lc rgb '{}' title 'odometry'", kOdometryColour));
  if (fixes.count > 0) {
    plot.commands += data_block("fixes", fixes.points);
    plots.push_back(
        fmt::format("$fixes using 2:3 with points pt 7 ps 0.35 lc rgb '{}' title 'calculated'", kFixColour));
  }
  const std::vector<runlog::PoseRow>& marked = run.truth.empty() ? run.odometry : run.truth;
  if (!marked.empty()) {
    plot.commands += ends(marked, false);
    plots.push_back(end_marks());
  }
  plot.commands += plot_command(plots);

  Figure figure{"fig18_paths", "Figure 18", "True and calculated trajectory"};
  figure.wide = false;
  figure.caption = fmt::format("{} positions from one stereo frame each{}{}.", fixes.count,
                               run.truth.empty() ? "" : " beside the true trajectory",
                               runlog::has_odometry(run) ? ", and the path by odometry alone" : "");
  if (outside > 0) figure.caption += fmt::format(" {} of them lie outside this figure.", outside);
  return drawn(drawing, std::move(figure), std::move(plot));
}

}  // namespace twocone::report
