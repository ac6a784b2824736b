// SPDX-License-Identifier: Apache-2.0
#include "apps/doctor/doctor.h"

#include <algorithm>
#include <optional>
#include <string_view>

#include <fmt/format.h>

#include "apps/config/to_layers.h"
#include "apps/config/yaml/text_file.h"
#include "apps/doctor/advice.h"
#include "apps/doctor/checks/camera_checks.h"
#include "apps/doctor/checks/drive_checks.h"
#include "apps/doctor/checks/pair_checks.h"
#include "apps/doctor/whole_robot.h"

namespace twocone::doctor {
namespace {

bool has_device(std::string_view driver) {
  const drivers::Backend* const known = drivers::find_backend(driver);
  return known == nullptr || known->has_device();
}

/// Used for a robot whose map cannot be read: its parts need none.
config::Map any_map(const std::filesystem::path& file) {
  constexpr double kAnywhere_m = 1e6;
  config::Map map;
  map.file = file;
  map.bounds = {-kAnywhere_m, kAnywhere_m, -kAnywhere_m, kAnywhere_m};
  return map;
}

class Examination {
 public:
  Examination(const config::Robot& robot, const Options& options, const Openers& openers,
              const Surroundings& surroundings)
      : robot_(robot), options_(options), openers_(openers), surroundings_(surroundings) {}

  Report go() {
    try {
      if (const auto settings = check_files()) check_parts(*settings);
    } catch (const Interrupted& interrupted) {
      report_.add({"robot", "complete", interrupted.what(), Verdict::kFailed, "run it again and let it finish"});
    }
    return std::move(report_);
  }

 private:
  std::optional<drivers::RobotSettings> check_files() {
    std::optional<config::Map> map;
    try {
      map = config::read_map(robot_.map);
    } catch (const config::FileError& error) {
      report_.add({"files", "map", error.what(), Verdict::kFailed, "correct the map, or map: in the robot file"});
    }
    try {
      auto settings = config::to_robot_settings(robot_, map.value_or(any_map(robot_.map)), 1);
      static_cast<void>(config::to_rig(robot_));
      if (map)
        report_.add({"files", "robot and map", fmt::format("{}: {} landmarks", robot_.name, map->landmarks.size())});
      return settings;
    } catch (const config::FileError& error) {
      report_.add({"files", "consistency", error.what(), Verdict::kFailed, "correct the robot file"});
    }
    return std::nullopt;
  }

  void check_parts(const drivers::RobotSettings& settings) {
    const bool lower = has_device(settings.lower.driver);
    const bool upper = has_device(settings.upper.driver);
    const bool drive = has_device(settings.drive.driver);
    const bool others = std::any_of(settings.others.begin(), settings.others.end(),
                                    [](const auto& other) { return has_device(other.part.driver); });
    if (!lower && !upper && !drive && !others) {
      check_whole_robot(robot_, settings, openers_, surroundings_, report_);
      return;
    }
    const auto differ = drivers::check_cameras_differ(settings);
    if (!differ) report_.add(failed_row("cameras", "two devices", differ.error(), ""));
    check_camera_part("lower", settings.lower, rim_of(robot_.rig.lower));
    check_camera_part("upper", settings.upper, rim_of(robot_.rig.upper));
    for (const drivers::OtherCamera& other : settings.others) check_camera_part(other.name, other.part, std::nullopt);
    if (lower && upper && differ) check_pair_part(settings);
    if (drive) {
      guarded("drive", [&] { check_drive_part(settings); });
    } else {
      report_deviceless("drive", settings.drive.driver);
    }
  }

  void report_deviceless(const std::string& part, const std::string& driver) {
    report_.add({part, "driver", fmt::format("{}: no device", driver), Verdict::kNotRun,
                 "name a driver with a device (twocone devices)"});
  }

  /// An exception in a part's check is a failure of that part.
  template <typename Check>
  void guarded(const std::string& part, Check check) {
    end_if_asked(surroundings_);
    try {
      check();
    } catch (const Interrupted&) {
      throw;
    } catch (const std::exception& error) {
      report_.add({part, "exception", error.what(), Verdict::kFailed, "see the message"});
    }
  }

  void check_camera_part(const std::string& name, const drivers::CameraPart& part,
                         const std::optional<vision::RimCircle>& rim) {
    if (!has_device(part.driver)) return report_deviceless(name, part.driver);
    guarded(name, [&] {
      const auto camera = openers_.camera("cameras." + name, part);
      if (!camera) {
        report_.add(failed_row(name, "opens", camera.error(), camera_advice(camera.error().code)));
        return;
      }
      if (rim) works_.push_back(name);
      check_camera({name, part, rim}, **camera, options_.seconds, surroundings_, report_);
    });
  }

  void check_pair_part(const drivers::RobotSettings& settings) {
    if (works_.size() < 2) {
      report_.add({"pair", "stream", "one of its cameras cannot be opened", Verdict::kNotRun, "see the cameras' rows"});
      return;
    }
    const OpenPair open = [&](std::chrono::nanoseconds max_skew) -> Result<StereoRig> {
      auto lower = openers_.camera("cameras.lower", settings.lower);
      if (!lower) return lower.error();
      auto upper = openers_.camera("cameras.upper", settings.upper);
      if (!upper) return upper.error();
      return StereoRig(*std::move(lower), *std::move(upper), max_skew);
    };
    guarded("pair", [&] {
      check_pair(
          {settings.lower.settings, settings.upper.settings, settings.max_skew, settings.drive.limits.command_timeout},
          open, options_.seconds, surroundings_, report_);
    });
  }

  void check_drive_part(const drivers::RobotSettings& settings) {
    surroundings_.progress("drive", 0);
    // Every speed is allowed here, to find the least one that turns a wheel.
    drivers::DrivePart part = settings.drive;
    if (part.serial) part.serial->least_speed_radps = 0;
    const auto drive = openers_.drive(part);
    if (!drive) {
      report_.add(drive_failed("opens", drive.error()));
      return;
    }
    const DriveUnderTest test{settings.drive, 1 / settings.lower.settings.rate_hz};
    if (!check_standing_drive(test, **drive, surroundings_, report_)) {
      report_.add({"drive", "moving tests", "the drive is not in order", Verdict::kNotRun, "see the rows above"});
      return;
    }
    if (ask_off_the_ground(options_.wheels_off_the_ground, surroundings_, report_) != Permission::kGiven) return;
    check_wheels(test, **drive, surroundings_, report_);
  }

  const config::Robot& robot_;
  const Options& options_;
  const Openers& openers_;
  const Surroundings& surroundings_;
  Report report_;
  std::vector<std::string> works_;  ///< cameras of the pair that could be opened
};

}  // namespace

Report examine(const config::Robot& robot, const Options& options, const Openers& openers,
               const Surroundings& surroundings) {
  return Examination(robot, options, openers, surroundings).go();
}

}  // namespace twocone::doctor
