// SPDX-License-Identifier: Apache-2.0
#include <atomic>
#include <cmath>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include <fmt/format.h>
#include <pybind11/functional.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>
#include <nlohmann/json.hpp>

#include "apps/as_built/as_built.h"
#include "apps/calibrate/calibrate.h"
#include "apps/calibrate/files.h"
#include "apps/compare/compare.h"
#include "apps/config/map_file.h"
#include "apps/config/robot_file.h"
#include "apps/config/to_layers.h"
#include "apps/config/yaml/text_file.h"
#include "apps/design/design.h"
#include "apps/design/output.h"
#include "apps/runlog/run_data.h"
#include "apps/runlog/storage/disk.h"
#include "apps/runlog/storage/locked_folder.h"
#include "apps/scan/scan.h"
#include "apps/survey/files.h"
#include "apps/survey/survey.h"
#include "apps/tradeoff/output.h"
#include "apps/tradeoff/plan.h"
#include "apps/tradeoff/run_shards.h"
#include "apps/tradeoff/shard.h"
#include "python/native/work.h"

namespace py = pybind11;

// Each function does what the program's subcommand of that name does, and returns the text of the JSON file that it
// writes, which twocone/tools.py reads.
namespace twocone::python {
namespace {

namespace fs = std::filesystem;
using Paths = std::vector<fs::path>;
using Priors = std::map<std::string, double>;

/// @throws config::FileError if one of the files exists
void refuse_overwriting(const Paths& files) {
  for (const fs::path& file : files) {
    if (fs::exists(file)) throw config::FileError("{} exists: force=True replaces it", file.string());
  }
}

struct Stopped {};
/// Ends work that is to end: interruptibly() then raises what has stopped it. @throws Stopped
void end_if(const std::atomic<bool>& stop) {
  if (stop) throw Stopped();
}

std::vector<runlog::RunData> read_runs(const Paths& folders) {
  if (folders.empty()) throw py::value_error("runs is empty, must name at least one run folder");
  std::vector<runlog::RunData> runs;
  for (const fs::path& folder : folders) runs.push_back(runlog::read_run(folder));
  return runs;
}

void set_priors(const Priors& given, vision::CalibrationPriors& priors) {
  for (const auto& [name, sigma] : given) calibrate::set_prior(name, sigma, priors);
}

std::string calibrate_robot(const Paths& folders, const fs::path& out, const fs::path& robot_file, int frames,
                            const Priors& priors, bool fits_distortion, const fs::path& figures, bool force) {
  const calibrate::Files files = calibrate::files_of(out, {}, figures);
  if (!force) refuse_overwriting(files.all());
  return interruptibly([&](const std::atomic<bool>& stop) {
    const auto runs = read_runs(folders);
    const config::Robot robot = calibrate::robot_to_calibrate(runs.front(), robot_file);
    calibrate::Settings settings;
    settings.frames = frames;
    settings.fit_distortion = fits_distortion;
    settings.priors = calibrate::priors_of(robot);
    set_priors(priors, settings.priors);
    settings.progress = [&stop](double /*done*/) { end_if(stop); };
    const auto report = value_or_raise(calibrate::calibrate(runs, robot, settings));
    end_if(stop);
    calibrate::write_files(report, robot, files);
    return calibrate::to_json(report);
  });
}

std::string survey_room(const Paths& folders, const fs::path& out, const fs::path& robot_file,
                        const fs::path& calibrated,
                        const std::vector<std::tuple<std::string, std::string, double>>& distances,
                        double distance_sigma_m, bool refines, int frames, bool force) {
  const survey::Files files = survey::files_of(out, calibrated);
  if (!force) refuse_overwriting(files.all());
  return interruptibly([&](const std::atomic<bool>& stop) {
    const auto runs = read_runs(folders);
    const config::Robot robot = robot_file.empty() ? runs.front().robot : config::read_robot(robot_file);
    const config::Map map = config::read_map(robot.map);
    survey::Settings settings;
    settings.frames = frames;
    settings.calibrates = !calibrated.empty();
    settings.priors = calibrate::priors_of(robot);
    for (const auto& [from, to, distance_m] : distances) {
      settings.distances.push_back({from, to, distance_m, distance_sigma_m});
    }
    if (refines && map.landmarks.empty()) {
      throw config::FileError("{} has no landmarks, so that there is nothing to refine", robot.map.string());
    }
    if (refines) settings.measured = map.landmarks;
    settings.progress = [&stop](double /*done*/) { end_if(stop); };
    const auto report = value_or_raise(survey::survey(runs, robot, settings));
    end_if(stop);
    survey::write_files(report, robot, map, files);
    return survey::to_json(report);
  });
}

/// @param requirements by the names of design::Requirements
std::string design_rig(const fs::path& folder, const std::string& name,
                       const std::map<std::string, double>& requirements, const fs::path& map_file, bool force) {
  design::Requirements wanted;
  const std::map<std::string, double*> numbers{{"camera_angle_rad", &wanted.camera_angle_rad},
                                               {"lowest_rad", &wanted.lowest_rad},
                                               {"highest_rad", &wanted.highest_rad},
                                               {"sigma_m", &wanted.sigma_m},
                                               {"at_m", &wanted.at_m},
                                               {"sigma_px", &wanted.sigma_px},
                                               {"greatest_radius_m", &wanted.greatest_radius_m},
                                               {"greatest_height_m", &wanted.greatest_height_m},
                                               {"lens_height_m", &wanted.lens_height_m},
                                               {"body_radius_m", &wanted.body_radius_m}};
  for (const auto& [key, value] : requirements) {
    if (const auto found = numbers.find(key); found != numbers.end()) {
      *found->second = value;
    } else if (key == "width_px" || key == "height_px") {
      if (std::trunc(value) != value || std::abs(value) > 1e6)
        throw py::value_error(fmt::format("{} is {}, must be a whole number", key, value));
      (key == "width_px" ? wanted.width_px : wanted.height_px) = int(value);
    } else if (key == "floor_from_m") {
      wanted.floor_from_m = value;
    } else {
      throw py::type_error(fmt::format("design() has no requirement '{}'", key));
    }
  }
  const design::Files files = design::files_in(folder, name);
  if (!force) refuse_overwriting({files.page, files.data, files.robot, files.map, files.scene, files.profile});
  return interruptibly([&](const std::atomic<bool>& stop) {
    std::optional<config::Map> map;
    if (!map_file.empty()) map = config::read_map(map_file);
    const design::Design made = design::design(wanted);
    end_if(stop);
    design::write_robot(made, map, files);
    design::Result result;
    result.robot = config::read_robot(files.robot);
    result.map = config::read_map(files.map);
    result.settings = {.sigma_px = wanted.sigma_px, .at_m = wanted.at_m};
    result.analysis = design::analyse(result.robot, result.map, result.settings);
    const std::string json = design::design_json(result).dump(1) + '\n';
    runlog::write_whole(files.data, json);
    runlog::write_whole(files.page, design::page(result));
    return json;
  });
}

std::string sweep(const fs::path& robot_file, const fs::path& out, std::uint64_t seed, int episodes, bool is_fine) {
  return interruptibly([&](const std::atomic<bool>& stop) {
    const config::Robot robot = config::read_robot(robot_file);
    const config::Map map = config::read_map(robot.map);
    const tradeoff::Plan plan = tradeoff::make_plan(robot, map, {seed, episodes, is_fine});
    const tradeoff::Subject subject{robot, map, plan};
    const tradeoff::SweepFolder folder(out, robot, map, plan);
    const tradeoff::Watch watch{[](double) {}, [](const std::string&) {}};
    value_or_raise(tradeoff::run_shards(subject, folder, folder.missing(), watch, stop));
    if (stop) return std::string();
    const tradeoff::Sweep result = tradeoff::finish_sweep(subject, folder);
    runlog::write_whole(folder.path() / "index.html", tradeoff::page(result, nullptr));
    return tradeoff::tradeoff_json(result);
  });
}

std::string compare_runs(const fs::path& simulated, const fs::path& real, const fs::path& out, const fs::path& scene,
                         const fs::path& poses) {
  return interruptibly([&](const std::atomic<bool>& stop) {
    runlog::make_folder(out);
    const runlog::RunLock lock(out);
    compare::Settings settings;
    settings.real = real;
    settings.simulated = simulated;
    settings.real_poses = poses;
    settings.stop = &stop;
    if (!scene.empty()) {
      settings.simulated = out / "simulated";
      settings.is_rendered = true;
      if (const Status rendered = compare::render_again(settings, scene); !rendered) {
        throw FailureError({FailureCode(int(rendered.error().code)), rendered.error().message});
      }
    }
    settings.work = out / "parts";
    const compare::Outcome outcome = value_or_raise(compare::compare(settings));
    std::string json = compare::to_json(outcome.comparison);
    runlog::write_whole(out / "compare.json", json);
    runlog::write_whole(out / "compare.html", compare::page(outcome.comparison, out));
    return json;
  });
}

/// Returns the believed robot file and the built one.
std::pair<fs::path, fs::path> draw_as_built(const fs::path& robot_file, const fs::path& out, std::uint64_t seed,
                                            bool has_unmodelled, bool force) {
  const as_built::Files files = as_built::files_in(out);
  if (!force) refuse_overwriting({files.scene, files.built_map, files.built, files.believed_map, files.believed});
  const config::Robot plan = config::read_robot(robot_file);
  if (!config::is_simulated(plan)) {
    throw config::FileError("{}: no part has driver sim_povray, must be a simulated robot", robot_file.string());
  }
  std::optional<as_built::Unmodelled> unmodelled;
  if (has_unmodelled) unmodelled.emplace();
  as_built::write(as_built::draw(plan, config::read_map(plan.map), seed, {}, unmodelled), out);
  return {files.believed, files.built};
}

py::dict scan_run(const fs::path& run, int every, bool clouds, bool plan) {
  const scan::ScanCounts counts = interruptibly([&](const std::atomic<bool>& stop) {
    scan::ScanOptions options;
    options.every = every;
    options.clouds = clouds;
    options.plan = plan;
    options.stop = &stop;
    return value_or_raise(scan::scan(run, options));
  });
  py::dict result;
  result["frames"] = counts.frames;
  result["without_images"] = counts.without_images;
  result["unknown"] = counts.unknown;
  result["free"] = counts.free;
  result["occupied"] = counts.occupied;
  result["points"] = counts.points;
  return result;
}

}  // namespace

void add_tools(py::module_& module) {
  module.def("calibrate", &calibrate_robot, py::arg("runs"), py::arg("out"), py::arg("robot"), py::arg("frames"),
             py::arg("priors"), py::arg("distortion"), py::arg("figures"), py::arg("force"));
  module.def("survey", &survey_room, py::arg("runs"), py::arg("out"), py::arg("robot"), py::arg("calibrated"),
             py::arg("distances"), py::arg("distance_sigma_m"), py::arg("refines"), py::arg("frames"),
             py::arg("force"));
  module.def("design", &design_rig, py::arg("out"), py::arg("name"), py::arg("requirements"), py::arg("map"),
             py::arg("force"));
  module.def("as_built", &draw_as_built, py::arg("robot"), py::arg("out"), py::arg("seed"), py::arg("unmodelled"),
             py::arg("force"));
  module.def("scan", &scan_run, py::arg("run"), py::arg("every"), py::arg("clouds"), py::arg("plan"));
  module.def("tradeoff", &sweep, py::arg("robot"), py::arg("out"), py::arg("seed"), py::arg("episodes"),
             py::arg("fine"));
  module.def("compare", &compare_runs, py::arg("simulated"), py::arg("real"), py::arg("out"), py::arg("scene"),
             py::arg("poses"));
}

}  // namespace twocone::python
