// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <optional>
#include <set>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "apps/report/kit/plain_text.h"
#include "apps/tradeoff/output.h"
#include "apps/tradeoff/wording.h"
#include "apps/web/document.h"

namespace twocone::tradeoff {
namespace {

constexpr std::size_t kWidth = 120;

/// Returns `text`, wrapped between words.
std::string paragraph(std::string_view text, std::string_view first = "", std::string_view next = "  ") {
  return report::paragraph(kWidth, first, next, report::ascii(text));
}

std::string head(const Sweep& sweep) {
  std::string text = paragraph(fmt::format("twocone {}, commit {}, {}", sweep.version, sweep.commit, sweep.compiler)) +
                     paragraph(fmt::format("robot {}, map {}, seed {}, {} episodes, {} settings", sweep.robot,
                                           sweep.map, sweep.seed, sweep.episodes, sweep.settings.size()));
  if (!sweep.machine.empty()) text += paragraph("machine: " + sweep.machine);
  text += report::repeat_lines(kWidth, sweep.repeat) + "\n";
  for (const std::string& sentence : rule_sentences()) text += paragraph(sentence);
  return text;
}

struct Column {
  std::array<std::string_view, 2> heads;
  std::size_t width;
};
// The widths of the columns and the blanks between them fill kWidth.
constexpr std::array<Column, 20> kColumns{
    {{{"", ""}, 2},      {{"", "size"}, 9},  {{"", "AA"}, 3},     {{"ef-", "fects"}, 5}, {{"esti-", "mator"}, 8},
     {{"", "lm"}, 2},    {{"be-", "ar"}, 3}, {{"Hz x", "n"}, 5},  {{"", "mean"}, 6},     {{"", "its interval"}, 13},
     {{"", "95 %"}, 6},  {{"", "max"}, 6},   {{"ans", "%"}, 4},   {{"cov", "%"}, 4},     {{"bound", "mm"}, 6},
     {{"vis", "ms"}, 4}, {{"loc", "ms"}, 4}, {{"95 %", "ms"}, 4}, {{"rend", "s"}, 4},    {{"", "MiB"}, 3}}};

std::string line(const std::vector<std::string>& cells) {
  std::string text;
  for (std::size_t i = 0; i < kColumns.size(); ++i) {
    constexpr std::size_t kFirstNumber = 5;
    text += fmt::format(fmt::runtime(i < kFirstNumber ? "{:<{}} " : "{:>{}} "), cells[i], kColumns[i].width);
  }
  text.erase(text.find_last_not_of(' ') + 1);
  return text + "\n";
}

std::string percent(double share) { return fitting(share * 100, 4); }

std::string row(const SettingResult& result) {
  const Setting& setting = result.setting;
  std::vector<std::string> cells;
  const auto add = [&](std::string text) { cells.push_back(std::move(text)); };
  const auto number = [&](double value, double unit) { add(fitting(value / unit, kColumns[cells.size()].width)); };
  add(fmt::format("{}{}", result.on_robot_frontier ? 'R' : ' ', result.on_simulation_frontier ? 'S' : ' '));
  add(fmt::format("{}x{}", setting.images.width_px, setting.images.height_px));
  add(antialias_name(setting.images.antialias));
  add(std::string(name(setting.images.effects)));
  add(setting.level == Level::kAdaptive ? fmt::format("ad {}mm", fitting(setting.enough_m / kMm, 3))
                                        : std::string(name(setting.level)));
  add(fmt::to_string(setting.landmarks));
  add(setting.uses_bearings() ? "yes" : "no");
  add(fmt::format("{:g}x{}", setting.rate_hz, setting.frames));
  const ErrorFigures error = result.position_m.value_or(kNoErrors);
  number(error.mean.value, kMm);
  constexpr std::size_t kLimit = 6;
  add(std::isfinite(error.mean.high)
          ? fmt::format("{}-{}", fitting(error.mean.low / kMm, kLimit), fitting(error.mean.high / kMm, kLimit))
          : "-");
  number(error.p95.value, kMm);
  number(error.max, kMm);
  add(percent(result.answered_share()));
  add(percent(result.coverage.value_or(kNoInterval).value));
  number(result.bound_m.value_or(kNoNumber), kMm);
  number(result.vision.median_s.value, kMs);
  number(result.localisation.median_s.value, kMs);
  number(result.robot_time_s().value, kMs);
  number(result.render_cpu.median_s.value, 1);
  number(result.peak_bytes, kMiB);
  return line(cells);
}

std::string heads() {
  std::string text;
  for (std::size_t i = 0; i < 2; ++i) {
    std::vector<std::string> cells;
    cells.reserve(kColumns.size());
    for (const Column& column : kColumns) cells.emplace_back(column.heads[i]);
    text += line(cells);
  }
  return text;
}

std::string frontier_rows(const Sweep& sweep) {
  std::vector<const SettingResult*> chosen;
  for (const SettingResult& result : sweep.settings) {
    if (result.on_robot_frontier || result.on_simulation_frontier) chosen.push_back(&result);
  }
  std::ranges::stable_sort(chosen, {}, [](const SettingResult* r) { return r->simulation_time_s().value; });
  std::string text;
  for (const SettingResult* result : chosen) text += row(*result);
  return text.empty() ? "no setting answers often enough\n" : text;
}

std::string counts(const Sweep& sweep) {
  std::vector<std::string_view> axes;  // the axes on which the sweep has at least two values
  for (const Axis axis : kAllAxes) {
    std::set<std::string> values;
    for (const SettingResult& result : sweep.settings) values.insert(facts_of(axis).value(result.setting));
    if (values.size() > 1) axes.push_back(facts_of(axis).name);
  }
  const auto on_robot = std::ranges::count(sweep.settings, true, &SettingResult::on_robot_frontier);
  std::string text = paragraph(
      fmt::format("{} settings over {} axes ({})", sweep.settings.size(), axes.size(), fmt::join(axes, ", ")));
  if (const auto span = span_of(sweep)) {
    text += paragraph(fmt::format(
        "On the frontier: {} of robot time, {} of simulation time; the latter spans a factor of {:.0f} in error "
        "({} to {} mm) and of {:.0f} in time ({} to {} s).",
        on_robot, span->settings, span->most_error_m / span->least_error_m, significant(span->most_error_m / kMm),
        significant(span->least_error_m / kMm), span->most_time_s / span->least_time_s, significant(span->least_time_s),
        significant(span->most_time_s)));
  }
  return text;
}

// ---- files

using Json = nlohmann::ordered_json;

/// A row of the files, by its heads. A number that does not exist is null.
struct Row {
  Json cells = Json::object();

