// SPDX-License-Identifier: Apache-2.0
#include "apps/tradeoff/run_shards.h"

#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <string>

#include <fmt/format.h>

#include "apps/report/kit/plain_text.h"
#include "apps/runlog/storage/disk.h"
#include "apps/runlog/version.h"
#include "apps/tradeoff/merge.h"
#include "apps/tradeoff/output.h"
#include "apps/tradeoff/shard.h"

namespace twocone::tradeoff {
namespace {

/// About proportional to the time of a shard: rendering grows with the number of pixels, and anti-aliasing with the
/// fraction of pixels that it smooths, about a quarter (ViewSettings::antialias).
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
  Setting setting;
  setting.images = {robot.lower.width_px, robot.lower.height_px, robot.lower.antialias, Effects::kScene};
  const std::string& level = keys.method == name(Level::kPaper) ? keys.method : keys.stage;
  for (const Level known : {Level::kPaper, Level::kFound, Level::kCoarse, Level::kAdaptive}) {
    if (level == name(known)) setting.level = known;
  }
  if (setting.level == Level::kAdaptive) setting.enough_m = keys.enough_m;
  setting.landmarks = int(keys.landmarks.empty() ? subject.plan.landmarks.size() : keys.landmarks.size());
  setting.bearings = keys.bearings;
  setting.rate_hz = robot.lower.rate_hz;
  return setting;
}

}  // namespace

Result<std::size_t> run_shards(const Subject& subject, const SweepFolder& folder,
                               const std::vector<std::size_t>& shards, const Watch& watch,
                               const std::atomic<bool>& stop) {
  sim_povray::RenderSettings render;
  render.notice = watch.tell;
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
      if (!record) return Error{record.error().code, fmt::format("shard {}: {}", shard, record.error().message)};
      folder.add(shard, *record);
    }
    before += weight;
    ++done;
  }
  return done;
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
  sweep.repeat = fmt::format("twocone tradeoff --robot {} --episodes {} --seed {}{}", report::shell_word(sweep.robot),
                             asked.episodes, asked.seed, asked.fine ? " --fine" : "");
  sweep.seed = asked.seed;
  sweep.episodes = int(subject.plan.episodes.size());
  sweep.landmarks = subject.plan.landmarks;
  const auto& settings = subject.plan.settings;
  const auto same = std::find(settings.begin(), settings.end(), as_is(subject));
  if (same != settings.end()) sweep.as_is = std::size_t(same - settings.begin());
  runlog::write_whole(folder.path() / "errors.csv", errors_csv(sweep));
  runlog::write_whole(folder.path() / "tradeoff.csv", tradeoff_csv(sweep));
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
