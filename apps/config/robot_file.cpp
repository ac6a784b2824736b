// SPDX-License-Identifier: Apache-2.0
#include "apps/config/robot_file.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include "apps/config/keys/robot_keys.h"
#include "apps/config/yaml/names.h"
#include "apps/config/yaml/text_file.h"
#include "apps/config/yaml/yaml_reader.h"
#include "hal/stereo_rig.h"

namespace twocone::config {
namespace {

// Leaves room, within the 255 bytes of a file name, for the suffix "-waypoints-seed18446744073709551615-2".
constexpr std::size_t kLongestName = 200;

/// The bounds keep a time within the range of its nanosecond counter.
constexpr Range kTimeoutRange{.least = 0.001, .greatest = 60};
constexpr Range kSkewRange{.least = 0, .greatest = 60};
constexpr Range kRateRange{.least = 0.01, .greatest = 1000};
constexpr Range kImageSide{.least = 1, .greatest = 16384};

void read_start(Section& root, std::optional<Pose2>& start) {
  Section* section = root.section("start", "pose at t = 0", Need::kOptional);
  if (section == nullptr) return;
  start.emplace();
  section->number("x_m", {"x at t = 0", kMetres, kAnyNumber}, start->x_m);
  section->number("y_m", {"y at t = 0", kMetres, kAnyNumber}, start->y_m);
  section->number("heading_rad", {"heading at t = 0, counter-clockwise from x", kRadians, kWithinATurn},
                  start->heading_rad);
}

void read_drive(Section& root, Drive& drive) {
  Section* section = root.section("drive", "the two wheels: driver, sizes, limits");
  if (section == nullptr) return;
  section->text("driver", "what moves the wheels", drive.driver);
  section->number("wheel_separation_m", {"distance between the wheels' contact points", kMetres, kRobotLength},
                  drive.wheel_separation_m);
  section->number("wheel_radius_m", {"radius of a wheel", kMetres, kPartLength}, drive.wheel_radius_m);
  section->number("max_speed_mps", {"greatest speed of a wheel over the floor", kMetresPerSecond, kAboveZero},
                  drive.max_speed_mps);
  section->number("command_timeout_s", {"time without a command after which the wheels stop", kSeconds, kTimeoutRange},
                  drive.command_timeout_s, Need::kOptional);
  read_wheel_sigma(*section, drive);
  read_serial_drive(*section, drive);
}

/// The state of a camera during reading. Its own `effects` are read after those that all cameras share.
struct ReadCamera {
  Section* section = nullptr;  ///< null: absent or unreadable
  drivers::CameraPart* camera = nullptr;
  bool has_driver = false;
  bool has_rate = false;

