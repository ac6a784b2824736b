// SPDX-License-Identifier: Apache-2.0
#include "apps/runs/run.h"

#include <set>
#include <system_error>
#include <tuple>
#include <vector>

#include <fmt/format.h>

#include "apps/config/to_layers.h"
#include "apps/config/yaml/text_file.h"
#include "apps/estimation/track.h"
#include "apps/runlog/storage/disk.h"
#include "apps/runlog/storage/image_file.h"
#include "apps/runlog/storage/locked_folder.h"
#include "apps/runlog/summary/summary.h"
#include "apps/runlog/tables/tables.h"
#include "localisation/odometry.h"

namespace twocone::runs {
namespace {

namespace fs = std::filesystem;

// Stands in place of a verdict if the images cannot be read.
constexpr const char* kNoImage = "no_image";

/// A frame's two images.
struct Pair {
  Image lower, upper;
};

/// Returns nothing if an image cannot be read and `allow_missing` permits it. Errors: those of read_image()
Result<std::optional<Pair>> read_pair(const fs::path& folder, std::uint64_t frame, bool allow_missing) {
  const auto without = [&](const Error& error) -> Result<std::optional<Pair>> {
    if (allow_missing) return std::optional<Pair>();
    return Error(error.code,
                 "frame {}: {}; nothing was changed: put the image back, or leave such frames without an answer with "
                 "--allow-missing",
                 frame, error.message);
  };
  auto lower = runlog::read_image(runlog::lower_image_file(folder, frame));
  if (!lower) return without(lower.error());
  auto upper = runlog::read_image(runlog::upper_image_file(folder, frame));
  if (!upper) return without(upper.error());
  return std::optional(Pair{*std::move(lower), *std::move(upper)});
}

runlog::AnswerRows no_image_rows(const runlog::FrameRow& frame, const config::Map& map, const runlog::PoseRow* truth) {
  estimation::FrameAnswer none;
  none.ranges.resize(map.landmarks.size());
  runlog::AnswerRows rows = runlog::to_rows(frame.frame, frame.t_s, none, map, truth);
  for (runlog::RangeRow& row : rows.ranges) row.verdict = kNoImage;
  for (runlog::FixRow& row : rows.fixes) row.verdict = kNoImage;
  return rows;
}

}  // namespace

Result<runlog::RunData> localise(const fs::path& folder, estimation::Method method, const Progress& progress,
                                 const LocaliseOptions& options) {
  (void)runlog::read_run_yaml(folder);  // throws before a folder without a run is locked
  const runlog::RunLock lock(folder);
  const runlog::RunData run = runlog::read_run(folder);
  const estimation::Estimator estimator(method, run.robot, run.map);
  estimation::Track track(method, run.robot, run.map);
  if (run.frames.empty()) throw config::FileError("{}: the run has no frame", folder.string());
  runlog::check_drive(run);
  bool is_any_read = false;
  std::vector<runlog::AnswerRows> answers;
  for (std::size_t i = 0; i < run.frames.size(); ++i) {
    if (options.stop && *options.stop) {
      return Error(ErrorCode::kCancelled, "stopped from outside; {} is as it was", folder.string());
    }
    const runlog::FrameRow& frame = run.frames[i];
    const runlog::PoseRow* const truth = run.truth.empty() ? nullptr : &run.truth[i];
    const auto pair = read_pair(folder, frame.frame, options.allow_missing);
    if (!pair) return pair.error();
    localisation::Fix fix;
    std::vector<vision::Beam> scan;
    is_any_read = is_any_read || *pair;
    if (*pair) {
      const auto answer = estimator.answer((*pair)->lower, (*pair)->upper,
                                           vision::frame_motion(runlog::twist_at(run, i), frame.skew_s));
      if (!answer) return with_name(fmt::format("frame {}", frame.frame), answer.error());
      answers.push_back(runlog::to_rows(frame.frame, frame.t_s, *answer, run.map, truth));
      answers.back().timing = runlog::to_row(frame.frame, frame.t_s, answer->timing,
                                             estimation::time_limit_of(method, run.robot).has_value());
      fix = answer->fix;
      scan = answer->scan;
    } else {
      answers.push_back(no_image_rows(frame, run.map, truth));
    }
    const runlog::DriveRow* const drive = runlog::has_odometry(run) ? &run.drive[i] : nullptr;
    answers.back().track = runlog::to_row(
        frame.frame, frame.t_s, fix,
        drive ? track.follow(drive->t_s, drive->left_rad, drive->right_rad, run.odometry[i].heading_rad, fix, scan)
              : estimation::track_without_wheels(fix));
    progress(double(i + 1) / double(run.frames.size()));
  }
  if (!is_any_read) {
    return Error(ErrorCode::kNotFound, "{}: no frame has both its images; nothing was changed", folder.string());
  }
  const std::string name(to_string(method));
  runlog::write_results(folder, name, answers, runlog::OnTop::kYes, &run.info);
  return runlog::read_run(folder, name);
}

namespace {

void refuse_other_robots(const runlog::RunData& run, const config::Robot& robot) {
  const auto refuse = [&](const std::string& what) {
    throw config::FileError("{}: {} is not that of the robot that made {}", robot.file.string(), what,
                            run.folder.string());
  };
  if (robot.start != run.robot.start) refuse("start");
  for (const auto& [name, now, then] :
       {std::tuple{"lower", &robot.lower, &run.robot.lower}, std::tuple{"upper", &robot.upper, &run.robot.upper}}) {
    if (now->settings.width_px != then->settings.width_px || now->settings.height_px != then->settings.height_px) {
      refuse(fmt::format("cameras.{}: {} x {} px", name, now->settings.width_px, now->settings.height_px));
    }
  }
}

void refuse_other_rooms(const runlog::RunData& run, const config::Robot& robot, const config::Map& map) {
  const auto names_of = [](const config::Map& of) {
    std::set<std::string> names;
    for (const Landmark& landmark : of.landmarks) names.insert(landmark.name);
    return names;
  };
  const auto before = names_of(run.map), now = names_of(map);
  if (now == before) return;
  throw config::FileError(
      "{}: map: {} has the landmarks {}, and the map with which {} was made has {}: another room; if it is "
      "the map that you want, name it with --map",
      robot.file.string(), map.file.string(), fmt::join(now, ", "), run.folder.string(), fmt::join(before, ", "));
}

std::string odometry_text(const runlog::RunData& run, const config::Robot& robot) {
  localisation::Odometry odometry(config::to_wheels(robot), config::to_start_pose(robot));
  std::string text;
  if (!runlog::has_odometry(run)) return text;
  for (std::size_t i = 0; i < run.frames.size(); ++i) {
    const localisation::Pose& pose = odometry.update(run.drive[i].left_rad, run.drive[i].right_rad);
    text += runlog::to_line(runlog::PoseRow{run.frames[i].t_s, pose.x_m, pose.y_m, pose.heading_rad}) + '\n';
  }
  return text;
}

}  // namespace

void copy_run_with(const runlog::OtherBeliefs& other, const fs::path& from, const fs::path& to, bool replace) {
  const runlog::RunData run = runlog::read_run(from);
  const config::Robot robot = other.robot_file.empty() ? run.robot : config::read_robot(other.robot_file);
  runlog::OtherBeliefs beliefs = other;
  if (beliefs.map_file.empty()) beliefs.map_file = robot.map;
  const config::Map map = config::read_map(beliefs.map_file);
  refuse_other_robots(run, robot);
  if (other.map_file.empty()) refuse_other_rooms(run, robot, map);
  config::check_landmarks(robot, map);
  runlog::check_drive(run);
  std::error_code none_such;
  if (fs::equivalent(from, to, none_such)) {
    throw runlog::DiskError("{} is the run itself: choose another --out", to.string());
  }
  if (replace) runlog::remove_run(to);
  runlog::NewFolder folder(to);
  const std::vector<std::string> cameras = config::camera_names(run.robot);
  for (const runlog::FrameRow& row : run.frames) {
    for (const std::string& camera : cameras) {
      // A missing image is not an error here, because localise() handles it.
      const fs::path image = runlog::camera_image_file(from, camera, row.frame);
      if (fs::exists(image)) runlog::link_or_copy(image, runlog::camera_image_file(to, camera, row.frame));
    }
  }
  // Tables are copied, because a program may still append to the originals.
  for (const char* table : {"frames.csv", "drive.csv"})
    runlog::write_whole(to / table, config::read_text(from / table));
  if (!run.truth.empty()) runlog::write_whole(to / "truth.tum", config::read_text(from / "truth.tum"));
  runlog::write_whole(to / "odometry.tum", odometry_text(run, robot));
  runlog::write_run_yaml_for(beliefs, from, to);  // written last, because it makes the folder a run
  folder.keep();
}

}  // namespace twocone::runs
