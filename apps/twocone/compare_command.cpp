// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "apps/compare/compare.h"
#include "apps/config/calibration_file.h"
#include "apps/runlog/storage/disk.h"
#include "apps/runlog/storage/locked_folder.h"
#include "apps/twocone/commands.h"
#include "apps/twocone/terminal.h"

namespace twocone::cli {
namespace {

struct CompareArguments {
  std::vector<std::filesystem::path> runs;
  std::filesystem::path scene;
  std::filesystem::path poses;
  std::filesystem::path out;
  std::filesystem::path write_robot;
  bool force = false;
  bool page = true;
  compare::Settings settings;
};

/// Returns F_sim.yaml beside F.yaml.
std::filesystem::path twin_of(const std::filesystem::path& robot) {
  return robot.parent_path() / (robot.stem().string() + "_sim" + robot.extension().string());
}

void check(const CompareArguments& options) {
  if (options.scene.empty() && options.runs.size() != 2) {
    throw BadUsage("{} run folder given: it takes a simulated and a real one, or a real one with --scene MAP.yaml",
                   options.runs.size());
  }
  if (!options.scene.empty() && options.runs.size() != 1) {
    throw BadUsage("--scene renders the real run's places again: give one run folder, the real one");
  }
  for (const auto& [key, value] : options.settings.limits) {
    if (!(std::isfinite(value) && value >= 0)) throw BadUsage("--max-{} is {}, must be a number >= 0", key, value);
  }
  if (!(options.settings.false_alarm > 0 && options.settings.false_alarm < 1)) {
    throw BadUsage("--false-alarm is {}, must be above 0 and below 1", options.settings.false_alarm);
  }
  if (options.write_robot.empty() || options.force) return;
  refuse_overwriting(
      {options.write_robot, config::calibration_file_of(options.write_robot), twin_of(options.write_robot)});
}

/// Returns the name of a folder, also if a slash ends its path.
std::string name_of(const std::filesystem::path& folder) {
  const auto whole = std::filesystem::absolute(folder).lexically_normal();
  return whole.has_filename() ? whole.filename().string() : whole.parent_path().filename().string();
}

void write_robots(const CompareArguments& options, const compare::Outcome& outcome) {
  if (!outcome.calibration) {
    throw CommandFailed("no robot file is written: the real run does not determine its rig (see the notes above)");
  }
  // Written before the robot file that names it.
  runlog::write_whole(config::calibration_file_of(options.write_robot), calibrate::to_json(*outcome.calibration));
  runlog::write_whole(options.write_robot, compare::corrected_robot(outcome, options.write_robot));
  fmt::print("robot   {}\n", options.write_robot.string());
  if (options.settings.is_rendered) return;  // a rendered comparison uses the real robot file and has no twin
  const auto twin = twin_of(options.write_robot);
  runlog::write_whole(twin, compare::like_the_real(outcome, twin));
  fmt::print("robot   {}  (for the simulation)\n", twin.string());
}

void judge(const CompareArguments& options, const compare::Comparison& comparison) {
  std::string beyond, undecided;
  const auto add = [](std::string& to, const compare::Row& row, const std::string& what) {
    to += fmt::format("{}{}, {}: {}", to.empty() ? "" : "\n  ", to_string(row.stage), row.name, what);
  };
  for (const compare::Row& row : comparison.rows) {
    const auto asked = options.settings.limits.find(row.limit_key);
    if (asked == options.settings.limits.end()) continue;
    if (!row.gap) {
      add(undecided, row, "there is no number" + (row.note.empty() ? "" : " (" + row.note + ")"));
    } else if (row.light == compare::Light::kCannotTell) {
      add(undecided, row,
          fmt::format("{:.4g} +- {:.4g} {}, limit {:g}", *row.gap, *row.gap_sigma, row.unit, asked->second));
    } else if (*row.gap > asked->second) {
      const std::string sigma = row.gap_sigma ? fmt::format(" +- {:.4g}", *row.gap_sigma) : "";
      add(beyond, row, fmt::format("{:.4g}{} {}, limit {:g}", *row.gap, sigma, row.unit, asked->second));
    }
  }
  if (!undecided.empty()) undecided = "undecided: " + undecided;
  if (!beyond.empty()) throw CommandFailed("beyond its limit: " + beyond + (undecided.empty() ? "" : "\n" + undecided));
  if (!undecided.empty()) throw Undecided(undecided);
}

/// The folder of the comparison, locked. If it is new and no work is stored in it, the destructor removes it.
class OutFolder {
 public:
  explicit OutFolder(const std::filesystem::path& folder)
      : folder_(folder), was_there_(std::filesystem::exists(folder)) {
    runlog::make_folder(folder);
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
      if (entry->is_regular_file() && name != runlog::RunLock::kFileName && name != "rendered_from.txt") return true;
    }
    return bool(error);
  }