  /// Complains about a key that only the simulator supports.
  void refuse_if_real(std::string_view key) const {
    if (section->has(key) && has_driver && camera->driver != drivers::kSimPovray) {
      section->complain(key, kNoUnit, fmt::format("absent: driver {} has no such setting", camera->driver));
    }
  }
};

ReadCamera read_camera(Section* section, drivers::CameraPart& camera) {
  ReadCamera part{section, &camera};
  if (section == nullptr) return part;
  part.has_driver = section->text("driver", "what takes the images", camera.driver);
  section->whole("width_px", {"width of the image", kPixels, kImageSide}, camera.settings.width_px);
  section->whole("height_px", {"height of the image", kPixels, kImageSide}, camera.settings.height_px);
  part.has_rate = section->number("rate_hz", {"images a second", kHertz, kRateRange}, camera.settings.rate_hz);
  const Quantity antialias{"rays per pixel side", kNoUnit, {.least = 1, .greatest = 9}};
  if (section->whole("antialias", antialias, camera.antialias, Need::kOptional)) part.refuse_if_real("antialias");
  if (part.has_driver) read_camera_device(*section, camera);
  return part;
}

std::vector<ReadCamera> read_cameras(Section& root, Robot& robot) {
  std::vector<ReadCamera> parts;
  Section* cameras = root.section("cameras", "the two cameras, lower and upper");
  if (cameras == nullptr) return parts;
  parts.push_back(read_camera(cameras->section("lower", "camera of the lower mirror"), robot.lower));
  parts.push_back(read_camera(cameras->section("upper", "camera of the upper mirror"), robot.upper));
  const std::vector<std::string> names = cameras->keys();
  robot.others.reserve(names.size());  // the parts point into this vector
  for (const std::string& name : names) {
    if (name == "lower" || name == "upper") continue;
    drivers::OtherCamera& other = robot.others.emplace_back();
    other.name = name;
    parts.push_back(read_camera(cameras->section(name, "a further camera"), other.part));
    if (!is_name(name, "_")) cameras->complain(name, kNoUnit, "named with letters, digits and _");
  }
  const ReadCamera& lower = parts.front();
  for (const ReadCamera& part : parts) {
    if (lower.has_rate && part.has_rate && part.camera->settings.rate_hz != robot.lower.settings.rate_hz) {
      part.section->complain("rate_hz", kHertz, fmt::format("that of cameras.lower, {}", robot.lower.settings.rate_hz));
    }
  }
  const bool good_skew = root.number("max_skew_s", {"greatest time between the two exposures", kSeconds, kSkewRange},
                                     robot.max_skew_s, Need::kOptional);
  if (lower.has_rate && good_skew && !root.has("max_skew_s"))
    robot.max_skew_s = StereoRig::kFreeSkew / robot.lower.settings.rate_hz;
  return parts;
}

/// Gives a view that leaves its place in the image to the images the image's middle.
void set_missing(const std::vector<std::string>& missing, std::string_view mirror, const CameraSettings& camera,
                 RigView& view) {
  const auto is_missing = [&](std::string_view key) {
    return std::ranges::find(missing, fmt::format("{}.{}", mirror, key)) != missing.end();
  };
  constexpr double kRadiusShare = 0.4;
  if (is_missing("centre_px")) view.centre_px = middle_px(camera);
  if (is_missing("rim_radius_px")) view.rim_radius_px = kRadiusShare * std::min(camera.width_px, camera.height_px);
}

/// Reads the lens data of the calibration files into the rig.
void read_camera_infos(Robot& robot) {
  std::string bad;
  const auto read = [&](RigView& view, const drivers::CameraPart& camera, std::string_view name) {
    if (view.camera_info.empty()) return;
    try {
      read_camera_info(camera, fmt::format("cameras.{} of {}", name, robot.file.string()), view);
    } catch (const FileError& error) {
      // Both mirrors may name the same file, and its faults are reported once.
      if (bad.find(error.what()) == std::string::npos)
        bad += fmt::format("{}{}", bad.empty() ? "" : "\n", error.what());
    }
  };
  read(robot.rig.lower, robot.lower, "lower");
  read(robot.rig.upper, robot.upper, "upper");
  if (!bad.empty()) throw FileError(bad);
}

/// Reads the camera's own effects over the common ones, key by key. A real camera has none. Returns the camera's own
/// section.
Section* read_own_effects(const ReadCamera& part, Section* common_section, const sim_povray::CameraEffects& common,
                          bool good_common) {
  Section* own = part.section->section("effects", "what this camera does beyond the ideal", Need::kOptional);
  part.refuse_if_real("effects");
  if (part.camera->driver != drivers::kSimPovray) {
    sim_povray::CameraEffects ignored;
    if (own != nullptr) read_camera_effects(*own, ignored);
    return own;
  }
  part.camera->effects = common;
  const bool good = own == nullptr || read_camera_effects(*own, part.camera->effects);
  const std::optional<double> rate_hz = part.has_rate ? std::optional(part.camera->settings.rate_hz) : std::nullopt;
  if (good && good_common) check_camera_effects(part.camera->effects, own, common_section, rate_hz);
  return own;
}

/// Returns the coordinate of a pixel in an image that is scaled by `k`.
double scaled_px(double place_px, double k) { return (place_px + 0.5) * k - 0.5; }

void scale(drivers::CameraPart& camera, RigView& view, double k) {
  camera.settings.width_px = static_cast<int>(std::lround(camera.settings.width_px * k));
  camera.settings.height_px = static_cast<int>(std::lround(camera.settings.height_px * k));
  for (double& place_px : view.centre_px) place_px = scaled_px(place_px, k);
  view.rim_radius_px *= k;
  if (view.distortion_focal_px) {
    for (double& focal_px : *view.distortion_focal_px) focal_px *= k;
  }
  if (view.distortion_principal_px) {
    for (double& place_px : *view.distortion_principal_px) place_px = scaled_px(place_px, k);
  }
  // These values are in pixels of the simulated camera's image.
  camera.effects.distortion_focal_px *= k;
  camera.effects.defocus_px *= k;
}

void scale(RigSigma& sigma, double k) {
  sigma.centre_px *= k;
  sigma.rim_radius_px *= k;
}

}  // namespace

std::array<double, 2> middle_px(const CameraSettings& camera) {
  return {(camera.width_px - 1) / 2.0, (camera.height_px - 1) / 2.0};
}

namespace {

/// Returns the robot of a node to which `changes` have been made already.
Robot parse_changed(const YAML::Node& given, const std::filesystem::path& file, const std::vector<KeyChange>& changes) {
  const YAML::Node node = with_present_names(given);
  if (node.IsDefined() && node.IsMap() && node["landmarks"] && !node["rig"]) {
    throw FileError("{}: is a map; a robot file is wanted, which names the map: `map: {}`", file.string(),
                    file.filename().string());
  }
  Reading reading(node, file, changes);
  Section& root = reading.root();
  Robot robot;
  robot.file = file;
  robot.changes = changes;
  root.text("name", "the robot's name", robot.name);
  std::string map;
  if (root.text("map", "the map of the place it is in", map)) robot.map = resolve(map, file);
  root.text("attach", "the served world to take a place in", robot.attach, Need::kOptional);
  if (!robot.attach.empty() && !is_name(robot.attach, "-_")) {
    root.complain("attach", kNoUnit, "letters, digits, - and _");
  }
  read_start(root, robot.start);
  root.whole("latency_frames", {"age of the fix that corrects the odometry", kNoUnit, kZeroOrMore},
             robot.latency_frames, Need::kOptional);
  if (Section* body = root.section("body", "the robot's body")) {
    body->number("radius_m", {"radius of the body, seen from above", kMetres, kRobotLength}, robot.body_radius_m);
  }
  read_drive(root, robot.drive);
  const std::vector<ReadCamera> cameras = read_cameras(root, robot);
  read_rig(root, file, robot.rig);
  read_estimator(root, robot.estimator);
  Section* common_effects = read_effects(root, robot.effects);
  sim_povray::CameraEffects common;
  bool good_common = true;
  std::vector<Section*> camera_effects;
  if (common_effects != nullptr) {
    good_common = read_camera_effects(*common_effects, common);
    camera_effects.push_back(common_effects);
  }
  for (const ReadCamera& part : cameras) {
    Section* own = part.section != nullptr ? read_own_effects(part, common_effects, common, good_common) : nullptr;
    if (own != nullptr) camera_effects.push_back(own);
  }
  check_unneeded_keys(camera_effects);
  root.points("waypoints_m", "places to drive to in turn", robot.waypoints, Need::kOptional);
  reading.finish();
  set_missing(robot.rig.missing, "lower", robot.lower.settings, robot.rig.lower);
  set_missing(robot.rig.missing, "upper", robot.upper.settings, robot.rig.upper);
  read_camera_infos(robot);
  return robot;
}

YAML::Node load_changed(const std::filesystem::path& file, const std::vector<KeyChange>& changes) {
  const YAML::Node node = with_present_names(load_yaml(file));
  return node.IsMap() ? with_changes(node, changes) : node;
}

}  // namespace

Robot parse_robot(const YAML::Node& node, const std::filesystem::path& file) { return parse_changed(node, file, {}); }

Robot read_robot(const std::filesystem::path& file, const std::vector<KeyChange>& changes) {
  Robot robot = parse_changed(load_changed(file, changes), file, changes);
  // Run folders have the robot's name. Only read_robot() checks it, because an older run with another name must stay
  // readable.
  const auto is_control = [](unsigned char c) { return c < 0x20 || c == 0x7F; };
  const bool has_control = std::ranges::any_of(robot.name, is_control);
  if (has_control || robot.name.find('/') != std::string::npos || robot.name.starts_with(".") ||
      robot.name.size() > kLongestName) {
    std::ranges::replace_if(robot.name, is_control, '?');
    throw FileError(
        "{}: name is '{}', must be fit for a folder's name: no / in it, no . before it, no control "
        "characters, at most {} bytes",
        file.string(), robot.name, kLongestName);
  }
  return robot;
}

YAML::Node load_robot_node(const Robot& robot) {
  YAML::Node node = load_changed(robot.file, robot.changes);
  const Robot read = parse_changed(node, robot.file, robot.changes);
  node["map"] = std::filesystem::absolute(read.map).string();
  make_rig_paths_absolute(node, robot.file);
  set_estimator(node, robot.estimator);
  return node;
}

std::vector<std::string> camera_names(const Robot& robot) {
  std::vector<std::string> names{"lower", "upper"};
  for (const drivers::OtherCamera& other : robot.others) names.push_back(other.name);
  return names;
}

Robot scaled(Robot robot, double k) {
  scale(robot.lower, robot.rig.lower, k);
  scale(robot.upper, robot.rig.upper, k);
  if (robot.rig.sigma) scale(*robot.rig.sigma, k);
  return robot;
}

}  // namespace twocone::config
