// SPDX-License-Identifier: Apache-2.0
#include "apps/report/page.h"

#include <algorithm>
#include <cmath>
#include <map>

#include <fmt/format.h>

#include "apps/report/kit/figure.h"
#include "apps/runlog/summary/bounds.h"
#include "localisation/fix.h"

namespace twocone::report {
namespace {

/// Returns the errors of ranges in units of their own stated sigmas.
std::vector<double> normalised_ranges(const runlog::RunData& run) {
  std::vector<double> errors;
  for (const runlog::RangeRow& row : run.ranges) {
    if (!row.range_m || !row.true_range_m || !row.sigma_range_m || !(*row.sigma_range_m > 0)) continue;
    errors.push_back((*row.range_m - *row.true_range_m) / *row.sigma_range_m);
  }
  return errors;
}

/// Returns the squared errors of positions in units of their own stated covariances, for fixes with one answer.
std::vector<double> normalised_positions(const runlog::RunData& run) {
  std::vector<double> squares;
  for (const runlog::FixRow& row : run.fixes) {
    using localisation::FixVerdict;
    if (row.verdict == to_string(FixVerdict::kWeak) || row.verdict == to_string(FixVerdict::kAmbiguous)) continue;
    if (is_out_of_bounds(row)) continue;
    if (!row.x_m || !row.y_m || !row.true_x_m || !row.true_y_m) continue;
    if (!row.var_x_m2 || !row.cov_xy_m2 || !row.var_y_m2) continue;
    const double determinant = *row.var_x_m2 * *row.var_y_m2 - *row.cov_xy_m2 * *row.cov_xy_m2;
    if (!(determinant > 0)) continue;
    const double dx_m = *row.x_m - *row.true_x_m;
    const double dy_m = *row.y_m - *row.true_y_m;
    squares.push_back((dx_m * dx_m * *row.var_y_m2 - 2 * dx_m * dy_m * *row.cov_xy_m2 + dy_m * dy_m * *row.var_x_m2) /
                      determinant);
  }
  return squares;
}

/// Returns bins of equal width from `from` to `to`, as densities. Values outside are counted in the total and not
/// drawn. Returns nothing without a value.
std::string histogram(const std::vector<double>& values, double from, double to, int bins) {
  if (values.empty()) return "";
  std::vector<int> counts(std::size_t(bins), 0);
  const double width = (to - from) / bins;
  for (const double value : values) {
    const double place = std::floor((value - from) / width);
    if (place >= 0 && place < bins) ++counts[std::size_t(place)];
  }
  std::string rows;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    rows +=
        fmt::format("{:.6g} {:.6g}\n", from + (double(i) + 0.5) * width, counts[i] / (width * double(values.size())));
  }
  return rows;
}

int count_outside(const std::vector<double>& values, double from, double to) {
  return int(std::count_if(values.begin(), values.end(), [&](double v) { return !(v >= from && v < to); }));
}

}  // namespace

