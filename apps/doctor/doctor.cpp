// SPDX-License-Identifier: Apache-2.0
#include "apps/doctor/doctor.h"

#include <algorithm>
#include <optional>
#include <string_view>

#include <fmt/format.h>

#include "apps/config/to_layers.h"
#include "apps/config/yaml/text_file.h"
#include "apps/design/sight.h"
#include "apps/doctor/checks/checks.h"
#include "apps/estimation/image_as_mat.h"

namespace twocone::doctor {
namespace {

bool has_device(std::string_view driver) {
  const drivers::Backend* const known = drivers::find_backend(driver);
  return known == nullptr || known->has_device();
}

/// Returns a map without landmarks for a robot whose map cannot be read, because its parts need none.
config::Map any_map(const std::filesystem::path& file) {
  constexpr double kAnywhere_m = 1e6;
  config::Map map;
  map.file = file;
  map.bounds = {-kAnywhere_m, kAnywhere_m, -kAnywhere_m, kAnywhere_m};
  return map;
}

constexpr const char* kRobotPart = "robot";
constexpr const char* kWholeAdvice =
    "check the robot file's drivers, map and scene; a served world needs a running twocone serve";
// Equal to the waits of a run. A served world waits for its slowest robot, and an image waits for POV-Ray.
constexpr std::chrono::milliseconds kWholePairTime{60'000};
constexpr std::chrono::milliseconds kFirstImageTime{150'000};

class Examination {
 public:
  Examination(const config::Robot& robot, const Options& options, const Openers& openers,
              const Surroundings& surroundings)
      : robot_(robot), options_(options), openers_(openers), surroundings_(surroundings) {}

  Report go() {
    try {
      if (const auto settings = check_files()) check_parts(*settings);
    } catch (const Interrupted& interrupted) {
      report_.add({"robot", "complete", interrupted.what(), kFailed, "run it again and let it finish"});
    }
    return std::move(report_);
  }

 private:
  std::optional<drivers::RobotSettings> check_files() {
    std::optional<config::Map>& map = map_;
    try {
      map = config::read_map(robot_.map);
    } catch (const config::FileError& error) {
      report_.add({"files", "map", error.what(), kFailed, "correct the map, or map: in the robot file"});
    }
    try {
      auto settings = config::to_robot_settings(robot_, map.value_or(any_map(robot_.map)), 1);
      static_cast<void>(config::to_assumed_rig(robot_));
      if (map)
        report_.add({"files", "robot and map", fmt::format("{}: {} landmarks", robot_.name, map->landmarks.size())});
      if (robot_.rig.missing.empty()) {
        const design::Sight sight(config::to_rig(robot_));
        report_.add({"rig", "blind zones", design::words_of(design::reach_of(sight))});
      }
      return settings;
    } catch (const config::FileError& error) {
      report_.add({"files", "consistency", error.what(), kFailed, "correct the robot file"});
    }
    return std::nullopt;
  }

  void check_parts(const drivers::RobotSettings& settings) {
    const bool lower = has_device(settings.lower.driver);
    const bool upper = has_device(settings.upper.driver);
    const bool drive = has_device(settings.drive.driver);
    const bool others =
        std::ranges::any_of(settings.others, [](const auto& other) { return has_device(other.part.driver); });
    if (!lower && !upper && !drive && !others) return check_whole_robot(settings);
    const auto differ = drivers::check_cameras_differ(settings);
    if (!differ) report_.add(failed_row("cameras", "two devices", differ.error(), ""));
    check_camera_part("lower", settings.lower, believed_rim(vision::Side::kLower));
    check_camera_part("upper", settings.upper, believed_rim(vision::Side::kUpper));
    for (const drivers::OtherCamera& other : settings.others) check_camera_part(other.name, other.part, std::nullopt);
    check_rig_part();
    if (lower && upper && differ) check_pair_part(settings);
    if (drive) {
      guarded("drive", [&] { check_drive_part(settings); });
    } else {
      report_deviceless("drive", settings.drive.driver);
    }
  }

  /// Checks a robot without any device. Opens and starts it, takes one pair and checks its images. For sim_povray, this
  /// includes the rims.
  void check_whole_robot(const drivers::RobotSettings& settings) {
    report_simulated("lower", settings.lower.driver);
    report_simulated("upper", settings.upper.driver);
    for (const drivers::OtherCamera& other : settings.others) report_simulated(other.name, other.part.driver);
    report_simulated("drive", settings.drive.driver);
    const auto failed = [&](const char* check, const Error& error) {
      report_.add(failed_row(kRobotPart, check, error, kWholeAdvice));
    };
    surroundings_.progress("simulated robot", 0);
    auto opened = openers_.robot(settings);
    if (!opened) return failed("opens", opened.error());
    Robot whole = *std::move(opened);
    end_if_asked(surroundings_);
    if (const auto started = whole.start(settings.lower.settings, settings.upper.settings); !started) {
      return failed("starts", started.error());
    }
    report_.add({kRobotPart, "opens, starts", fmt::format("{} cameras and a drive", 2 + settings.others.size())});
    end_if_asked(surroundings_);
    const auto pair = whole.next_frame(kWholePairTime);
    if (!pair) return failed("pair", pair.error());
    report_.add({kRobotPart, "pair", fmt::format("received; skew {:.1f} ms", 1e3 * seconds_of(pair->skew()))});
    if (const auto angles = whole.drive().read_angles(); !angles) {
      failed("angles", angles.error());
    } else {
      report_.add({kRobotPart, "angles",
                   fmt::format("left {:.3f} rad, right {:.3f} rad", angles->left_rad, angles->right_rad)});
    }
    surroundings_.progress("simulated robot", 0.5);
    check_view("lower", pair->lower, settings.lower.driver, believed_rim(vision::Side::kLower));
    check_view("upper", pair->upper, settings.upper.driver, believed_rim(vision::Side::kUpper));
    check_rig_part();
    whole.stop();
  }

  /// Returns the rim in the image according to `rig:`.
  [[nodiscard]] vision::RimCircle believed_rim(vision::Side side) const {
    const vision::Rig rig = config::to_assumed_rig(robot_);
    return vision::rim_in_image(vision::of_view(rig, side));
  }

  void report_simulated(const std::string& part, const std::string& driver) {
    report_.add({part, "driver",
                 driver == drivers::kMemory ? "memory: invented data, no bench test"
                                            : fmt::format("{}: simulated, no bench test", driver)});
  }

  void check_view(const std::string& view, const Frame& frame, const std::string& driver,
                  const vision::RimCircle& believed) {
    end_if_asked(surroundings_);
    const auto failed = [&](const Error& error) { report_.add(failed_row(view, "image", error, kWholeAdvice)); };
    const auto image = frame.image(kFirstImageTime);
    if (!image) return failed(image.error());
    const auto rgb = to_rgb8(**image);
    if (!rgb) return failed(rgb.error());
    if (driver != drivers::kMemory) {
      (view == "lower" ? lower_ : upper_) = *rgb;
      return check_image(view, *rgb, believed, report_);
    }
    // The pattern of driver memory shows no mirror.
    report_.add({view, "image", fmt::format("{} x {}", rgb->width_px, rgb->height_px)});
  }

  void report_deviceless(const std::string& part, const std::string& driver) {
    report_.add({part, "driver", fmt::format("{}: no device", driver), kNotRun,
                 "name a driver with a device (twocone devices)"});
  }

  /// Performs a part's check. Reports an exception as a failure of that part, except Interrupted.
  template <typename Check>
  void guarded(const std::string& part, Check check) {
    end_if_asked(surroundings_);
    try {
      check();
    } catch (const Interrupted&) {
      throw;
    } catch (const std::exception& error) {
      report_.add({part, "exception", error.what(), kFailed, "see the message"});
    }
  }

  void check_camera_part(const std::string& name, const drivers::CameraPart& part,
                         const std::optional<vision::RimCircle>& rim) {
    if (!has_device(part.driver)) return report_deviceless(name, part.driver);
    guarded(name, [&] {
      const auto camera = openers_.camera("cameras." + name, part);
      if (!camera) return report_.add(failed_row(name, "opens", camera.error(), camera_advice(camera.error().code)));
      if (rim) works_.push_back(name);
      auto image = check_camera({name, part, rim}, **camera, options_.seconds, surroundings_, report_);
      if (name == "lower") {
        lower_ = std::move(image);
      } else if (name == "upper") {
        upper_ = std::move(image);
      }
    });
  }

  /// Compares `rig:` with what one image of each camera shows. Needs a map with landmarks.
  void check_rig_part() {
    if (!lower_ || !upper_ || !map_) return;
    surroundings_.progress("rig", 0);
    guarded("rig", [&] {
      check_rig({robot_, *map_, estimation::as_mat(*lower_), estimation::as_mat(*upper_), options_.images}, report_);
    });
  }

  void check_pair_part(const drivers::RobotSettings& settings) {
    if (works_.size() < 2) {
      return report_.add({"pair", "stream", "one of its cameras cannot be opened", kNotRun, "see the cameras' rows"});
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
    // Every speed is allowed here, because the test looks for the least one that turns a wheel.
    drivers::DrivePart part = settings.drive;
    if (part.serial) part.serial->least_speed_radps = 0;
    const auto drive = openers_.drive(part);
    if (!drive) return report_.add(drive_failed("opens", drive.error()));
    const DriveUnderTest test{settings.drive, 1 / settings.lower.settings.rate_hz};
    if (!check_standing_drive(test, **drive, surroundings_, report_)) {
      return report_.add({"drive", "moving tests", "the drive is not in order", kNotRun, "see the rows above"});
    }
    if (ask_off_the_ground(options_.wheels_off_the_ground, surroundings_, report_) != Permission::kGiven) return;
    check_wheels(test, **drive, surroundings_, report_);
  }

  const config::Robot& robot_;
  const Options& options_;
  const Openers& openers_;
  const Surroundings& surroundings_;
  Report report_;
  std::optional<config::Map> map_;      ///< none: unreadable
  std::optional<Image> lower_, upper_;  ///< the last image of each camera of the pair, kRgb8
  std::vector<std::string> works_;      ///< cameras of the pair that could be opened
};

}  // namespace

Report examine(const config::Robot& robot, const Options& options, const Openers& openers,
               const Surroundings& surroundings) {
  return Examination(robot, options, openers, surroundings).go();
}

}  // namespace twocone::doctor
