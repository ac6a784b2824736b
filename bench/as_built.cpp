// SPDX-License-Identifier: Apache-2.0
//
// as_built_bench --robots N [--calibrate] --rows FILE : robots as built (apps/as_built), in synthetic images.
//
// Each robot is drawn from its seed with the tolerances of the generator and believes its plan. Uncalibrated, it takes
// what one pair of images shows of its rig, as `run --self-rig` does. Calibrated, it drives among the landmarks, and
// `calibrate` makes its rig and its map. Then it is put at a few places, and its fixes are compared with the truth.
// Robots are inside the model: effects of cameras and what no model has are for rendered images. Rows that the file has
// already are not made again.
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <numbers>
#include <random>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <Eigen/Dense>
#include <opencv2/imgproc.hpp>

#include "apps/as_built/as_built.h"
#include "apps/calibrate/calibrate.h"
#include "apps/config/to_layers.h"
#include "apps/estimation/estimator.h"
#include "apps/estimation/image_as_mat.h"
#include "apps/estimation/self_rig.h"
#include "apps/runlog/run_data.h"
#include "apps/runlog/storage/disk.h"
#include "apps/runlog/storage/image_file.h"
#include "base/scratch_folder.h"
#include "localisation/odometry.h"
#include "tests/support/synthetic_lab.h"

namespace twocone {
namespace {

namespace fs = std::filesystem;
using testing_support::SyntheticCamera;
using testing_support::SyntheticRig;
using testing_support::SyntheticScene;

constexpr int kPlaces = 4;  ///< at which each robot is judged
constexpr double kRoom_m = 1.3;
constexpr int kDriveFrames = 60;
constexpr double kFrame_s = 0.4;
constexpr double kNoise = 1;  ///< grey levels

/// The world of a drawn robot: its images from anywhere.
class World {
 public:
  World(const as_built::AsBuilt& drawn, std::uint64_t seed)
      : drawn_(drawn),
        rig_(config::to_rig(drawn.built), {.level = 0.4, .swing = 0.25, .swing_bearing_rad = 0.7, .rise = 0.1}),
        random_(seed) {
    for (const Landmark& l : drawn.built_map.landmarks) {
      landmarks_.push_back(
          {{l.x_m, l.y_m}, l.radius_m, l.top_m, 0.75 * Eigen::Vector3d(l.colour[0], l.colour[1], l.colour[2])});
    }
  }

  SyntheticRig::Pair take(const localisation::Pose& pose) {
    SyntheticScene scene;
    scene.landmarks = testing_support::seen_from(landmarks_, {pose.x_m, pose.y_m}, pose.heading_rad);
    scene.shading.light_bearing_rad = -pose.heading_rad;  // the lamp stands in the room
    return rig_.take(scene, SyntheticCamera{.noise_grey_levels = kNoise}, random_);
  }
  std::mt19937_64& random() { return random_; }

