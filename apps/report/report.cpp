// SPDX-License-Identifier: Apache-2.0
#include "apps/report/report.h"

#include <stdexcept>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "apps/report/kit/html.h"
#include "apps/report/kit/plan.h"
#include "apps/report/page.h"

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

/// Returns the HTML of a slider through some frames. Without a script the page shows the first one.
std::string browser_html(const std::vector<FrameView>& frames) {
  if (frames.empty()) return "";
  std::string views;
  for (const FrameView& view : frames) {
    views += html::shown_frame(inline_svg(view.svg, fmt::format("frame{}", view.frame)),
                               fmt::format("frame {}, t = {:.2f} s", view.frame, view.t_s), views.empty());
  }
  const std::string slider = html::element(
      "div",
      fmt::format("<input id=\"frame-choice\" type=\"range\" min=\"0\" max=\"{}\" value=\"0\" disabled=\"disabled\" "
                  "aria-label=\"frame\"/>",
                  frames.size() - 1) +
          html::element("output", "", "id=\"frame-name\""),
      "class=\"slider\"");
  const std::string caption = html::element(
      "figcaption",
      fmt::format("{} frames, evenly spaced over the run: both mirrors unrolled, landmarks at their measured "
                  "bearings with the computed range.",
                  frames.size()));
  return html::section("browse", "Frames of the run",
                       html::element("figure", slider + views + caption, "class=\"wide\""));
}

std::string repeat_html(const runlog::RunData& run) {
  const auto timing = runlog::summarise_timing(run);
  const bool has_budget = timing && timing->budget_s;
  return html::section(
      "repeat", "How to repeat this",
      html::text("p", fmt::format("With this command the same version repeats the run byte for byte{}:",
                                  has_budget ? ", unless the time limit cuts an answer short" : "")) +
          html::text("pre", repeat_command(run.info, run.robot, run.method)) +
          html::text("p", "The scripts that drew the figures are beside them, in figures/*.gp."));
}

std::string facts_html(const runlog::RunData& run, const runlog::Summary& summary) {
  const auto joined = [](const std::vector<std::string>& words) { return fmt::format("{}", fmt::join(words, " ")); };
  std::vector<std::pair<std::string, std::string>> facts{
      {"twocone", fmt::format("{}, commit {}", run.info.version, run.info.commit)},
      {"compiler", run.info.compiler},
      {"robot", fmt::format("{} ({})", run.robot.name, run.robot.file.string())},
      {"map", run.map.file.string()},
      {"scene", run.map.scene ? run.map.scene->string() : "none: a real room"},
      {"behaviour", run.info.behaviour},
      {"method", run.method == run.info.method
                     ? run.method
                     : fmt::format("{} (the run itself used {})", run.method, run.info.method)},
      {"seed", fmt::to_string(run.info.seed)},
      {"frames", fmt::format("{} of {}, {:.2f} s", summary.frames, run.info.frames_wanted, summary.duration_s)},
      {"images", fmt::format("{} x {} px at {:g} Hz", run.robot.lower.settings.width_px,
                             run.robot.lower.settings.height_px, run.robot.lower.settings.rate_hz)}};
  if (run.info.finished && run.info.wall_s > 0) {
    facts.emplace_back(
        "time taken",
        fmt::format("{:.1f} s, of which {:.1f} s waiting for images; processor {:.1f} s here, {:.1f} s in POV-Ray",
                    run.info.wall_s, run.info.render_wait_s, run.info.own_cpu_s, run.info.render_cpu_s));
  }
  for (const config::KeyChange& change : run.robot.changes) facts.emplace_back("changed key", to_string(change));
  if (const auto& names = run.robot.estimator.landmarks; !names.empty()) {
    facts.emplace_back("searched for only", fmt::format("{}", fmt::join(names, ", ")));
  }
  if (const auto timing = runlog::summarise_timing(run)) {
    facts.emplace_back("vision and localisation, per frame", joined(timing_words(*timing)));
  }
  for (const std::string& device : run.info.devices) facts.emplace_back("device", device);
  if (summary.capture) facts.emplace_back("cameras", joined(capture_words(*summary.capture)));
  return html::facts(facts);
}

std::string provenance_html(const PageContent& content) {
  return html::section("run", "The run",
                       facts_html(content.run, content.summary) + html::text("h3", "Events during the run") +
                           html::list(content.run.info.events, "Nothing out of the ordinary.") +
                           html::text("h3", "Notes on this report") + html::list(content.notes, "Nothing is missing."));
}

}  // namespace

std::string page(const PageContent& content) {
  const runlog::RunData& run = content.run;
  const runlog::Summary& summary = content.summary;
  const std::string title =
      fmt::format("twocone run: robot {}, method {}, seed {}", run.robot.name, run.method, run.info.seed);

  std::vector<std::pair<std::string, std::string>> places{{"ranges", "Ranges"}, {"position", "Position"}};
  std::string figures;
  for (const FigureGroup& group : content.groups) {
    const std::string inner = group.tables + figures_html(group.figures);
    if (inner.empty()) continue;
    figures += html::section(group.id, group.title, inner);
    places.emplace_back(group.id, group.title);
  }
  if (!content.frames.empty()) places.emplace_back("browse", "Frames of the run");
  places.insert(places.end(), {{"repeat", "Repeat"}, {"run", "The run"}});

  std::string main = html::text("h1", title);
  main += html::text("p", headline(summary), "class=\"headline\"");
  if (!run.info.finished) {
    main += html::text("p",
                       fmt::format("This run was cut off after {} of {} frames; the results below are of those.",
                                   summary.frames, run.info.frames_wanted),
                       "class=\"warning\"");
  }
  main += html::navigation(places) + rules(content) + tiles(summary);
  main += html::section("ranges", "Ranges", range_table(content) + coverage_table(content));
  main += html::section("position", "Position", position_table(content));
  main += figures + browser_html(content.frames) + repeat_html(run) + provenance_html(content);

  return html::document(title, style(), html::element("main", main), script());
}

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

  PageContent content{run, summary, baseline ? &*baseline : nullptr, {}, {}, {}};

  settings.progress(0.05);
  const Figure trajectory = draw_trajectory(drawing, overhead_image(drawing, run.map, "Figure 7 is"));
  settings.progress(0.35);
  if (run.truth.empty())
    result.notes.emplace_back("There is no ground truth, so there is no figure of the position error.");
  content.groups.push_back({"paths", "Trajectories", {trajectory, draw_paths(drawing), draw_position_error(drawing)}});
  settings.progress(0.45);
  content.groups.push_back({"range-figures", "Ranges frame by frame", draw_ranges(drawing)});
  content.groups.push_back(
      {"bounds", "Errors beside their bounds", {draw_error_and_bound(drawing), draw_normalised_errors(drawing)}});
  settings.progress(0.6);
  const RunErrorBudget budget = error_budget_of(run, settings.error_budget_draws, settings.error_budget_pose_step);
  content.groups.push_back({"error-budget",
                            "The error budget",
                            {draw_error_budget(drawing, budget.error_budget)},
                            error_budget_table(budget)});
  settings.progress(0.65);
  content.groups.push_back({"rig", "The rig", {draw_geometry(drawing), draw_resolution(drawing)}});
  settings.progress(0.75);
  content.groups.push_back({"views", "Images of the mirrors", {draw_superimposed(drawing), draw_strips(drawing)}});
  content.frames = frame_views(run, kBrowsedFrames);
  content.notes = result.notes;

  settings.progress(0.95);
  if (const Status written = write_file(result.html, page(content)); !written) return written.error();
  settings.progress(1);
  return result;
}

}  // namespace twocone::report
