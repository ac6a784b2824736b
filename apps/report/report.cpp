// SPDX-License-Identifier: Apache-2.0
#include "apps/report/report.h"

#include <stdexcept>

#include <fmt/format.h>

#include "apps/files/file_error.h"
#include "apps/report/figures/path_figures.h"
#include "apps/report/figures/plan.h"
#include "apps/report/figures/range_figures.h"
#include "apps/report/figures/rig_figures.h"
#include "apps/report/figures/view_figures.h"
#include "apps/report/page/page.h"

namespace twocone::report {
namespace {

constexpr int kBrowsedFrames = 12;

void check(const runs::RunData& run, const ReportSettings& settings) {
  std::string bad;
  if (settings.gnuplot_timeout.count() <= 0) {
    bad += fmt::format("\n  gnuplot_timeout is {} ms, must be > 0 ms", settings.gnuplot_timeout.count());
  }
  std::error_code ignored;
  if (!std::filesystem::is_directory(run.folder, ignored)) {
    bad += fmt::format("\n  folder is '{}', must be a run's folder", run.folder.string());
  }
  if (!bad.empty()) throw std::invalid_argument("write_report:" + bad);
}

/// The same frames by method `paper`, if they were measured by it too.
std::optional<runs::Summary> read_baseline(const runs::RunData& run, std::vector<std::string>& notes) {
  std::error_code ignored;
  if (run.method == "paper" || !std::filesystem::is_directory(run.folder / "methods" / "paper", ignored))
    return std::nullopt;
  try {
    return runs::summarise(runs::read_run(run.folder, "paper"));
  } catch (const files::FileError& error) {
    notes.push_back(fmt::format("The baseline, method paper, cannot be read: {}", error.what()));
    return std::nullopt;
  }
}

std::optional<cv::Mat> find_overhead(const Drawing& drawing, const ReportSettings& settings) {
  if (!settings.overhead) return std::nullopt;
  Result<cv::Mat> picture = overhead_picture(drawing.run.map, drawing.folder / "overhead.png", settings.render);
  if (picture) return std::move(*picture);
  drawing.notes.push_back(
      fmt::format("Figure 7 is drawn over a plan, not a picture of the arena from above: {}", picture.error().message));
  return std::nullopt;
}

template <typename Item>
void append(std::vector<Item>& list, std::optional<Item> item) {
  if (item) list.push_back(std::move(*item));
}

}  // namespace

Result<ReportResult> write_report(const runs::RunData& run, const ReportSettings& settings) {
  check(run, settings);
  const auto tell = [&](double fraction, std::string_view next) {
    if (settings.progress) settings.progress(fraction, next);
  };
  ReportResult result;
  result.html = run.folder / "report.html";
  const std::filesystem::path folder = run.folder / "figures";
  const Gnuplot gnuplot(settings.gnuplot, folder, settings.gnuplot_timeout);
  tell(0, "looking for gnuplot");
  if (const Status there = gnuplot.check(); !there) return there.error();
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) return Error{ErrorCode::kUnavailable, fmt::format("cannot make {}: {}", folder.string(), error.message())};

  const runs::Summary summary = runs::summarise(run);
  const std::optional<runs::Summary> baseline = read_baseline(run, result.notes);
  const Drawing drawing{run, summary, gnuplot, folder, result.notes};

  FigureGroup paths{"paths", "Trajectories", "", {}};
  tell(0.05, "the arena from above");
  paths.figures.push_back(draw_trajectory(drawing, find_overhead(drawing, settings)));
  tell(0.35, "positions");
  if (run.truth.empty()) result.notes.emplace_back("There is no ground truth, so no figure of the position's error.");
  paths.figures.push_back(draw_paths(drawing));
  append(paths.figures, draw_position_error(drawing));

  FigureGroup ranges{"range-figures", "Range by range", "", {}};
  tell(0.45, "ranges");
  ranges.figures = draw_ranges(drawing);

  FigureGroup rig{"rig", "The rig", "", {}};
  tell(0.65, "the rig");
  rig.figures.push_back(draw_geometry(drawing));
  append(rig.figures, draw_resolution(drawing));

  FigureGroup views{"views", "What the mirrors saw", "", {}};
  tell(0.75, "views");
  append(views.figures, draw_superimposed(drawing));
  append(views.figures, draw_strips(drawing));
  PageContent content{run,
                      summary,
                      baseline ? &*baseline : nullptr,
                      {paths, ranges, rig, views},
                      frame_views(run, kBrowsedFrames),
                      result.notes};

  tell(0.95, "the page");
  if (const Status written = write_file(result.html, page(content)); !written) return written.error();
  tell(1, "done");
  return result;
}

}  // namespace twocone::report
