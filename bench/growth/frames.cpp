// SPDX-License-Identifier: Apache-2.0
#include <sys/resource.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <fstream>
#include <sstream>

#include <fmt/format.h>

#include "apps/config/map_file.h"
#include "apps/config/robot_file.h"
#include "apps/runs/run.h"
#include "base/child_process.h"
#include "bench/growth/growth.h"

namespace twocone::bench {
namespace {

namespace fs = std::filesystem;

constexpr std::array kFrames{25, 50, 100, 200};

double cpu_s(int processes) {
  rusage usage{};
  ::getrusage(processes, &usage);
  double sum = 0;
  for (const timeval& t : {usage.ru_utime, usage.ru_stime}) sum += double(t.tv_sec) + 1e-6 * double(t.tv_usec);
  return sum;
}

/// Returns the peak memory of this process since it started this program.
double peak_mib() {
  const std::uint64_t bytes = base::peak_memory_bytes(::getpid());
  if (bytes == 0) throw std::runtime_error("/proc/self/status has no VmHWM");
  return double(bytes) / (1024 * 1024);
}

struct RunFigures {
  double wall_s = 0, own_cpu_s = 0, povray_cpu_s = 0, peak_mib = 0;
};

/// Measures a run in a separate process, because the peak memory of a process never falls.
RunFigures figures_of(int frames, const Options& options) {
  base::ChildRequest request;
  request.program.path = fs::read_symlink("/proc/self/exe").string();
  request.program.arguments = {"--run-alone", std::to_string(frames), "--scratch", options.scratch.string()};
  for (char** entry = environ; *entry != nullptr; ++entry) request.program.environment.emplace_back(*entry);
  request.program.folder = options.scratch.string();
  request.max_output = 4096;
  request.timeout = std::chrono::minutes(30);
  const base::ChildResult result = base::run_child(request);
  if (result.end != base::ChildResult::End::kEnded || result.wait_status != 0) {
    throw std::runtime_error(fmt::format("a run of {} frames: {}", frames, result.errors));
  }
  RunFigures figures;
  std::istringstream line(result.output);
  if (!(line >> figures.wall_s >> figures.own_cpu_s >> figures.povray_cpu_s >> figures.peak_mib)) {
    throw std::runtime_error("cannot read a run's figures: " + result.output);
  }
  return figures;
}

}  // namespace

void run_alone(int frames, const fs::path& scratch) {
  const fs::path file = scratch / "small.yaml";
  const config::Robot lab = config::read_robot(TWOCONE_SOURCE_DIR "/robots/lab_sim.yaml");
  std::ofstream(file) << config::robot_text(lab.file, file, config::scaled(lab, 0.25), {});
  const config::Robot robot = config::read_robot(file);
  const config::Map map = config::read_map(robot.map);
  runs::RunOptions options;
  options.frames = frames;
  options.method = estimation::Method::kOutline;
  options.out = scratch / "run";
  fs::remove_all(options.out);
  const std::atomic<bool> stop{false};
  const double begin_s = wall_s();
  (void)value(runs::run(
      robot, map, options, [](double) {}, stop));
  fmt::print("{} {} {} {}\n", wall_s() - begin_s, cpu_s(RUSAGE_SELF), cpu_s(RUSAGE_CHILDREN), peak_mib());
}

Growth grow_frames(const Options& options) {
  Growth growth;
  growth.title = "Frames of a run";
  growth.what =
      "`twocone run` in the lab with images of 160 x 120 pixels, method `outline` (and `paper` beside it, as always), "
      "each in a process of its own. Memory is that of the program, without POV-Ray's.";
  growth.size_name = "frames";
  Column wall{"wall time, s", 2, {}};
  Column own{"own processor time, s", 2, {}};
  Column povray{"POV-Ray's processor time, s", 2, {}};
  Column memory{"peak memory, MiB", 1, {}};
  for (const int frames : kFrames) {
    growth.sizes.push_back(frames);
    growth.labels.push_back(std::to_string(frames));
    for (Column* column : {&wall, &own, &povray, &memory}) column->repeats.emplace_back();
    for (int repeat = 0; repeat < options.repeats; ++repeat) {
      const RunFigures figures = figures_of(frames, options);
      wall.repeats.back().push_back(figures.wall_s);
      own.repeats.back().push_back(figures.own_cpu_s);
      povray.repeats.back().push_back(figures.povray_cpu_s);
      memory.repeats.back().push_back(figures.peak_mib);
    }
  }
  growth.columns = {wall, own, povray, memory};
  return growth;
}

}  // namespace twocone::bench