Figure draw_error_and_bound(const Drawing& drawing) {
  const runlog::RunData& run = drawing.run;
  std::map<std::uint64_t, double> times_s;
  for (const runlog::FrameRow& frame : run.frames) times_s[frame.frame] = frame.t_s;
  std::string curve;
  bool any_bound = false;
  for (const runlog::FrameBound& bound : runlog::bounds(run)) {
    std::optional<double> sigma_mm;
    if (bound.covariance) sigma_mm = std::sqrt((*bound.covariance)(0, 0) + (*bound.covariance)(1, 1)) * kMmPerM;
    any_bound |= sigma_mm.has_value();
    curve += fmt::format("{:.6g} {}\n", times_s.at(bound.frame), number(sigma_mm));
  }
  std::string points;
  std::vector<double> errors_mm;
  for (const runlog::FixRow& fix : run.fixes) {
    const auto time = times_s.find(fix.frame);
    if (!fix.error_m || time == times_s.end()) continue;
    errors_mm.push_back(*fix.error_m * kMmPerM);
    points += fmt::format("{:.6g} {}\n", time->second, number(errors_mm.back()));
  }
  if (!any_bound || errors_mm.empty()) return {};

  const double limit_mm = std::max(readable_limit(errors_mm), 1e-3);
  const auto beyond = count_beyond(errors_mm, limit_mm);
  Plot plot{.height_px = 380};
  plot.commands = data_block("bound", curve) + data_block("fixes", points);
  plot.commands += fmt::format(
      "set yrange [0:{:.6g}]\nset xlabel 'time / s' offset 0,0.3\nset ylabel 'position error / mm'\n"
      "set key outside top center horizontal maxrows 1\n",
      1.1 * limit_mm);
  std::vector<std::string> plots;
  add_error_plots("$fixes", 2, limit_mm, beyond > 0, "beyond the axis", plots);
  plots.push_back(fmt::format("$bound using 1:2 with lines lw 2.5 lc rgb '{}' title 'bound, 1 sigma of the distance'",
                              kBoundColour));
  plot.commands += plot_command(plots);

  Figure figure{"bound_position", "", "Position error and its Cram\u00e9r-Rao bound"};
  figure.caption =
      "Line: the smallest standard deviation that the images of that frame allow (Cram\u00e9r-Rao bound), "
      "sqrt(var x + var y), at the true pose with the measured noise of the outlines. No unbiased estimator has "
      "smaller errors on average.";
  if (beyond > 0) {
    figure.caption += fmt::format(" {} of the errors lie beyond the axis; the largest is {:.0f} mm.", beyond,
                                  *std::max_element(errors_mm.begin(), errors_mm.end()));
  }
  return drawn(drawing, std::move(figure), std::move(plot));
}

Figure draw_normalised_errors(const Drawing& drawing) {
  const std::vector<double> ranges = normalised_ranges(drawing.run);
  const std::vector<double> positions = normalised_positions(drawing.run);
  if (ranges.empty() && positions.empty()) return {};
  constexpr double kWidest = 5, kLargest = 12;
  constexpr int kBins = 40;

  Plot plot{.height_px = 380};
  plot.commands = data_block("ranges", histogram(ranges, -kWidest, kWidest, kBins)) +
                  data_block("positions", histogram(positions, 0, kLargest, kBins));
  plot.commands +=
      "set multiplot layout 1,2 margins 0.08,0.98,0.16,0.84 spacing 0.09,0.1\nset samples 300\n"
      "set key outside top center horizontal\nset yrange [0:*]\n";
  const auto panel = [&](const char* data, bool any, double from, double to, const char* axis, const char* expected,
                         const char* title) {
    plot.commands += fmt::format("set xrange [{:g}:{:g}]\nset boxwidth {:.6g}\nset xlabel '{}' offset 0,0.3\n", from,
                                 to, (to - from) / kBins, axis);
    std::vector<std::string> plots;
    if (any) {
      plots.push_back(
          fmt::format("${} using 1:2 with boxes fs solid 0.45 lc rgb '{}' title 'this run'", data, kOdometryColour));
    }
    plots.push_back(fmt::format("{} with lines lw 2.5 lc rgb '{}' title '{}'", expected, kBoundColour, title));
    plot.commands += plot_command(plots);
  };
  plot.commands += "set ylabel 'density'\n";
  panel("ranges", !ranges.empty(), -kWidest, kWidest, "range error / its sigma", "exp(-x*x/2)/sqrt(2*pi)", "normal");
  plot.commands += "unset ylabel\n";
  panel("positions", !positions.empty(), 0, kLargest, "position error squared by its covariance", "exp(-x/2)/2",
        "chi-squared");
  plot.commands += "unset multiplot\n";

  Figure figure{"bound_normalised", "", "Errors compared with the stated sigmas"};
  figure.caption = fmt::format(
      "Errors in units of the sigmas that the method states with them: {} ranges, {} positions. The lines are the "
      "distributions that correct sigmas give. Where the histogram is wider than its line, the sigmas are too small; "
      "where it is narrower, they are too large.",
      ranges.size(), positions.size());
  const int outside = count_outside(ranges, -kWidest, kWidest) + count_outside(positions, 0, kLargest);
  if (outside > 0) figure.caption += fmt::format(" {} of them lie beyond the axes; the densities count them.", outside);
  return drawn(drawing, std::move(figure), std::move(plot));
}

}  // namespace twocone::report
