// SPDX-License-Identifier: Apache-2.0
#include "apps/runs/run.h"

#include <fmt/format.h>

#include "apps/config/to_layers.h"
#include "apps/config/yaml/text_file.h"
#include "apps/runlog/version.h"

namespace twocone::runs {
namespace {

/// Returns the first difference between the scene's files then and now. Empty: no difference.
std::string changed_scene(const runlog::FileDigests& then, const runlog::FileDigests& now) {
  for (const auto& [file, digest] : then) {
    const auto same = now.find(file);
    if (same == now.end()) return file + " is not part of the scene any more";
    if (same->second != digest) return file + " has changed";
  }
  for (const auto& [file, digest] : now) {
    if (!then.contains(file)) return file + " was not part of the scene";
  }
  return {};
}

/// Returns why the run cannot be driven again. Empty: it can be.
std::string why_not(const std::filesystem::path& folder, const runlog::RunYaml& run) {
  const runlog::RunInfo& info = run.info;
  if (info.finished) return fmt::format("it is finished, with all its {} frames", info.frames_wanted);
  if (info.behaviour == runlog::kImported) return "it was imported: another program took its images";
  if (info.behaviour == "manual") return "a person drove it; begin a new run";
  if (info.behaviour == "controller") return "a program of its own drove it; begin a new run";
  if (!config::is_simulated(run.robot)) {
    return "its robot is real, and no program can put it back to its last pose; begin a new run";
  }
  if (!run.robot.attach.empty()) {
    return fmt::format(
        "its world '{}' is served by another program, where other robots may have moved; begin a new run",
        run.robot.attach);
  }
  if (estimation::time_limit_of(estimation::method_named(info.method), run.robot)) {
    return "it has a time budget, so that the clock took part in its answers; begin a new run";
  }
  const std::string then = fmt::format("{} ({}), {}", info.version, info.commit, info.compiler);
  const std::string now = fmt::format("{} ({}), {}", runlog::version(), runlog::commit(), runlog::compiler());
  if (then != now) return fmt::format("twocone {} made it, and this is {}", then, now);
  try {
    if (std::string changed = runlog::changed_since(folder); !changed.empty()) return changed;
  } catch (const config::FileError& error) {
    return error.what();
  }
  return changed_scene(info.scene_files, runlog::scene_files(run.map));
}

}  // namespace

std::string why_not_resumed(const std::filesystem::path& folder) {
  return why_not(folder, runlog::read_run_yaml(folder));
}

Result<runlog::RunInfo> resume(const std::filesystem::path& folder, const RunOptions& options, const Progress& progress,
                               const std::atomic<bool>& stop) {
  const runlog::RunYaml run = runlog::read_run_yaml(folder);
  if (const std::string reason = why_not(folder, run); !reason.empty()) {
    throw config::FileError("{} cannot be resumed: {}", folder.string(), reason);
  }
  config::Robot robot = config::read_robot(run.robot.file, run.robot.changes);
  robot.estimator = run.robot.estimator;  // may be from the command line
  RunOptions again = options;
  again.frames = run.info.frames_wanted;
  again.behaviour = run.info.behaviour;
  again.method = estimation::method_named(run.info.method);
  again.seed = run.info.seed;
  again.truth = run.info.truth;
  again.real_time = run.info.real_time;
  again.maps = run.info.maps;
  again.telemetry = run.info.telemetry;
  again.rendered_before = run.info.renderer;
  // An image of another renderer would give other rows, and the run would be rejected. Before there was another one,
  // all images were POV-Ray's.
  again.renderer = sim_povray::RendererKind::kPovray;
  if (run.info.renderer == "native") again.renderer = sim_povray::RendererKind::kAuto;
  if (run.info.renderer == "native unchecked") again.renderer = sim_povray::RendererKind::kNative;
  again.out = folder;
  again.old = runlog::OldLines::kKeep;
  again.replace = false;
  return runs::run(robot, config::read_map(run.map.file), again, progress, stop);
}

}  // namespace twocone::runs
