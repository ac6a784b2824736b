// SPDX-License-Identifier: Apache-2.0
#include "apps/report/page.h"

#include <algorithm>
#include <array>
#include <initializer_list>
#include <numbers>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "apps/estimation/method.h"
#include "apps/report/kit/figure.h"
#include "apps/report/kit/html.h"
#include "apps/report/paper.h"
#include "localisation/fix.h"
#include "vision/ranging.h"

namespace twocone::report {
namespace {

using vision::RangeVerdict;

const std::string kNone = "\u2013";

std::string mm(double metres) { return fmt::format("{:.2f}", metres * kMmPerM); }
std::string percent(int part, int whole) {
  return whole > 0 ? fmt::format("{:.1f}\u00a0%", 100.0 * part / whole) : kNone;
}

std::string plain_mm(std::optional<double> value_mm) { return value_mm ? fmt::format("{:.2f}", *value_mm) : kNone; }

void add_errors(std::vector<std::string>& cells, const std::optional<runlog::ErrorStatistics>& error) {
  for (const std::optional<double> error_mm : errors_mm(error)) cells.push_back(plain_mm(error_mm));
}

/// Adds the bound, the ratio of the errors to it, and the share of answers whose stated sigmas contain the truth.
void add_bound(std::vector<std::string>& cells, const std::optional<runlog::BoundComparison>& bound,
               const std::optional<runlog::Share>& share) {
  cells.push_back(bound ? mm(bound->bound_rms) : kNone);
  cells.push_back(bound && bound->ratio() ? fmt::format("{:.2f}", *bound->ratio()) : kNone);
  cells.push_back(share ? percent(share->held, share->count) : kNone);
}

/// Returns the number of frames with that verdict; 0 if it does not occur.
int count_of(const std::map<std::string, int>& verdicts, RangeVerdict verdict) {
  const auto found = verdicts.find(std::string(to_string(verdict)));
  return found == verdicts.end() ? 0 : found->second;
}

std::string swatch(const std::string& colour) {
  return fmt::format("<span class=\"swatch\" style=\"background:{}\"></span>", colour);
}

std::string share_bar(const std::map<std::string, int>& verdicts) {
  int whole = 0;
  for (const auto& [verdict, count] : verdicts) whole += count;
  std::string parts;
  for (const auto& [verdict, count] : by_frequency(verdicts)) {
    parts += fmt::format("<i style=\"width:{:.3f}%;background:{}\" title=\"{}: {}\"></i>", 100.0 * count / whole,
                         verdict_colour(verdict), escape(verdict), count);
  }
  return html::element("div", parts, "class=\"share\"");
}

/// Returns the verdicts with their counts as HTML.
/// @param hidden_ranges number of ranges with verdict `occluded`; not every frame with this verdict has a range
std::string words(const std::map<std::string, int>& verdicts, int hidden_ranges = 0) {
  std::vector<std::string> parts;
  for (const auto& [verdict, count] : by_frequency(verdicts)) {
    parts.push_back(fmt::format("{} {}", verdict, count));
    if (verdict == to_string(RangeVerdict::kOccluded) && hidden_ranges > 0) {
      parts.back() += fmt::format(" ({} with a range)", hidden_ranges);
    }
  }
  return escape(fmt::format("{}", fmt::join(parts, ", ")));
}

/// Formats a number for large type, with few digits.
std::string tile_mm(double metres) { return fmt::format("{:.{}f} mm", metres * kMmPerM, metres < 1 ? 1 : 0); }

std::string tile(std::string_view value, std::string_view meaning) {
  return html::element("div", html::text("b", value) + html::text("span", meaning), "class=\"tile\"");
}

std::string heading_table(const runlog::Summary& summary) {
  if (!summary.heading_error && !summary.estimate_heading_error) return "";
  const bool bounded = summary.heading_bound_rad.has_value();
  std::vector<std::string> heads{"", "frames", "mean", "rmse", "95\u00a0%", "max"};
  if (bounded) heads.insert(heads.end(), {"bound, rms", "rmse / bound"});
  html::Table table("Heading, difference from the true one in degrees", html::head_row(heads));
  const auto degrees = [](double rad) { return fmt::format("{:.4f}", rad * 180 / std::numbers::pi); };
  const auto add = [&](const std::string& name, const runlog::ErrorStatistics& error,
                       const std::optional<runlog::BoundComparison>& bound) {
    std::vector<std::string> cells{name, fmt::to_string(error.count)};
    for (const double rad : {error.mean, error.rmse, error.p95, error.max}) cells.push_back(degrees(rad));
    if (bounded) {
      cells.push_back(bound ? degrees(bound->bound_rms) : kNone);
      cells.push_back(bound && bound->ratio() ? fmt::format("{:.2f}", *bound->ratio()) : kNone);
    }
    table.add(cells);
  };
  if (summary.heading_error) {
    add("fix, method " + escape(summary.method), *summary.heading_error, summary.heading_bound_rad);
  }
  if (summary.estimate_heading_error) add("estimate (estimate.tum)", *summary.estimate_heading_error, {});
  return table.str();
}

std::string outlier_line(const runlog::Summary& summary) {
  std::vector<std::string> named;
  for (const runlog::LandmarkSummary& landmark : summary.landmarks) {
    if (landmark.outliers > 0) named.push_back(fmt::format("{} {}", landmark.name, landmark.outliers));
  }
  if (!named.empty()) {
    return html::text("p", fmt::format("Left out of fixes as outliers, in frames: {}.", fmt::join(named, ", ")));
  }
  return has_bounds(summary) ? html::text("p", "No measurement was left out of a fix as an outlier.") : "";
}

/// A verdict of a range or a fix. Its meaning depends on the method: `meaning` is that of method `outline`.
struct Verdict {
  std::string_view name, colour, meaning;
  std::string_view of_paper{};  ///< meaning in method `paper`; empty: the same
};

const Verdict* find_verdict(std::string_view name) {
  using localisation::FixVerdict;
  static const std::array<Verdict, 19> kVerdicts{
      {{to_string(RangeVerdict::kOk), "#009e73", "an answer"},
       {to_string(FixVerdict::kGap), "#56b4e9",
        "a position, although two circles did not meet: the middle of the gap between them was taken"},
       {to_string(FixVerdict::kAmbiguous), "#cc79a7", "two positions fit the measurements equally well",
        "two positions fit the three ranges equally well"},
       {to_string(RangeVerdict::kNotSeen), "#999999", "nothing of its colour in either mirror",
        "nothing of its colour in the lower mirror"},
       {to_string(FixVerdict::kTooFew), "#999999", "too few measurements to determine a position",
        "fewer than three ranges"},
       {to_string(RangeVerdict::kTruncated), "#e69f00", "it reaches the rims: too near for its top to be seen",
        "it reaches the lower rim: too near for its top to be seen"},
       {to_string(RangeVerdict::kNoMatch), "#0072b2", "seen, but its outline could not be fitted",
        "seen in the lower mirror, not found in the upper one"},
       {to_string(RangeVerdict::kBeyondLimit), "#d55e00",
        "too far: within 3 sigma the images do not distinguish its range from infinity",
        "too far: its disparity is not positive"},
       {to_string(RangeVerdict::kSameColour), "#f0e442", "another landmark has this colour"},
       {to_string(RangeVerdict::kOneView), "#8fce9f", "a range from one mirror and the known height of the top"},
       {to_string(RangeVerdict::kOccluded), "#7a5195",
        "something hides a part of its outline: a range without a bearing where its top is whole, else none"},
       {to_string(RangeVerdict::kSaturated), "#f2c14e", "too bright: its colour cannot be recognised"},
       {to_string(RangeVerdict::kTwoCandidates), "#cc79a7",
        "two objects of its colour, and the images do not show which one it is"},
       {to_string(RangeVerdict::kInconsistent), "#a3333d",
        "the two mirrors contradict each other, or the map's height and radius"},
       {to_string(RangeVerdict::kImpossible), "#5c3a21", "no position of a landmark gives these images"},
       {to_string(FixVerdict::kWeak), "#56b4e9", "a position that is hardly determined along one direction"},
       {to_string(FixVerdict::kContradictory), "#a3333d",
        "the measurements contradict each other, and it is unknown which one is wrong"},
       {to_string(FixVerdict::kOutOfBounds), "#5c3a21",
        "a position outside the map's bounds, where the robot cannot be"},
       {"no_image", "#5b4a8a", "an image of the frame is missing or damaged"}}};
  const auto* found = std::ranges::find(kVerdicts, name, &Verdict::name);
  return found == kVerdicts.end() ? nullptr : found;
}

}  // namespace

std::string verdict_colour(std::string_view verdict) {
  const Verdict* known = find_verdict(verdict);
  return known != nullptr ? std::string(known->colour) : "#5b4a8a";
}

std::string_view verdict_meaning(std::string_view verdict, std::string_view method) {
  const Verdict* known = find_verdict(verdict);
  if (known == nullptr) return "";
  return method == to_string(estimation::Method::kPaper) && !known->of_paper.empty() ? known->of_paper : known->meaning;
}

std::string headline(const runlog::Summary& summary) {
  if (summary.frames == 0) return "This run has no frames.";
  if (summary.frames_with_fix == 0) return fmt::format("None of {} frames has a position.", summary.frames);
  if (!summary.fix_error) {
    return fmt::format("{} of {} frames have a position; without ground truth its error is unknown.",
                       summary.frames_with_fix, summary.frames);
  }
  return fmt::format(
      "From one stereo frame at a time, the robot's position is off by {:.1f} mm on average; the paper reports {} mm.",
      summary.fix_error->mean * kMmPerM, paper::kPositionMean_mm);
}

std::string tiles(const runlog::Summary& summary) {
  std::string text;
  if (summary.fix_error) {
    text +=
        tile(tile_mm(summary.fix_error->mean), fmt::format("mean position error (paper: {})", paper::kPositionMean_mm));
    text += tile(tile_mm(summary.fix_error->max),
                 fmt::format("worst position error (paper: within {})", paper::kPositionWithin_mm));
  }
  text += tile(percent(summary.frames_with_fix, summary.frames),
               fmt::format("of {} frames have a position", summary.frames));
  if (summary.odometry_error) {
    text += tile(tile_mm(summary.odometry_error->mean), "mean error of odometry alone");
  }
  if (summary.travelled_m)
    text += tile(fmt::format("{:.2f} m", *summary.travelled_m), fmt::format("driven in {:.1f} s", summary.duration_s));
  if (summary.headings_covered_deg)
    text += tile(fmt::format("{:.0f}\u00b0", *summary.headings_covered_deg), "of all 360\u00b0 of heading covered");
  return html::element("div", text, "class=\"tiles\"");
}

std::string rules(const PageContent& content) {
  const runlog::Summary& summary = content.summary;
  std::string success = html::element(
      "p", fmt::format("<strong>Criterion of success.</strong> As good as the paper: over every frame with a position "
                       "the mean error is at most {} mm and none is above {} mm. Nothing is left out: of two answers "
                       "to one frame the worse one counts, and a frame without an answer is counted by its reason "
                       "(the paper writes 0 for it).",
                       paper::kPositionMean_mm, paper::kPositionWithin_mm));
  if (summary.fix_error) {
    const double mean_mm = summary.fix_error->mean * kMmPerM;
    const double max_mm = summary.fix_error->max * kMmPerM;
    const bool met = mean_mm <= paper::kPositionMean_mm && max_mm <= paper::kPositionWithin_mm;
    success += html::element(
        "p",
        fmt::format("<span class=\"{}\">{}</span> mean {:.2f} mm, worst {:.2f} mm; {} of {} frames have no position.",
                    met ? "met" : "unmet", met ? "Met:" : "Not met:", mean_mm, max_mm,
                    summary.frames - summary.frames_with_fix, summary.frames));
  }
  std::string truth = html::element(
      "p",
      has_truth(summary)
          ? "<strong>Precision of the truth.</strong> The truth is the simulated world's own pose: the numbers that "
            "place the cameras in the scene, written with every digit. A true range is the distance from there to "
            "the landmark's axis in the map, so it is exact as far as the map agrees with the scene. No behaviour and "
            "no estimator reads the truth."
          : "<strong>No ground truth.</strong> This run has none (a real robot in a real room), so only coverage is "
            "reported below, and no error.");
  truth += html::element(
      "p",
      "The paper's numbers stand beside ours for comparison only: Burbridge &amp; Spacek (2006) had another room, and "
      "a rig whose sizes they do not give.",
      "class=\"soft\"");
  return html::element("div", html::element("div", success) + html::element("div", truth), "class=\"rules\"");
}

std::string range_table(const PageContent& content) {
  const runlog::Summary& summary = content.summary;
  const bool truth = has_truth(summary);
  // A method that states sigmas does not round to pixels, so its errors are compared with the bound of the images.
  const bool bounded = has_bounds(summary);
  std::vector<std::string> groups{"", "frames"};
  std::vector<int> spans{1, 2};
  std::vector<std::string> heads{"landmark", "with a range", "covered"};
  const auto add_group = [&](const char* name, std::initializer_list<const char*> columns) {
    groups.emplace_back(name);
    spans.push_back(int(columns.size()));
    heads.insert(heads.end(), columns.begin(), columns.end());
  };
  if (truth) {
    add_group("error / mm", {"mean", "rmse", "95\u00a0%", "max"});
    if (bounded) {
      add_group("Cram\u00e9r\u2013Rao bound", {"rms / mm", "rmse / bound", "in 1.96 \u03c3"});
    } else {
      add_group("rounding to pixels", {"alone: mean"});
    }
    if (content.baseline != nullptr) add_group("method paper", {"mean", "max"});
    add_group("the paper", {"mean", "max"});
  }
  html::Table table(truth ? "Range to each landmark, |computed \u2212 true|" : "Range to each landmark",
                    html::head_row(groups, spans) + html::head_row(heads));
  for (const config::Landmark& landmark : content.run.map.landmarks) {
    const runlog::LandmarkSummary& own = landmark_of(summary, landmark.name);
    std::vector<std::string> cells{swatch(own_colour(landmark.colour)) + escape(landmark.name),
                                   fmt::to_string(own.frames_with_range),
                                   percent(own.frames_with_range, summary.frames)};
    if (truth) {
      add_errors(cells, own.error);
      if (!bounded) {
        const std::optional<double> rounding_m = rounding_error_m(content.run, landmark);
        cells.push_back(rounding_m ? mm(*rounding_m) : kNone);
      } else {
        add_bound(cells, own.range_bound_m, own.within_95);
      }
      if (content.baseline != nullptr) {
        const auto baseline_mm = errors_mm(landmark_of(*content.baseline, landmark.name).error);
        cells.insert(cells.end(), {plain_mm(baseline_mm.front()), plain_mm(baseline_mm.back())});
      }
      const paper::LandmarkFigures* figures = paper::find_landmark(landmark.name);
      cells.push_back(figures != nullptr ? fmt::to_string(figures->mean_mm) : kNone);
      cells.push_back(figures != nullptr ? fmt::to_string(figures->max_mm) : kNone);
    }
    table.add(cells);
  }
  std::string text = table.str();
  if (truth && !bounded) {
    text += html::element("p",
                          "\"Rounding to pixels alone\" is the mean error if both matches were right to the nearest "
                          "whole pixel and nothing else were wrong: a third of a pixel of disparity at the true ranges "
                          "of this run.",
                          "class=\"soft\"");
  }
  if (truth && bounded) {
    text += html::element(
        "p",
        "The Cram\u00e9r\u2013Rao bound is the smallest standard deviation that any unbiased method can have. It is "
        "computed from the landmark's outline in both mirrors, at the true pose, with the noise of the outline as "
        "measured in this run. \"rmse / bound\" is over the frames that have both. \"In 1.96 \u03c3\" is the share of "
        "ranges whose error is within 1.96 of their own stated sigmas; it is 95\u00a0% if the sigmas are correct.",
        "class=\"soft\"");
  }
  return text;
}

std::string coverage_table(const PageContent& content) {
  html::Table table("Result of each frame", html::head_row({"", "share of the frames", "frames by verdict"}),
                    "class=\"words\"");
  std::set<std::string> verdicts;
  for (const runlog::LandmarkSummary& landmark : content.summary.landmarks) {
    const int hidden_ranges = landmark.frames_with_range - count_of(landmark.verdicts, RangeVerdict::kOk) -
                              count_of(landmark.verdicts, RangeVerdict::kOneView);
    table.add({escape(landmark.name), share_bar(landmark.verdicts), words(landmark.verdicts, hidden_ranges)});
    for (const auto& [verdict, count] : landmark.verdicts) verdicts.insert(verdict);
  }
  table.add({"position", share_bar(content.summary.fix_verdicts), words(content.summary.fix_verdicts)});
  for (const auto& [verdict, count] : content.summary.fix_verdicts) verdicts.insert(verdict);
  std::string legend;
  for (const std::string& verdict : verdicts) {
    const std::string_view known = verdict_meaning(verdict, content.summary.method);
    const std::string meaning = known.empty() ? "" : ": " + escape(known);
    legend += html::element("span", swatch(verdict_colour(verdict)) + "<b>" + escape(verdict) + "</b>" + meaning);
  }
  return table.str() + html::element("div", legend, "class=\"legend\"");
}

std::string position_table(const PageContent& content) {
  const runlog::Summary& summary = content.summary;
  const bool truth = has_truth(summary);
  std::vector<std::string> heads{"", "frames", "covered"};
  const bool bounded = truth && has_bounds(summary);
  if (truth) heads.insert(heads.end(), {"mean", "rmse", "95\u00a0%", "max"});
  if (bounded) heads.insert(heads.end(), {"bound, rms", "rmse / bound", "in 95\u00a0% ellipse"});
  html::Table table(truth ? "Position, distance from the true one in mm" : "Position", html::head_row(heads));
  const auto add = [&](const std::string& name, int frames, const std::optional<runlog::ErrorStatistics>& error) {
    std::vector<std::string> cells{name, fmt::to_string(frames), percent(frames, summary.frames)};
    if (truth) add_errors(cells, error);
    if (bounded && &error == &summary.fix_error) {
      add_bound(cells, summary.position_bound_m, summary.in_ellipse_95);
    } else if (bounded) {
      cells.insert(cells.end(), 3, kNone);
    }
    table.add(cells);
  };
  add("fix, method " + escape(summary.method), summary.frames_with_fix, summary.fix_error);
  if (content.baseline != nullptr)
    add("fix, method paper", content.baseline->frames_with_fix, content.baseline->fix_error);
  if (truth) {
    if (summary.estimate_error) {
      add("estimate (estimate.tum)", summary.estimate_error->count, summary.estimate_error);
    }
    add("odometry alone", summary.odometry_error ? summary.odometry_error->count : 0, summary.odometry_error);
    std::vector<std::string> cells(heads.size(), kNone);
    cells[0] = "the paper";
    cells[3] = fmt::to_string(paper::kPositionMean_mm);
    cells[6] = fmt::format("within {}", paper::kPositionWithin_mm);
    table.add(cells, "class=\"soft\"");
  }
  return table.str() + heading_table(summary) + outlier_line(summary);
}

}  // namespace twocone::report
