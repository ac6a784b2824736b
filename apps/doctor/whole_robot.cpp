// SPDX-License-Identifier: Apache-2.0
#include "apps/doctor/whole_robot.h"

#include <fmt/format.h>

#include "apps/doctor/advice.h"
#include "apps/doctor/checks/image_checks.h"

namespace twocone::doctor {
namespace {

using std::chrono::milliseconds;

constexpr const char* kRobotPart = "robot";
constexpr const char* kAdvice =
    "check the robot file's drivers, map and scene; a served world needs a running twocone serve";
// As long as a run waits: a served world waits for its slowest robot, and an image for POV-Ray.
constexpr milliseconds kPairTime{60'000};
constexpr milliseconds kFirstImageTime{150'000};

void add_driver_rows(const drivers::RobotSettings& settings, Report& report) {
  const auto add = [&report](const std::string& part, const std::string& driver) {
    report.add({part, "driver",
                driver == drivers::kMemory ? "memory: invented data, no bench test"
                                           : fmt::format("{}: simulated, no bench test", driver)});
  };
  add("lower", settings.lower.driver);
  add("upper", settings.upper.driver);
  for (const drivers::OtherCamera& other : settings.others) add(other.name, other.part.driver);
  add("drive", settings.drive.driver);
}

void check_view(const std::string& view, const Frame& frame, const std::string& driver,
                const vision::RimCircle& believed, Report& report) {
  const auto failed = [&](const Error& error) { report.add(failed_row(view, "image", error, kAdvice)); };
  const auto image = frame.image(kFirstImageTime);
  if (!image) return failed(image.error());
  const auto rgb = to_rgb8(**image);
  if (!rgb) return failed(rgb.error());
  // The pattern of driver memory shows no mirror.
  if (driver == drivers::kMemory) {
    report.add({view, "image", fmt::format("{} x {}", rgb->width_px, rgb->height_px)});
    return;
  }
  check_image(view, *rgb, believed, report);
}

}  // namespace

vision::RimCircle rim_of(const config::RigView& view) {
  return {{view.centre_px[0], view.centre_px[1]}, view.rim_radius_px, 0};
}

void check_whole_robot(const config::Robot& robot, const drivers::RobotSettings& settings, const Openers& openers,
                       const Surroundings& surroundings, Report& report) {
  add_driver_rows(settings, report);
  const auto failed = [&](const char* check, const Error& error) {
    report.add(failed_row(kRobotPart, check, error, kAdvice));
  };
  surroundings.progress("simulated robot", 0);
  auto opened = openers.robot(settings);
  if (!opened) return failed("opens", opened.error());
  Robot whole = *std::move(opened);
  end_if_asked(surroundings);
  if (const auto started = whole.start(settings.lower.settings, settings.upper.settings); !started) {
    return failed("starts", started.error());
  }
  report.add({kRobotPart, "opens, starts", fmt::format("{} cameras and a drive", 2 + settings.others.size())});
  end_if_asked(surroundings);
  const auto pair = whole.next_frame(kPairTime);
  if (!pair) return failed("pair", pair.error());
  report.add({kRobotPart, "pair", fmt::format("received; skew {:.1f} ms", 1e3 * seconds_of(pair->skew()))});
  if (const auto angles = whole.drive().read_angles(); !angles) {
    failed("angles", angles.error());
  } else {
    report.add(
        {kRobotPart, "angles", fmt::format("left {:.3f} rad, right {:.3f} rad", angles->left_rad, angles->right_rad)});
  }
  surroundings.progress("simulated robot", 0.5);
  end_if_asked(surroundings);
  check_view("lower", pair->lower, settings.lower.driver, rim_of(robot.rig.lower), report);
  end_if_asked(surroundings);
  check_view("upper", pair->upper, settings.upper.driver, rim_of(robot.rig.upper), report);
  whole.stop();
}

}  // namespace twocone::doctor
