// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

#include "apps/error_budget/error_budget.h"
#include "apps/report/kit/figure.h"
#include "apps/runlog/run_data.h"
#include "apps/runlog/summary/summary.h"

/// The figures, the tables and the page of a run's report, and their data. Private to apps/report.
namespace twocone::report {

/// The run that the figures of a report show, and the tools that draw them.
struct Drawing : DrawingTools {
  const runlog::RunData& run;
  const runlog::Summary& summary;
};

// "Returns nothing": the figure has no SVG, because the run has no data for it.

/// Draws figure 7: the true trajectory (without ground truth that of odometry, without odometry the estimate) over
/// `overhead`, an image of the arena from above (CV_8UC3 b g r, covering the map's bounds), or else over its plan.
Figure draw_trajectory(const Drawing& drawing, const std::optional<Image>& overhead);

/// Draws figure 17: the position error and the error of odometry against the frame number. Returns nothing without
/// truth.
Figure draw_position_error(const Drawing& drawing);

/// Draws figure 18: the true trajectory, the calculated one, and that of odometry.
Figure draw_paths(const Drawing& drawing);

/// Draws figures 11 to 16 of the paper: for each landmark of the map, the true and the computed range against the frame
/// number, with the error below. A mark for each frame without a range has the colour of the reason. Landmarks with
/// names that the paper does not have get a figure too.
std::vector<Figure> draw_ranges(const Drawing& drawing);

/// Draws the position error against time, with the Cramer-Rao bound of each frame as a line: sqrt(var x + var y).
/// Returns nothing without truth or bounds.
Figure draw_error_and_bound(const Drawing& drawing);

/// Draws the distributions of the normalised errors: the range error over its sigma, and the squared position error in
/// units of its covariance. Beside them are those that correct sigmas give: standard normal, and chi-squared with two
/// degrees of freedom. Returns nothing for a method that states no sigmas.
Figure draw_normalised_errors(const Drawing& drawing);

/// The error budget of a run's robot on the path of the run. It uses every `pose_step`-th pose of the true path
/// (without truth, of the estimate; without an estimate, of the odometry). For a run without frames it uses a grid over
/// the arena. Speed and turn rate are root mean squares over the run. The noise of the outlines is the run's own if it
/// was measured.
struct RunErrorBudget {
  error_budget::ErrorBudget error_budget;
  error_budget::ErrorBudgetSettings settings;
  bool noise_measured = false;  ///< true: median of sightings.csv; false: the default of ErrorBudgetSettings
};
/// Computes the error budget of a run. @param draws,pose_step >= 1. @throws as error_budget::error_budget
RunErrorBudget error_budget_of(const runlog::RunData& run, int draws, int pose_step);

/// Returns the error budget as an HTML table with a few sentences.
std::string error_budget_table(const RunErrorBudget& run_error_budget);

/// Draws the error budget on a logarithmic axis: linear propagation as bars, and the Monte Carlo results as marks on
/// them. Returns nothing if the error budget has neither ranges nor positions.
Figure draw_error_budget(const Drawing& drawing, const error_budget::ErrorBudget& error_budget);

/// Draws figure 8: the rig from the side, to scale, with the region that each mirror sees and the region that both see.
Figure draw_geometry(const Drawing& drawing);

/// Draws the change of range for one pixel of disparity (range_per_pixel_m) against the range, with the errors of this
/// run. Returns nothing for cones that are not right-angled.
Figure draw_resolution(const Drawing& drawing);

/// Draws figure 9 for the frame with the most ranges: the upper mirror's image on the lower one's, with circles around
/// the matches of the paper's method. Without images, it returns nothing and adds a note.
Figure draw_superimposed(const Drawing& drawing);

/// Draws both mirrors' images unrolled for three frames of the run, one above the other on the same axis of bearings.
/// Each landmark's name is at its measured bearing. Returns nothing without images.
Figure draw_strips(const Drawing& drawing);

/// One frame of the run for the page's slider.
struct FrameView {
  std::uint64_t frame = 0;
  double t_s = 0;
  std::string svg;
};

/// Returns at most `count` frames, evenly spaced over the run; frames without images are left out.
std::vector<FrameView> frame_views(const runlog::RunData& run, int count);

// ---- the page

/// Figures that belong together. The page leaves out figures without an SVG, and groups without figures and tables.
struct FigureGroup {
  std::string id;  ///< in the page's HTML
  std::string title;
  std::vector<Figure> figures{};
  std::string tables{};  ///< HTML, shown before the figures
};

/// Everything that the page shows.
struct PageContent {
  const runlog::RunData& run;
  const runlog::Summary& summary;
  const runlog::Summary* baseline = nullptr;  ///< of method `paper` on the same frames
  std::vector<FigureGroup> groups;
  std::vector<FrameView> frames;
  std::vector<std::string> notes;
};

/// Returns report.html: one page that needs no other file. It is UTF-8 and well-formed XML, and equal content gives
/// equal bytes.
std::string page(const PageContent& content);

// The parts of the page that describe the run in words and tables. Each function returns HTML, except headline().

/// Returns the result in one sentence, plain text.
std::string headline(const runlog::Summary& summary);

/// Returns the most important numbers, in large type.
std::string tiles(const runlog::Summary& summary);

/// Returns the criterion of success, whether the run met it, and how accurate the ground truth is.
std::string rules(const PageContent& content);

std::string range_table(const PageContent& content);
std::string coverage_table(const PageContent& content);
std::string position_table(const PageContent& content);

// ---- the data of the table, the page and the figures

/// Returns the summary of method `paper` on the same frames, if the run has one and the results in `run` are of another
/// method. If a baseline exists but cannot be read, the function adds a note.
std::optional<runlog::Summary> baseline_of(const runlog::RunData& run, std::vector<std::string>& notes);

/// Returns whether the method states sigmas or bounds of its errors are known.
bool has_bounds(const runlog::Summary& summary);

/// Returns whether the summary was made with ground truth.
bool has_truth(const runlog::Summary& summary);

/// Returns the verdicts that occur, with their counts: first `ok`, then the others by descending frequency.
std::vector<std::pair<std::string, int>> by_frequency(const std::map<std::string, int>& verdicts);

/// Returns the mean, the root mean square, the 95 % limit and the largest of the errors, in millimetres.
std::array<std::optional<double>, 4> errors_mm(const std::optional<runlog::ErrorStatistics>& error);

/// Returns the summary of the landmark called `name`; an empty one if there is none.
const runlog::LandmarkSummary& landmark_of(const runlog::Summary& summary, const std::string& name);

/// Returns rate, skew and losses of a real robot's pairs of images as text. A line may be broken between the elements.
std::vector<std::string> capture_words(const runlog::CaptureSummary& capture);

/// Returns the times of vision and localisation, as capture_words(). They hold for one machine and one run on it.
std::vector<std::string> timing_words(const runlog::TimingSummary& timing);

/// Returns the colour of a verdict, the same in every figure and table.
std::string verdict_colour(std::string_view verdict);

/// Returns what a verdict of that method means, in plain words; empty for an unknown verdict.
std::string_view verdict_meaning(std::string_view verdict, std::string_view method);

constexpr double kMmPerM = 1000;

/// Returns the first and the last frame number, widened because the axis of a single frame would have no width.
std::pair<double, double> frame_span(const runlog::RunData& run);

/// Returns the distance of odometry from truth at each frame, in metres; nothing where either is missing.
std::vector<std::optional<double>> odometry_errors_m(const runlog::RunData& run);

/// Returns the ranges to one landmark, in the order of the run.
std::vector<const runlog::RangeRow*> rows_of(const runlog::RunData& run, const std::string& landmark);

/// Returns the number of absolute errors beyond `limit`, the end of their axis.
std::ptrdiff_t count_beyond(const std::vector<double>& errors, double limit);

/// Adds plots of the errors of fixes from a data block. Its first column is the place on the other axis. An error is a
/// dot, or beyond `limit`, the end of the axis, a triangle at that end.
/// @param column number of the errors' column, from 1. @param is_beyond whether an error is beyond `limit`
void add_error_plots(std::string_view block, int column, double limit, bool is_beyond, std::string_view beyond_title,
                     std::vector<std::string>& plots);

}  // namespace twocone::report
