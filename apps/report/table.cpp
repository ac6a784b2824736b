// SPDX-License-Identifier: Apache-2.0
#include "apps/report/report.h"

#include <algorithm>
#include <filesystem>
#include <numbers>
#include <system_error>

#include <fmt/format.h>

#include "apps/config/to_layers.h"
#include "apps/config/yaml/text_file.h"
#include "apps/estimation/method.h"
#include "apps/report/data.h"
#include "apps/report/kit/plain_text.h"
#include "apps/report/paper.h"
#include "localisation/pose_filter.h"
#include "vision/ranging.h"

namespace twocone::report {
namespace {

constexpr std::size_t kWidth = 100;
constexpr std::size_t kNameWidth = 12;
constexpr double kDegreesPerRad = 180 / std::numbers::pi;
const std::string_view kOk = to_string(vision::RangeVerdict::kOk);

std::string percent_or_dash(int part, int whole) {
  return whole > 0 ? fmt::format("{:.1f} %", 100.0 * part / whole) : "-";
}

/// Formats a number in nine columns, the first of them blank. A longer number, such as the error of a very wrong
/// answer, is written with an exponent.
std::string column(std::optional<double> value, int digits = 2) {
  if (!value) return fmt::format("{:>9}", "-");
  const std::string text = fmt::format("{:9.{}f}", *value, digits);
  return text.size() <= 9 && text.front() == ' ' ? text : fmt::format("{:9.1e}", *value);
}

std::string error_columns(const std::optional<runlog::ErrorStatistics>& error) {
  std::string text;
  for (const std::optional<double> error_mm : errors_mm(error)) text += column(error_mm);
  return text;
}

std::string baseline_columns(const std::optional<runlog::ErrorStatistics>& error) {
  const auto [mean_mm, rmse_mm, p95_mm, max_mm] = errors_mm(error);
  return " |" + column(mean_mm) + column(max_mm);
}

std::string paper_columns(double mean_mm, double max_mm) { return fmt::format(" |{:>7}{:>6}", mean_mm, max_mm); }

/// Returns the beginning of a row: a name, the number of frames that have such an answer, and their share of `whole`.
std::string row_head(std::string_view name, int frames, int whole) {
  return fmt::format("{:<{}}{:>8}{:>9}", cut(name, kNameWidth - 1), kNameWidth, frames, percent_or_dash(frames, whole));
}

/// Returns the items with a comma after each one except the last.
std::vector<std::string> listed(std::vector<std::string> items) {
  for (std::size_t i = 0; i + 1 < items.size(); ++i) items[i] += ',';
  return items;
}

/// Returns the counts by verdict, the most frequent first.
std::vector<std::string> counts(const std::map<std::string, int>& verdicts, bool with_ok) {
  std::vector<std::string> words;
  for (const auto& [verdict, count] : by_frequency(verdicts)) {
    if (with_ok || verdict != kOk) words.push_back(fmt::format("{} {}", ascii(verdict), count));
  }
  return listed(words);
}

/// Returns the numbers of frames with a position that the track did not use, by reason; empty if it used all.
std::string not_taken(const runlog::Summary& summary) {
  using localisation::FixUse;
  std::map<std::string, int> reasons = summary.track_uses;
  for (const FixUse use : {FixUse::kStarted, FixUse::kTaken, FixUse::kRelocated, FixUse::kNoFix}) {
    reasons.erase(std::string(to_string(use)));
  }
  if (reasons.empty()) return "";
  return wrapped(kWidth, "Fixes that the track did not take: ", "  ", counts(reasons, true));
}

std::string head(const runlog::Summary& summary, const runlog::RunInfo& info, const config::Robot& robot) {
  std::string text = wrapped(kWidth, "", "  ",
                             {fmt::format("twocone {},", ascii(info.version)),
                              fmt::format("commit {},", ascii(info.commit)), ascii(info.compiler)});
  text += wrapped(kWidth, "", "  ",
                  {fmt::format("robot {},", ascii(robot.name)), fmt::format("behaviour {},", ascii(info.behaviour)),
                   fmt::format("method {},", ascii(summary.method)), fmt::format("seed {}", info.seed)});
  std::vector<std::string> facts{fmt::format("{} of {} frames", summary.frames, info.frames_wanted),
                                 fmt::format("{:.2f} s", summary.duration_s)};
  if (summary.travelled_m) facts.push_back(fmt::format("{:.2f} m driven", *summary.travelled_m));
  if (summary.headings_covered_deg) {
    facts.push_back(fmt::format("headings covered: {:.0f} of 360 degrees", *summary.headings_covered_deg));
  }
  text += wrapped(kWidth, "", "  ", listed(facts));
  if (!info.finished) text += "This run was cut off: the results below are of the frames that it finished.\n";
  return text + repeat_lines(kWidth, repeat_command(info, robot, summary.method));
}

std::string device_lines(const runlog::CaptureSummary& capture, const runlog::RunInfo& info) {
  std::string text;
  for (const std::string& device : info.devices) text += wrapped(kWidth, "", "  ", {ascii(device)});
  return text + wrapped(kWidth, "", "  ", capture_words(capture));
}

std::string range_rows(const runlog::Summary& summary, bool truth, const runlog::Summary* baseline) {
  std::string text;
  for (const runlog::LandmarkSummary& landmark : summary.landmarks) {
    text += row_head(landmark.name, landmark.frames_with_range, summary.frames);
    if (truth) {
      text += error_columns(landmark.error);
      if (baseline != nullptr) text += baseline_columns(landmark_of(*baseline, landmark.name).error);
      const paper::LandmarkFigures* figures = paper::find_landmark(landmark.name);
      text += figures != nullptr ? paper_columns(figures->mean_mm, figures->max_mm) : " |";
    }
    text += "\n";
  }
  return text;
}

/// Returns the heads of the columns. @param paper adds the paper's columns
std::string column_heads(std::string_view first, bool truth, const runlog::Summary* baseline, bool paper = true) {
  std::string text = fmt::format("{:<{}}{:>8}{:>9}", first, kNameWidth, "frames", "covered");
  if (!truth) return text + "\n";
  text += fmt::format("{:>9}{:>9}{:>9}{:>9}", "mean", "rmse", "95 %", "max");
  if (baseline != nullptr) text += fmt::format(" |{:>9}{:>9}", "mean", "max");
  return text + (paper ? fmt::format(" |{:>7}{:>6}\n", "mean", "max") : "\n");
}

std::string group_heads(std::string_view what, bool truth, const runlog::Summary* baseline) {
  if (!truth) return fmt::format("{}\n", what);
  std::string text = fmt::format("{:<65}", fmt::format("{}, error in mm", what));
  if (baseline != nullptr) text += fmt::format(" | {:<17}", "method paper");
  return text + " | the paper\n";
}

std::string why_not(const runlog::Summary& summary) {
  std::string text;
  for (const runlog::LandmarkSummary& landmark : summary.landmarks) {
    const std::vector<std::string> words = counts(landmark.verdicts, false);
    if (!words.empty()) {
      text += wrapped(kWidth, fmt::format("  {:<{}}", cut(landmark.name, kNameWidth - 1), kNameWidth),
                      std::string(16, ' '), words);
    }
  }
  return text.empty() ? "Every frame has a range to every landmark.\n"
                      : "Frames by verdict, where it is not ok:\n" + text;
}

/// Returns the names of the landmarks that were searched for if the robot file restricts the search. Any other landmark
/// has the verdict `not_seen` because it was not searched for.
std::string searched_for(const config::Robot& robot) {
  std::vector<std::string> words;
  for (const std::string& name : robot.estimator.landmarks) words.push_back(cut(name, kNameWidth));
  return words.empty() ? "" : wrapped(kWidth, "Only these landmarks were searched for: ", "  ", listed(words));
}

std::string heading_row(std::string_view name, const std::optional<runlog::ErrorStatistics>& error, int frames) {
  if (!error) return "";
  return fmt::format("{}{:9.4f}{:9.4f}{:9.4f}{:9.4f}\n", row_head(name, error->count, frames),
                     error->mean * kDegreesPerRad, error->rmse * kDegreesPerRad, error->p95 * kDegreesPerRad,
                     error->max * kDegreesPerRad);
}

std::string headings(const runlog::Summary& summary) {
  if (!summary.heading_error && !summary.estimate_heading_error) return "";
  return std::string("Heading, error in degrees\n") + column_heads("", true, nullptr, false) +
         heading_row("fix", summary.heading_error, summary.frames) +
         heading_row("estimate", summary.estimate_heading_error, summary.frames) + "\n";
}

std::string share_within(const std::optional<runlog::Share>& share) {
  return share ? fmt::format("{:>9} of {}", percent_or_dash(share->held, share->count), share->count)
               : fmt::format("{:>9}", "-");
}

/// Returns a row of the table of bounds.
/// @param digits decimals of the errors. @param scale factor from the comparison's unit to the table's
std::string bound_row(std::string_view name, const std::optional<runlog::BoundComparison>& bound, int digits,
                      double scale) {
  std::string text = fmt::format("{:<{}}{:>8}", name, kNameWidth, bound ? bound->count : 0);
  if (!bound) return text + column({}) + column({}) + column({});
  text += column(bound->rmse ? std::optional(*bound->rmse * scale) : std::nullopt, digits);
  return text + column(bound->bound_rms * scale, digits) + column(bound->ratio());
}

std::string bounds(const runlog::Summary& summary) {
  if (!has_bounds(summary)) return "";
  std::string text =
      fmt::format("Beside the Cramer-Rao bound, mm (heading: degrees)\n{:<{}}{:>8}{:>9}{:>9}{:>9}{:>9}\n", "",
                  kNameWidth, "frames", "rmse", "bound", "ratio", "95 %");
  for (const runlog::LandmarkSummary& landmark : summary.landmarks) {
    text += bound_row(cut(landmark.name, kNameWidth - 1), landmark.range_bound_m, 2, kMmPerM);
    text += share_within(landmark.within_95) + "\n";
  }
  text += bound_row("position", summary.position_bound_m, 2, kMmPerM) + share_within(summary.in_ellipse_95) + "\n";
  if (summary.heading_bound_rad) text += bound_row("heading", summary.heading_bound_rad, 4, kDegreesPerRad) + "\n";
  if (summary.whole_position_bound_m) {
    text += "The same with the sigmas of map and rig:\n";
    text += bound_row("position", summary.whole_position_bound_m, 2, kMmPerM) + "\n";
    if (summary.whole_heading_bound_rad) {
      text += bound_row("heading", summary.whole_heading_bound_rad, 4, kDegreesPerRad) + "\n";
    }
  }
  return text + "95 %: answers whose own 1.96 sigma (position: 95 % ellipse) contains the truth; ideally 95 %.\n\n";
}

std::string outliers(const runlog::Summary& summary) {
  std::vector<std::string> words;
  for (const runlog::LandmarkSummary& landmark : summary.landmarks) {
    if (landmark.outliers > 0) words.push_back(fmt::format("{} {}", cut(landmark.name, kNameWidth), landmark.outliers));
  }
  if (!words.empty()) return wrapped(kWidth, "Left out of fixes as outliers, in frames: ", "  ", listed(words));
  return has_bounds(summary) ? "No measurement was left out of a fix as an outlier.\n" : "";
}

}  // namespace

bool has_bounds(const runlog::Summary& summary) {
  return summary.position_bound_m || summary.in_ellipse_95 ||
         std::ranges::any_of(summary.landmarks, [](const auto& l) { return l.range_bound_m || l.within_95; });
}

std::optional<runlog::Summary> baseline_of(const runlog::RunData& run, std::vector<std::string>& notes) {
  const std::string paper(to_string(estimation::Method::kPaper));
  std::error_code ignored;
  if (run.method == paper || !std::filesystem::is_directory(run.folder / "methods" / paper, ignored)) {
    return std::nullopt;
  }
  try {
    return runlog::summarise(runlog::read_run(run.folder, paper));
  } catch (const config::FileError& error) {
    notes.push_back(fmt::format("The baseline, method paper, cannot be read: {}", error.what()));
    return std::nullopt;
  }
}

std::string table_of(const runlog::RunData& run, std::vector<std::string>& notes) {
  const std::optional<runlog::Summary> baseline = baseline_of(run, notes);
  if (run.method == to_string(estimation::Method::kOutline)) {
    if (std::string note = config::ruler_note(run.robot, run.map); !note.empty()) notes.push_back(std::move(note));
  }
  const std::optional<runlog::TimingSummary> timing = runlog::summarise_timing(run);
  return table(runlog::summarise(run), run.info, run.robot, baseline ? &*baseline : nullptr,
               timing ? &*timing : nullptr);
}

bool has_truth(const runlog::Summary& summary) {
  return summary.travelled_m || summary.fix_error || summary.odometry_error ||
         std::ranges::any_of(summary.landmarks, [](const auto& landmark) { return landmark.error.has_value(); });
}

std::vector<std::pair<std::string, int>> by_frequency(const std::map<std::string, int>& verdicts) {
  std::vector<std::pair<std::string, int>> sorted;
  for (const auto& [verdict, count] : verdicts) {
    if (count > 0) sorted.emplace_back(verdict, count);
  }
  std::stable_sort(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) {
    return (a.first == kOk) != (b.first == kOk) ? a.first == kOk : a.second > b.second;
  });
  return sorted;
}

