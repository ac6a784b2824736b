// SPDX-License-Identifier: Apache-2.0
#include "apps/runs/run.h"

#include <cmath>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>
#include <nlohmann/json.hpp>

#include "apps/config/map_file.h"
#include "apps/config/robot_file.h"
#include "apps/estimation/method.h"
#include "apps/runlog/run_data.h"
#include "apps/runlog/summary/summary.h"
#include "apps/runlog/tables/tables.h"
#include "drivers/sim_povray/place.h"
#include "python/native/work.h"
#include "twocone/types.h"

namespace py = pybind11;

namespace twocone::python {
namespace {

namespace fs = std::filesystem;

// ---- tables

using Objects = std::vector<nlohmann::ordered_json>;

py::object texts_of(const Objects& rows, const std::string& name) {
  py::list texts;
  for (const auto& row : rows) {
    const auto found = row.find(name);
    texts.append(found == row.end() ? "" : found->is_string() ? found->get<std::string>() : found->dump());
  }
  return py::module_::import("numpy").attr("array")(texts, py::arg("dtype") = "str");
}

/// Returns a column as an array, with nan for empty fields.
py::array_t<double> numbers_of(const Objects& rows, const std::string& name) {
  py::array_t<double> numbers{py::ssize_t(rows.size())};
  auto to = numbers.mutable_unchecked<1>();
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const auto found = rows[i].find(name);
    to(py::ssize_t(i)) = found == rows[i].end() ? std::numeric_limits<double>::quiet_NaN()
                         : found->is_boolean()  ? double(found->get<bool>())
                                                : found->get<double>();
  }
  return numbers;
}

/// Returns a table as a dict of its columns.
template <typename Row>
py::dict table_of(const std::vector<Row>& rows) {
  const std::set<std::string> texts = runlog::text_columns<Row>();
  Objects objects;
  objects.reserve(rows.size());
  for (const Row& row : rows) objects.push_back(runlog::to_object(row));
  py::dict table;
  for (const std::string& name : runlog::split_fields(runlog::TableReader<Row>::header())) {
    table[py::str(name)] = texts.contains(name) ? texts_of(objects, name) : py::object(numbers_of(objects, name));
  }
  return table;
}

/// Returns poses as an array of rows t_s, x_m, y_m, heading_rad.
py::array_t<double> array_of(const std::vector<runlog::PoseRow>& poses) {
  py::array_t<double> array({py::ssize_t(poses.size()), py::ssize_t(4)});
  auto to = array.mutable_unchecked<2>();
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const runlog::PoseRow& p = poses[i];
    const double values[] = {p.t_s, p.x_m, p.y_m, p.heading_rad};
    for (int k = 0; k < 4; ++k) to(py::ssize_t(i), k) = values[k];
  }
  return array;
}

/// Returns what twocone/runs.py makes a Run of.
py::dict read_run(const fs::path& folder, const std::string& method) {
  const auto [run, summary] = interruptibly([&](const std::atomic<bool>& /*stop*/) {
    runlog::RunData data = runlog::read_run(folder, method);
    std::string json = runlog::to_json(runlog::summarise(data), data.info);
    return std::pair(std::move(data), std::move(json));
  });
  py::dict result;
  result["folder"] = run.folder;
  result["method"] = run.method;
  result["robot_file"] = run.robot.file;
  result["map_file"] = run.robot.map;
  result["summary"] = summary;
  result["events"] = run.info.events;
  result["frames"] = table_of(run.frames);
  result["drive"] = table_of(run.drive);
  result["ranges"] = table_of(run.ranges);
  result["fixes"] = table_of(run.fixes);
  result["sightings"] = table_of(run.sightings);
  result["timing"] = table_of(run.timing);
  result["track"] = table_of(run.track);
  result["truth"] = array_of(run.truth);
  result["odometry"] = array_of(run.odometry);
  result["estimate"] = array_of(run.estimate);
  return result;
}

// ---- run

config::Robot robot_with(const fs::path& file, const std::vector<std::string>& changes) {
  std::vector<config::KeyChange> parsed;
  for (const std::string& change : changes) parsed.push_back(config::parse_change(change));
  return config::read_robot(file, parsed);
}

