// SPDX-License-Identifier: Apache-2.0
#include "apps/tradeoff/merge.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>

#include <fmt/format.h>

namespace twocone::tradeoff {
namespace {

void add(ByEpisode& values, int episode, double value) {
  if (episode < 0) throw std::invalid_argument(fmt::format("a row's episode is {}, must be >= 0", episode));
  if (values.size() <= std::size_t(episode)) values.resize(std::size_t(episode) + 1);
  values[std::size_t(episode)].push_back(value);
}

int count(const ByEpisode& values) {
  std::size_t n = 0;
  for (const auto& episode : values) n += episode.size();
  return int(n);
}

std::optional<ErrorFigures> errors_of(const ByEpisode& values) {
  ErrorFigures figures;
  figures.count = count(values);
  if (figures.count == 0) return std::nullopt;
  figures.mean = mean_interval(values, kConfidence);
  figures.rmse = rmse_interval(values, kConfidence);
  figures.p95 = quantile_interval(values, 0.95, kConfidence);
  figures.max = quantile_interval(values, 1, kConfidence).value;
  return figures;
}

TimeFigures times_of(const ByEpisode& values) {
  if (count(values) == 0) return {};
  TimeFigures figures;
  figures.median_s = quantile_interval(values, 0.5, kConfidence);
  figures.spread_s =
      quantile_interval(values, 0.75, kConfidence).value - quantile_interval(values, 0.25, kConfidence).value;
  figures.p95_s = quantile_interval(values, 0.95, kConfidence);
  return figures;
}

/// The numbers in all rows of one setting, and of its images.
struct Values {
  int frames = 0;  ///< those that require an answer
  ByEpisode position_m, heading_rad, range_m, in_ellipse, vision_s, localisation_s, robot_s;
  double bound_squares = 0;
  int bounds = 0;
  double peak_bytes = 0;
};
struct RenderValues {
  ByEpisode cpu_s;
  double peak_bytes = 0;
};
struct AllValues {
  std::vector<Values> settings;
  std::map<Images, RenderValues> images;
};

void add(Values& values, const FrameRow& row) {
  add(values.vision_s, row.episode, row.vision_s);
  add(values.localisation_s, row.episode, row.localisation_s);
  add(values.robot_s, row.episode, row.vision_s + row.localisation_s);
  if (row.verdict.empty()) return;
  ++values.frames;
  if (row.error_m) add(values.position_m, row.episode, *row.error_m);
  if (row.heading_error_rad) add(values.heading_rad, row.episode, *row.heading_error_rad);
  if (row.in_ellipse) add(values.in_ellipse, row.episode, *row.in_ellipse ? 1 : 0);
  if (row.bound_m) {
    values.bound_squares += *row.bound_m * *row.bound_m;
    ++values.bounds;
  }
}

AllValues values_of(const Plan& plan, const ShardRecord& all) {
  AllValues values{.settings = std::vector<Values>(plan.settings.size()), .images = {}};
  const auto index = [&plan](const auto& row) {
    if (row.setting >= 0 && std::size_t(row.setting) < plan.settings.size()) return std::size_t(row.setting);
    throw std::invalid_argument(
        fmt::format("a row is of setting {}, but the plan has 0 to {}", row.setting, int(plan.settings.size()) - 1));
  };
  const auto of = [&](const auto& row) -> Values& { return values.settings[index(row)]; };
  const auto images_of = [&](const auto& row) -> RenderValues& {
    return values.images[plan.settings[index(row)].images];
  };
  for (const FrameRow& row : all.frames) add(of(row), row);
  for (const RangeRow& row : all.ranges) add(of(row).range_m, row.episode, row.error_m);
  for (const RenderRow& row : all.renders) add(images_of(row).cpu_s, row.episode, row.cpu_s);
  for (const MemoryRow& row : all.memory) of(row).peak_bytes = std::max(of(row).peak_bytes, row.peak_bytes);
  for (const MemoryRow& row : all.render_memory) {
    images_of(row).peak_bytes = std::max(images_of(row).peak_bytes, row.peak_bytes);
  }
  return values;
}

SettingResult figures_of(const Setting& setting, const Values& values) {
  SettingResult result;
  result.setting = setting;
  result.frames = values.frames;
  result.answered = count(values.position_m);
  result.position_m = errors_of(values.position_m);
  result.heading_rad = errors_of(values.heading_rad);
  result.range_m = errors_of(values.range_m);
  if (count(values.in_ellipse) > 0) result.coverage = share_interval(values.in_ellipse, kConfidence);
  if (values.bounds > 0) result.bound_m = std::sqrt(values.bound_squares / values.bounds);
  result.vision = times_of(values.vision_s);
  result.localisation = times_of(values.localisation_s);
  result.robot = times_of(values.robot_s);
  result.peak_bytes = values.peak_bytes;
  return result;
}

}  // namespace

Sweep merge(const Plan& plan, const ShardRecord& all) {
  const AllValues values = values_of(plan, all);
  std::map<Images, TimeFigures> rendering;
  for (const auto& [images, of_images] : values.images) rendering[images] = times_of(of_images.cpu_s);
  Sweep sweep;
  for (std::size_t i = 0; i < plan.settings.size(); ++i) {
    SettingResult result = figures_of(plan.settings[i], values.settings[i]);
    if (const auto found = values.images.find(result.setting.images); found != values.images.end()) {
      result.render_cpu = rendering[found->first];
      result.render_bytes = found->second.peak_bytes;
    }
    sweep.settings.push_back(result);
  }
  mark_frontiers(sweep.settings);
  return sweep;
}

Check check_of(const Plan& plan, const ShardRecord& all, std::size_t setting) {
  const Values values = values_of(plan, all).settings.at(setting);
  return {values.position_m, values.robot_s, values.frames > 0 ? double(count(values.position_m)) / values.frames : 0};
}

}  // namespace twocone::tradeoff
