// SPDX-License-Identifier: Apache-2.0
#include "apps/report/page.h"

#include <algorithm>
#include <cmath>
#include <map>

#include <fmt/format.h>

#include "apps/report/kit/figure.h"
#include "apps/report/kit/html.h"
#include "apps/report/paper.h"

namespace twocone::report {
namespace {

/// Height of the marks, as a fraction of the plot's height.
constexpr double kMarkHeight = 0.045;

/// The data of one landmark's figure, for gnuplot.
struct RangeData {
  std::string points;                          ///< frame, true, computed, error in mm
  std::map<std::string, std::string> reasons;  ///< frames without a range by verdict
  bool any_true = false, any_computed = false;
  double longest_m = 0;
  std::vector<double> errors_mm;  ///< absolute
  double limit_mm = 0;            ///< of their axis
};

RangeData collect(const runlog::RunData& run, const std::string& landmark) {
  RangeData data;
  std::optional<std::uint64_t> previous;
  for (const runlog::RangeRow* row : rows_of(run, landmark)) {
    if (previous && row->frame > *previous + 1) data.points += "\n";  // a line is not drawn over missing frames
    previous = row->frame;
    std::optional<double> error_mm;
    if (row->range_m && row->true_range_m) error_mm = (*row->range_m - *row->true_range_m) * kMmPerM;
    data.points +=
        fmt::format("{} {} {} {}\n", row->frame, number(row->true_range_m), number(row->range_m), number(error_mm));
    if (!row->range_m) data.reasons[row->verdict] += fmt::format("{} 1\n", row->frame);
    data.any_true |= row->true_range_m.has_value();
    data.any_computed |= row->range_m.has_value();
    if (error_mm) data.errors_mm.push_back(std::abs(*error_mm));
    data.longest_m = std::max({data.longest_m, row->range_m.value_or(0), row->true_range_m.value_or(0)});
  }
  data.limit_mm = readable_limit(data.errors_mm);
  return data;
}

std::string data_blocks(const RangeData& data) {
  std::string text = data_block("range", data.points);
  int k = 0;
  for (const auto& [reason, frames] : data.reasons) text += data_block(fmt::format("reason{}", k++), frames);
  return text;
}

std::string range_panel(const RangeData& data, const std::string& colour) {
  const double top_m = data.longest_m > 0 && std::isfinite(data.longest_m) ? data.longest_m * 1.1 : 1;
  std::vector<std::string> plots;
  if (data.any_true) {
    plots.push_back(fmt::format("$range using 1:2 with lines lw 2 lc rgb '{}' title 'true'", kTruthColour));
  }
  if (data.any_computed) {
    plots.push_back(fmt::format("$range using 1:3 with points pt 7 ps 0.35 lc rgb '{}' title 'computed'", colour));
  }
  int k = 0;
  for (const auto& [reason, frames] : data.reasons) {
    plots.push_back(fmt::format("$reason{} using 1:({}) axes x1y2 with boxes lc rgb '{}' title {}", k++, kMarkHeight,
                                verdict_colour(reason), gnuplot_string(reason)));
  }
  return fmt::format("set yrange [0:{:.6g}]\nset y2range [0:1]\nset ylabel 'range / m'\n{}", top_m,
                     plot_command(plots));
}

/// Returns the distance of tick marks on an axis that reaches `reach` to both sides: 1, 2 or 5 times a power of ten,
/// with at most three marks on each side.
double tick_step(double reach) {
  const double power = std::pow(10, std::floor(std::log10(reach / 3)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= reach / 3) return factor * power;
  }
  return 10 * power;
}

std::string error_panel(const RangeData& data, const std::string& colour) {
  const double reach_mm = std::max(data.limit_mm, 1e-3) * 1.15;
  // Within the limit as dots; beyond it as triangles at the edge, pointing outwards.
  return fmt::format(
      "set ylabel 'error / mm'\nset yrange [{0:.6g}:{1:.6g}]\nset ytics {2:.6g}\nset xzeroaxis lc rgb '#777777' lw 1 "
      "dt solid\n"
      "plot $range using 1:(abs($4) <= {3:.9g} ? $4 : NaN) with points pt 7 ps 0.3 lc rgb '{4}' notitle, \\\n"
      "     $range using 1:($4 > {3:.9g} ? {3:.9g} : NaN) with points pt 9 ps 0.8 lc rgb '{4}' notitle, \\\n"
      "     $range using 1:($4 < -{3:.9g} ? -{3:.9g} : NaN) with points pt 11 ps 0.8 lc rgb '{4}' notitle\n",
      -reach_mm, reach_mm, tick_step(reach_mm), data.limit_mm, colour);
}

Plot range_plot(const runlog::RunData& run, const RangeData& data, const std::string& colour) {
  const auto [first, last] = frame_span(run);
  Plot plot{.width_px = 620, .height_px = data.errors_mm.empty() ? 320 : 450};
  plot.commands = data_blocks(data);
  plot.commands += fmt::format(
      "set xrange [{:g}:{:g}]\nset boxwidth 1\nset lmargin 8\nset rmargin 2\n"
      "set key outside top center horizontal\n",
      first, last);
  const std::string frame_axis = "set xlabel 'frame' offset 0,0.4\n";
  if (data.errors_mm.empty()) {
    plot.commands += frame_axis + range_panel(data, colour);
    return plot;
  }
  plot.commands +=
      "set multiplot\n" +
      std::string(data.reasons.size() > 1 ? "set tmargin at screen 0.86\n" : "set tmargin at screen 0.90\n") +
      "set bmargin at screen 0.43\nset format x ''\n" + range_panel(data, colour) +
      "unset key\nset tmargin at screen 0.38\nset bmargin at screen 0.135\nset format x '%g'\n" + frame_axis +
      error_panel(data, colour) + "unset multiplot\n";
  return plot;
}

std::string caption(const Drawing& drawing, const config::Landmark& landmark, const RangeData& data) {
  const runlog::LandmarkSummary& own = landmark_of(drawing.summary, landmark.name);
  std::string text = fmt::format("{} of {} frames have a range.", own.frames_with_range, drawing.summary.frames);
  if (own.error) {
    text += fmt::format(" Mean error {:.1f} mm, 95 % within {:.1f} mm, worst {:.1f} mm.", own.error->mean * kMmPerM,
                        own.error->p95 * kMmPerM, own.error->max * kMmPerM);
    if (const paper::LandmarkFigures* figures = paper::find_landmark(landmark.name)) {
      text += fmt::format(" The paper: mean {}, worst {} mm.", figures->mean_mm, figures->max_mm);
    }
  }
  if (const auto beyond = count_beyond(data.errors_mm, data.limit_mm); beyond > 0) {
    text += fmt::format(" {} {} beyond the error axis: {} at its edge.", beyond,
                        beyond == 1 ? "error lies" : "errors lie", beyond == 1 ? "a triangle" : "triangles");
  }
  if (!data.reasons.empty()) text += " Marks along the bottom: frames without a range, coloured by the reason.";
  return text;
}

}  // namespace

std::vector<const runlog::RangeRow*> rows_of(const runlog::RunData& run, const std::string& landmark) {
  std::vector<const runlog::RangeRow*> rows;
  for (const runlog::RangeRow& row : run.ranges) {
    if (row.landmark == landmark) rows.push_back(&row);
  }
  return rows;
}

std::vector<Figure> draw_ranges(const Drawing& drawing) {
  std::vector<Figure> figures;
  int position = 0;
  for (const config::Landmark& landmark : drawing.run.map.landmarks) {
    const paper::LandmarkFigures* paper_landmark = paper::find_landmark(landmark.name);
    const RangeData data = collect(drawing.run, landmark.name);
    Figure figure;
    figure.stem = paper_landmark != nullptr ? fmt::format("fig{}_range_{}", paper_landmark->figure, slug(landmark.name))
                                            : fmt::format("range_{:02}_{}", position, slug(landmark.name));
    ++position;
    if (paper_landmark != nullptr) figure.number = fmt::format("Figure {}", paper_landmark->figure);
    figure.title = fmt::format("Range to {}", landmark.name);
    figure.wide = false;
    figure.caption = caption(drawing, landmark, data);
    figures.push_back(drawn(drawing, std::move(figure), range_plot(drawing.run, data, line_colour(landmark.colour))));
  }
  return figures;
}

}  // namespace twocone::report