/// Functions of Python that the program calls from a thread of its own. What one of them raises is kept, and is thrown
/// when the work has ended.
class Callbacks {
 public:
  /// Calls a function with the interpreter's lock, and returns its result as a type of C++. Returns nothing if it
  /// raises, or one has raised before.
  template <typename Result, typename... Arguments>
  std::optional<Result> call(const py::object& function, const Arguments&... arguments) {
    const py::gil_scoped_acquire lock;
    if (has_failed()) return std::nullopt;
    try {
      const py::object result = function(arguments...);
      if constexpr (std::is_same_v<Result, std::monostate>) {
        return std::monostate();
      } else {
        return result.cast<Result>();
      }
    } catch (py::error_already_set& error) {
      raised_ = std::make_unique<py::error_already_set>(std::move(error));
    } catch (const py::cast_error&) {
      wrong_ = true;
    }
    return std::nullopt;
  }
  [[nodiscard]] bool has_failed() const { return raised_ != nullptr || wrong_; }
  /// Requires the interpreter's lock.
  void rethrow() {
    if (wrong_) throw py::type_error("controller must return a twocone.Velocity or (forward_mps, turn_radps)");
    if (raised_) throw py::error_already_set(std::move(*raised_));
  }

 private:
  std::unique_ptr<py::error_already_set> raised_;
  std::atomic<bool> wrong_{false};
};

struct RunArguments {
  fs::path robot, out;
  std::vector<std::string> changes;
  std::string behaviour, method, renderer;
  py::object controller, progress;
  int frames = 0;
  std::uint64_t seed = 1;
  bool landmarks = true, real_time = false, truth = false, telemetry = false, replace = false;
};

/// Drives a robot as `twocone run`.
void drive(const RunArguments& arguments) {
  const config::Robot robot = robot_with(arguments.robot, arguments.changes);
  const config::Map map = config::read_map(robot.map);
  runs::RunOptions options;
  options.frames = arguments.frames;
  options.behaviour = arguments.behaviour;
  options.method = arguments.method.empty() ? estimation::method_of(robot) : estimation::method_named(arguments.method);
  if (!arguments.landmarks && options.method == estimation::Method::kPaper) {
    throw py::value_error("landmarks=False needs method outline: method paper has no way to find landmarks");
  }
  options.seed = arguments.seed;
  options.out = arguments.out;
  options.maps = !arguments.landmarks;
  options.real_time = arguments.real_time;
  options.truth = arguments.truth;
  options.telemetry = arguments.telemetry;
  options.replace = arguments.replace;
  if (!arguments.renderer.empty()) {
    options.renderer = sim_povray::renderer_named(arguments.renderer);
    if (!options.renderer) throw py::value_error("renderer must be auto, native or povray");
  }
  Callbacks callbacks;
  const auto done = interruptibly([&](std::atomic<bool>& stop) {
    if (!arguments.controller.is_none()) {
      options.controller = [&](const localisation::Pose& p, double step_s) -> behaviours::Motion {
        using Pair = std::pair<double, double>;
        const auto motion = callbacks.call<Pair>(arguments.controller, Pose{p.x_m, p.y_m, p.heading_rad}, step_s);
        if (!motion) stop = true;
        return motion ? behaviours::Motion{motion->first, motion->second} : behaviours::Motion{};
      };
    }
    const auto progress = [&](double share) {
      if (!arguments.progress.is_none()) callbacks.call<std::monostate>(arguments.progress, share);
      if (callbacks.has_failed()) stop = true;
    };
    return runs::run(robot, map, options, progress, stop);
  });
  callbacks.rethrow();
  value_or_raise(done);
}

/// Computes ranges and fixes again from the stored frames.
void localise_again(const fs::path& folder, const std::string& method, bool allows_missing) {
  interruptibly([&](const std::atomic<bool>& stop) {
    const std::string wanted = method.empty() ? runlog::read_run_yaml(folder).info.method : method;
    const auto nothing = [](double) {};
    return value_or_raise(runs::localise(folder, estimation::method_named(wanted), nothing,
                                         {.allow_missing = allows_missing, .stop = &stop}));
  });
}

}  // namespace

void add_runs(py::module_& module) {
  module.def("read_run", &read_run, py::arg("folder"), py::arg("method"));
  module.def("localise", &localise_again, py::arg("folder"), py::arg("method"), py::arg("allow_missing"));
  module.def(
      "run",
      [](const fs::path& robot, const fs::path& out, const std::vector<std::string>& changes,
         const std::string& behaviour, const py::object& controller, int frames, const std::string& method,
         std::uint64_t seed, const std::string& renderer, bool landmarks, bool real_time, bool truth, bool telemetry,
         const py::object& progress, bool force) {
        drive({robot, out, changes, behaviour, method, renderer, controller, progress, frames, seed, landmarks,
               real_time, truth, telemetry, force});
      },
      py::arg("robot"), py::arg("out"), py::arg("changes"), py::arg("behaviour"), py::arg("controller"),
      py::arg("frames"), py::arg("method"), py::arg("seed"), py::arg("renderer"), py::arg("landmarks"),
      py::arg("real_time"), py::arg("truth"), py::arg("telemetry"), py::arg("progress"), py::arg("force"));
}

}  // namespace twocone::python
