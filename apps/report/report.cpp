// SPDX-License-Identifier: Apache-2.0
#include "apps/report/report.h"

#include <stdexcept>

#include <fmt/format.h>

#include "apps/report/figures/figures.h"
#include "apps/report/kit/plan.h"
#include "apps/report/page/page.h"
#include "apps/report/table.h"

namespace twocone::report {
namespace {

constexpr int kBrowsedFrames = 12;

void check(const runlog::RunData& run, const ReportSettings& settings) {
  std::string bad;
  for (const auto& [name, value] : {std::pair{"error_budget_draws", settings.error_budget_draws},
                                    {"error_budget_pose_step", settings.error_budget_pose_step}}) {
    if (value < 1) bad += fmt::format("\n  {} is {}, must be >= 1", name, value);
  }
  std::error_code ignored;
  if (!std::filesystem::is_directory(run.folder, ignored)) {
    bad += fmt::format("\n  folder is '{}', must be a run's folder", run.folder.string());
  }
  if (!bad.empty()) throw std::invalid_argument("write_report:" + bad);
}

void append(std::vector<Figure>& figures, std::optional<Figure> figure) {
  if (figure) figures.push_back(*std::move(figure));
}

}  // namespace

Result<ReportResult> write_report(const runlog::RunData& run, const ReportSettings& settings) {
  check(run, settings);
  ReportResult result;
  result.html = run.folder / "report.html";
  const Gnuplot gnuplot{settings.gnuplot, run.folder / "figures"};
  settings.progress(0);
  if (const Status ready = gnuplot.prepare(); !ready) return ready.error();

  const runlog::Summary summary = runlog::summarise(run);
  const std::optional<runlog::Summary> baseline = baseline_of(run, result.notes);
  const Drawing drawing{{gnuplot, result.notes}, run, summary};

  FigureGroup paths{"paths", "Trajectories"};
  settings.progress(0.05);
  paths.figures.push_back(draw_trajectory(drawing, overhead_image(drawing, run.map, "Figure 7 is")));
  settings.progress(0.35);
  if (run.truth.empty())
    result.notes.emplace_back("There is no ground truth, so there is no figure of the position error.");
  paths.figures.push_back(draw_paths(drawing));
  append(paths.figures, draw_position_error(drawing));

  settings.progress(0.45);
  const FigureGroup ranges{"range-figures", "Ranges frame by frame", draw_ranges(drawing)};

  FigureGroup bounded{"bounds", "Errors beside their bounds"};
  append(bounded.figures, draw_error_and_bound(drawing));
  append(bounded.figures, draw_normalised_errors(drawing));

  settings.progress(0.6);
  const RunErrorBudget run_error_budget =
      error_budget_of(run, settings.error_budget_draws, settings.error_budget_pose_step);
  FigureGroup budgeted{"error-budget", "The error budget", {}, error_budget_table(run_error_budget)};
  append(budgeted.figures, draw_error_budget(drawing, run_error_budget.error_budget));

  FigureGroup rig{"rig", "The rig"};
  settings.progress(0.65);
  rig.figures.push_back(draw_geometry(drawing));
  append(rig.figures, draw_resolution(drawing));

  FigureGroup views{"views", "Images of the mirrors"};
  settings.progress(0.75);
  append(views.figures, draw_superimposed(drawing));
  append(views.figures, draw_strips(drawing));
  PageContent content{run,
                      summary,
                      baseline ? &*baseline : nullptr,
                      {paths, ranges, bounded, budgeted, rig, views},
                      frame_views(run, kBrowsedFrames),
                      result.notes};

  settings.progress(0.95);
  if (const Status written = write_file(result.html, page(content)); !written) return written.error();
  settings.progress(1);
  return result;
}

}  // namespace twocone::report
