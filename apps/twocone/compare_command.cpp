// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "apps/compare/compare.h"
#include "apps/compare/correct.h"
#include "apps/compare/render_again.h"
#include "apps/compare/show/page.h"
#include "apps/runs/disk.h"
#include "apps/runs/run_lock.h"
#include "apps/twocone/commands.h"
#include "apps/twocone/progress_bar.h"
#include "apps/twocone/standard_streams.h"
#include "apps/twocone/stop_signals.h"

namespace twocone::cli {
namespace {

struct Options {
  std::vector<std::filesystem::path> runs;
  std::filesystem::path scene;
  std::filesystem::path poses;
  std::filesystem::path out;
  std::filesystem::path write_robot;
  bool force = false;
  bool page = true;
  compare::Settings settings;
  std::map<std::string, std::optional<double>> limits;
};

/// Beside F.yaml, F_sim.yaml.
std::filesystem::path twin_of(const std::filesystem::path& robot) {
  return robot.parent_path() / (robot.stem().string() + "_sim" + robot.extension().string());
}

void check(const Options& options) {
  if (options.scene.empty() && options.runs.size() != 2) {
    throw BadUsage(
        fmt::format("{} run folder given: it takes a simulated and a real one, or a real one with --scene MAP.yaml",
                    options.runs.size()));
  }
  if (!options.scene.empty() && options.runs.size() != 1) {
    throw BadUsage("--scene renders the real run's places again: give one run folder, the real one");
  }
  for (const auto& [key, value] : options.limits) {
    if (value && !(std::isfinite(*value) && *value >= 0)) {
      throw BadUsage(fmt::format("--max-{} is {}, must be a number >= 0", key, *value));
    }
  }
  if (!(options.settings.false_alarm > 0 && options.settings.false_alarm < 1)) {
    throw BadUsage(fmt::format("--false-alarm is {}, must be above 0 and below 1", options.settings.false_alarm));
  }
  if (options.write_robot.empty() || options.force) return;
  for (const auto& file : {options.write_robot, twin_of(options.write_robot)}) {
    if (std::filesystem::exists(file)) {
      throw CommandFailed(fmt::format("{} exists: --force replaces it", file.string()));
    }
  }
}

/// The name of a folder that may be named with a slash at its end.
std::string name_of(const std::filesystem::path& folder) {
  const auto whole = std::filesystem::absolute(folder).lexically_normal();
  return whole.has_filename() ? whole.filename().string() : whole.parent_path().filename().string();
}

void write_robots(const Options& options, const compare::Outcome& outcome) {
  if (!outcome.calibration) {
    throw CommandFailed("no robot file is written: the real run does not tell its rig (see the notes above)");
  }
  runs::write_whole(options.write_robot, compare::corrected_robot(outcome, options.write_robot));
  fmt::print("robot   {}\n", options.write_robot.string());
  if (options.settings.is_rendered) return;  // its robot file is the real one, which no simulation runs
  const auto twin = twin_of(options.write_robot);
  runs::write_whole(twin, compare::like_the_real(outcome, twin));
  fmt::print("robot   {}  (for the simulation)\n", twin.string());
}

void judge(const Options& options, const compare::Comparison& comparison) {
  std::string beyond, untold;
  const auto add = [](std::string& to, const compare::Row& row, const std::string& what) {
    to += fmt::format("{}{}, {}: {}", to.empty() ? "" : "\n  ", row.stage, row.name, what);
  };
  for (const compare::Row& row : comparison.rows) {
    const auto asked = options.limits.find(row.limit_key);
    if (asked == options.limits.end() || !asked->second) continue;
    if (!row.gap) {
      add(untold, row, "there is no number" + (row.note.empty() ? "" : " (" + row.note + ")"));
    } else if (row.light == compare::Light::kCannotTell) {
      add(untold, row,
          fmt::format("{:.4g} +- {:.4g} {}, limit {:g}", *row.gap, *row.gap_sigma, row.unit, *asked->second));
    } else if (*row.gap > *asked->second) {
      const std::string sigma = row.gap_sigma ? fmt::format(" +- {:.4g}", *row.gap_sigma) : "";
      add(beyond, row, fmt::format("{:.4g}{} {}, limit {:g}", *row.gap, sigma, row.unit, *asked->second));
    }
  }
  if (!untold.empty()) untold = "cannot be told: " + untold;
  if (!beyond.empty()) {
    throw CommandFailed("beyond its limit: " + beyond + (untold.empty() ? "" : "\n" + untold));
  }
  if (!untold.empty()) throw CannotTell(untold);
}

/// The comparison's folder, locked. One that was made here goes again where nothing was kept in it to go on from.
class OutFolder {
 public:
  explicit OutFolder(const std::filesystem::path& folder)
      : folder_(folder), was_there_(std::filesystem::exists(folder)) {
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    if (error) throw CommandFailed(fmt::format("cannot make {}: {}", folder.string(), error.message()));
    lock_.emplace(folder);
  }
  ~OutFolder() {
    std::error_code ignored;
    if (!was_there_ && !holds_work()) std::filesystem::remove_all(folder_, ignored);
  }
  OutFolder(const OutFolder&) = delete;
  OutFolder& operator=(const OutFolder&) = delete;

