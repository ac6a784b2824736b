// SPDX-License-Identifier: Apache-2.0
#include "apps/calibrate/start.h"

#include <algorithm>
#include <cmath>

#include "apps/config/to_layers.h"
#include "apps/runlog/storage/image_file.h"
#include "localisation/odometry.h"
#include "localisation/trajectory_error.h"

namespace twocone::calibrate {
namespace {

// Pairs of frames for the search. A pose of one view is good to some centimetres, so that a drive of 0.3 m has a
// direction; a turn by the wheels is wrong by a few per cent of it.
constexpr std::size_t kSearchPairs = 15;
constexpr double kSearchDrive_m = 0.3;
constexpr double kSearchTurn_rad = 0.5;

// Priors of a start that the images gave. The image of the tip is some pixels off where the lens distorts or is off the
// mirror's axis.
constexpr double kFoundCentrePrior_px = 5;
constexpr double kFoundRimPrior = 0.02;
constexpr double kFoundAzimuthSigmas = 3;

/// Returns some thirty frames of a run, in pairs that are a short drive apart, with the motion between the two of a
/// pair. Images that cannot be read are left out.
std::vector<vision::SelfRigFrame> frames_for_search(const runlog::RunData& run) {
  const std::size_t count = std::min(run.frames.size(), run.drive.size());
  std::vector<Pose2> poses;
  localisation::Odometry odometry(config::to_wheels(run.robot), {});
  for (std::size_t row = 0; row < count; ++row) {
    poses.push_back(odometry.update(run.drive[row].left_rad, run.drive[row].right_rad));
  }
  std::vector<vision::SelfRigFrame> frames;
  const auto add = [&](std::size_t row, const std::optional<Pose2>& motion) {
    const auto files = runlog::images_of(run, row);
    const auto lower = runlog::read_rgb(files[0], run.robot.lower.settings);
    const auto upper = runlog::read_rgb(files[1], run.robot.upper.settings);
    if (!lower || !upper) return false;
    frames.push_back({*lower, *upper, motion, {}});
    return true;
  };
  std::optional<std::size_t> last;
  for (const std::size_t row : chosen_rows(run.frames.size(), kSearchPairs)) {
    if (last && row <= *last) continue;
    if (!add(row, {})) continue;
    last = row;
    for (std::size_t next = row + 1; next < count; ++next) {
      const Pose2 motion = localisation::seen_from(poses[row], poses[next]);
      if (std::hypot(motion.x_m, motion.y_m) < kSearchDrive_m && std::abs(motion.heading_rad) < kSearchTurn_rad) {
        continue;
      }
      if (add(next, motion)) last = next;
      break;
    }
  }
  return frames;
}

/// Returns whether all images of a camera are equal although the robot moved.
bool is_frozen(const std::vector<vision::SelfRigFrame>& frames, vision::Side camera) {
  const cv::Mat& first = of_view(frames.front(), camera);
  const auto is_first = [&](const vision::SelfRigFrame& frame) {
    return cv::norm(of_view(frame, camera), first, cv::NORM_INF) == 0;
  };
  return std::ranges::any_of(frames, [](const auto& frame) { return frame.motion.has_value(); }) &&
         std::ranges::all_of(frames, is_first);
}

}  // namespace

Result<Start> find_start(const runlog::RunData& run, const config::Robot& robot, const Settings& settings) {
  Start start{robot, {}, {}, false, settings.priors};
  if (!settings.start_from_images) return start;
  vision::SelfRigProblem problem = estimation::self_rig_problem(robot, run.map);
  problem.frames = frames_for_search(run);
  if (problem.frames.empty()) return start;  // sight() names the images
  start.found = vision::find_rig(problem);
  for (const vision::Side camera : {vision::Side::kLower, vision::Side::kUpper}) {
    // A lens cap and a dead camera repeat one image, too, and what_to_change() names them.
    const bool has_mirror = start.found->views[std::size_t(camera)].mirror.verdict == vision::MirrorVerdict::kFound;
    if (!has_mirror || !is_frozen(problem.frames, camera)) continue;
    return Error(ErrorCode::kBadData,
                 "{}: camera {} repeats one image while the wheels turn: it is frozen; plug it in again, and see "
                 "twocone doctor",
                 run.folder.string(), to_string(camera));
  }
  if (start.found->missing() != vision::NotFound::kNothing) {
    if (robot.rig.missing.empty() && !start.found->is_blind()) return start;
    return Error(ErrorCode::kBadData, "{}: {}", run.folder.string(), estimation::what_to_change(*start.found));
  }
  estimation::SelfRigAnswer answer = estimation::compare_with_file(robot, *start.found, problem);
  start.replaced = std::move(answer.differences);
  start.robot.rig = std::move(answer.rig);
  start.exchanged = *start.found->exchanged.value;
  if (start.exchanged) std::swap(start.robot.lower, start.robot.upper);
  // One prior counts for both views, so that it is that of the view which is known less.
  const auto count = [&](const char* key) {
    return std::ranges::count_if(start.replaced, [&](const auto& r) { return r.key.ends_with(key); });
  };
  const bool are_believed = start.found->views[0].is_circle_believed || start.found->views[1].is_circle_believed;
  if (count("centre_px") == 2 && !are_believed) start.priors.centre_px = kFoundCentrePrior_px;
  if (count("centre_px") == 1) start.priors.centre_px = std::max(start.priors.centre_px, kFoundCentrePrior_px);
  if (count("rim_radius_px") > 0) start.priors.rim_share = std::max(start.priors.rim_share, kFoundRimPrior);
  if (count("azimuth_rad") > 0) {
    start.priors.azimuth_rad =
        std::max({start.priors.azimuth_rad, kFoundAzimuthSigmas * start.found->relative_azimuth.sigma_rad,
                  kFoundAzimuthSigmas * start.found->azimuth.sigma_rad});
  }
  return start;
}

}  // namespace twocone::calibrate