 private:
  const as_built::AsBuilt& drawn_;
  SyntheticRig rig_;
  std::vector<testing_support::SyntheticLandmark> landmarks_;
  std::mt19937_64 random_;
};

/// What a robot believes, and how it came to that: empty, or why there is nothing.
struct Believer {
  config::Robot robot;
  config::Map map;
  std::string why_not;
};

Believer with_self_rig(const as_built::AsBuilt& drawn, World& world) {
  Believer believer{drawn.believed, drawn.believed_map, ""};
  vision::SelfRigProblem problem = estimation::self_rig_problem(drawn.believed, drawn.believed_map);
  const auto start = config::to_start_pose(drawn.built);
  const auto pair = world.take(start);
  problem.frames.push_back({pair.lower, pair.upper, {}, start.heading_rad});
  const vision::SelfRig found = vision::find_rig(problem);
  if (found.missing() != vision::NotFound::kNothing) {
    believer.why_not = to_string(found.missing());
    return believer;
  }
  if (*found.exchanged.value) {
    believer.why_not = "exchanged";
    return believer;
  }
  believer.robot.rig = estimation::compare_with_file(drawn.believed, found, problem, estimation::Replace::kAll).rig;
  return believer;
}

/// Drives a robot along a path that turns through all headings, and stores it as a run.
runlog::RunData drive(const as_built::AsBuilt& drawn, World& world, const fs::path& folder) {
  runlog::RunData run;
  run.folder = folder;
  run.robot = drawn.believed;
  run.map = drawn.believed_map;
  const localisation::WheelGeometry wheels = config::to_wheels(drawn.built);
  const double radius_m = drawn.built.effects.wheel_radius_m.value_or(wheels.radius_m);
  const double separation_m = drawn.built.effects.wheel_separation_m.value_or(wheels.separation_m);
  fs::create_directories(folder / "lower");
  fs::create_directories(folder / "upper");
  localisation::Pose pose = config::to_start_pose(drawn.built);
  double left_rad = 0;
  double right_rad = 0;
  for (int i = 0; i < kDriveFrames; ++i) {
    const auto pair = world.take(pose);
    const auto frame = std::uint64_t(i);
    runlog::write_image(runlog::lower_image_file(folder, frame), estimation::as_image(pair.lower));
    runlog::write_image(runlog::upper_image_file(folder, frame), estimation::as_image(pair.upper));
    const double t_s = kFrame_s * i;
    run.frames.push_back({.frame = frame, .t_s = t_s, .lower_t_s = t_s, .upper_t_s = t_s});
    run.drive.push_back({t_s, {}, {}, left_rad, right_rad});
    // A figure of eight: 0.25 m/s, with turns of either hand.
    const double turn_radps = 0.75 * std::sin(2 * std::numbers::pi * (i + 0.5) / kDriveFrames);
    const double left_m = (0.25 - turn_radps * separation_m / 2) * kFrame_s;
    const double right_m = (0.25 + turn_radps * separation_m / 2) * kFrame_s;
    pose = localisation::drive_arc(pose, left_m, right_m, separation_m);
    left_rad += left_m / radius_m;
    right_rad += right_m / radius_m;
  }
  return run;
}

Believer calibrated(const as_built::AsBuilt& drawn, World& world, const fs::path& folder) {
  Believer believer{drawn.believed, drawn.believed_map, ""};
  const std::vector<runlog::RunData> runs{drive(drawn, world, folder / "run")};
  calibrate::Settings settings;
  settings.frames = kDriveFrames;
  settings.priors = calibrate::priors_of(drawn.believed);
  settings.fit_distortion = true;
  const auto report = calibrate::calibrate(runs, drawn.believed, settings);
  if (!report) {
    believer.why_not = report.error().message;
    return believer;
  }
  believer.robot.rig = report->rig;
  believer.robot.drive = report->drive;
  believer.robot.rig.calibration = folder / "robot.calibration.json";
  runlog::write_whole(believer.robot.rig.calibration, calibrate::to_json(*report));
  if (const auto landmarks = calibrate::refined_landmarks(*report); !landmarks.empty()) {
    believer.map.landmarks = landmarks;
  }
  return believer;
}

/// Localises at a few places. @returns one line for each: robot, place, verdict, error m, heading error rad, squared
/// distance in sigmas of the position, own sigma m, sigma m
std::vector<std::string> judge(std::uint64_t seed, const Believer& believer, World& world) {
  std::vector<std::string> lines;
  const estimation::Estimator estimator(estimation::Method::kOutline, believer.robot, believer.map);
  std::uniform_real_distribution<double> place(-kRoom_m, kRoom_m);
  std::uniform_real_distribution<double> turn(-std::numbers::pi, std::numbers::pi);
  for (int i = 0; i < kPlaces; ++i) {
    const localisation::Pose pose{place(world.random()), place(world.random()), turn(world.random())};
    const auto pair = world.take(pose);
    const auto answer = estimator.answer(estimation::as_image(pair.lower), estimation::as_image(pair.upper));
    if (!answer) throw std::runtime_error(answer.error().message);
    const localisation::Fix& fix = answer->fix;
    std::string line = fmt::format("{},{},{}", seed, i, to_string(fix.verdict));
    if (fix.verdict == localisation::FixVerdict::kOk && fix.heading_rad) {
      const Eigen::Vector2d off_m = *fix.position_m - Eigen::Vector2d(pose.x_m, pose.y_m);
      const Eigen::Matrix2d covariance = fix.covariance->topLeftCorner<2, 2>();
      line += fmt::format(",{:.6f},{:.6f},{:.4f},{:.6f},{:.6f}", off_m.norm(),
                          base::wrap_angle_rad(*fix.heading_rad - pose.heading_rad),
                          off_m.dot(covariance.inverse() * off_m),
                          std::sqrt(fix.own_covariance->topLeftCorner<2, 2>().trace()), std::sqrt(covariance.trace()));
    } else {
      line += ",,,,,";
    }
    lines.push_back(line);
  }
  return lines;
}

std::set<std::uint64_t> seeds_in(const fs::path& rows) {
  std::set<std::uint64_t> seeds;
  std::ifstream in(rows);
  for (std::string line; std::getline(in, line);) seeds.insert(std::strtoull(line.c_str(), nullptr, 10));
  return seeds;
}

struct Summary {
  int frames = 0, ok = 0, beyond_5 = 0, beyond_10 = 0, robots = 0, silent = 0;
  double shares = 0, shares2 = 0;
  double squared_sigmas = 0;  ///< mean
  std::vector<double> errors_m, headings_rad;
};

Summary summarise(const fs::path& rows) {
  Summary s;
  std::map<std::string, std::pair<int, int>> by_robot;  // ok, held
  std::ifstream in(rows);
  for (std::string line; std::getline(in, line);) {
    std::vector<std::string> fields;
    std::istringstream text(line);
    for (std::string field; std::getline(text, field, ',');) fields.push_back(field);
    if (fields.size() < 3) continue;
    if (fields[1] == "-") {
      ++s.silent;
      s.frames += kPlaces;
      continue;
    }
    ++s.frames;
    if (fields.size() < 8) continue;
    const double distance2 = std::stod(fields[5]);
    ++s.ok;
    s.squared_sigmas += (distance2 - s.squared_sigmas) / s.ok;
    s.beyond_5 += distance2 > 25 ? 1 : 0;
    s.beyond_10 += distance2 > 100 ? 1 : 0;
    s.errors_m.push_back(std::stod(fields[3]));
    s.headings_rad.push_back(std::abs(std::stod(fields[4])));
    constexpr double kTwo95 = 5.991;  // quantile of chi-squared of two numbers
    auto& [ok, held] = by_robot[fields[0]];
    ++ok;
    held += distance2 < kTwo95 ? 1 : 0;
  }
  for (const auto& [robot, counts] : by_robot) {
    const double share = double(counts.second) / counts.first;
    s.shares += share;
    s.shares2 += share * share;
    ++s.robots;
  }
  return s;
}

int run(int argc, char** argv) {
  int robots = 20;
  int first = 1;
  bool is_calibrated = false;
  fs::path rows;
  std::string robot_file = "robots/lab_sim.yaml";
  CLI::App program("Robots as built, in synthetic images");
  program.add_option("--robots", robots, "Number of robots")->capture_default_str();
  program.add_option("--first", first, "Seed of the first one")->capture_default_str();
  program.add_flag("--calibrate", is_calibrated, "Calibrate each robot first");
  program.add_option("--rows", rows, "File of results; rows that it has are not made again")->required();
  program.add_option("ROBOT", robot_file, "The plan")->capture_default_str();
  CLI11_PARSE(program, argc, argv);

  const config::Robot plan = config::read_robot(robot_file);
  const config::Map map = config::read_map(plan.map);
  const std::set<std::uint64_t> done = seeds_in(rows);
  std::ofstream out(rows, std::ios::app);
  for (int i = 0; i < robots; ++i) {
    const auto seed = std::uint64_t(first + i);
    if (done.contains(seed)) continue;
    const as_built::AsBuilt drawn = as_built::draw(plan, map, seed);
    World world(drawn, seed);
    const base::ScratchFolder scratch(base::scratch_roots());
    const Believer believer = is_calibrated ? calibrated(drawn, world, scratch.path()) : with_self_rig(drawn, world);
    if (!believer.why_not.empty()) {
      std::string why = believer.why_not;
      std::ranges::replace(why, ',', ';');
      out << fmt::format("{},-,{}\n", seed, why) << std::flush;
      continue;
    }
    for (const std::string& line : judge(seed, believer, world)) out << line << '\n';
    out << std::flush;
  }
  if (!out) throw std::runtime_error(fmt::format("{}: cannot be written", rows.string()));

  Summary s = summarise(rows);
  const double share = s.shares / std::max(1, s.robots);
  const double error =
      std::sqrt(std::max(0.0, s.shares2 / std::max(1, s.robots) - share * share) / std::max(1, s.robots - 1));
  const auto mean = [](const std::vector<double>& values) {
    double sum = 0;
    for (const double value : values) sum += value;
    return values.empty() ? 0 : sum / double(values.size());
  };
  fmt::print("robots {}, without an answer {}; fixes in {:.1f} % of {} frames\n", s.robots + s.silent, s.silent,
             100.0 * s.ok / std::max(1, s.frames), s.frames);
  fmt::print("95 % ellipses hold {:.1f} +- {:.1f} % over robots; beyond 5 sigma {}, beyond 10 sigma {} of {}\n",
             100 * share, 100 * error, s.beyond_5, s.beyond_10, s.ok);
  fmt::print("mean squared distance in sigmas {:.2f}; it is 2 where the sigmas are right\n", s.squared_sigmas);
  fmt::print("position error, mean {:.2f} mm; heading error, mean {:.3f} degrees\n", 1000 * mean(s.errors_m),
             mean(s.headings_rad) * 180 / std::numbers::pi);
  return 0;
}

}  // namespace
}  // namespace twocone

int main(int argc, char** argv) {
  try {
    return twocone::run(argc, argv);
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 1;
  }
}
