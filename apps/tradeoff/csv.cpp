// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <concepts>
#include <optional>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "apps/tradeoff/output.h"

namespace twocone::tradeoff {
namespace {

/// A row's cells, each with its head, so that no column can lose its name.
struct Row {
  std::vector<std::string> heads, cells;

  void add(std::string_view head, std::string_view cell) {
    heads.emplace_back(head);
    cells.emplace_back(cell);
  }
  void add(std::string_view head, std::integral auto value) { add(head, fmt::to_string(value)); }
  /// Adds the shortest digits that give the same number again; an empty cell for a number that is not finite.
  void add(std::string_view head, std::optional<double> value) {
    add(head, value && std::isfinite(*value) ? fmt::format("{}", *value) : "");
  }
  /// Adds NAME_UNIT, NAME_low_UNIT, NAME_high_UNIT. @param unit with its underscore; empty for a share
  void add(std::string_view name, std::string_view unit, const std::optional<Interval>& interval) {
    add(fmt::format("{}{}", name, unit), interval ? std::optional(interval->value) : std::nullopt);
    add(fmt::format("{}_low{}", name, unit), interval ? std::optional(interval->low) : std::nullopt);
    add(fmt::format("{}_high{}", name, unit), interval ? std::optional(interval->high) : std::nullopt);
  }
};

void add_setting(Row& row, const Setting& setting) {
  row.add("width_px", setting.images.width_px);
  row.add("height_px", setting.images.height_px);
  row.add("antialias", setting.images.antialias);
  row.add("effects", name(setting.images.effects));
  row.add("estimator", name(setting.level));
  row.add("enough_m", setting.level == Level::kAdaptive ? std::optional(setting.enough_m) : std::nullopt);
  row.add("landmarks", setting.landmarks);
  row.add("bearings", setting.uses_bearings() ? 1 : 0);
  row.add("rate_hz", setting.rate_hz);
  row.add("frames", setting.frames);
}

void add_errors(Row& row, std::string_view name, std::string_view unit, const std::optional<ErrorFigures>& figures) {
  const auto add = [&](std::string_view what, Interval ErrorFigures::*member) {
    row.add(fmt::format("{}_{}", name, what), unit, figures ? std::optional((*figures).*member) : std::nullopt);
  };
  add("mean", &ErrorFigures::mean);
  add("rmse", &ErrorFigures::rmse);
  add("p95", &ErrorFigures::p95);
  row.add(fmt::format("{}_max{}", name, unit), figures ? std::optional(figures->max) : std::nullopt);
}

void add_result(Row& row, const SettingResult& result) {
  add_setting(row, result.setting);
  row.add("frames_observed", result.frames);
  row.add("answered", result.answered);
  add_errors(row, "position", "_m", result.position_m);
  add_errors(row, "heading", "_rad", result.heading_rad);
  add_errors(row, "range", "_m", result.range_m);
  row.add("coverage", "", result.coverage);
  row.add("bound_m", result.bound_m);
}

void add_times(Row& row, std::string_view name, const TimeFigures& times) {
  row.add(fmt::format("{}_median", name), "_s", times.median_s);
  row.add(fmt::format("{}_spread_s", name), times.spread_s);
  row.add(fmt::format("{}_p95", name), "_s", times.p95_s);
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

std::string csv(const Sweep& sweep, bool has_costs) {
  std::string text;
  for (const SettingResult& result : sweep.settings) {
    Row row;
    add_result(row, result);
    if (has_costs) add_costs(row, result);
    if (text.empty()) text = fmt::format("{}\n", fmt::join(row.heads, ","));
    text += fmt::format("{}\n", fmt::join(row.cells, ","));
  }
  return text;
}

}  // namespace

std::string errors_csv(const Sweep& sweep) { return csv(sweep, false); }
std::string tradeoff_csv(const Sweep& sweep) { return csv(sweep, true); }

}  // namespace twocone::tradeoff