  const std::filesystem::path folder_;
  const bool was_there_;
  std::optional<runlog::RunLock> lock_;
};

std::string next_step(const std::filesystem::path& out) {
  return fmt::format("interrupted: what was measured is kept in {}; next: the same command continues there",
                     out.string());
}

void compare_with(CompareArguments options) {
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
    settings.progress = [&bar](double done) { bar.show(done); };
    if (const Status rendered = compare::render_again(settings, options.scene); !rendered) {
      if (stop) throw Interrupted(next_step(options.out));
      throw CommandFailed(rendered.error().message);
    }
  }
  settings.work = options.out / "parts";
  ProgressBar bar("compare");
  settings.progress = [&bar](double done) { bar.show(done); };
  const compare::Outcome outcome = value_or_interrupted(compare::compare(settings), next_step(options.out));
  bar.remove();
  fmt::print("{}\n", compare::table(outcome.comparison));
  runlog::write_whole(options.out / "compare.json", compare::to_json(outcome.comparison));
  fmt::print("numbers {}\n", (options.out / "compare.json").string());
  if (options.page) {
    runlog::write_whole(options.out / "compare.html", compare::page(outcome.comparison, options.out));
    fmt::print("page    {}\n", (options.out / "compare.html").string());
  }
  if (!options.write_robot.empty()) write_robots(options, outcome);
  std::fflush(stdout);
  judge(options, outcome.comparison);
}

}  // namespace

void add_compare(CLI::App& program) {
  auto options = std::make_shared<CompareArguments>();
  CLI::App* command = program.add_subcommand(
      "compare", "Compare simulated with real: where two runs differ, by how much, why, and what to change");
  command->add_option("RUN", options->runs, "SIM_DIR REAL_DIR, or REAL_DIR alone with --scene")
      ->required()
      ->expected(1, 2);
  command->add_option("--scene", options->scene, "Map with a scene in which the real run's places are rendered again");
  command->add_option("--poses", options->poses,
                      "The real robot's poses from another system: TUM, the run's clock (default: truth.tum, or the\n"
                      "poses that the corrected rig gives from the images)");
  command->add_option("--out", options->out,
                      "Folder for compare.html, compare.json and the data for a continuation\n"
                      "(default: runs/compare-REAL-with-SIM)");
  command->add_option(
      "--write-robot", options->write_robot,
      "Robot file to write: the real one corrected; and FILE_sim.yaml, a simulation that behaves like it");
  command->add_flag("--force", options->force, "Replace robot files that exist");
  command->add_flag("!--no-page", options->page, "Only the table and compare.json");
  add_checked(command, "--frames", options->settings.fit_frames, "Frames of each run from which its rig is calculated",
              CLI::Range(4, 100'000));
  add_checked(command, "--every", options->settings.every, "Measure the images of every Nth real frame",
              CLI::Range(1, 1'000'000));
  add_checked(command, "--jobs", options->settings.jobs, "Threads that measure images", CLI::Range(1, 256));
  command
      ->add_option("--false-alarm", options->settings.false_alarm,
                   "Share of comparisons without a difference that may name one")
      ->capture_default_str();
  for (const compare::LimitKind& kind : compare::limit_kinds()) {
    command
        ->add_option_function<double>(
            fmt::format("--max-{}", kind.key),
            [options, key = kind.key](double limit) { options->settings.limits[key] = limit; },
            fmt::format("Fail beyond this: {} (light's limit: {:g})", kind.what, kind.by_default))
        ->group("Limits");
  }
  command->footer(
      "Exit status: 0 done, each --max kept; 1 failed, or a gap is beyond its --max; 2 bad usage; 3 no gap is beyond "
      "its\n"
      "--max, but one is undecided: there is no number, or its sigma exceeds the limit.");
  command->callback([options] { compare_with(*options); });
}

}  // namespace twocone::cli
