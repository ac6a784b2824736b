// SPDX-License-Identifier: Apache-2.0
#include "apps/tradeoff/run_shards.h"

#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <memory>
#include <string>

#include <fmt/format.h>

#include "apps/report/table.h"
#include "apps/runs/disk.h"
#include "apps/runs/version.h"
#include "apps/tradeoff/merge.h"
#include "apps/tradeoff/output.h"
#include "apps/tradeoff/shard.h"

namespace twocone::tradeoff {
namespace {

/// POV-Ray processes of one job: as many in all as one job has, but two at least, for a pair of pictures.
int processes_of(int jobs) { return std::max(2, sim_povray::RenderSettings{}.processes / jobs); }

/// About proportional to the time that a shard takes: rendering goes with pixels, anti-aliasing with the share of a
/// picture's pixels that it smooths, a quarter or so (ViewSettings::antialias).
double weight_of(const Plan::Shard& shard) {
  const double rays = 1 + 0.25 * (shard.pictures.antialias * shard.pictures.antialias - 1);
  return double(shard.pictures.width_px) * shard.pictures.height_px * rays * shard.legs;
}

std::vector<Piece> pieces_of(const Plan& plan, const std::vector<std::size_t>& shards) {
  std::vector<Pictures> kinds;
  std::vector<Piece> pieces;
  for (const std::size_t shard : shards) {
    const Plan::Shard& planned = plan.shards.at(shard);
    const auto kind = std::find(kinds.begin(), kinds.end(), planned.pictures);
    pieces.push_back({shard, std::size_t(kind - kinds.begin()), weight_of(planned)});
    if (kind == kinds.end()) kinds.push_back(planned.pictures);
  }
  return pieces;
}

std::string machine() {
  std::ifstream info("/proc/cpuinfo");
  std::string line, model = "unknown processor";
  while (std::getline(info, line)) {
    if (line.rfind("model name", 0) != 0) continue;
    const std::size_t text = line.find_first_not_of(" \t", line.find(':') + 1);
    if (text != std::string::npos) model = line.substr(text);
    break;
  }
  return fmt::format("{}, {} cores", model, ::sysconf(_SC_NPROCESSORS_ONLN));
}

/// What the robot file says, as a setting.
Setting as_is(const Subject& subject) {
  const files::Robot& robot = subject.robot;
  const files::EstimatorKeys& keys = robot.estimator;
  Setting setting;
  setting.pictures = {robot.lower.width_px, robot.lower.height_px, robot.lower.antialias, Effects::kScene};
  if (keys.method == "paper") {
    setting.level = Level::kPaper;
  } else if (keys.stage == "found") {
    setting.level = Level::kFound;
  } else if (keys.stage == "coarse") {
    setting.level = Level::kCoarse;
  } else if (keys.stage == "adaptive") {
    setting.level = Level::kAdaptive;
    setting.enough_m = keys.enough_m;
  }
  setting.landmarks = int(keys.landmarks.empty() ? subject.plan.landmarks.size() : keys.landmarks.size());
  setting.bearings = keys.bearings;
  setting.rate_hz = robot.lower.rate_hz;
  return setting;
}

}  // namespace

Result<std::size_t> run_shards(const Subject& subject, const SweepFolder& folder,
                               const std::vector<std::size_t>& shards, const WorkOptions& options,
                               const std::atomic<bool>& stop) {
  const auto start = [&](const Tell& tell) -> DoShard {
    sim_povray::RenderSettings render;
    render.processes = processes_of(options.jobs);
    render.notice = tell;
    auto runner = std::make_shared<ShardRunner>(subject.robot, subject.map, subject.plan, render);
    return [runner, &folder](std::size_t shard, const std::function<void(double)>& progress,
                             const std::atomic<bool>& child_stop) -> Status {
      // By another program meanwhile.
      if (folder.has(shard)) return {};
      const Result<ShardRecord> record = runner->run(shard, progress, child_stop);
      if (!record) return record.error();
      folder.add(shard, *record);
      return {};
    };
  };
  return run_in_children(pieces_of(subject.plan, shards), options, start, stop);
}

Sweep finish_sweep(const Subject& subject, const SweepFolder& folder) {
  const PlanOptions& asked = subject.plan.options;
  Sweep sweep = merge(subject.plan, folder.read_all());
  sweep.robot = subject.robot.file.string();
  sweep.map = subject.map.file.string();
  sweep.version = runs::version();
  sweep.commit = runs::commit();
  sweep.compiler = runs::compiler();
  sweep.machine = machine();
  sweep.repeat = fmt::format("twocone tradeoff --robot {} --legs {} --seed {}{}", report::shell_word(sweep.robot),
                             asked.legs, asked.seed, asked.fine ? " --fine" : "");
  sweep.seed = asked.seed;
  sweep.legs = int(subject.plan.legs.size());
  sweep.landmarks = subject.plan.landmarks;
  const auto& settings = subject.plan.settings;
  const auto same = std::find(settings.begin(), settings.end(), as_is(subject));
  if (same != settings.end()) sweep.as_is = std::size_t(same - settings.begin());
  runs::write_whole(folder.path() / "errors.csv", errors_csv(sweep));
  runs::write_whole(folder.path() / "tradeoff.csv", tradeoff_csv(sweep));
  runs::write_whole(folder.path() / "tradeoff.txt", table(sweep));
  return sweep;
}

Result<Check> run_check(const Subject& subject, const SweepFolder& folder, const Setting& setting, int legs,
                        const WorkOptions& options, const std::atomic<bool>& stop) {
  const Pictures& pictures = setting.pictures;
  const Plan plan = make_check_plan(subject.robot, subject.map, subject.plan, pictures, legs);
  const Subject checked{subject.robot, subject.map, plan};
  const std::string name = fmt::format("{}x{}-R{}-{}-legs{}", pictures.width_px, pictures.height_px, pictures.antialias,
                                       tradeoff::name(pictures.effects), legs);
  const SweepFolder own(folder.path() / "checks" / name, subject.robot, subject.map, plan);
  const std::vector<std::size_t> missing = own.missing();
  const Result<std::size_t> done = run_shards(checked, own, missing, options, stop);
  if (!done) return done.error();
  if (*done < missing.size()) return Error{ErrorCode::kRefused, "stopped"};

  const int number = int(std::find(plan.settings.begin(), plan.settings.end(), setting) - plan.settings.begin());
  const ShardRecord record = own.read_all();
  int frames = 0, answered = 0;
  for (const FrameRow& row : record.frames) {
    // Without a verdict no answer was due: the frame was one on the way to that of several.
    if (row.setting != number || row.verdict.empty()) continue;
    ++frames;
    if (row.error_m) ++answered;
  }
  return Check{position_errors(record, number), robot_times(record, number),
               frames > 0 ? double(answered) / frames : 0};
}

}  // namespace twocone::tradeoff
