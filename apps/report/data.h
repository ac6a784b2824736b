// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "apps/error_budget/error_budget.h"
#include "apps/runlog/run_data.h"
#include "apps/runlog/summary/summary.h"

/// The data of a run's table and page. Private to apps/report.
namespace twocone::report {

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

/// Returns what the page shows of a run, except the telemetry, the error budget, the images and the notes.
nlohmann::ordered_json run_json(const runlog::RunData& run, const runlog::Summary& summary,
                                const std::optional<runlog::Summary>& baseline);

/// Returns the error budget: `lines` of `source`, `size`, and `range` and `position` with the analytic and the Monte
/// Carlo value in metres. The first line is the total.
nlohmann::ordered_json error_budget_json(const RunErrorBudget& run_error_budget);

/// Returns figure 9 for the frame with the most ranges: the upper mirror's image on the lower one's, and the matches of
/// the paper's method in pixels of this image. Without images, it returns null and adds a note.
nlohmann::ordered_json disparity_json(const runlog::RunData& run, std::vector<std::string>& notes);

/// Returns both mirrors' images unrolled for three frames of the run, with the landmarks' measured bearings and ranges.
/// A frame without images is left out.
nlohmann::ordered_json panoramas_json(const runlog::RunData& run);

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

constexpr double kMmPerM = 1000;

}  // namespace twocone::report
