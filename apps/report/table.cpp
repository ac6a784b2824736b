// SPDX-License-Identifier: Apache-2.0
#include "apps/report/table.h"

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <numbers>
#include <system_error>

#include <fmt/format.h>

#include "apps/files/file_error.h"
#include "apps/report/paper_figures.h"
#include "apps/report/plain_text.h"
#include "localisation/pose_filter.h"

namespace twocone::report {
namespace {

constexpr std::size_t kWidth = 100;
constexpr std::size_t kNameWidth = 12;
constexpr double kMmPerM = 1000;
constexpr double kDegreesPerRad = 180 / std::numbers::pi;

std::string percent(int part, int whole) { return whole > 0 ? fmt::format("{:.1f} %", 100.0 * part / whole) : "-"; }

/// In nine columns, a blank among them: what is too long for that, as a wild answer's error is, in powers of ten.
std::string column(double value, int digits = 2) {
  const std::string text = fmt::format("{:9.{}f}", value, digits);
  return text.size() <= 9 && text.front() == ' ' ? text : fmt::format("{:9.1e}", value);
}

std::string error_columns(const std::optional<runs::ErrorStatistics>& error) {
  if (!error) return fmt::format("{:>9}{:>9}{:>9}{:>9}", "-", "-", "-", "-");
  return column(error->mean_m * kMmPerM) + column(error->rmse_m * kMmPerM) + column(error->p95_m * kMmPerM) +
         column(error->max_m * kMmPerM);
}

std::string baseline_columns(const std::optional<runs::ErrorStatistics>& error) {
  if (!error) return fmt::format(" |{:>9}{:>9}", "-", "-");
  return " |" + column(error->mean_m * kMmPerM) + column(error->max_m * kMmPerM);
}

std::string paper_columns(std::optional<double> mean_mm, std::optional<double> max_mm) {
  if (!mean_mm) return " |";
  return fmt::format(" |{:>7}{:>6}", *mean_mm, *max_mm);
}

/// `ok` first, then the most frequent reason.
std::vector<std::string> counts(const std::map<std::string, int>& verdicts, bool with_ok) {
  std::vector<std::pair<std::string, int>> sorted(verdicts.begin(), verdicts.end());
  std::stable_sort(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) {
    return (a.first == "ok") != (b.first == "ok") ? a.first == "ok" : a.second > b.second;
  });
  std::vector<std::string> words;
  for (const auto& [verdict, count] : sorted) {
    if (count > 0 && (with_ok || verdict != "ok")) words.push_back(fmt::format("{} {},", ascii(verdict), count));
  }
  if (!words.empty()) words.back().pop_back();
  return words;
}

/// Frames with a position that the track left alone, by reason; nothing where it took all.
std::string not_taken(const runs::Summary& summary) {
  using localisation::FixUse;
  std::map<std::string, int> reasons = summary.track_uses;
  for (const FixUse use : {FixUse::kStarted, FixUse::kTaken, FixUse::kRelocated, FixUse::kNoFix}) {
    reasons.erase(std::string(to_string(use)));
  }
  if (reasons.empty()) return "";
  return wrapped(kWidth, "Fixes that the track did not take: ", "  ", counts(reasons, true));
}

std::string head(const runs::Summary& summary, const runs::RunInfo& info, const files::Robot& robot) {
  std::string text = wrapped(kWidth, "", "  ",
                             {fmt::format("twocone {},", ascii(info.version)),
                              fmt::format("commit {},", ascii(info.commit)), ascii(info.compiler)});
  text += wrapped(kWidth, "", "  ",
                  {fmt::format("robot {},", ascii(robot.name)), fmt::format("behaviour {},", ascii(info.behaviour)),
                   fmt::format("method {},", ascii(summary.method)), fmt::format("seed {}", info.seed)});
  std::vector<std::string> facts{fmt::format("{} of {} frames,", summary.frames, info.frames_wanted),
                                 fmt::format("{:.2f} s,", summary.duration_s)};
  if (summary.travelled_m) facts.push_back(fmt::format("{:.2f} m driven,", *summary.travelled_m));
  if (summary.headings_covered_deg) {
    facts.push_back(fmt::format("headings covered: {:.0f} of 360 degrees,", *summary.headings_covered_deg));
  }
  facts.back().pop_back();
  text += wrapped(kWidth, "", "  ", facts);
  if (!info.finished) text += "This run was cut off: what follows is of the frames that it finished.\n";

  std::vector<std::string> words;
  std::string command = repeat_command(info, robot, summary.method);
  for (std::size_t at = command.find(" --"); at != std::string::npos; at = command.find(" --")) {
    words.push_back(command.substr(0, at));
    command = command.substr(at + 1);
  }
  words.push_back(command);
  return text + wrapped(kWidth, "repeat: ", "          ", words, " \\");
}

std::string device_lines(const runs::CaptureSummary& capture, const runs::RunInfo& info) {
  std::string text;
  for (const std::string& device : info.devices) text += wrapped(kWidth, "", "  ", {ascii(device)});
  return text + wrapped(kWidth, "", "  ", capture_words(capture));
}

std::string range_rows(const runs::Summary& summary, bool truth, const runs::Summary* baseline) {
  std::string text;
  for (const runs::LandmarkSummary& landmark : summary.landmarks) {
    const int seen = landmark.frames_with_range;
    text += fmt::format("{:<{}}{:>8}{:>9}", cut(landmark.name, kNameWidth - 1), kNameWidth, seen,
                        percent(seen, summary.frames));
    if (truth) {
      text += error_columns(landmark.error);
      if (baseline != nullptr) {
        const runs::LandmarkSummary* other = find_landmark(baseline, landmark.name);
        text += baseline_columns(other != nullptr ? other->error : std::nullopt);
      }
      const paper::PillarFigures* figures = paper::find_pillar(landmark.name);
      text += figures != nullptr ? paper_columns(figures->mean_mm, figures->max_mm) : paper_columns({}, {});
    }
    text += "\n";
  }
  return text;
}

/// @param paper with the paper's columns
std::string column_heads(std::string_view first, bool truth, const runs::Summary* baseline, bool paper = true) {
  std::string text = fmt::format("{:<{}}{:>8}{:>9}", first, kNameWidth, "frames", "covered");
  if (!truth) return text + "\n";
  text += fmt::format("{:>9}{:>9}{:>9}{:>9}", "mean", "rmse", "95 %", "max");
  if (baseline != nullptr) text += fmt::format(" |{:>9}{:>9}", "mean", "max");
  return text + (paper ? fmt::format(" |{:>7}{:>6}\n", "mean", "max") : "\n");
}

std::string group_heads(std::string_view what, bool truth, const runs::Summary* baseline) {
  if (!truth) return fmt::format("{}\n", what);
  std::string text = fmt::format("{:<65}", fmt::format("{}, error in mm", what));
  if (baseline != nullptr) text += fmt::format(" | {:<17}", "method paper");
  return text + " | the paper\n";
}

std::string why_not(const runs::Summary& summary) {
  std::string text;
  for (const runs::LandmarkSummary& landmark : summary.landmarks) {
    const std::vector<std::string> words = counts(landmark.verdicts, false);
    if (!words.empty()) {
      text += wrapped(kWidth, fmt::format("  {:<{}}", cut(landmark.name, kNameWidth - 1), kNameWidth),
                      std::string(16, ' '), words);
    }
  }
  return text.empty() ? "Every frame has a range to every pillar.\n"
                      : "Frames by verdict, where it is not ok:\n" + text;
}

/// Where the robot file restricts the method: of the other landmarks `not_seen` means that nobody looked.
std::string looked_for(const files::Robot& robot) {
  std::vector<std::string> words;
  for (const std::string& name : robot.estimator.landmarks) words.push_back(cut(name, kNameWidth) + ",");
  if (words.empty()) return "";
  words.back().pop_back();
  return wrapped(kWidth, "Looked for were only: ", "  ", words);
}

std::string heading_row(std::string_view name, const std::optional<runs::AngleStatistics>& error, int frames) {
  if (!error) return "";
  return fmt::format("{:<{}}{:>8}{:>9}{:9.4f}{:9.4f}{:9.4f}{:9.4f}\n", name, kNameWidth, error->count,
                     percent(error->count, frames), error->mean_rad * kDegreesPerRad, error->rmse_rad * kDegreesPerRad,
                     error->p95_rad * kDegreesPerRad, error->max_rad * kDegreesPerRad);
}

std::string headings(const runs::Summary& summary) {
  if (!summary.heading_error && !summary.estimate_heading_error) return "";
  return std::string("Heading, error in degrees\n") + column_heads("", true, nullptr, false) +
         heading_row("fix", summary.heading_error, summary.frames) +
         heading_row("estimate", summary.estimate_heading_error, summary.frames) + "\n";
}

std::string hold(const std::optional<runs::Share>& share) {
  return share ? fmt::format("{:>9} of {}", percent(share->held, share->count), share->count)
               : fmt::format("{:>9}", "-");
}

/// @param digits after the point, of the errors. @param scale from the comparison's unit to the table's
std::string bound_row(std::string_view name, const std::optional<runs::BoundComparison>& bound, int digits,
                      double scale) {
  if (!bound) return fmt::format("{:<{}}{:>8}{:>9}{:>9}{:>9}", name, kNameWidth, 0, "-", "-", "-");
  std::string text = fmt::format("{:<{}}{:>8}", name, kNameWidth, bound->count);
  text += bound->rmse ? column(*bound->rmse * scale, digits) : fmt::format("{:>9}", "-");
  text += column(bound->bound_rms * scale, digits);
  return text + (bound->rmse ? column(*bound->ratio()) : fmt::format("{:>9}", "-"));
}

std::string bounds(const runs::Summary& summary) {
  if (!has_bounds(summary)) return "";
  std::string text =
      fmt::format("Beside the Cramer-Rao bound, mm (heading: degrees)\n{:<{}}{:>8}{:>9}{:>9}{:>9}{:>9}\n", "",
                  kNameWidth, "frames", "rmse", "bound", "ratio", "95 %");
  for (const runs::LandmarkSummary& landmark : summary.landmarks) {
    text += bound_row(cut(landmark.name, kNameWidth - 1), landmark.range_bound_m, 2, kMmPerM);
    text += hold(landmark.within_95) + "\n";
  }
  text += bound_row("position", summary.position_bound_m, 2, kMmPerM) + hold(summary.in_ellipse_95) + "\n";
  if (summary.heading_bound_rad) text += bound_row("heading", summary.heading_bound_rad, 4, kDegreesPerRad) + "\n";
  return text + "95 %: answers whose own 1.96 sigma (position: 95 % ellipse) holds the truth; it should be 95 %.\n\n";
}

std::string outliers(const runs::Summary& summary) {
  std::vector<std::string> words;
  for (const runs::LandmarkSummary& landmark : summary.landmarks) {
    if (landmark.outliers > 0)
      words.push_back(fmt::format("{} {},", cut(landmark.name, kNameWidth), landmark.outliers));
  }
  if (!words.empty()) {
    words.back().pop_back();
    return wrapped(kWidth, "Left out of fixes as outliers, in frames: ", "  ", words);
  }
  return has_bounds(summary) ? "No measurement was left out of a fix as an outlier.\n" : "";
}

}  // namespace

