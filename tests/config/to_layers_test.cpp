// SPDX-License-Identifier: Apache-2.0
#include "apps/config/to_layers.h"

#include <chrono>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include "tests/config/fixtures.h"

namespace twocone::config {
namespace {

using std::chrono::milliseconds;

Robot good_robot() { return read_robot(data("good_robot.yaml")); }
Map good_map() { return read_map(data("good_map.yaml")); }

std::string all_of(const DriveLimits& limits) {
  const auto& [max_speed_radps, command_timeout] = limits;
  return fmt::format("{} {}\n", max_speed_radps, command_timeout.count());
}

std::string all_of(const CameraDevice& device) {
  const auto& [name, format, controls] = device;
  std::string text = name + " " + format + "\n";
  for (const auto& [control, value] : controls) text += fmt::format("{} {}\n", control, value);
  return text;
}

std::string all_of(const serial::SerialDriveSettings& serial) {
  const auto& [port, protocol, baud, counts_per_turn, address, swap_wheels, reverse_left, reverse_right, watchdog,
               least_speed_radps] = serial;
  return fmt::format("{} {} {} {} {} {} {} {} {} {}\n", port, protocol, baud.value_or(0), counts_per_turn.value_or(0),
                     address, swap_wheels, reverse_left, reverse_right, watchdog, least_speed_radps.value_or(-1));
}

std::string all_of(const drivers::CameraPart& part) {
  const auto& [driver, asked, antialias, effects, device] = part;
  const auto& [width_px, height_px, rate_hz] = asked;
  const auto& [gain, full_well, read_noise, vignetting, defocus_px, exposure_time_s, readout_s, shutter_samples,
               distortion, focal_px, drop, late, stamp_late_s, colour_gain, flicker, jpeg_quality] = effects;
  return fmt::format("{} {} {} {} {} {} {} {} {} {} {} {} {} {} {} {} {} {} {} {} {}\n", driver, width_px, height_px,
                     rate_hz, antialias, gain, full_well, read_noise, vignetting, defocus_px, exposure_time_s,
                     readout_s, shutter_samples, fmt::join(distortion, ","), focal_px, drop, late, stamp_late_s,
                     fmt::join(colour_gain, ","), flicker, jpeg_quality) +
         all_of(device);
}

std::string all_of(const sim_povray::SessionSettings& session) {
  const auto& [name, body, drive, map_outline, run_ahead, rendered, stored, truth] = session;
  const auto& [body_name, start, body_radius_m, wheels, timeout, physics, seed, begin, start_place] = body;
  const auto& [separation_m, radius_m, slip, slip_correlation_s, counts, lag_s] = wheels;
  std::string text = fmt::format("{} {} {} {} {} {} {} {} {}\n", name, body_name, start.x_m, start.y_m,
                                 start.heading_rad, body_radius_m, run_ahead, map_outline, start_place);
  text += fmt::format("{} {} {} {} {} {}\n", separation_m, radius_m, slip, slip_correlation_s, counts, lag_s);
  text += fmt::format("{} {} {} {} {} {} {}", timeout.count(), seed, begin.has_value(), bool(rendered), bool(stored),
                      bool(truth), all_of(drive));
  if (!physics) return text + "no physics\n";
  const auto& [mass_kg, wheel_friction, body_friction] = *physics;
  return text + fmt::format("{} {} {}\n", mass_kg, wheel_friction, body_friction);
}

std::string all_of(const sim_povray::PlaceSettings& place) {
  const auto& [scene, scene_paths, unit_m, walls, solids, moving, switches, render] = place;
  std::string text = fmt::format("{} {}\n", scene.string(), unit_m);
  for (const auto& folder : scene_paths) text += folder.string() + "\n";
  if (walls) text += fmt::format("{} {} {} {}\n", walls->min_x_m, walls->max_x_m, walls->min_y_m, walls->max_y_m);
  for (const auto& [name, shape] : solids) {
    text += name;
    if (const auto* disc = std::get_if<Disc>(&shape)) {
      text += fmt::format(" {} {} {}\n", disc->centre.x_m, disc->centre.y_m, disc->radius_m);
    } else {
      for (const auto& [x_m, y_m] : std::get<sim_povray::Outline>(shape)) text += fmt::format(" ({}, {})", x_m, y_m);
    }
  }
  for (const auto& [name, path_m, speed_mps, loop, radius_m] : moving) {
    text += fmt::format("{} {} {} {}", name, speed_mps, loop, radius_m);
    for (const auto& [x_m, y_m] : path_m) text += fmt::format(" ({}, {})", x_m, y_m);
  }
  const auto& [shadows, area_lights, photons, radiosity, media, depth] = switches;
  text += fmt::format("\n{} {} {} {} {} {}\n", shadows, area_lights, photons, radiosity, media, depth.value_or(-1));
  const auto& [renderer, povray, processes, hold, whole_image, landlock, timeout, notice, chosen] = render;
  return text + fmt::format("{} {} {} {} {} {} {} {} {}\n", to_string(renderer), povray, processes, hold, whole_image,
                            landlock, timeout.count(), bool(notice), bool(chosen));
}

/// Returns every field as text. The bindings name each field of each struct, so that a new field does not compile
/// unnoticed.
std::string all_of(const drivers::RobotSettings& settings) {
  const auto& [lower, upper, drive, max_skew, others, world] = settings;
  const auto& [driver, drive_limits, serial] = drive;
  std::string text = all_of(lower) + all_of(upper) + driver + " " + all_of(drive_limits);
  if (serial) text += all_of(*serial);
  text += fmt::format("{}\n", max_skew.count());
  for (const auto& [name, part] : others) text += name + " " + all_of(part);
  if (!world) return text + "no world";
  const auto& [attach, place, session] = *world;
  return text + attach + "\n" + all_of(place) + all_of(session);
}

TEST(ToRobotSettings, TakesEachFieldFromItsPlace) {
  const Robot robot = good_robot();
  const DriveLimits limits{.max_speed_radps = 0.37 / 0.043, .command_timeout = milliseconds(410)};
  drivers::RobotSettings wanted;
  wanted.lower = {.driver = "sim_povray", .settings = {641, 479, 12.5}, .antialias = 2, .effects = robot.lower.effects};
  wanted.upper = {.driver = "sim_povray", .settings = {322, 243, 12.5}, .antialias = 1, .effects = robot.upper.effects};
  wanted.drive = {.driver = "sim_povray", .limits = limits};
  wanted.max_skew = milliseconds(11);
  wanted.others = {
      {"aft_2", {.driver = "sim_povray", .settings = {80, 60, 12.5}, .effects = robot.others.at(0).part.effects}}};
  drivers::SimulatedWorld& world = wanted.world.emplace();
  world.place = to_place(good_map());
  world.session.name = "nina";
  world.session.drive = limits;
  world.session.run_ahead_frames = 5;  // latency_frames plus two
  world.session.body.start = {.x_m = 0.31, .y_m = -0.42, .heading_rad = 0.53};
  world.session.body.radius_m = 0.17;
  world.session.body.wheels.separation_m = 0.29;
  world.session.body.wheels.radius_m = 0.043;
  world.session.body.wheels.slip = 0.013;
  world.session.body.wheels.encoder_counts_per_turn = 1200;
  world.session.body.wheels.lag_s = 0.07;
  world.session.body.command_timeout = milliseconds(410);
  world.session.body.physics.emplace().mass_kg = 4.2;  // wheel_friction is not in the file
  world.session.body.physics->body_friction = 0.25;
  world.session.body.seed = 77;
  EXPECT_EQ(all_of(to_robot_settings(robot, good_map(), 77)), all_of(wanted));
  EXPECT_NE(robot.lower.effects, robot.upper.effects);
}

TEST(ToRobotSettings, TheWorldsWheelsMayDifferFromTheBelievedOnes) {
  Robot robot = good_robot();
  robot.effects.wheel_radius_m = 0.0437;
  const auto radius = to_robot_settings(robot, good_map(), 1);
  EXPECT_EQ(radius.world->session.body.wheels.radius_m, 0.0437);
  EXPECT_EQ(radius.world->session.body.wheels.separation_m, 0.29) << "not in the file";
  EXPECT_EQ(radius.drive.limits.max_speed_radps, 0.37 / 0.043) << "the robot uses its belief";
  EXPECT_EQ(to_wheels(robot).radius_m, 0.043);
  robot.effects.wheel_separation_m = 0.283;
  EXPECT_EQ(to_robot_settings(robot, good_map(), 1).world->session.body.wheels.separation_m, 0.283);
  EXPECT_EQ(to_wheels(robot).separation_m, 0.29);
}

TEST(ToRobotSettings, WithoutMassAndFrictionThereIsNoPhysics) {
  Robot robot = good_robot();
  robot.effects.mass_kg.reset();
  robot.effects.body_friction.reset();
  EXPECT_FALSE(to_robot_settings(robot, good_map(), 1).world->session.body.physics.has_value());
  robot.effects.wheel_friction = 0.6;
  const auto physics = to_robot_settings(robot, good_map(), 1).world->session.body.physics;
  ASSERT_TRUE(physics.has_value());
  EXPECT_EQ(physics->wheel_friction, 0.6);
  EXPECT_EQ(physics->mass_kg, sim_povray::Physics{}.mass_kg);
}

TEST(ToRobotSettings, AServedWorldNeedsNoLocalScene) {
  Robot robot = good_robot();
  robot.attach = "hall-2";
  Map map = good_map();
  map.scene.reset();
  const drivers::RobotSettings settings = to_robot_settings(robot, map, 1);
  ASSERT_TRUE(settings.world.has_value());
  EXPECT_EQ(settings.world->attach, "hall-2");
  EXPECT_EQ(settings.world->session.name, "nina");
  EXPECT_EQ(all_of(settings.world->place), all_of(sim_povray::PlaceSettings{}));
}

TEST(ToPlace, HasEveryThingOfTheMap) {
  sim_povray::PlaceSettings wanted;
  wanted.scene = data("cellar.pov");
  wanted.scene_paths = good_map().scene_paths;
  wanted.unit_m = 0.04;
  wanted.walls = Bounds{.min_x_m = -2.1, .max_x_m = 3.3, .min_y_m = -1.7, .max_y_m = 2.9};
  wanted.solids = {{"landmark red", Disc{{-1.9, 0.7}, 0.08}},
                   {"landmark green", Disc{{2.3, -1.1}, 0.11}},
                   {"obstacle 1", sim_povray::Outline{{0.1, 0.2}, {0.9, 0.3}, {0.4, 1.1}}},
                   {"obstacle 2", Disc{{1.2, -0.8}, 0.25}}};
  wanted.moving = moving_in_good_map();
  wanted.switches = {.shadows = false, .photons = false, .reflection_depth = 3};
  EXPECT_EQ(all_of(to_place(good_map())), all_of(wanted));
}

TEST(ToPlace, APlaceThatCannotBeServedIsAFileError) {
  Map map = good_map();
  map.file = "m.yaml";
  map.unit_m = -0.04;
  EXPECT_EQ(message_of([&] { to_place(map); }).rfind("m.yaml: ", 0), 0u);
  map.scene.reset();
  EXPECT_EQ(message_of([&] { to_place(map); }), "m.yaml: scene is missing: the POV-Ray file");
}

TEST(ToRobotSettings, OtherDriversHaveNoWorld) {
  Robot robot = good_robot();
  robot.drive.driver = robot.lower.driver = robot.upper.driver = "memory";
  robot.others.clear();
  robot.start.reset();
  Map map = good_map();
  map.scene.reset();
  EXPECT_EQ(to_robot_settings(robot, map, 1).world, std::nullopt);
}

/// Fails if any code on the simulator's side reads the robot's beliefs.
TEST(BeliefAndTruth, NothingOfTheRigReachesTheDrivers) {
  const std::string before = all_of(to_robot_settings(good_robot(), good_map(), 77));
  Robot robot = good_robot();
  auto& [lower, upper, separation_m, lens_height_m, sigma, calibration, missing] = robot.rig;
  separation_m *= 1.7;
  lens_height_m += 0.31;
  sigma = RigSigma{.centre_px = 3};
  calibration = "found.calibration.json";
  missing = {"lower.centre_px"};
  for (RigView* view : {&lower, &upper}) {
    auto& [apex_rad, mirror_radius_m, lens_to_tip_m, centre_px, rim_radius_px, azimuth_rad, mirrored, tilt_rad,
           axis_offset_m, late_s, readout_s, distortion, focal_px, principal_px, camera_info] = *view;
    apex_rad *= 1.3;
    mirror_radius_m *= 1.1;
    lens_to_tip_m *= 0.9;
    centre_px[0] += 5;
    centre_px[1] -= 7;
    rim_radius_px *= 1.2;
    azimuth_rad += 0.6;
    mirrored = !mirrored;
    tilt_rad[0] += 0.03;
    axis_offset_m[1] -= 0.002;
    late_s = -0.02;
    readout_s = 0.01;
    distortion = {0.1, -0.2, 0.003, 0.004};
    focal_px = {611.0, 613.0};
    principal_px = {317.0, 241.0};
    camera_info = "lens.yaml";
  }
  EXPECT_NE(robot.rig, good_robot().rig);
  EXPECT_EQ(all_of(to_robot_settings(robot, good_map(), 77)), before);
}

TEST(BeliefAndTruth, OfLandmarksOnlyWhatABodyTouchesReachesTheDrivers) {
  const std::string before = all_of(to_robot_settings(good_robot(), good_map(), 77));
  Map map = good_map();
  map.landmarks[0].colour = {0.2, 0.3, 0.9};
  map.landmarks[1].top_m *= 0.5;
  map.landmarks[1].sigma.x_m += 0.1;
  EXPECT_EQ(all_of(to_robot_settings(good_robot(), map, 77)), before);
}

TEST(BeliefAndTruth, TheComparisonAboveSeesAChange) {
  const std::string before = all_of(to_robot_settings(good_robot(), good_map(), 77));
  Robot robot = good_robot();
  robot.effects.slip = 0.0131;
  EXPECT_NE(all_of(to_robot_settings(robot, good_map(), 77)), before);
  EXPECT_NE(all_of(to_robot_settings(good_robot(), good_map(), 78)), before);
}

struct Mismatch {
  const char* name;
  std::function<void(Robot&, Map&)> change;
  const char* message;  ///< {R} and {M} represent the files
  friend void PrintTo(const Mismatch& mismatch, std::ostream* out) { *out << mismatch.name; }
};

class MismatchTest : public testing::TestWithParam<Mismatch> {};

TEST_P(MismatchTest, IsRefusedInTheseWords) {
  Robot robot = good_robot();
  Map map = good_map();
  robot.file = "r.yaml";
  map.file = "m.yaml";
  GetParam().change(robot, map);
  EXPECT_EQ(message_of([&] { to_robot_settings(robot, map, 1); }), GetParam().message);
}

const Mismatch kMismatches[] = {
    {"LandmarkThatTheMapHasNot",
     [](Robot& robot, Map&) {
       robot.estimator.landmarks = {"red", "blue", "green"};
     },
     "r.yaml: estimator.landmarks names 'blue', must be a landmark of m.yaml: red, green"},
    {"StartBeyondAWall", [](Robot& robot, Map&) { robot.start->x_m = 3.4; },
     "r.yaml: start has x = 3.4 m, must be within bounds_m.x of m.yaml, -2.1 to 3.3"},
    {"StartInAnotherCountry",
     [](Robot& robot, Map&) {
       robot.start = Pose2{-9, 9.5, 0};
     },
     "r.yaml: start has x = -9 m, must be within bounds_m.x of m.yaml, -2.1 to 3.3\n"
     "r.yaml: start has y = 9.5 m, must be within bounds_m.y of m.yaml, -1.7 to 2.9"},
    {"WaypointBeyondAWall", [](Robot& robot, Map&) { robot.waypoints[1].y_m = -1.8; },
     "r.yaml: waypoints_m[1] has y = -1.8 m, must be within bounds_m.y of m.yaml, -1.7 to 2.9"},
    {"NoStart", [](Robot& robot, Map&) { robot.start.reset(); },
     "r.yaml: start is missing: the pose at which the scene shows the robot; driver sim_povray needs it"},
    {"NoScene", [](Robot&, Map& map) { map.scene.reset(); },
     "m.yaml: scene is missing: the POV-Ray file; driver sim_povray of r.yaml needs it"},
    {"OneSimulatedPartIsEnough",
     [](Robot& robot, Map& map) {
       robot.drive.driver = robot.lower.driver = "memory";
       map.scene.reset();
     },
     "m.yaml: scene is missing: the POV-Ray file; driver sim_povray of r.yaml needs it"},
    {"AttachWithoutTheSimulator",
     [](Robot& robot, Map&) {
       robot.attach = "hall";
       robot.drive.driver = robot.lower.driver = robot.upper.driver = "memory";
       robot.others.clear();
     },
     "r.yaml: attach is 'hall', must be absent: no part has driver sim_povray"}};

INSTANTIATE_TEST_SUITE_P(All, MismatchTest, testing::ValuesIn(kMismatches), name_of<Mismatch>);

TEST(ToRobotSettings, WhatTheDriversRejectIsAFileErrorToo) {
  Robot robot = good_robot();
  robot.lower.settings.width_px = -3;
  const std::string message = message_of([&] { to_robot_settings(robot, good_map(), 1); });
  EXPECT_EQ(message.rfind(robot.file.string() + ": ", 0), 0u) << message;
  EXPECT_NE(message.find("width_px is -3"), std::string::npos) << message;
}

// Catches a command that works with the assumed numbers of a rig that nobody has measured.
TEST(ToRig, RefusesARigThatIsLeftToTheImages) {
  Robot robot = good_robot();
  robot.rig.missing = {"lower.centre_px", "upper.azimuth_rad"};
  const std::string message = message_of([&] { (void)to_rig(robot); });
  EXPECT_NE(message.find("rig has no lower.centre_px, upper.azimuth_rad"), std::string::npos) << message;
  EXPECT_NE(message.find("run --self-rig"), std::string::npos) << message;
  EXPECT_NE(message.find("calibrate"), std::string::npos) << message;
  EXPECT_EQ(to_assumed_rig(robot).lower.settings().centre_px, to_rig(good_robot()).lower.settings().centre_px);
}

TEST(ToRig, HoldsEveryFieldOfBothMirrors) {
  const vision::Rig rig = to_rig(good_robot());
  const vision::MirrorViewSettings& lower = rig.lower.settings();
  const vision::MirrorViewSettings& upper = rig.upper.settings();
  EXPECT_EQ(lower.cone.apex_rad, 1.5708);
  EXPECT_EQ(lower.cone.rim_radius_m, 0.061);
  EXPECT_EQ(lower.cone.lens_to_tip_m, 0.118);
  EXPECT_EQ(lower.lens_height_m, 0.23);
  EXPECT_EQ(lower.centre_px, Eigen::Vector2d(318.25, 241.5));
  EXPECT_EQ(lower.rim_radius_px, 233.75);
  EXPECT_EQ(lower.azimuth_rad, 0.021);
  EXPECT_FALSE(lower.mirrored);
  EXPECT_EQ(upper.cone.apex_rad, 1.61);
  EXPECT_EQ(upper.cone.rim_radius_m, 0.057);
  EXPECT_EQ(upper.cone.lens_to_tip_m, 0.118);
  EXPECT_EQ(upper.centre_px, Eigen::Vector2d(160.5, 120.75));
  EXPECT_EQ(upper.rim_radius_px, 117.5);
  EXPECT_EQ(upper.azimuth_rad, -0.034);
  EXPECT_TRUE(upper.mirrored);
  EXPECT_EQ(lower.tilt_rad, Eigen::Vector2d(0, 0));
  EXPECT_EQ(upper.tilt_rad, Eigen::Vector2d(0.011, -0.007));
  EXPECT_FALSE(lower.distortion.has_value());
  Robot robot = good_robot();
  robot.rig.lower.axis_offset_m = {0.003, -0.004};
  EXPECT_EQ(to_rig(robot).lower.settings().axis_offset_m, Eigen::Vector2d(0.003, -0.004));
  robot.rig.lower.late_s = -0.004;
  robot.rig.upper.readout_s = 0.012;
  EXPECT_EQ(to_rig(robot).exposures, (std::array{vision::ExposureTimes{-0.004, 0}, vision::ExposureTimes{0, 0.012}}));
}

TEST(ToRig, ALensIsAboutTheMirrorsImageUnlessTheFileSaysOtherwise) {
  Robot robot = good_robot();
  robot.rig.lower.distortion = {-0.1, 0.02, 0.001, -0.002, 0.03};
  const vision::Rig rig = to_rig(robot);
  const auto& by_default = rig.lower.settings().distortion;
  ASSERT_TRUE(by_default.has_value());
  EXPECT_EQ(by_default->coefficients, robot.rig.lower.distortion);
  EXPECT_EQ(by_default->focal_px, Eigen::Vector2d::Constant(rig.lower.focal_length_px()));
  EXPECT_EQ(by_default->principal_px, Eigen::Vector2d(318.25, 241.5));
  robot.rig.lower.distortion_focal_px = {701.25, 698.5};
  robot.rig.lower.distortion_principal_px = {322.75, 243.125};
  const vision::Rig other = to_rig(robot);
  EXPECT_EQ(other.lower.settings().distortion->focal_px, Eigen::Vector2d(701.25, 698.5));
  EXPECT_EQ(other.lower.settings().distortion->principal_px, Eigen::Vector2d(322.75, 243.125));
}

TEST(ToRig, ALensThatTheFileDoesNotHaveIsAboutTheMiddleOfTheImage) {
  Robot robot = good_robot();
  robot.lower.settings.width_px = 801;
  robot.lower.settings.height_px = 600;
  const vision::Rig rig = to_rig(robot);
  EXPECT_EQ(rig.lower.settings().lens_axis_px, Eigen::Vector2d(400, 299.5));
  EXPECT_EQ(rig.upper.settings().lens_axis_px,
            Eigen::Vector2d((robot.upper.settings.width_px - 1) / 2.0, (robot.upper.settings.height_px - 1) / 2.0));
}

TEST(ToRig, TheTipsAreTheSeparationApartWhateverTheLenses) {
  // The result has four sums and differences of numbers below 1, each rounded by at most half an epsilon.
  constexpr double kRounding_m = 4 * std::numeric_limits<double>::epsilon();
  Robot robot = good_robot();
  for (const double lens_to_tip_m : {0.118, 0.093, 0.241}) {
    robot.rig.upper.lens_to_tip_m = lens_to_tip_m;
    const vision::Rig rig = to_rig(robot);
    EXPECT_NEAR(rig.mirror_separation_m(), 0.307, kRounding_m) << "upper lens to tip " << lens_to_tip_m << " m";
    EXPECT_NEAR(rig.upper.settings().lens_height_m, 0.23 + 0.118 + 0.307 - lens_to_tip_m, kRounding_m);
  }
}

TEST(ToRig, ARejectedMirrorIsAFileErrorNamingFileAndMirror) {
  for (const bool is_lower : {true, false}) {
    Robot robot = good_robot();
    robot.file = "r.yaml";
    (is_lower ? robot.rig.lower : robot.rig.upper).rim_radius_px = -1;
    const std::string message = message_of([&] { to_rig(robot); });
    EXPECT_EQ(message.rfind(is_lower ? "r.yaml: rig, lower mirror: " : "r.yaml: rig, upper mirror: ", 0), 0u)
        << message;
    EXPECT_NE(message.find("rim_radius_px"), std::string::npos) << message;
  }
}

TEST(ToTargets, AndPositionsAreTheLandmarksInTheirOrder) {
  const std::vector<Landmark> targets = to_targets(good_map());
  const std::vector<Eigen::Vector2d> positions = to_landmark_positions(good_map());
  ASSERT_EQ(targets.size(), 2u);
  ASSERT_EQ(positions.size(), 2u);
  EXPECT_EQ(targets[0].name, "red");
  EXPECT_EQ(targets[0].colour, (std::array{0.9, 0.1, 0.05}));
  EXPECT_EQ(targets[0].radius_m, 0.08);
  EXPECT_EQ(targets[0].top_m, good_map().landmarks[0].top_m);
  EXPECT_NE(targets[0].top_m, targets[1].top_m);
  // The range is from the opposite corner. The tolerance is some roundings of a few metres.
  constexpr double kRounding_m = 16 * std::numeric_limits<double>::epsilon();
  const Bounds bounds = good_map().bounds;
  EXPECT_NEAR(*targets[0].greatest_range_m, std::hypot(bounds.max_x_m + 1.9, 0.7 - bounds.min_y_m), kRounding_m);
  EXPECT_NEAR(*targets[1].greatest_range_m, std::hypot(2.3 - bounds.min_x_m, bounds.max_y_m + 1.1), kRounding_m);
  EXPECT_EQ(positions[0], Eigen::Vector2d(-1.9, 0.7));
  EXPECT_EQ(targets[1].name, "green");
  EXPECT_EQ(targets[1].radius_m, 0.11);
  EXPECT_EQ(positions[1], Eigen::Vector2d(2.3, -1.1));
}

TEST(ToWheels, AreThoseOfTheDrive) {
  EXPECT_EQ(to_wheels(good_robot()).radius_m, 0.043);
  EXPECT_EQ(to_wheels(good_robot()).separation_m, 0.29);
}

TEST(ToStartPose, IsTheFilesOrTheOrigin) {
  Robot robot = good_robot();
  EXPECT_EQ(to_start_pose(robot), (localisation::Pose{.x_m = 0.31, .y_m = -0.42, .heading_rad = 0.53}));
  robot.start.reset();
  EXPECT_EQ(to_start_pose(robot), localisation::Pose{});
}

TEST(CheckLandmarks, ReportsAllThatTheMapLacks) {
  Robot robot = good_robot();
  const Map map = good_map();
  EXPECT_EQ(message_of([&] { check_landmarks(robot, map); }), "no error") << "all landmarks of the map";
  robot.estimator.landmarks = {"green", "red"};
  EXPECT_EQ(message_of([&] { check_landmarks(robot, map); }), "no error");
  robot.file = "r.yaml";
  robot.estimator.landmarks = {"grue", "red", "bleen"};
  EXPECT_EQ(message_of([&] { check_landmarks(robot, map); }),
            fmt::format("r.yaml: estimator.landmarks names 'grue', must be a landmark of {0}: red, green\n"
                        "r.yaml: estimator.landmarks names 'bleen', must be a landmark of {0}: red, green",
                        map.file.string()));
}

TEST(ToStartPose, BringsTheHeadingIntoItsRange) {
  // The heading is below 8 rad, where doubles are 2^-50 apart. The sum and the wrapping may each be wrong by half of
  // that.
  constexpr double kRounding_rad = 4 * std::numeric_limits<double>::epsilon();
  Robot robot = good_robot();
  robot.start->heading_rad = 0.53 + std::numbers::pi;
  EXPECT_NEAR(to_start_pose(robot).heading_rad, 0.53 - std::numbers::pi, kRounding_rad);
  EXPECT_EQ(to_robot_settings(robot, good_map(), 1).world->session.body.start.heading_rad,
            to_start_pose(robot).heading_rad);
}

TEST(ToArena, HasWallsLandmarksAndObstacles) {
  const behaviours::Arena arena = to_arena(good_map());
  EXPECT_EQ(arena.min_m, Eigen::Vector2d(-2.1, -1.7));
  EXPECT_EQ(arena.max_m, Eigen::Vector2d(3.3, 2.9));
  ASSERT_EQ(arena.outlines.size(), 1u);
  EXPECT_EQ(arena.outlines[0], (behaviours::Outline{{0.1, 0.2}, {0.9, 0.3}, {0.4, 1.1}}));
  ASSERT_EQ(arena.discs.size(), 3u);
  EXPECT_EQ(arena.discs[0].centre, (FloorPoint{-1.9, 0.7}));
  EXPECT_EQ(arena.discs[0].radius_m, 0.08);
  EXPECT_EQ(arena.discs[1].centre, (FloorPoint{2.3, -1.1}));
  EXPECT_EQ(arena.discs[2].centre, (FloorPoint{1.2, -0.8}));
  EXPECT_EQ(arena.discs[2].radius_m, 0.25);
}

}  // namespace
}  // namespace twocone::config
