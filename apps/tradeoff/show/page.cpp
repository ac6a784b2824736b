// SPDX-License-Identifier: Apache-2.0
#include "apps/tradeoff/show/page.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "apps/report/kit/html.h"
#include "apps/tradeoff/output.h"
#include "apps/tradeoff/show/wording.h"

namespace twocone::tradeoff {
namespace {

namespace html = report::html;
using report::escape;

constexpr std::string_view kNone = "\u2013";

std::string headline(const Sweep& sweep) {
  const auto span = span_of(sweep);
  if (!span) return "No setting answers often enough to be on a frontier.";
  return fmt::format(
      "{} mm take {} s of processor time per frame in simulation, {} mm take {} s: {} settings, {} of them on "
      "the frontier.",
      significant(span->most_error_m / kMm, 2), significant(span->least_time_s, 2),
      significant(span->least_error_m / kMm, 2), significant(span->most_time_s, 2), sweep.settings.size(),
      span->settings);
}

/// Returns an image for the page. @param svg stand-alone, with spots. @param caption plain text
std::string image_html(std::string_view id, std::string_view svg, std::string_view caption) {
  return html::element("figure", report::inline_svg(svg, id) + html::text("figcaption", caption),
                       fmt::format("id=\"{}\" class=\"wide\"", escape(id)));
}

/// Formats "0.160 (0.150 to 0.171)" in units of `unit`, e.g. 1e-3 for millimetres. An interval that is not finite is
/// left out. @param pattern of the interval
std::string with_interval(const Interval& interval, double unit, const char* pattern = " ({} to {})") {
  std::string text = significant(interval.value / unit);
  if (std::isfinite(interval.low) && std::isfinite(interval.high)) {
    text += fmt::format(fmt::runtime(pattern), significant(interval.low / unit), significant(interval.high / unit));
  }
  return text;
}

/// Returns a table cell that is sorted by a number.
std::string cell(double value, double unit) {
  if (!std::isfinite(value)) return std::string(kNone);
  return fmt::format("<data value=\"{:.9g}\">{}</data>", value, significant(value / unit));
}

std::string cell(const Interval& interval, double unit) {
  if (!std::isfinite(interval.value)) return std::string(kNone);
  return fmt::format("<data value=\"{:.9g}\">{}</data>", interval.value,
                     with_interval(interval, unit, " <small>{}\u2013{}</small>"));
}

std::string words(double order, std::string_view text) {
  return fmt::format("<data value=\"{:.9g}\">{}</data>", order, escape(text));
}

std::string frontier_cell(const SettingResult& result) {
  std::string text;
  if (result.on_robot_frontier) text += "<b class=\"on\" title=\"on the frontier of robot time\">R</b>";
  if (result.on_simulation_frontier) text += "<b class=\"on\" title=\"on the frontier of simulation time\">S</b>";
  return fmt::format("<data value=\"{}\">{}</data>",
                     -(2 * int(result.on_simulation_frontier) + int(result.on_robot_frontier)), text);
}

std::vector<std::string> row(const Sweep& sweep, std::size_t index) {
  const SettingResult& result = sweep.settings[index];
  const Setting& setting = result.setting;
  const Images& images = setting.images;
  const ErrorFigures position = result.position_m.value_or(kNoErrors);
  std::string estimator(name(setting.level));
  if (setting.level == Level::kAdaptive) estimator += fmt::format(" to {:g} mm", setting.enough_m / kMm);
  std::string size = fmt::format("{} \u00d7 {}", images.width_px, images.height_px);
  if (sweep.as_is == index) size += " (robot file, unchanged)";
  return {words(double(images.width_px) * images.height_px, size),
          frontier_cell(result),
          words(images.antialias, antialias_name(images.antialias)),
          words(double(images.effects), name(images.effects)),
          words(double(setting.level) + setting.enough_m, estimator),
          words(setting.landmarks, fmt::to_string(setting.landmarks)),
          words(setting.uses_bearings(), setting.uses_bearings() ? "yes" : "no"),
          words(setting.rate_hz, fmt::format("{:g}", setting.rate_hz)),
          words(setting.frames, fmt::to_string(setting.frames)),
          cell(position.mean, kMm),
          cell(position.rmse.value, kMm),
          cell(position.p95.value, kMm),
          cell(position.max, kMm),
          cell(result.heading_rad.value_or(kNoErrors).mean.value, kDegree),
          cell(result.range_m.value_or(kNoErrors).mean.value, kMm),
          cell(result.answered_share(), 0.01),
          cell(result.coverage.value_or(kNoInterval).value, 0.01),
          cell(result.bound_m.value_or(kNoNumber), kMm),
          cell(result.vision.median_s.value, kMs),
          cell(result.localisation.median_s.value, kMs),
          cell(result.robot_time_s(), kMs),
          cell(result.render_cpu.median_s.value, 1),
          cell(result.simulation_time_s().value, 1),
          cell(result.peak_bytes, kMiB)};
}

std::string table_html(const Sweep& sweep) {
  std::vector<std::string> heads;
  for (const std::string_view head :
       {"size/px",         "frontier",    "rays",         "effects",        "estimator",
        "land\u00admarks", "bearings",    "rate/Hz",      "frames",         "mean/mm",
        "RMSE/mm",         "95 %/mm",     "max/mm",       "heading/\u00b0", "range/mm",
        "answered/%",      "coverage/%",  "bound/mm",     "vision/ms",      "local\u00adisation/ms",
        "robot 95 %/ms",   "rendering/s", "simulation/s", "memory/MiB"}) {
    heads.push_back(html::text("button", head, "type=\"button\""));
  }
  html::Table table("Errors are position errors unless stated otherwise; small numbers: 95 % interval",
                    html::head_row(heads), "id=\"all\"");
  for (std::size_t i = 0; i < sweep.settings.size(); ++i) {
    const SettingResult& result = sweep.settings[i];
    table.add(row(sweep, i),
              fmt::format("data-setting=\"{}\"{}", i,
                          result.on_robot_frontier || result.on_simulation_frontier ? " class=\"frontier\"" : ""));
  }
  return table.str();
}

std::string facts_html(const Sweep& sweep) {
  std::vector<std::pair<std::string, std::string>> facts{
      {"twocone", fmt::format("{}, commit {}", sweep.version, sweep.commit)},
      {"compiler", sweep.compiler},
      {"machine", sweep.machine},
      {"robot", sweep.robot},
      {"map", sweep.map},
      {"seed", fmt::to_string(sweep.seed)},
      {"episodes", fmt::to_string(sweep.episodes)},
      {"landmarks, the most important first", fmt::format("{}", fmt::join(sweep.landmarks, ", "))}};
  std::erase_if(facts, [](const auto& fact) { return fact.second.empty(); });
  return html::facts(facts);
}

std::string files_html() {
  const auto link = [](std::string_view file) { return fmt::format("<a href=\"{0}\">{0}</a>", file); };
  return html::element("p",
                       fmt::format("The same data as files: {} (with times and frontiers), {} (only results that do "
                                   "not depend on the machine's speed).",
                                   link("tradeoff.csv"), link("errors.csv")));
}

std::string frontiers(const SettingResult& result) {
  if (result.on_robot_frontier && result.on_simulation_frontier) return "on both frontiers";
  if (result.on_robot_frontier) return "on the frontier of robot time";
  if (result.on_simulation_frontier) return "on the frontier of simulation time";
  return answers_enough(result) ? "dominated" : "does not answer often enough for a frontier";
}

/// Returns the SVG of drawing_of(plane) with an invisible circle over each mark, whose <title> is its tooltip. The Tab
/// key reaches those of the frontier. Each is written as `<circle class="spot" cx= cy= data-setting="index">`.
std::string with_spots(std::string_view svg, const Sweep& sweep, const Plane& plane) {
  std::string spots = "<g class=\"spots\" fill=\"#000000\" fill-opacity=\"0\" pointer-events=\"all\">\n";
  for (const Mark& mark : plane.marks) {
    const Pixel at = plane.pixel(mark.at);
    constexpr double kRadius_px = 8;
    spots += fmt::format(
        "<circle class=\"spot\" cx=\"{:.2f}\" cy=\"{:.2f}\" r=\"{}\" tabindex=\"{}\" role=\"img\" "
        "data-setting=\"{}\"><title>{}</title></circle>\n",
        at.x, at.y, kRadius_px, mark.on_frontier ? 0 : -1, mark.setting,
        report::escape(tooltip(sweep.settings[mark.setting])));
  }
  std::string text(svg);
  const std::size_t end = text.rfind("</svg>");
  return text.insert(end == std::string::npos ? text.size() : end, spots + "</g>\n");
}

std::string caption_of(const Sweep& sweep, const Plane& plane) {
  std::string text = plane.cost == Cost::kRobotTime
                         ? "Robot time: vision and localisation of one frame on one core, 95 % quantile. --budget-ms "
                           "limits this time. The paper's star is for a whole stereo frame on the computer of its day, "
                           "ranging included."
                         : "Simulation time: robot time plus the median processor time of rendering both images.";
  text +=
      " Solid marks are on the frontier, with 95 % intervals; no swept setting is below the staircase line. The dashed "
      "line connects the smallest Cram\u00e9r-Rao bounds of settings fine and adaptive, with all landmarks of the map "
      "and, for several frames, with wheels that measure their motion exactly. Bounds are root mean squares; a mean "
      "error can be as small as 0.8 times its own root mean square.";
  const auto silent = std::ranges::count_if(sweep.settings, [](const SettingResult& r) { return !r.position_m; });
  if (silent > 0)
    text += fmt::format(" {} of {} settings never answered and are not drawn.", silent, sweep.settings.size());
  return text + " Point at a mark, or select it with Tab and the arrow keys, to see its setting.";
}

/// Returns index.html: one page that needs no other file. It is UTF-8 and well-formed XML.
/// @param images HTML. @param choice shown with its reason; may be null
std::string page(const Sweep& sweep, std::string_view images, const Choice* choice) {
  const std::string title = fmt::format("twocone tradeoff: robot {}, seed {}", sweep.robot, sweep.seed);
  std::string main = html::text("h1", title) + html::text("p", headline(sweep), "class=\"headline\"");
  std::string rules;
  for (const std::string& sentence : rule_sentences()) rules += html::text("p", sentence);
  main += html::element("div", rules, "class=\"rules\"");
  main += html::navigation({{"images", "Images"},
                            {"conclusions", "Conclusions"},
                            {"growth", "Growth"},
                            {"settings", "All settings"},
                            {"repeat", "Repeat"}});
  if (choice != nullptr && !choice->why.empty()) main += html::text("p", choice->why, "class=\"choice\"");

  main += html::section("images", "What accuracy costs in time", html::element("div", images, "class=\"figures\""));

  std::vector<std::string> sentences;
  for (const auto& [axis, sentence] : conclusions(sweep)) sentences.push_back(sentence);
  main += html::section("conclusions", "Effect and cost of each axis", html::list(sentences));
  main += html::section(
      "growth", "Growth of error and time",
      html::text("p", "Exponents of power laws, with 95 % intervals:") + html::list(growth_sentences(sweep)));
  main += html::section("settings", "All settings", files_html() + table_html(sweep));
  main += html::section("repeat", "How to repeat this",
                        html::text("p", "The same version makes the same errors byte for byte, and its own times:") +
                            html::text("pre", sweep.repeat) + facts_html(sweep));
  return html::document(title, std::string(report::style()) + std::string(page_style()),
                        html::element("main", main) + "<div id=\"tip\" role=\"status\" hidden=\"hidden\"></div>\n",
                        page_script());
}

}  // namespace

std::string tooltip(const SettingResult& result) {
  std::string text = describe(result.setting) + "\n";
  if (const auto& error = result.position_m) {
    text += fmt::format("error: mean {} mm; 95 % below {} mm; max {} mm\n", with_interval(error->mean, kMm),
                        significant(error->p95.value / kMm), significant(error->max / kMm));
  }
  if (result.heading_rad)
    text += fmt::format("heading: mean {} deg\n", with_interval(result.heading_rad->mean, kDegree));
  text += fmt::format("answered: {} of {} frames", result.answered, result.frames);
  if (result.coverage) {
    text += fmt::format("; 95 % ellipses contain the truth in {:.0f} %", result.coverage->value * 100);
    if (std::isfinite(result.coverage->low) && std::isfinite(result.coverage->high)) {
      text += fmt::format(" ({:.0f} to {:.0f})", result.coverage->low * 100, result.coverage->high * 100);
    }
  }
  text += "\n";
  if (result.bound_m) text += fmt::format("bound (Cram\u00e9r-Rao), rms: {} mm\n", significant(*result.bound_m / kMm));
  text += fmt::format("robot: {} ms (95 % quantile); medians: vision {} ms, localisation {} ms\n",
                      with_interval(result.robot_time_s(), kMs), significant(result.vision.median_s.value / kMs),
                      significant(result.localisation.median_s.value / kMs));
  text += fmt::format("rendering: {} s; simulation: {} s\n", with_interval(result.render_cpu.median_s, 1),
                      significant(result.simulation_time_s().value));
  text += fmt::format("memory: {:.0f} MiB, POV-Ray {:.0f} MiB\n", result.peak_bytes / kMiB, result.render_bytes / kMiB);
  return text + frontiers(result);
}

Status write_images(const Sweep& sweep, const Choice* choice, const std::filesystem::path& folder) {
  const report::Gnuplot gnuplot{"gnuplot", folder / "figures"};
  if (Status ready = gnuplot.prepare(); !ready) return ready;

  std::string images;
  for (const Cost cost : {Cost::kSimulationTime, Cost::kRobotTime}) {
    const Plane plane = plane_of(sweep, cost);
    const report::Plot plot = drawing_of(sweep, plane, choice);
    const Result<std::string> svg = gnuplot.draw(plot);
    if (!svg) return svg.error();
    images += image_html(plot.stem, with_spots(*svg, sweep, plane), caption_of(sweep, plane));
  }
  return report::write_file(folder / "index.html", page(sweep, images, choice));
}

}  // namespace twocone::tradeoff