std::array<std::optional<double>, 4> errors_mm(const std::optional<runlog::ErrorStatistics>& error) {
  if (!error) return {};
  return {error->mean * kMmPerM, error->rmse * kMmPerM, error->p95 * kMmPerM, error->max * kMmPerM};
}

const runlog::LandmarkSummary& landmark_of(const runlog::Summary& summary, const std::string& name) {
  static const runlog::LandmarkSummary none;
  const auto found = std::ranges::find(summary.landmarks, name, &runlog::LandmarkSummary::name);
  return found == summary.landmarks.end() ? none : *found;
}

std::vector<std::string> capture_words(const runlog::CaptureSummary& capture) {
  return {fmt::format("pairs: {:.4g} a second,", capture.rate_hz),
          fmt::format("95 % of the periods within {:.1f} ms of the median;", capture.jitter_p95_s * 1e3),
          fmt::format("skew {:.1f} ms in the median,", capture.skew_median_s * 1e3),
          fmt::format("{:.1f} ms at most;", capture.skew_max_s * 1e3),
          fmt::format("lost: lower {}, upper {},", capture.lower_lost, capture.upper_lost),
          fmt::format("of these skipped for newer ones: {}, {};", capture.counts.lower_skipped,
                      capture.counts.upper_skipped),
          fmt::format("without a partner: {};", capture.counts.unpaired),
          fmt::format("cameras reconnected: {}", capture.counts.recoveries)};
}

