// SPDX-License-Identifier: Apache-2.0
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "apps/config/to_layers.h"
#include "apps/import/import_run.h"
#include "apps/recording/recording.h"
#include "apps/report/report.h"
#include "apps/runlog/run_data.h"
#include "apps/runlog/run_folder.h"
#include "apps/runlog/storage/locked_folder.h"
#include "apps/runs/run.h"
#include "apps/runs/self_rig.h"
#include "apps/twocone/commands.h"
#include "apps/twocone/terminal.h"
#include "apps/viewer/live_run.h"

namespace twocone::cli {
namespace {

// ---- run

struct RunArguments {
  RobotArgument robot;
  std::filesystem::path resume;  ///< run folder; empty: a new run
  std::string method;            ///< empty: the robot file's
  std::string landmarks;         ///< none, or empty: those of the map
  std::optional<double> budget_ms;
  bool self_rig = false;
  std::filesystem::path mcap;  ///< empty: none
  bool live = false;
  viewer::PageAddress page;
  bool has_frames = false;  ///< --frames is given
  runs::RunOptions run;
  double patience_s = std::chrono::duration<double>(run.patience).count();
};

/// Ten minutes at 15 Hz, which a person ends by an interruption.
constexpr int kManualFrames = 9'000;

/// Returns runs/NAME-BEHAVIOUR-seedN, with -2, -3 ... appended if that exists.
std::filesystem::path free_folder(const std::string& robot, const runs::RunOptions& run) {
  const std::string name = fmt::format("runs/{}-{}-seed{}", robot, run.behaviour, run.seed);
  std::filesystem::path folder = name;
  for (int i = 2; std::filesystem::exists(folder); ++i) folder = fmt::format("{}-{}", name, i);
  return folder;
}

config::Robot with_budget(config::Robot robot, const RunArguments& options) {
  try {
    return estimation::with_budget(std::move(robot), options.run.method, *options.budget_ms / 1000);
  } catch (const std::invalid_argument& error) {
    throw BadUsage("--budget-ms: {}", error.what());
  }
}

/// Returns a message with the stored frames of an interrupted run and the next command, which continues or reports it.
std::string next_step(const runs::RunOptions& run) {
  if (!std::filesystem::exists(run.out / "run.yaml")) {
    return "interrupted before its first frame: no run folder is left; next: the same command again";
  }
  const std::string folder = run.out.string();
  const runlog::RunData data = runlog::read_run(run.out, "", runlog::Tables::kFrames);
  return fmt::format("interrupted: {} of {} frames are in {}; next: twocone {} {}", data.frames.size(),
                     data.info.frames_wanted, folder,
                     runs::why_not_resumed(run.out).empty() ? "run --resume" : "report", folder);
}

void run_with(RunArguments options) {
  config::Robot robot;
  if (options.resume.empty()) {
    robot = options.robot.read();
    options.run.method =
        options.method.empty() ? estimation::method_of(robot) : estimation::method_named(options.method);
    options.run.maps = !options.landmarks.empty();
    if (options.run.maps && options.run.method == estimation::Method::kPaper) {
      throw BadUsage("--landmarks none needs method outline: method paper has no way to find landmarks");
    }
    if (options.budget_ms) robot = with_budget(std::move(robot), options);
    if (options.run.out.empty()) options.run.out = free_folder(robot.name, options.run);
  } else {
    const runlog::RunYaml before = runlog::read_run_yaml(options.resume);
    robot = before.robot;
    options.run.frames = before.info.frames_wanted;
    options.run.out = options.resume;
  }

  if (!options.mcap.empty()) {
    // A fault of --mcap is reported before the run, not after it.
    if (!options.run.replace) refuse_overwriting({options.mcap});
    const auto folder = options.mcap.parent_path();
    if (!folder.empty() && !std::filesystem::is_directory(folder)) {
      throw CommandFailed("--mcap: {} is no folder", folder.string());
    }
  }
  if (options.run.behaviour == "manual" && !options.live) {
    throw BadUsage("--behaviour manual needs --live: a person drives in the page");
  }
  if (options.run.behaviour == "manual" && !options.has_frames) options.run.frames = kManualFrames;
  // A person cannot follow a world that is faster than life.
  if (options.live && config::is_simulated(robot)) options.run.real_time = true;
  std::optional<viewer::LiveRun> live;

  // After a signal, the present frame is completed and the wheels stop.
  const std::atomic<bool>& stop = stop_on_signals();

  {
    ProgressBar bar(fmt::format("{} frames", options.run.frames));
    options.run.notify = [&bar, &live](const std::string& event) {
      bar.say(event);
      if (live) live->event(event);
    };
    options.run.patience = std::chrono::milliseconds(std::llround(1000 * options.patience_s));
    const auto progress = [&bar](double done) { bar.show(done); };
    if (options.self_rig) {
      const auto found = runs::with_self_rig(robot, config::read_map(robot.map), options.run, stop);
      if (!found && stop) throw Interrupted(next_step(options.run));
      runs::SelfRigRobot own = value_or_fail(found);
      bar.say(own.event);
      robot = std::move(own.robot);
    }
    if (options.live) {
      live.emplace(robot, config::read_map(robot.map), options.run.maps, options.run.behaviour == "manual");
      bar.say(fmt::format("watch at {}", value_or_fail(live->open(options.page))));
      bar.say(fmt::format("Foxglove  {}", live->foxglove_address()));
      live->watch(options.run);
    }
    const auto driven = options.resume.empty()
                            ? runs::run(robot, config::read_map(robot.map), options.run, progress, stop)
                            : runs::resume(options.run.out, options.run, progress, stop);
    if (live) live->end(driven ? "" : driven.error().message);
    if (!driven && stop) throw Interrupted(next_step(options.run));
    value_or_fail(driven);
  }
  const runlog::RunData data = runlog::read_run(options.run.out);
  std::vector<std::string> notes;
  fmt::print("{}", report::table_of(data, notes));
  for (const std::string& note : notes) say(fmt::format("note: {}", note));
  fmt::print("\nrun folder  {}\n", options.run.out.string());
  if (!options.mcap.empty()) {
    ProgressBar bar("export");
    recording::export_run(options.run.out, options.mcap, [&bar](double done) { bar.show(done); });
    bar.remove();
    fmt::print("recording   {}\n", options.mcap.string());
  }
}

// ---- localise

struct LocaliseArguments {
  std::filesystem::path folder;
  runlog::OtherBeliefs other;
  std::filesystem::path out;
  std::string method;  ///< empty: the run's
  bool allow_missing = false;
  bool replace = false;
};

/// Returns the method of --method, or of the other robot's file, or of the run.
estimation::Method method_of(const LocaliseArguments& options) {
  if (!options.method.empty()) return estimation::method_named(options.method);
  if (!options.other.robot_file.empty()) {
    const config::Robot robot = config::read_robot(options.other.robot_file);
    if (!robot.estimator.method.empty()) return estimation::method_named(robot.estimator.method);
  }
  return estimation::method_named(runlog::read_run_yaml(options.folder).info.method);
}

runlog::RunData localise(const LocaliseArguments& options, estimation::Method method,
                         const std::filesystem::path& folder) {
  const std::atomic<bool>& stop = stop_on_signals();
  ProgressBar bar("localise");
  const runs::LocaliseOptions how{.allow_missing = options.allow_missing, .stop = &stop};
  return value_or_interrupted(
      runs::localise(
          folder, method, [&bar](double done) { bar.show(done); }, how),
      fmt::format("interrupted: {} is as it was; next: the same command again", options.folder.string()));
}

/// Localises the run's images with another robot's file or map. A failure leaves no folder that would block a retry.
runlog::RunData localise_copy(const LocaliseArguments& options, estimation::Method method) {
  runs::copy_run_with(options.other, options.folder, options.out, options.replace);
  try {
    return localise(options, method, options.out);
  } catch (...) {
    runlog::remove_run(options.out);
    throw;
  }
}

void localise_with(const LocaliseArguments& options) {
  if (options.replace && options.out.empty()) throw BadUsage("--force needs --out: the run that it replaces");
  if (!options.out.empty() && options.other.robot_file.empty() && options.other.map_file.empty()) {
    throw BadUsage("--out needs --robot or --map: without them the results replace those of the run");
  }
  const estimation::Method method = method_of(options);
  const runlog::RunData data =
      options.out.empty() ? localise(options, method, options.folder) : localise_copy(options, method);
  std::vector<std::string> notes;
  fmt::print("{}", report::table_of(data, notes));
  for (const std::string& note : notes) say(fmt::format("note: {}", note));
}

// ---- report

void report_with(const std::filesystem::path& folder) {
  (void)runlog::read_run_yaml(folder);  // throws before a folder without a run is locked
  // If another program writes the run, its present state is read, and that program writes the summary.
  const auto lock = runlog::RunLock::try_take(folder);
  const runlog::RunData data = runlog::read_run(folder);
  if (lock) runlog::write_summary(data);
  std::vector<std::string> notes;  // not printed, because write_report returns the same notes
  fmt::print("{}", report::table_of(data, notes));
  std::fflush(stdout);
  ProgressBar bar("report");
  report::ReportSettings settings;
  settings.progress = [&bar](double done) { bar.show(done); };
  const report::ReportResult result = value_or_fail(report::write_report(data, settings));
  bar.remove();
  for (const std::string& note : result.notes) say(fmt::format("note: {}", note));
  fmt::print("\nreport  {}\n", result.html.string());
}

// ---- import

struct ImportArguments {
  importer::Recording recording;
  std::filesystem::path out;
  std::optional<double> max_skew_ms;
};

void import_with(ImportArguments options) {
  if (options.max_skew_ms) options.recording.max_skew_s = *options.max_skew_ms / 1e3;
  ProgressBar bar("import");
  const importer::Imported imported =
      importer::import_run(options.recording, options.out, [&bar](double done) { bar.show(done); });
  bar.remove();
  for (const std::string& event : imported.events) say(event);
  say(fmt::format("{} frames are in {}; next: twocone localise {}", imported.frames, options.out.string(),
                  options.out.string()));
}

}  // namespace

void add_run(CLI::App& program) {
  auto options = std::make_shared<RunArguments>();
  CLI::App* command =
      program.add_subcommand("run", "Drive a robot, range its landmarks, find its position; write a run folder");
  auto* robot = add_robot(command, options->robot, "Robot file (robots/lab_sim.yaml)");
  auto* resume = command->add_option("--resume", options->resume,
                                     "Run folder of a simulated run that was interrupted or killed: continue it with\n"
                                     "the same settings; takes no other option but --log-level");
  auto* frames =
      add_checked(command, "--frames", options->run.frames, "Stereo frames to take", CLI::Range(1, 100'000'000));
  add_checked(command, "--behaviour", options->run.behaviour,
              "How to drive: wander, waypoints, explore, still, or manual (by hand, in the page of --live)",
              CLI::IsMember({"wander", "waypoints", "explore", "still", "manual"}));
  add_live(command, options->live, options->page,
           "Show the run in a browser while the robot drives, and print the page's address. PORT: any that is free.\n"
           "A simulation is paced by the wall clock");
  command->add_flag("--telemetry", options->run.telemetry, "Also write telemetry.jsonl into the run folder");
  command->add_option("--mcap", options->mcap, "Also write the run as this MCAP file at its end, as export does");
  command
      ->add_option("--method", options->method,
                   fmt::format("How to range and localise (default: from the robot file, else {})",
                               estimation::to_string(estimation::kDefaultMethod)))
      ->check(is_method());
  command->add_option(
      "--budget-ms", options->budget_ms,
      "Milliseconds for vision and localisation of each frame: method outline refines no longer than that");
  add_checked(command, "--seed", options->run.seed, "Seed of all random numbers of the run", whole_number());
  command->add_option("--out", options->run.out, "Run folder to make (default: runs/ROBOT-BEHAVIOUR-seedN)");
  add_checked(command, "--patience", options->patience_s,
              "Seconds to wait for a device that fails, with the wheels stopped (real robots)",
              number_within(0, 86'400));
  add_renderer(command, options->run.renderer);
  command
      ->add_option("--landmarks", options->landmarks,
                   "none: start without landmarks, whatever the map lists, and find them on the way (landmarks.csv)")
      ->check(CLI::IsMember({"none"}));
  command->add_flag("--real-time", options->run.real_time,
                    "Pace the simulation by the wall clock, and report the frames that were late");
  command->add_flag("--self-rig", options->self_rig,
                    "Take what the first images show of rig: before the run begins: where the mirrors are, mirrored\n"
                    "images, and how the cameras are turned; recorded in run.yaml");
  command->add_flag("--truth", options->run.truth,
                    "Also store what each pixel shows: object, distance and normal (simulation, native renderer)");
  command->add_flag("--force", options->run.replace, "Replace the run that is in --out");
  for (CLI::Option* const other : command->get_options()) {
    if (other != resume && other->get_name() != "--help") resume->excludes(other);
  }
  command->callback([options, robot, resume, frames] {
    options->has_frames = frames->count() > 0;
    if (robot->count() + resume->count() == 0) throw BadUsage("run: --robot is required, or --resume");
    run_with(*options);
  });
}

void add_localise(CLI::App& program) {
  auto options = std::make_shared<LocaliseArguments>();
  CLI::App* command = program.add_subcommand("localise", "Repeat ranges and fixes offline, from a run's stored frames");
  command->add_option("DIR", options->folder, "Run folder")->required();
  command
      ->add_option("--method", options->method, "How to range and localise (default: as the run, or as --robot says)")
      ->check(is_method());
  auto* robot = command->add_option("--robot", options->other.robot_file,
                                    "Robot file whose rig, wheels, estimator and map to use, such as one from\n"
                                    "calibrate; needs --out");
  auto* map = command->add_option("--map", options->other.map_file,
                                  "Map to use instead of the run's, or of the one that --robot names; needs --out");
  auto* out = command->add_option("--out", options->out, "Run folder to make for the results, with the same images");
  command->add_flag("--allow-missing", options->allow_missing,
                    "Leave frames that have lost an image without an answer (verdict no_image)");
  command->add_flag("--force", options->replace, "Replace the run that is in --out");
  robot->needs(out);
  map->needs(out);
  command->callback([options] { localise_with(*options); });
}

void add_report(CLI::App& program) {
  auto folder = std::make_shared<std::filesystem::path>();
  CLI::App* command = program.add_subcommand("report", "Tables and figures of a run, as one page: DIR/report.html");
  command->add_option("DIR", *folder, "Run folder, also of a run that was cut off")->required();
  command->callback([folder] { report_with(*folder); });
}

void add_import(CLI::App& program) {
  auto options = std::make_shared<ImportArguments>();
  importer::Recording& recording = options->recording;
  std::map<std::string, importer::StampUnit> units;
  for (const importer::NamedUnit& named : importer::kNamedUnits) units.emplace(named.name, named.unit);
  CLI::App* command = program.add_subcommand("import", "Make a run folder from a recording of another program");
  command->add_option("--robot", recording.robot_file, "Robot file of the recorded robot")->required();
  auto* file = command->add_option("--recording", recording.file,
                                   "MCAP file, or bag of ROS 1, with both cameras' images and the odometry");
  auto* lower = command->add_option("--lower", recording.lower, "Folder of the lower camera's images, PNG or JPEG");
  auto* upper = command->add_option("--upper", recording.upper, "Folder of the upper camera's images");
  for (const auto& [option, topic, what] :
       {std::tuple{"--lower-topic", &recording.topics.lower, "Topic of the lower camera's images in --recording"},
        {"--upper-topic", &recording.topics.upper, "Topic of the upper camera's images"},
        {"--odometry-topic", &recording.topics.odometry, "Topic of the robot's poses by its wheels"}}) {
    command->add_option(option, *topic, what)->needs(file);
  }
  command->add_option("--out", options->out, "Run folder to make")->required();
  command->add_option("--lower-times", recording.lower_times,
                      "Lines TIME NAME or TIME,NAME of the lower images; default: their names are the times");
  command->add_option("--upper-times", recording.upper_times, "The same for the upper images");
  command
      ->add_option_function<std::string>(
          "--times-in", [options, units](const std::string& unit) { options->recording.unit = units.at(unit); },
          "Unit of the images' times: s, ms, us or ns; default: seconds if they have a decimal point, "
          "nanoseconds if they have 19 digits")
      ->check(CLI::IsMember(units));
  command->add_option("--trajectory", recording.trajectory,
                      "TUM file of the robot's true poses from another system, on the images' clock");
  auto* odometry = command->add_option(
      "--odometry", recording.odometry,
      "CSV file of columns t_s,left_rad,right_rad or t_s,x_m,y_m,heading_rad, on the images' clock");
  for (auto* const other : {lower, upper, odometry}) file->excludes(other);
  command->add_option("--max-skew-ms", options->max_skew_ms,
                      "Greatest time between the two images of a pair; default: half of their median period");
  command->callback([options] {
    const importer::Recording& r = options->recording;
    if (r.file.empty() && (r.lower.empty() || r.upper.empty())) {
      throw BadUsage("import: --lower and --upper are required, or --recording");
    }
    import_with(*options);
  });
}

}  // namespace twocone::cli