 private:
  [[nodiscard]] bool holds_work() const {
    std::error_code error;
    for (std::filesystem::recursive_directory_iterator entry(folder_, error), end; !error && entry != end;
         entry.increment(error)) {
      const auto name = entry->path().filename();
      if (entry->is_regular_file() && name != runs::RunLock::kFileName && name != "rendered_from.txt") return true;
    }
    return bool(error);
  }

  const std::filesystem::path folder_;
  const bool was_there_;
  std::optional<runs::RunLock> lock_;
};

std::string next_step(const std::filesystem::path& out) {
  return fmt::format("interrupted: what was measured is kept in {}; next: the same command goes on there",
                     out.string());
}

void execute(Options options) {
  check(options);
  const std::atomic<bool>& stop = stop_on_signals();
  compare::Settings& settings = options.settings;
  settings.real = options.runs.back();
  settings.simulated = options.runs.front();
  settings.real_poses = options.poses;
  settings.stop = &stop;
  if (options.out.empty()) {
    options.out = fmt::format("runs/compare-{}{}", name_of(settings.real),
                              options.scene.empty() ? "-with-" + name_of(settings.simulated) : "-rendered");
  }
  const OutFolder folder(options.out);
  if (!options.scene.empty()) {
    settings.simulated = options.out / "simulated";
    settings.is_rendered = true;
    ProgressBar bar("render");
    compare::RenderAgain again;
    again.real = settings.real;
    again.scene = options.scene;
    again.poses = options.poses;
    again.to = settings.simulated;
    again.fit_frames = settings.fit_frames;
    again.progress = [&bar](double done) { bar.show(done); };
    again.stop = &stop;
    if (const Status rendered = compare::render_again(again); !rendered) {
      if (stop) throw Interrupted(next_step(options.out));
      throw CommandFailed(rendered.error().message);
    }
  }
  settings.work = options.out / "parts";
  for (const auto& [key, value] : options.limits) {
    if (value) settings.limits[key] = *value;
  }
  std::optional<compare::Outcome> outcome;
  {
    ProgressBar bar("compare");
    settings.progress = [&bar](double done, std::string_view) { bar.show(done); };
    outcome = value_or_interrupted(compare::compare(settings), next_step(options.out));
  }
  compare::advise(outcome->comparison.sources);
  fmt::print("{}\n", compare::table(outcome->comparison));
  runs::write_whole(options.out / "compare.json", compare::to_json(outcome->comparison));
  fmt::print("numbers {}\n", (options.out / "compare.json").string());
  if (options.page) {
    const Status written = compare::write_page(outcome->comparison, options.out, {});
    if (written) {
      fmt::print("page    {}\n", (options.out / "compare.html").string());
    } else {
      say(fmt::format("note: no page: {}", written.error().message));
    }
  }
  if (!options.write_robot.empty()) write_robots(options, *outcome);
  std::fflush(stdout);
  judge(options, outcome->comparison);
}

}  // namespace

void add_compare(CLI::App& program) {
  auto options = std::make_shared<Options>();
  CLI::App* command = program.add_subcommand(
      "compare", "Simulated against real: where two runs differ, by how much, why, and what to change");
  command->add_option("RUN", options->runs, "SIM_DIR REAL_DIR, or REAL_DIR alone with --scene")
      ->required()
      ->expected(1, 2);
  command->add_option("--scene", options->scene, "Map with a scene: render the real run's places again in it");
  command->add_option("--poses", options->poses,
                      "Where the real robot was, by another system: TUM, the run's clock (default: truth.tum, or what\n"
                      "the corrected rig makes of the pictures)");
  command->add_option("--out", options->out,
                      "Folder for compare.html, compare.json and what is kept to go on from\n"
                      "(default: runs/compare-REAL-with-SIM)");
  command->add_option(
      "--write-robot", options->write_robot,
      "Robot file to write: the real one corrected; and FILE_sim.yaml, a simulation that behaves like it");
  command->add_flag("--force", options->force, "Replace robot files that exist");
  command->add_flag("!--no-page", options->page, "Table and numbers alone");
  command->add_option("--frames", options->settings.fit_frames, "Frames of each run from which its rig is found")
      ->check(CLI::Range(4, 100'000))
      ->capture_default_str();
  command->add_option("--every", options->settings.every, "Measure the pictures of every so many real frames")
      ->check(CLI::Range(1, 1'000'000))
      ->capture_default_str();
  command->add_option("--jobs", options->settings.jobs, "Threads that measure pictures")
      ->check(CLI::Range(1, 256))
      ->capture_default_str();
  command
      ->add_option("--false-alarm", options->settings.false_alarm,
                   "Share of comparisons without a difference that may name one")
      ->capture_default_str();
  for (const compare::LimitKind& kind : compare::limit_kinds()) {
    command
        ->add_option(fmt::format("--max-{}", kind.key), options->limits[kind.key],
                     fmt::format("Fail beyond this: {} (light's limit: {:g})", kind.what, kind.by_default))
        ->group("Limits");
  }
  command->footer(
      "Exit status: 0 done, each --max kept; 1 failed, or a gap is beyond its --max; 2 bad usage; 3 no gap is beyond "
      "its\n"
      "--max, but one cannot be told: there is no number, or its sigma exceeds the limit.");
  command->callback([options] { execute(*options); });
}

}  // namespace twocone::cli
