// SPDX-License-Identifier: Apache-2.0
#include "apps/runs/self_rig.h"

#include <utility>

#include <fmt/format.h>

#include "apps/config/to_layers.h"
#include "apps/estimation/image_as_mat.h"
#include "apps/estimation/self_rig.h"
#include "apps/runs/loop/frame_taker.h"

namespace twocone::runs {
namespace {

// A served world waits for its slowest robot; the images themselves may take longer.
constexpr std::chrono::milliseconds kPairTime{60'000};

/// What the images of one pair show.
struct Shown {
  vision::SelfRig found;
  std::optional<estimation::SelfRigAnswer> answer;  ///< none: found.missing()
};

Result<Shown> shown_in(const config::Robot& robot, const config::Map& map, const Image& lower, const Image& upper,
                       estimation::Replace which) {
  const auto lower_rgb = to_rgb8(lower);
  const auto upper_rgb = to_rgb8(upper);
  if (!lower_rgb) return lower_rgb.error();
  if (!upper_rgb) return upper_rgb.error();
  vision::SelfRigProblem problem = estimation::self_rig_problem(robot, map);
  problem.frames.push_back({estimation::as_mat(*lower_rgb), estimation::as_mat(*upper_rgb), {}, {}});
  if (robot.start) problem.frames.back().heading_rad = robot.start->heading_rad;
  Shown shown{vision::find_rig(problem), {}};
  if (shown.found.missing() == vision::NotFound::kNothing) {
    shown.answer = estimation::compare_with_file(robot, shown.found, problem, which);
  }
  return shown;
}

std::string list_of(const std::vector<estimation::RigDifference>& differences) {
  std::string text;
  for (const auto& [key, in_file, seen] : differences) {
    text += fmt::format("{}rig.{} {}{}", text.empty() ? "" : ", ", key, seen,
                        in_file.empty() ? "" : fmt::format(" instead of {}", in_file));
  }
  return text;
}

constexpr const char* kExchanged =
    "camera lower shows the upper mirror, and camera upper the lower one: exchange the entries of cameras.lower and "
    "cameras.upper";

}  // namespace

Result<SelfRigRobot> with_self_rig(const config::Robot& robot, const config::Map& map, const RunOptions& options,
                                   const std::atomic<bool>& stop) {
  drivers::RobotSettings settings = config::to_robot_settings(robot, map, options.seed);
  if (settings.world && options.renderer) settings.world->place.render.renderer = *options.renderer;
  auto opened = options.open(settings);
  if (!opened) return opened.error();
  Robot taken = *std::move(opened);
  if (auto started = taken.start(settings.lower.settings, settings.upper.settings); !started) return started.error();
  const auto frame = taken.next_frame(kPairTime);
  if (!frame) return frame.error();
  const auto images = wait_for_images(*frame, [&stop] { return stop.load(); });
  taken.stop();
  if (!images) return images.error();
  const auto shown = shown_in(robot, map, *images->first, *images->second, estimation::Replace::kAll);
  if (!shown) return shown.error();
  const auto refused = [&](const std::string& why) {
    return Error(ErrorCode::kRefused, "{}: --self-rig: {}", robot.file.string(), why);
  };
  if (!shown->answer) return refused(estimation::what_to_change(shown->found));
  if (*shown->found.exchanged.value) return refused(kExchanged);
  SelfRigRobot result{robot, ""};
  for (config::KeyChange& change : estimation::changes_to(*shown->answer)) {
    result.robot.changes.push_back(std::move(change));
  }
  result.robot.rig = shown->answer->rig;
  result.event = "--self-rig: taken from the first images: " + list_of(shown->answer->differences);
  return result;
}

std::optional<std::string> rig_warning(const config::Robot& robot, const config::Map& map, const Image& lower,
                                       const Image& upper) {
  const auto shown = shown_in(robot, map, lower, upper, estimation::Replace::kContradicted);
  if (!shown) return std::nullopt;
  if (!shown->answer) {
    return "warning: rig: could not be compared with the first images: " + estimation::what_to_change(shown->found);
  }
  if (*shown->found.exchanged.value) return std::string("warning: ") + kExchanged;
  if (shown->answer->differences.empty()) return std::nullopt;
  return fmt::format(
      "warning: the first images contradict the robot file: {}; run --self-rig takes what they show, and calibrate "
      "refines it",
      list_of(shown->answer->differences));
}

}  // namespace twocone::runs
