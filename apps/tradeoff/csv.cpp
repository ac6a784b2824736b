// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <optional>
#include <string_view>

#include <fmt/format.h>

#include "apps/tradeoff/output.h"
#include "apps/tradeoff/show/wording.h"

namespace twocone::tradeoff {
namespace {

/// Heads and rows are filled by the same calls, so that no column can lose its name.
class Table {
 public:
  void begin_row() {
    first_ = true;
    if (!rows_.empty()) rows_ += '\n';
    heads_done_ = !rows_.empty();
  }
  void add(std::string_view head, std::string_view cell) {
    if (!heads_done_) heads_ += fmt::format("{}{}", first_ ? "" : ",", head);
    rows_ += fmt::format("{}{}", first_ ? "" : ",", cell);
    first_ = false;
  }
  void add(std::string_view head, int value) { add(head, fmt::to_string(value)); }
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
  [[nodiscard]] std::string str() const { return heads_ + '\n' + (rows_.empty() ? "" : rows_ + '\n'); }

 private:
  std::string heads_, rows_;
  bool first_ = true, heads_done_ = false;
};

void add_setting(Table& table, const Setting& setting) {
  table.add("width_px", setting.images.width_px);
  table.add("height_px", setting.images.height_px);
  table.add("antialias", setting.images.antialias);
  table.add("effects", name(setting.images.effects));
  table.add("estimator", name(setting.level));
  table.add("enough_m", setting.level == Level::kAdaptive ? std::optional(setting.enough_m) : std::nullopt);
  table.add("landmarks", setting.landmarks);
  table.add("bearings", setting.uses_bearings() ? 1 : 0);
  table.add("rate_hz", std::optional(setting.rate_hz));
  table.add("frames", setting.frames);
}

void add_errors(Table& table, std::string_view name, std::string_view unit,
                const std::optional<ErrorFigures>& figures) {
  const auto add = [&](std::string_view what, Interval ErrorFigures::*member) {
    table.add(fmt::format("{}_{}", name, what), unit, figures ? std::optional((*figures).*member) : std::nullopt);
  };
  add("mean", &ErrorFigures::mean);
  add("rmse", &ErrorFigures::rmse);
  add("p95", &ErrorFigures::p95);
  table.add(fmt::format("{}_max{}", name, unit), figures ? std::optional(figures->max) : std::nullopt);
}

void add_result(Table& table, const SettingResult& result) {
  add_setting(table, result.setting);
  table.add("frames_observed", result.frames);
  table.add("answered", result.answered);
  add_errors(table, "position", "_m", result.position_m);
  add_errors(table, "heading", "_rad", result.heading_rad);
  add_errors(table, "range", "_m", result.range_m);
  table.add("coverage", "", result.coverage);
  table.add("bound_m", result.bound_m);
}

void add_times(Table& table, std::string_view name, const TimeFigures& times) {
  table.add(fmt::format("{}_median", name), "_s", times.median_s);
  table.add(fmt::format("{}_spread_s", name), std::optional(times.spread_s));
  table.add(fmt::format("{}_p95", name), "_s", times.p95_s);
}

void add_costs(Table& table, const SettingResult& result) {
  add_times(table, "render", result.render_cpu);
  add_times(table, "vision", result.vision);
  add_times(table, "localisation", result.localisation);
  add_times(table, "robot", result.robot);
  table.add("simulation", "_s", result.simulation_time_s());
  table.add("peak_bytes", std::optional(result.peak_bytes));
  table.add("render_bytes", std::optional(result.render_bytes));
  table.add("robot_frontier", result.on_robot_frontier ? 1 : 0);
  table.add("simulation_frontier", result.on_simulation_frontier ? 1 : 0);
}

}  // namespace

std::string errors_csv(const Sweep& sweep) {
  Table table;
  for (const SettingResult& result : sweep.settings) {
    table.begin_row();
    add_result(table, result);
  }
  return table.str();
}

std::string tradeoff_csv(const Sweep& sweep) {
  Table table;
  for (const SettingResult& result : sweep.settings) {
    table.begin_row();
    add_result(table, result);
    add_costs(table, result);
  }
  return table.str();
}

}  // namespace twocone::tradeoff
