// SPDX-License-Identifier: Apache-2.0
#include "apps/tradeoff/run_shards.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <string>

#include <fmt/format.h>

#include "apps/report/kit/plain_text.h"
#include "apps/runlog/storage/disk.h"
#include "apps/runlog/version.h"
#include "apps/tradeoff/output.h"
#include "base/errors.h"

namespace twocone::tradeoff {
namespace {

/// Returns a number that is about proportional to the time of a shard. Rendering grows with the number of pixels, and
/// anti-aliasing with the fraction of pixels that it smooths, about a quarter (ViewSettings::antialias).
double weight_of(const Plan::Shard& shard) {
  const double rays = 1 + 0.25 * (shard.images.antialias * shard.images.antialias - 1);
  return double(shard.images.width_px) * shard.images.height_px * rays * shard.episodes;
}

std::string machine() {
  std::ifstream info("/proc/cpuinfo");
  std::string line, model = "unknown processor";
  while (std::getline(info, line) && !line.starts_with("model name")) continue;
  const std::size_t text = line.find_first_not_of(" \t", line.find(':') + 1);
  if (info && text != std::string::npos) model = line.substr(text);
  return fmt::format("{}, {} cores", model, ::sysconf(_SC_NPROCESSORS_ONLN));
}

/// Returns the robot file's own setting, unchanged.
Setting as_is(const Subject& subject) {
  const config::Robot& robot = subject.robot;
  const config::EstimatorKeys& keys = robot.estimator;
  Setting setting{
      .images = {robot.lower.settings.width_px, robot.lower.settings.height_px, robot.lower.antialias, Effects::kScene},
      .landmarks = int(keys.landmarks.empty() ? subject.plan.landmarks.size() : keys.landmarks.size()),
      .bearings = keys.bearings,
      .rate_hz = robot.lower.settings.rate_hz};
  const std::string& level = keys.method == name(Level::kPaper) ? keys.method : keys.stage;
  for (const Level known : {Level::kPaper, Level::kFound, Level::kCoarse, Level::kAdaptive}) {
    if (level == name(known)) setting.level = known;
  }
  if (setting.level == Level::kAdaptive) setting.enough_m = keys.enough_m;
  return setting;
}

// ---- the figures of each setting

void add(ByEpisode& values, int episode, double value) {
  if (episode < 0) throw base::InvalidArgument("a row's episode is {}, must be >= 0", episode);
  if (values.size() <= std::size_t(episode)) values.resize(std::size_t(episode) + 1);
  values[std::size_t(episode)].push_back(value);
}

int count(const ByEpisode& values) {
  std::size_t n = 0;
  for (const auto& episode : values) n += episode.size();
  return int(n);
}

std::optional<ErrorFigures> errors_of(const ByEpisode& values) {
  if (count(values) == 0) return std::nullopt;
  ErrorFigures figures;
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

/// The numbers in all rows of one setting. The first setting of a set of images also has the numbers of the images.
struct Values {
  int frames = 0;  ///< number of frames that require an answer
  ByEpisode position_m, heading_rad, range_m, in_ellipse, vision_s, localisation_s, robot_s;
  double bound_squares = 0;
  int bounds = 0;
  double peak_bytes = 0;
  ByEpisode render_s;
  double render_bytes = 0;
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

std::vector<Values> values_of(const Plan& plan, const ShardRecord& all) {
  std::vector<Values> values(plan.settings.size());
  const auto of = [&](const auto& row) -> Values& {
    if (row.setting >= 0 && std::size_t(row.setting) < values.size()) return values[std::size_t(row.setting)];
    throw base::InvalidArgument("a row is of setting {}, but the plan has 0 to {}", row.setting,
                                int(plan.settings.size()) - 1);
  };
  for (const FrameRow& row : all.frames) add(of(row), row);
  for (const RangeRow& row : all.ranges) add(of(row).range_m, row.episode, row.error_m);
  for (const RenderRow& row : all.renders) add(of(row).render_s, row.episode, row.cpu_s);
  for (const MemoryRow& row : all.memory) of(row).peak_bytes = std::max(of(row).peak_bytes, row.peak_bytes);
  for (const MemoryRow& row : all.render_memory) of(row).render_bytes = std::max(of(row).render_bytes, row.peak_bytes);
  return values;
}

SettingResult figures_of(const Setting& setting, const Values& values, const Values& of_images) {
  SettingResult result;
  result.setting = setting;
  result.frames = values.frames;
  result.answered = count(values.position_m);
  result.position_m = errors_of(values.position_m);
  result.heading_rad = errors_of(values.heading_rad);
  result.range_m = errors_of(values.range_m);
  if (count(values.in_ellipse) > 0) result.coverage = share_interval(values.in_ellipse, kConfidence);
  if (values.bounds > 0) result.bound_m = std::sqrt(values.bound_squares / values.bounds);
  result.render_cpu = times_of(of_images.render_s);
  result.vision = times_of(values.vision_s);
  result.localisation = times_of(values.localisation_s);
  result.robot = times_of(values.robot_s);
  result.peak_bytes = values.peak_bytes;
  result.render_bytes = of_images.render_bytes;
  return result;
}

}  // namespace

Result<std::size_t> run_shards(const Subject& subject, const SweepFolder& folder,
                               const std::vector<std::size_t>& shards, const Watch& watch,
                               const std::atomic<bool>& stop) {
  sim_povray::RenderSettings render;
  render.notice = watch.report;
  const RunShard run = shard_runner(subject.robot, subject.map, subject.plan, render);
  double all = 0, before = 0;
  for (const std::size_t shard : shards) all += weight_of(subject.plan.shards.at(shard));
  std::size_t done = 0;
  for (const std::size_t shard : shards) {
    if (stop) break;
    const double weight = weight_of(subject.plan.shards[shard]);
    if (!folder.has(shard)) {
      const auto progress = [&](double share) { watch.progress((before + share * weight) / all); };
      const Result<ShardRecord> record = run(shard, progress, stop);
      if (!record && stop) break;
      if (!record) return with_name(fmt::format("shard {}", shard), record.error());
      folder.add(shard, *record);
    }
    before += weight;
    ++done;
  }
  return done;
}

Sweep merge(const Plan& plan, const ShardRecord& all) {
  const std::vector<Values> values = values_of(plan, all);
  Sweep sweep;
  for (std::size_t i = 0; i < plan.settings.size(); ++i) {
    const Setting& setting = plan.settings[i];
    sweep.settings.push_back(figures_of(setting, values[i], values[first_of(plan, setting.images)]));
  }
  mark_frontiers(sweep.settings);
  return sweep;
}

Check check_of(const Plan& plan, const ShardRecord& all, std::size_t setting) {
  const Values values = values_of(plan, all).at(setting);
  return {values.position_m, values.robot_s, values.frames > 0 ? double(count(values.position_m)) / values.frames : 0};
}

Sweep finish_sweep(const Subject& subject, const SweepFolder& folder) {
  const PlanOptions& asked = subject.plan.options;
  Sweep sweep = merge(subject.plan, folder.read_all());
  sweep.robot = subject.robot.file.string();
  sweep.map = subject.map.file.string();
  sweep.version = runlog::version();
  sweep.commit = runlog::commit();
  sweep.compiler = runlog::compiler();
  sweep.machine = machine();
  sweep.repeat = fmt::format("twocone tradeoff {} --episodes {} --seed {}{}", report::robot_options(subject.robot),
                             asked.episodes, asked.seed, asked.fine ? " --fine" : "");
  sweep.seed = asked.seed;
  sweep.episodes = int(subject.plan.episodes.size());
  sweep.landmarks = subject.plan.landmarks;
  const auto& settings = subject.plan.settings;
  const auto same = std::find(settings.begin(), settings.end(), as_is(subject));
  if (same != settings.end()) sweep.as_is = std::size_t(same - settings.begin());
  runlog::write_whole(folder.path() / "errors.csv", errors_csv(sweep));
  runlog::write_whole(folder.path() / "tradeoff.csv", tradeoff_csv(sweep));
  runlog::write_whole(folder.path() / "tradeoff.json", tradeoff_json(sweep));
  runlog::write_whole(folder.path() / "tradeoff.txt", table(sweep));
  return sweep;
}

Result<Check> run_check(const Subject& subject, const SweepFolder& folder, const Setting& setting, int episodes,
                        const Watch& watch, const std::atomic<bool>& stop) {
  const Images& images = setting.images;
  const Plan plan = make_check_plan(subject.robot, subject.map, subject.plan, images, episodes);
  const std::string name = fmt::format("{}x{}-R{}-{}-episodes{}", images.width_px, images.height_px, images.antialias,
                                       tradeoff::name(images.effects), episodes);
  const SweepFolder own(folder.path() / "checks" / name, subject.robot, subject.map, plan);
  const std::vector<std::size_t> missing = own.missing();
  const Result<std::size_t> done = run_shards({subject.robot, subject.map, plan}, own, missing, watch, stop);
  if (!done) return done.error();
  if (*done < missing.size()) return Error{ErrorCode::kCancelled, "stopped"};

  const auto number = std::find(plan.settings.begin(), plan.settings.end(), setting) - plan.settings.begin();
  return check_of(plan, own.read_all(), std::size_t(number));
}

}  // namespace twocone::tradeoff