  void add(const std::string& head, std::string_view text) { cells[head] = text; }
  void add(const std::string& head, std::integral auto value) { cells[head] = value; }
  void add(const std::string& head, double value) { cells[head] = std::isfinite(value) ? Json(value) : Json(); }
  /// Adds NAME_UNIT, NAME_low_UNIT, NAME_high_UNIT. @param unit with its underscore; empty for a share
  void add(const std::string& name, const std::string& unit, const Interval& interval) {
    add(name + unit, interval.value);
    add(name + "_low" + unit, interval.low);
    add(name + "_high" + unit, interval.high);
  }
};

void add_setting(Row& row, const Setting& setting) {
  row.add("width_px", setting.images.width_px);
  row.add("height_px", setting.images.height_px);
  row.add("antialias", setting.images.antialias);
  row.add("effects", name(setting.images.effects));
  row.add("estimator", name(setting.level));
  row.add("enough_m", setting.level == Level::kAdaptive ? setting.enough_m : kNoNumber);
  row.add("landmarks", setting.landmarks);
  row.add("bearings", setting.uses_bearings() ? 1 : 0);
  row.add("rate_hz", setting.rate_hz);
  row.add("frames", setting.frames);
}

void add_errors(Row& row, const std::string& name, const std::string& unit, const std::optional<ErrorFigures>& errors) {
  const ErrorFigures figures = errors.value_or(kNoErrors);
  row.add(name + "_mean", unit, figures.mean);
  row.add(name + "_rmse", unit, figures.rmse);
  row.add(name + "_p95", unit, figures.p95);
  row.add(name + "_max" + unit, figures.max);
}

void add_result(Row& row, const SettingResult& result) {
  add_setting(row, result.setting);
  row.add("frames_observed", result.frames);
  row.add("answered", result.answered);
  add_errors(row, "position", "_m", result.position_m);
  add_errors(row, "heading", "_rad", result.heading_rad);
  add_errors(row, "range", "_m", result.range_m);
  row.add("coverage", "", result.coverage.value_or(kNoInterval));
  row.add("bound_m", result.bound_m.value_or(kNoNumber));
}

void add_times(Row& row, const std::string& name, const TimeFigures& times) {
  row.add(name + "_median", "_s", times.median_s);
  row.add(name + "_spread_s", times.spread_s);
  row.add(name + "_p95", "_s", times.p95_s);
}

void add_costs(Row& row, const SettingResult& result) {
  add_times(row, "render", result.render_cpu);
  add_times(row, "vision", result.vision);
  add_times(row, "localisation", result.localisation);
  add_times(row, "robot", result.robot);
  row.add("simulation", "_s", result.simulation_time_s());
  row.add("peak_bytes", result.peak_bytes);
  row.add("render_bytes", result.render_bytes);
  row.add("robot_frontier", result.on_robot_frontier ? 1 : 0);
  row.add("simulation_frontier", result.on_simulation_frontier ? 1 : 0);
}

/// Returns a cell; for a number, the shortest digits that give the same number again.
std::string csv_cell(const Json& value) {
  if (value.is_number_float()) return fmt::format("{}", value.get<double>());
  return value.is_string() ? value.get<std::string>() : value.is_null() ? "" : value.dump();
}

std::string csv(const Sweep& sweep, bool has_costs) {
  std::string text;
  for (const SettingResult& result : sweep.settings) {
    Row row;
    add_result(row, result);
    if (has_costs) add_costs(row, result);
    std::vector<std::string> heads, cells;
    for (const auto& [head, value] : row.cells.items()) {
      heads.push_back(head);
      cells.push_back(csv_cell(value));
    }
    if (text.empty()) text = fmt::format("{}\n", fmt::join(heads, ","));
    text += fmt::format("{}\n", fmt::join(cells, ","));
  }
  return text;
}

Json json_of(const Sweep& sweep) {
  const auto index = [](const std::optional<std::size_t>& setting) { return setting ? Json(*setting) : Json(); };
  Json json{{"version", sweep.version},
            {"commit", sweep.commit},
            {"compiler", sweep.compiler},
            {"machine", sweep.machine},
            {"robot", sweep.robot},
            {"map", sweep.map},
            {"seed", sweep.seed},
            {"episodes", sweep.episodes},
            {"landmarks", sweep.landmarks},
            {"repeat", sweep.repeat},
            {"rules", rule_sentences()},
            {"least_answered", kLeastAnswered},
            {"paper", {{"mean_error_m", kPaperMeanError_m}, {"time_s", kPaperTime_s}}},
            {"as_is", index(sweep.as_is)},
            {"baseline", index(baseline_of(sweep))},
            {"conclusions", Json::object()},
            {"growth", growth_sentences(sweep)},
            {"settings", Json::array()}};
  for (const auto& [axis, sentence] : conclusions(sweep))
    json["conclusions"][std::string(facts_of(axis).name)] = sentence;
  for (const SettingResult& result : sweep.settings) {
    Row row;
    row.add("is", describe(result.setting));
    add_result(row, result);
    add_costs(row, result);
    json["settings"].push_back(std::move(row.cells));
  }
  return json;
}

}  // namespace

std::string errors_csv(const Sweep& sweep) { return csv(sweep, false); }
std::string tradeoff_csv(const Sweep& sweep) { return csv(sweep, true); }
std::string tradeoff_json(const Sweep& sweep) {
  return json_of(sweep).dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string page(const Sweep& sweep, const Choice* choice) {
  Json json = json_of(sweep);
  json["page"] = "tradeoff";
  if (choice != nullptr) {
    json["choice"] = {{"setting", choice->setting ? Json(*choice->setting) : Json()}, {"why", choice->why}};
  }
  return web::document(json, fmt::format("twocone tradeoff: robot {}, seed {}", sweep.robot, sweep.seed), table(sweep));
}

std::string table(const Sweep& sweep) {
  std::string text = head(sweep) + "\n";
  text += paragraph(
      "Errors in mm: mean, its interval, 95 % quantile, maximum. R, S: on the frontier of robot time (vision and "
      "localisation of a frame, 95 % quantile, ms), of simulation time (with rendering, s). Other times are medians of "
      "processor time; lm: landmarks searched for; bear: bearings are used.",
      "", "");
  text += "\n" + heads() + frontier_rows(sweep);
  if (const auto baseline = baseline_of(sweep)) {
    text += "method paper, as measured here:\n" + row(sweep.settings[*baseline]);
  }
  if (sweep.as_is) text += "the robot file, unchanged:\n" + row(sweep.settings[*sweep.as_is]);
  text += fmt::format("the paper's own, 2006: {:.0f} mm, about {:g} s a stereo frame\n\n", kPaperMeanError_m / kMm,
                      kPaperTime_s);
  text += counts(sweep) + "\n";
  for (const auto& [axis, sentence] : conclusions(sweep)) text += paragraph(sentence);
  const std::vector<std::string> grown = growth_sentences(sweep);
  if (!grown.empty()) text += "\nGrowth (exponents of power laws, 95 %):\n";
  for (const std::string& sentence : grown) text += paragraph(sentence, "  ", "    ");
  return text;
}

}  // namespace twocone::tradeoff
