// SPDX-License-Identifier: Apache-2.0
#include "apps/tradeoff/merge.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>

#include <fmt/format.h>

#include "apps/tradeoff/frontier.h"

namespace twocone::tradeoff {
namespace {

constexpr double kLevel = 0.95;

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
  figures.mean = mean_interval(values, kLevel);
  figures.rmse = rmse_interval(values, kLevel);
  figures.p95 = quantile_interval(values, 0.95, kLevel);
  figures.max = quantile_interval(values, 1, kLevel).value;
  return figures;
}

TimeFigures times_of(const ByEpisode& values) {
  if (count(values) == 0) return {};
  TimeFigures figures;
  figures.median_s = quantile_interval(values, 0.5, kLevel);
  figures.spread_s = quantile_interval(values, 0.75, kLevel).value - quantile_interval(values, 0.25, kLevel).value;
  figures.p95_s = quantile_interval(values, 0.95, kLevel);
  return figures;
}

/// All rows of one setting and of its images.
struct Rows {
  std::vector<const FrameRow*> frames;
  ByEpisode ranges;
  double peak_bytes = 0;
};
struct RenderRows {
  ByEpisode cpu_s;
  double peak_bytes = 0;
};
struct Sorted {
  std::vector<Rows> settings;
  std::map<Images, RenderRows> images;
};

Sorted sorted_rows(const Plan& plan, const ShardRecord& all) {
  Sorted sorted{.settings = std::vector<Rows>(plan.settings.size()), .images = {}};
  const auto index = [&plan](const auto& row) {
    if (row.setting >= 0 && std::size_t(row.setting) < plan.settings.size()) return std::size_t(row.setting);
    throw std::invalid_argument(
        fmt::format("a row is of setting {}, but the plan has 0 to {}", row.setting, int(plan.settings.size()) - 1));
  };
  const auto of = [&](const auto& row) -> Rows& { return sorted.settings[index(row)]; };
  const auto images_of = [&](const auto& row) -> RenderRows& {
    return sorted.images[plan.settings[index(row)].images];
  };
  for (const FrameRow& row : all.frames) of(row).frames.push_back(&row);
  for (const RangeRow& row : all.ranges) add(of(row).ranges, row.episode, row.error_m);
  for (const RenderRow& row : all.renders) add(images_of(row).cpu_s, row.episode, row.cpu_s);
  for (const MemoryRow& row : all.memory) of(row).peak_bytes = std::max(of(row).peak_bytes, row.peak_bytes);
  for (const MemoryRow& row : all.render_memory) {
    images_of(row).peak_bytes = std::max(images_of(row).peak_bytes, row.peak_bytes);
  }
  return sorted;
}

SettingResult figures_of(const Setting& setting, const Rows& rows) {
  SettingResult result;
  result.setting = setting;
  ByEpisode position, heading, in_ellipse, vision, localisation, robot;
  double bound_squares = 0;
  int bounds = 0;
  for (const FrameRow* row : rows.frames) {
    add(vision, row->episode, row->vision_s);
    add(localisation, row->episode, row->localisation_s);
    add(robot, row->episode, row->vision_s + row->localisation_s);
    if (row->verdict.empty()) continue;
    ++result.frames;
    if (row->error_m) add(position, row->episode, *row->error_m);
    if (row->heading_error_rad) add(heading, row->episode, *row->heading_error_rad);
    if (row->in_ellipse) add(in_ellipse, row->episode, *row->in_ellipse ? 1 : 0);
    if (row->bound_m) {
      bound_squares += *row->bound_m * *row->bound_m;
      ++bounds;
    }
  }
  result.answered = count(position);
  result.position_m = errors_of(position);
  result.heading_rad = errors_of(heading);
  result.range_m = errors_of(rows.ranges);
  if (count(in_ellipse) > 0) result.coverage = share_interval(in_ellipse, kLevel);
  if (bounds > 0) result.bound_m = std::sqrt(bound_squares / bounds);
  result.vision = times_of(vision);
  result.localisation = times_of(localisation);
  result.robot = times_of(robot);
  result.peak_bytes = rows.peak_bytes;
  return result;
}

}  // namespace

Sweep merge(const Plan& plan, const ShardRecord& all) {
  const Sorted sorted = sorted_rows(plan, all);
  std::map<Images, TimeFigures> rendering;
  for (const auto& [images, rows] : sorted.images) rendering[images] = times_of(rows.cpu_s);
  Sweep sweep;
  for (std::size_t i = 0; i < plan.settings.size(); ++i) {
    SettingResult result = figures_of(plan.settings[i], sorted.settings[i]);
    if (const auto rows = sorted.images.find(result.setting.images); rows != sorted.images.end()) {
      result.render_cpu = rendering[rows->first];
      result.render_bytes = rows->second.peak_bytes;
    }
    sweep.settings.push_back(result);
  }
  mark_frontiers(sweep.settings);
  return sweep;
}

ByEpisode position_errors(const ShardRecord& all, int setting) {
  ByEpisode errors_m;
  for (const FrameRow& row : all.frames) {
    if (row.setting == setting && !row.verdict.empty() && row.error_m) add(errors_m, row.episode, *row.error_m);
  }
  return errors_m;
}

ByEpisode robot_times(const ShardRecord& all, int setting) {
  ByEpisode times_s;
  for (const FrameRow& row : all.frames) {
    if (row.setting == setting) add(times_s, row.episode, row.vision_s + row.localisation_s);
  }
  return times_s;
}

}  // namespace twocone::tradeoff