std::vector<std::string> timing_words(const runlog::TimingSummary& timing) {
  const auto ms = [](double seconds) { return fmt::format("{:.2f} ms", seconds * 1e3); };
  std::vector<std::string> words{fmt::format("vision median {},", ms(timing.vision_median_s)),
                                 fmt::format("localisation median {},", ms(timing.localisation_median_s)),
                                 fmt::format("95 % of both together within {};", ms(timing.both_p95_s))};
  if (timing.refined_mean) {
    words.push_back(fmt::format("refined {:.2f} landmarks of {} on average;", *timing.refined_mean, timing.landmarks));
  }
  if (timing.budget_s) {
    words.push_back(fmt::format("time budget of {:.4g} ms kept in {} of {} frames;", *timing.budget_s * 1e3,
                                timing.kept, timing.frames));
  }
  words.back().pop_back();
  return words;
}

std::string repeat_command(const runlog::RunInfo& info, const config::Robot& robot, const std::string& method) {
  if (info.behaviour == runlog::kImported) {
    std::string import;
    for (const std::string& word : info.import_options) import += " " + shell_word(word);
    // Runs of older versions do not contain their import options.
    if (!import.empty()) import = fmt::format("twocone import{} --out RUN && ", import);
    return fmt::format("{}twocone localise RUN --method {}", import, shell_word(method));
  }
  // What a person did cannot be repeated, what was seen can.
  if (info.behaviour == "manual" || info.behaviour == "controller")
    return fmt::format("twocone localise RUN --method {}", shell_word(method));
  // The time budget comes from the file or from the command line. A repeated command may name both, because they are
  // equal. With twelve digits, the command's value divided by 1000 gives the same number again.
  using estimation::Method;
  const Method with_stages = method == to_string(Method::kPaper) ? Method::kPaper : Method::kOutline;
  const auto budget_s = estimation::time_limit_of(with_stages, robot);
  const std::string time_budget = budget_s ? fmt::format(" --budget-ms {:.12g}", *budget_s * 1e3) : "";
  const std::string renderer =
      info.renderer.empty() ? "" : " --renderer " + info.renderer.substr(0, info.renderer.find(' '));
  return fmt::format("twocone run {} --behaviour {} --frames {} --method {}{}{} --seed {}{}{}{}", robot_options(robot),
                     shell_word(info.behaviour), info.frames_wanted, shell_word(method), time_budget, renderer,
                     info.seed, info.truth ? " --truth" : "", info.real_time ? " --real-time" : "",
                     info.maps ? " --landmarks none" : "");
}