bool has_bounds(const runs::Summary& summary) {
  return summary.position_bound_m || summary.in_ellipse_95 ||
         std::any_of(summary.landmarks.begin(), summary.landmarks.end(), [](const runs::LandmarkSummary& landmark) {
           return landmark.range_bound_m || landmark.within_95;
         });
}

std::optional<runs::Summary> baseline_of(const runs::RunData& run, std::vector<std::string>& notes) {
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

std::string table_of(const runs::RunData& run, std::vector<std::string>& notes) {
  const std::optional<runs::Summary> baseline = baseline_of(run, notes);
  const std::optional<runs::EffortSummary> effort = runs::summarise_effort(run);
  return table(runs::summarise(run), run.info, run.robot, baseline ? &*baseline : nullptr, effort ? &*effort : nullptr);
}

bool has_truth(const runs::Summary& summary) {
  return summary.travelled_m || summary.fix_error || summary.odometry_error ||
         std::any_of(summary.landmarks.begin(), summary.landmarks.end(),
                     [](const runs::LandmarkSummary& landmark) { return landmark.error.has_value(); });
}

int count_of(const std::map<std::string, int>& verdicts, const std::string& verdict) {
  const auto found = verdicts.find(verdict);
  return found == verdicts.end() ? 0 : found->second;
}

const runs::LandmarkSummary* find_landmark(const runs::Summary* summary, const std::string& name) {
  if (summary == nullptr) return nullptr;
  const auto found = std::find_if(summary->landmarks.begin(), summary->landmarks.end(),
                                  [&](const runs::LandmarkSummary& landmark) { return landmark.name == name; });
  return found == summary->landmarks.end() ? nullptr : &*found;
}

std::vector<std::string> capture_words(const runs::CaptureSummary& capture) {
  return {fmt::format("pairs: {:.4g} a second,", capture.rate_hz),
          fmt::format("95 % within {:.1f} ms of it;", capture.jitter_p95_s * 1e3),
          fmt::format("skew {:.1f} ms in the median,", capture.skew_median_s * 1e3),
          fmt::format("{:.1f} ms at most;", capture.skew_max_s * 1e3),
          fmt::format("lost: lower {}, upper {},", capture.lower_lost, capture.upper_lost),
          fmt::format("of these passed over for newer ones: {}, {};", capture.counts.lower_skipped,
                      capture.counts.upper_skipped),
          fmt::format("without a partner: {};", capture.counts.unpaired),
          fmt::format("cameras that went away and came back: {}", capture.counts.recoveries)};
}

std::vector<std::string> effort_words(const runs::EffortSummary& effort) {
  const auto ms = [](double seconds) { return fmt::format("{:.2f} ms", seconds * 1e3); };
  std::vector<std::string> words{fmt::format("vision median {},", ms(effort.vision_median_s)),
                                 fmt::format("localisation median {},", ms(effort.localisation_median_s)),
                                 fmt::format("95 % of both together within {};", ms(effort.both_p95_s))};
  if (effort.refined_mean) {
    words.push_back(fmt::format("refined {:.2f} landmarks of {} on average;", *effort.refined_mean, effort.landmarks));
  }
  if (effort.budget_s) {
    words.push_back(
        fmt::format("budget {:.4g} ms kept in {} of {} frames;", *effort.budget_s * 1e3, effort.kept, effort.frames));
  }
  words.back().pop_back();
  return words;
}

std::string shell_word(const std::string& word) {
  constexpr std::string_view kSafe = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-./:=+,@%";
  if (!word.empty() && word.find_first_not_of(kSafe) == std::string::npos) return word;
  // What a terminal would take for a command, or for no letter, goes in as its bytes: so the command can be pasted.
  if (!is_printable(word)) {
    std::string safe = "$'";
    for (const char c : word) {
      const bool is_plain = c >= 0x20 && c < 0x7F && c != '\'' && c != '\\';
      safe += is_plain ? std::string(1, c) : fmt::format("\\x{:02x}", static_cast<unsigned char>(c));
    }
    return safe + "'";
  }
  std::string safe = "'";
  for (const char c : word) safe += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return safe + "'";
}

std::string repeat_command(const runs::RunInfo& info, const files::Robot& robot, const std::string& method) {
  if (info.behaviour == runs::kImported) {
    std::string import;
    for (const std::string& word : info.import_options) import += " " + shell_word(word);
    // Runs of older versions do not keep how they were imported.
    if (!import.empty()) import = fmt::format("twocone import{} --out RUN && ", import);
    return fmt::format("{}twocone localise RUN --method {}", import, shell_word(method));
  }
  // Whether the file said so or the command line: said twice it is the same. Twelve digits undo the division by 1000.
  const bool has_budget = method != "paper" && robot.estimator.stage == "adaptive" && robot.estimator.budget_s;
  const std::string budget =
      has_budget ? fmt::format(" --budget-ms {:.12g}", *robot.estimator.budget_s * 1e3) : std::string();
  return fmt::format("twocone run --robot {} --behaviour {} --frames {} --method {}{} --seed {}",
                     shell_word(robot.file.string()), shell_word(info.behaviour), info.frames_wanted,
                     shell_word(method), budget, info.seed);
}

std::string table(const runs::Summary& summary, const runs::RunInfo& info, const files::Robot& robot,
                  const runs::Summary* baseline, const runs::EffortSummary* effort) {
  const bool truth = has_truth(summary);
  std::string text = head(summary, info, robot) + "\n";
  if (summary.capture) text += device_lines(*summary.capture, info) + "\n";

  text += group_heads("Range to each pillar", truth, baseline) + column_heads("pillar", truth, baseline);
  text += range_rows(summary, truth, baseline) + why_not(summary) + looked_for(robot) + "\n";

  text += group_heads("Position", truth, baseline) + column_heads("", truth, baseline);
  text += fmt::format("{:<{}}{:>8}{:>9}", "fix", kNameWidth, summary.frames_with_fix,
                      percent(summary.frames_with_fix, summary.frames));
  if (truth) {
    text += error_columns(summary.fix_error);
    if (baseline != nullptr) text += baseline_columns(baseline->fix_error);
    text += paper_columns(paper::kPositionMean_mm, paper::kPositionWithin_mm) + "\n";
    if (summary.estimate_error) {
      text +=
          fmt::format("{:<{}}{:>8}{:>9}{}", "estimate", kNameWidth, summary.estimate_error->count,
                      percent(summary.estimate_error->count, summary.frames), error_columns(summary.estimate_error));
      if (baseline != nullptr) text += baseline_columns(baseline->estimate_error);
      text += "\n";
    }
    const int poses = summary.odometry_error ? summary.odometry_error->count : 0;
    text += fmt::format("{:<{}}{:>8}{:>9}", "odometry", kNameWidth, poses, percent(poses, summary.frames));
    text += error_columns(summary.odometry_error);
  }
  text += "\n";
  text += wrapped(kWidth, "Frames by verdict: ", "  ", counts(summary.fix_verdicts, true)) + outliers(summary) +
          not_taken(summary);
  if (effort != nullptr) text += wrapped(kWidth, "Looking and locating, per frame: ", "  ", effort_words(*effort));
  text += "\n" + headings(summary) + bounds(summary);
  text += truth ? "Every frame with an answer counts. The paper's rig and room differ from this one's: its figures\n"
                  "are a yardstick. Its maximum of the position is its \"to within 130 mm\".\n"
                : "There is no ground truth (a real room): no errors can be given, and none are.\n";
  return text;
}

}  // namespace twocone::report
