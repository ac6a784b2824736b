// SPDX-License-Identifier: Apache-2.0
#include "apps/report/figures/figures.h"

#include <algorithm>

#include <fmt/format.h>

#include "apps/report/figures/series.h"
#include "apps/report/kit/figure.h"
#include "apps/report/kit/html.h"

namespace twocone::report {
namespace {

/// Smaller values are not drawn: a logarithmic axis has no zero.
constexpr double kLeastDrawn_mm = 0.01;

std::string drawn_mm(double metres) {
  const double value_mm = metres * kMmPerM;
  return number(value_mm >= kLeastDrawn_mm ? std::optional(value_mm) : std::nullopt);
}

/// Returns the text of an axis label. gnuplot takes a '%' in it for the beginning of a number's format.
std::string tic_string(const std::string& text) { return gnuplot_string(replaced(text, "%", "%%")); }

}  // namespace

std::optional<Figure> draw_error_budget(const Drawing& drawing, const error_budget::ErrorBudget& error_budget) {
  if (error_budget.ranges == 0 && error_budget.poses == 0) return std::nullopt;
  std::vector<error_budget::ErrorBudgetLine> lines = error_budget.lines;
  std::stable_sort(lines.begin(), lines.end(), [](const auto& a, const auto& b) {
    return a.position.analytic_m + a.range.analytic_m > b.position.analytic_m + b.range.analytic_m;
  });
  lines.insert(lines.begin(), error_budget.total);

  std::string data;
  std::string tics;
  double largest_mm = 1;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const error_budget::ErrorBudgetLine& line = lines[i];
    data +=
        fmt::format("{} {} {} {} {}\n", -double(i), drawn_mm(line.range.analytic_m), drawn_mm(line.range.monte_carlo_m),
                    drawn_mm(line.position.analytic_m), drawn_mm(line.position.monte_carlo_m));
    const std::string name = line.size.empty() ? line.source : line.source + ": " + line.size;
    tics += fmt::format("{}{} {}", i > 0 ? ", " : "", tic_string(name), -double(i));
    for (const error_budget::Contribution& c : {line.range, line.position}) {
      largest_mm = std::max({largest_mm, c.analytic_m * kMmPerM, c.monte_carlo_m * kMmPerM});
    }
  }
  Plot plot;
  plot.height_px = 130 + 27 * int(lines.size());
  plot.commands = data_block("error_budget", data);
  plot.commands += fmt::format(
      "set logscale x\nset xrange [{0:g}:{1:.6g}]\nset yrange [{2:g}:0.6]\nset ytics ({3})\nset format x '%g'\n"
      "set xlabel 'root mean square / mm' offset 0,0.3\nset key outside top center horizontal\nunset grid\n"
      "set grid xtics back lc rgb '#e4e4e4' lw 1 dt solid\n",
      kLeastDrawn_mm, 1.6 * largest_mm, -double(lines.size()) + 0.4, tics);
  // Boxes from the axis' end to the value: x, y, xlow, xhigh, ylow, yhigh.
  const auto bars = [&](int column, double above, double below, std::string_view colour, const std::string& name) {
    return fmt::format(
        "$error_budget using {0}:1:({1:g}):{0}:($1 {2:+g}):($1 {3:+g}) with boxxyerror fs solid 0.75 noborder "
        "lc rgb '{4}' title {5}",
        column, kLeastDrawn_mm, below, above, colour, gnuplot_string(name));
  };
  const auto marks = [&](int column, double at, const std::string& title) {
    return fmt::format("$error_budget using {}:($1 {:+g}) with points pt 6 ps 0.8 lw 1.5 lc rgb '{}' {}", column, at,
                       kTruthColour, title);
  };
  plot.commands +=
      plot_command({bars(2, 0.36, 0.02, kOdometryColour, fmt::format("range at {:g} m", error_budget.range_m)),
                    bars(4, -0.02, -0.36, kFixColour, "position"), marks(3, 0.19, "title 'Monte Carlo'"),
                    marks(5, -0.19, "notitle")});

  Figure figure{"error_budget", "", "The error budget", "", ""};
  figure.caption = fmt::format(
      "Error that each source adds if it is wrong by the standard deviation beside its name. Bars: linear "
      "propagation; circles: {} draws each. Values below {:g} mm are not drawn.",
      error_budget.draws, kLeastDrawn_mm);
  return drawn(drawing, std::move(figure), std::move(plot));
}

}  // namespace twocone::report