std::string table(const runlog::Summary& summary, const runlog::RunInfo& info, const config::Robot& robot,
                  const runlog::Summary* baseline, const runlog::TimingSummary* timing) {
  const bool truth = has_truth(summary);
  std::string text = head(summary, info, robot) + "\n";
  if (summary.capture) text += device_lines(*summary.capture, info) + "\n";

  text += group_heads("Range to each landmark", truth, baseline) + column_heads("landmark", truth, baseline);
  text += range_rows(summary, truth, baseline) + why_not(summary) + searched_for(robot) + "\n";

  text += group_heads("Position", truth, baseline) + column_heads("", truth, baseline);
  text += row_head("fix", summary.frames_with_fix, summary.frames);
  if (truth) {
    text += error_columns(summary.fix_error);
    if (baseline != nullptr) text += baseline_columns(baseline->fix_error);
    text += paper_columns(paper::kPositionMean_mm, paper::kPositionWithin_mm) + "\n";
    if (const auto& error = summary.estimate_error) {
      text += row_head("estimate", error->count, summary.frames) + error_columns(error);
      if (baseline != nullptr) text += baseline_columns(baseline->estimate_error);
      text += "\n";
    }
    const auto& odometry = summary.odometry_error;
    text += row_head("odometry", odometry ? odometry->count : 0, summary.frames) + error_columns(odometry);
  }
  text += "\n";
  text += wrapped(kWidth, "Frames by verdict: ", "  ", counts(summary.fix_verdicts, true)) + outliers(summary) +
          not_taken(summary);
  if (timing != nullptr) text += wrapped(kWidth, "Time per frame: ", "  ", timing_words(*timing));
  text += "\n" + headings(summary) + bounds(summary);
  text += truth ? "Every frame with an answer counts. The paper's rig and room differ from this one's, so its numbers\n"
                  "serve for comparison only. Its maximum of the position is its \"to within 130 mm\".\n"
                : "There is no ground truth (a real room), so no errors are reported.\n";
  return text;
}

}  // namespace twocone::report
