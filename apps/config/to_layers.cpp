// SPDX-License-Identifier: Apache-2.0
#include "apps/config/to_layers.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <initializer_list>
#include <stdexcept>
#include <string>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <yaml-cpp/yaml.h>

#include "apps/config/calibration_file.h"
#include "apps/config/yaml/text_file.h"
#include "apps/config/yaml/yaml_reader.h"
#include "drivers/sim_povray/place.h"

namespace twocone::config {
namespace {

std::chrono::nanoseconds to_nanoseconds(double seconds) {
  return std::chrono::nanoseconds(std::llround(seconds * 1e9));
}

/// Adds lines about a point of the robot file that lies outside the map.
void check_within(const Robot& robot, const Map& map, std::string_view key, const Point& place, std::string& bad) {
  const auto check_side = [&](std::string_view side, double value, double least, double greatest) {
    if (value >= least && value <= greatest) return;
    bad += fmt::format("\n{}: {} has {} = {} m, must be within bounds_m.{} of {}, {} to {}", robot.file.string(), key,
                       side, value, side, map.file.string(), least, greatest);
  };
  check_side("x", place.x_m, map.bounds.min_x_m, map.bounds.max_x_m);
  check_side("y", place.y_m, map.bounds.min_y_m, map.bounds.max_y_m);
}

/// Adds lines about landmarks of `estimator:` that the map does not contain.
void check_landmarks(const Robot& robot, const Map& map, std::string& bad) {
  std::vector<std::string> known;
  for (const Landmark& landmark : map.landmarks) known.push_back(landmark.name);
  for (const std::string& name : robot.estimator.landmarks) {
    if (std::ranges::find(known, name) != known.end()) continue;
    bad += fmt::format("\n{}: estimator.landmarks names '{}', must be a landmark of {}: {}", robot.file.string(), name,
                       map.file.string(), fmt::join(known, ", "));
  }
}

void check_together(const Robot& robot, const Map& map) {
  std::string bad;
  check_landmarks(robot, map, bad);
  if (robot.start) check_within(robot, map, "start", {robot.start->x_m, robot.start->y_m}, bad);
  for (std::size_t i = 0; i < robot.waypoints.size(); ++i) {
    check_within(robot, map, fmt::format("waypoints_m[{}]", i), robot.waypoints[i], bad);
  }
  if (is_simulated(robot)) {
    if (!robot.start) {
      bad += fmt::format("\n{}: start is missing: the pose at which the scene shows the robot; driver {} needs it",
                         robot.file.string(), drivers::kSimPovray);
    }
    if (!map.scene && robot.attach.empty()) {
      bad += fmt::format("\n{}: scene is missing: the POV-Ray file; driver {} of {} needs it", map.file.string(),
                         drivers::kSimPovray, robot.file.string());
    }
  } else if (!robot.attach.empty()) {
    bad += fmt::format("\n{}: attach is '{}', must be absent: no part has driver {}", robot.file.string(), robot.attach,
                       drivers::kSimPovray);
  }
  if (!bad.empty()) throw FileError(bad.substr(1));
}

Disc disc_of(const Landmark& landmark) { return {{landmark.x_m, landmark.y_m}, landmark.radius_m}; }

/// Returns the fixed and moving objects of a map, without the scene that shows them.
sim_povray::PlaceSettings contents_of(const Map& map) {
  sim_povray::PlaceSettings place;
  place.walls = map.bounds;
  for (const Landmark& landmark : map.landmarks) {
    place.solids.push_back({fmt::format("landmark {}", landmark.name), disc_of(landmark)});
  }
  for (std::size_t i = 0; i < map.obstacles.size(); ++i) {
    sim_povray::Solid& solid = place.solids.emplace_back();
    solid.name = fmt::format("obstacle {}", i + 1);
    std::visit([&solid](const auto& shape) { solid.shape = shape; }, map.obstacles[i]);
  }
  place.moving = map.moving;
  return place;
}

/// Requires a map that names a scene.
sim_povray::PlaceSettings place_of(const Map& map) {
  sim_povray::PlaceSettings place = contents_of(map);
  place.scene = *map.scene;
  place.scene_paths = map.scene_paths;
  place.unit_m = map.unit_m;
  place.switches = map.effects;
  place.render.renderer = map.renderer;
  return place;
}

std::optional<sim_povray::Physics> physics_of(const Effects& effects) {
  if (!effects.mass_kg && !effects.wheel_friction && !effects.body_friction) return std::nullopt;
  sim_povray::Physics physics;
  physics.mass_kg = effects.mass_kg.value_or(physics.mass_kg);
  physics.wheel_friction = effects.wheel_friction.value_or(physics.wheel_friction);
  physics.body_friction = effects.body_friction.value_or(physics.body_friction);
  return physics;
}

sim_povray::SessionSettings session_of(const Robot& robot, const DriveLimits& limits, std::uint64_t seed) {
  sim_povray::SessionSettings session;
  session.name = robot.name;
  session.body.start = to_start_pose(robot);
  session.body.radius_m = robot.body_radius_m;
  session.body.wheels.separation_m = robot.effects.wheel_separation_m.value_or(robot.drive.wheel_separation_m);
  session.body.wheels.radius_m = robot.effects.wheel_radius_m.value_or(robot.drive.wheel_radius_m);
  session.body.wheels.slip = robot.effects.slip;
  session.body.wheels.encoder_counts_per_turn = robot.effects.encoder_counts_per_turn;
  session.body.wheels.lag_s = robot.effects.motor_lag_s;
  session.body.command_timeout = limits.command_timeout;
  session.body.physics = physics_of(robot.effects);
  session.body.seed = seed;
  session.drive = limits;
  // The run uses the frame of latency_frames ago. One frame more is simulated ahead, so no step waits for an image.
  session.run_ahead_frames = robot.latency_frames + 2;
  return session;
}

Eigen::Vector2d to_vector(const std::array<double, 2>& pair) { return {pair[0], pair[1]}; }

vision::MirrorView to_view(const RigView& view, double lens_height_m, const CameraSettings& camera) {
  vision::MirrorViewSettings settings{
      .cone = {.apex_rad = view.apex_rad, .rim_radius_m = view.mirror_radius_m, .lens_to_tip_m = view.lens_to_tip_m},
      .lens_height_m = lens_height_m,
      .centre_px = to_vector(view.centre_px),
      .rim_radius_px = view.rim_radius_px,
      .azimuth_rad = view.azimuth_rad,
      .mirrored = view.mirrored,
      .tilt_rad = to_vector(view.tilt_rad),
      .axis_offset_m = to_vector(view.axis_offset_m),
      .lens_axis_px = to_vector(middle_px(camera))};
  vision::MirrorView without_lens(settings);
  if (view.distortion.empty()) return without_lens;
  const double focal_px = without_lens.focal_length_px();
  settings.distortion = {.coefficients = view.distortion,
                         .focal_px = to_vector(view.distortion_focal_px.value_or(std::array{focal_px, focal_px})),
                         .principal_px = to_vector(view.distortion_principal_px.value_or(view.centre_px))};
  return vision::MirrorView(settings);
}

Eigen::Vector2d to_vector(const Point& point) { return {point.x_m, point.y_m}; }

/// Returns the distance from the farthest corner of the bounds.
double greatest_range_m(const Landmark& landmark, const Bounds& bounds) {
  return std::hypot(std::max(landmark.x_m - bounds.min_x_m, bounds.max_x_m - landmark.x_m),
                    std::max(landmark.y_m - bounds.min_y_m, bounds.max_y_m - landmark.y_m));
}

/// Returns the standard deviations of the rig's numbers, by vision::RigNumber.
std::vector<double> sigmas_of(const RigSigma& s) {
  std::vector<double> sigmas(vision::kRigNumbers, 0);
  for (const vision::Side side : {vision::Side::kLower, vision::Side::kUpper}) {
    const auto set = [&](std::initializer_list<vision::ViewNumber> numbers, double sigma) {
      for (const vision::ViewNumber number : numbers) sigmas[std::size_t(vision::rig_number(side, number))] = sigma;
    };
    set({vision::kColumn, vision::kRow}, s.centre_px);
    set({vision::kRim}, s.rim_radius_px);
    set({vision::kAzimuth}, s.azimuth_rad);
    set({vision::kTiltX, vision::kTiltY}, s.tilt_rad);
    set({vision::kOffsetX, vision::kOffsetY}, s.axis_offset_m);
    set({vision::kApex}, s.apex_rad);
    set({vision::kMirrorRadius}, s.mirror_radius_m);
    set({vision::kLensToTip}, s.lens_to_tip_m);
    set({vision::kK1, vision::kK2}, s.distortion);
  }
  sigmas[vision::kLensHeight] = s.lens_height_m;
  sigmas[vision::kSeparation] = s.mirror_separation_m;
  return sigmas;
}

void add_keys(const YAML::Node& node, const std::string& prefix, const std::string& file,
              sim_povray::KeyPlaces& places) {
  if (node.IsSequence() && !prefix.empty()) {
    const std::string list = prefix.substr(0, prefix.size() - 1);
    for (std::size_t i = 0; i < node.size(); ++i) {
      places.emplace(fmt::format("{}[{}]", list, i), fmt::format("{}:{}", file, node[i].Mark().line + 1));
    }
  }
  if (!node.IsMap()) return;
  for (const auto& pair : node) {
    if (!pair.first.IsScalar()) continue;  // the reader of the file rejects such a key
    const std::string key = prefix + pair.first.Scalar();
    places.emplace(key, fmt::format("{}:{}", file, pair.first.Mark().line + 1));
    add_keys(pair.second, key + ".", file, places);
  }
}

}  // namespace

void check_landmarks(const Robot& robot, const Map& map) {
  std::string bad;
  check_landmarks(robot, map, bad);
  if (!bad.empty()) throw FileError(bad.substr(1));
}

bool is_simulated(const Robot& robot) {
  const auto is_other_simulated = [](const drivers::OtherCamera& other) {
    return other.part.driver == drivers::kSimPovray;
  };
  return robot.drive.driver == drivers::kSimPovray || robot.lower.driver == drivers::kSimPovray ||
         robot.upper.driver == drivers::kSimPovray || std::ranges::any_of(robot.others, is_other_simulated);
}

drivers::RobotSettings to_robot_settings(const Robot& robot, const Map& map, std::uint64_t seed) {
  check_together(robot, map);
  drivers::RobotSettings settings;
  settings.lower = robot.lower;
  settings.upper = robot.upper;
  settings.drive.driver = robot.drive.driver;
  settings.drive.limits = {.max_speed_radps = robot.drive.max_speed_mps / robot.drive.wheel_radius_m,
                           .command_timeout = to_nanoseconds(robot.drive.command_timeout_s)};
  settings.drive.serial = robot.drive.serial;
  settings.max_skew = to_nanoseconds(robot.max_skew_s);
  settings.others = robot.others;
  if (is_simulated(robot)) {
    drivers::SimulatedWorld& world = settings.world.emplace();
    world.attach = robot.attach;
    if (robot.attach.empty()) world.place = place_of(map);
    world.session = session_of(robot, settings.drive.limits, seed);
    if (!robot.attach.empty()) world.session.map_outline = sim_povray::outline_of(contents_of(map));
  }
  try {
    drivers::check(settings);
  } catch (const std::invalid_argument& error) {
    throw FileError("{}: {}", robot.file.string(), error.what());
  }
  return settings;
}

sim_povray::PlaceSettings to_place(const Map& map) {
  if (!map.scene) throw FileError("{}: scene is missing: the POV-Ray file", map.file.string());
  sim_povray::PlaceSettings place = place_of(map);
  try {
    sim_povray::check(place);
  } catch (const std::invalid_argument& error) {
    throw FileError("{}: {}", map.file.string(), error.what());
  }
  return place;
}

std::vector<sim_povray::ViewSettings> to_views(const drivers::RobotSettings& settings) {
  std::vector<sim_povray::ViewSettings> views{{"lower", settings.lower.antialias, settings.lower.effects},
                                              {"upper", settings.upper.antialias, settings.upper.effects}};
  for (const drivers::OtherCamera& other : settings.others) {
    views.push_back({other.name, other.part.antialias, other.part.effects});
  }
  return views;
}

sim_povray::KeyPlaces key_places(const Robot& robot, const Map& map) {
  sim_povray::KeyPlaces places;
  add_keys(load_yaml(robot.file), "", robot.file.string(), places);
  for (const KeyChange& change : robot.changes) {
    const std::string place = "--set " + to_string(change);
    places[change.key] = place;
    sim_povray::KeyPlaces added;
    add_keys(parse_yaml(change.value, place), change.key + ".", place, added);
    for (const auto& [key, line] : added) places[key] = place;
  }
  add_keys(load_yaml(map.file), "map.", map.file.string(), places);
  return places;
}

vision::Rig to_rig(const Robot& robot) {
  if (!robot.rig.missing.empty()) {
    throw FileError(
        "{}: rig has no {}: twocone run --self-rig finds them in the first images, and twocone calibrate in a drive",
        robot.file.string(), fmt::join(robot.rig.missing, ", "));
  }
  return to_assumed_rig(robot);
}

vision::Rig to_assumed_rig(const Robot& robot) {
  const Rig& rig = robot.rig;
  const double lower_tip_m = rig.lens_height_m + rig.lower.lens_to_tip_m;
  const double upper_lens_m = lower_tip_m + rig.mirror_separation_m - rig.upper.lens_to_tip_m;
  std::string_view mirror = "rig, lower mirror";
  try {
    vision::MirrorView lower = to_view(rig.lower, rig.lens_height_m, robot.lower.settings);
    mirror = "rig, upper mirror";
    return {std::move(lower),
            to_view(rig.upper, upper_lens_m, robot.upper.settings),
            {vision::ExposureTimes{rig.lower.late_s, rig.lower.readout_s},
             vision::ExposureTimes{rig.upper.late_s, rig.upper.readout_s}}};
  } catch (const std::invalid_argument& error) {
    throw FileError("{}: {}: {}", robot.file.string(), mirror, error.what());
  }
}

std::vector<Landmark> to_targets(const Map& map) {
  std::vector<Landmark> targets = map.landmarks;
  for (Landmark& landmark : targets) landmark.greatest_range_m = greatest_range_m(landmark, map.bounds);
  return targets;
}

std::vector<Eigen::Vector2d> to_landmark_positions(const Map& map) {
  std::vector<Eigen::Vector2d> positions;
  for (const Landmark& landmark : map.landmarks) positions.push_back(vision::place_m(landmark));
  return positions;
}

localisation::WheelGeometry to_wheels(const Robot& robot) {
  return {.radius_m = robot.drive.wheel_radius_m, .separation_m = robot.drive.wheel_separation_m};
}

BeliefErrors to_belief_errors(const Robot& robot, const Map& map) {
  const RigSigma rig = robot.rig.sigma.value_or(ruler_sigma(robot.rig));
  const WheelSigma wheels = robot.drive.sigma.value_or(ruler_sigma(robot.drive));
  // All numbers in one list, as belief_names() has them. Without a calibration each is independent of the others.
  std::vector<double> sigmas = sigmas_of(rig);
  for (const Landmark& landmark : map.landmarks) {
    const LandmarkSigma& s = landmark.sigma;
    sigmas.insert(sigmas.end(), {s.x_m, s.y_m, s.top_m, s.radius_m});
  }
  sigmas.insert(sigmas.end(), {wheels.wheel_radius_m, wheels.wheel_ratio, wheels.wheel_separation_m, rig.late_s,
                               rig.late_s, rig.readout_s, rig.readout_s});

  const Eigen::VectorXd independent = Eigen::Map<const Eigen::VectorXd>(sigmas.data(), Eigen::Index(sigmas.size()));
  Eigen::MatrixXd covariance = independent.cwiseAbs2().asDiagonal();
  double sighting_px = 0;
  if (!robot.rig.calibration.empty()) {
    const Calibration calibration = read_calibration(robot.rig.calibration);
    covariance = belief_covariance(calibration, robot, map, independent);
    sighting_px = calibration.sighting_px;
  }
  if (!map.survey.empty()) {
    const Calibration survey = read_calibration(map.survey);
    covariance = with_survey(survey, robot, map, covariance);
    sighting_px = std::max(sighting_px, survey.sighting_px);
  }
  const Eigen::MatrixXd by_shared = root_of(covariance);
  BeliefErrors errors;
  errors.vision = vision_errors(by_shared, map.landmarks.size(), sighting_px);
  for (const auto& landmark : errors.vision.landmarks) {
    errors.places.emplace_back(landmark.middleRows<2>(vision::kPlaceX));
  }
  Eigen::Matrix3d by_sizes;  // of left radius share, right radius share, separation
  const double per_radius = 1 / robot.drive.wheel_radius_m;
  by_sizes << per_radius, -0.5, 0, per_radius, 0.5, 0, 0, 0, 1;
  errors.wheels = by_sizes * by_shared.bottomRows<kWheelNumbers + vision::kTimeNumbers>().topRows<kWheelNumbers>();
  return errors;
}

std::string ruler_note(const Robot& robot, const Map& map) {
  std::vector<std::string> lacking;
  if (!robot.rig.sigma && robot.rig.calibration.empty())
    lacking.push_back(fmt::format("rig: of {}", robot.file.string()));
  if (!robot.drive.sigma && robot.rig.calibration.empty())
    lacking.push_back(fmt::format("drive: of {}", robot.file.string()));
  if (const std::size_t count = map.without_sigma.size(); count > 0) {
    lacking.push_back(count == map.landmarks.size() ? fmt::format("the landmarks of {}", map.file.string())
                                                    : fmt::format("{} landmarks of {} ({})", count, map.file.string(),
                                                                  fmt::join(map.without_sigma, ", ")));
  }
  if (lacking.empty()) return "";
  return fmt::format("no sigma is stated for {}: the answers count with what a ruler gives (key sigma, sigma_m)",
                     fmt::join(lacking, ", "));
}

localisation::Pose to_start_pose(const Robot& robot) {
  const Pose2 start = robot.start.value_or(Pose2{});
  return {.x_m = start.x_m, .y_m = start.y_m, .heading_rad = localisation::wrap_angle_rad(start.heading_rad)};
}

localisation::FloorPlan to_floor_plan(const Map& map) {
  localisation::FloorPlan plan;
  const auto add = [&](const std::vector<Eigen::Vector2d>& corners) {
    for (std::size_t k = 0; k < corners.size(); ++k)
      plan.edges.push_back({corners[k], corners[(k + 1) % corners.size()]});
  };
  const Bounds& b = map.bounds;
  add({{b.min_x_m, b.min_y_m}, {b.max_x_m, b.min_y_m}, {b.max_x_m, b.max_y_m}, {b.min_x_m, b.max_y_m}});
  Map without_landmarks = map;
  without_landmarks.landmarks.clear();
  behaviours::Arena arena = to_arena(without_landmarks);
  for (const behaviours::Outline& outline : arena.outlines) add(outline);
  plan.discs = std::move(arena.discs);
  return plan;
}

behaviours::Arena to_arena(const Map& map) {
  behaviours::Arena arena;
  arena.min_m = {map.bounds.min_x_m, map.bounds.min_y_m};
  arena.max_m = {map.bounds.max_x_m, map.bounds.max_y_m};
  for (const Landmark& landmark : map.landmarks) {
    arena.discs.push_back(disc_of(landmark));
  }
  for (const Obstacle& obstacle : map.obstacles) {
    if (const auto* disc = std::get_if<Disc>(&obstacle)) {
      arena.discs.push_back(*disc);
      continue;
    }
    behaviours::Outline& outline = arena.outlines.emplace_back();
    for (const Point& corner : std::get<Polygon>(obstacle)) outline.push_back(to_vector(corner));
  }
  return arena;
}

}  // namespace twocone::config
