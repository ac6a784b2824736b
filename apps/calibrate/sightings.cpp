// SPDX-License-Identifier: Apache-2.0
#include "apps/calibrate/calibrate.h"

#include <algorithm>
#include <stdexcept>

#include <fmt/format.h>

#include "apps/config/to_layers.h"
#include "apps/config/yaml/text_file.h"
#include "apps/runlog/run_folder.h"
#include "vision/outline_ranging.h"

namespace twocone::calibrate {
namespace {

constexpr std::size_t kCircleImages = 31;

std::vector<vision::WheelReading> readings_between(const runlog::RunData& run, std::size_t from, std::size_t to) {
  std::vector<vision::WheelReading> readings;
  if (to >= run.drive.size()) return readings;  // the run was cut off before the wheels were written
  for (std::size_t i = from; i <= to; ++i) {
    readings.push_back({run.drive[i].t_s, run.drive[i].left_rad, run.drive[i].right_rad});
  }
  return readings;
}

/// Also returns an error if the image does not have the camera's size.
Result<cv::Mat> read_rgb(const std::filesystem::path& file, const drivers::CameraPart& camera) {
  auto rgb = runlog::read_rgb(file);
  if (rgb && (rgb->cols != camera.settings.width_px || rgb->rows != camera.settings.height_px)) {
    return Error(ErrorCode::kBadData, "{} has {} x {} pixels, the robot file says {} x {}", file.string(), rgb->cols,
                 rgb->rows, camera.settings.width_px, camera.settings.height_px);
  }
  return rgb;
}

/// Returns whether the sightings belong to the landmark. With a wrong rig, ranges may fail although sightings are
/// right.
bool is_trusted(vision::RangeVerdict verdict) {
  using vision::RangeVerdict;
  return verdict == RangeVerdict::kOk || verdict == RangeVerdict::kOneView || verdict == RangeVerdict::kInconsistent ||
         verdict == RangeVerdict::kBeyondLimit;
}

}  // namespace

std::vector<std::size_t> chosen_rows(std::size_t frames, int wanted) {
  const std::size_t count = std::min(frames, std::max(vision::CalibrationResult::kMinFrames, std::size_t(wanted)));
  std::vector<std::size_t> rows;
  for (std::size_t i = 0; i < count; ++i) rows.push_back(count == 1 ? 0 : i * (frames - 1) / (count - 1));
  return rows;
}

std::optional<vision::BodyTwist> twist_at(const runlog::RunData& run, std::size_t row) {
  if (row == 0 || row >= run.drive.size()) return std::nullopt;
  const runlog::DriveRow &before = run.drive[row - 1], &after = run.drive[row];
  const double time_s = after.t_s - before.t_s;
  if (!(time_s > 0)) return std::nullopt;
  const config::Drive& drive = run.robot.drive;
  const double left_mps = drive.wheel_radius_m * (after.left_rad - before.left_rad) / time_s;
  const double right_mps = drive.wheel_radius_m * (after.right_rad - before.right_rad) / time_s;
  return vision::BodyTwist{(left_mps + right_mps) / 2, (right_mps - left_mps) / drive.wheel_separation_m};
}

ChosenFrames choose_frames(const std::vector<runlog::RunData>& runs, int count) {
  std::size_t all = 0;
  for (const runlog::RunData& run : runs) all += run.frames.size();
  ChosenFrames chosen;
  for (const runlog::RunData& run : runs) {
    const std::size_t first_landmark = chosen.landmarks.size();
    chosen.landmarks.insert(chosen.landmarks.end(), run.map.landmarks.begin(), run.map.landmarks.end());
    const std::size_t available = run.frames.size();
    const std::size_t share = std::size_t(count) * available / std::max<std::size_t>(1, all);
    std::optional<std::size_t> last;
    for (const std::size_t row : chosen_rows(available, int(share))) {
      chosen.frames.push_back({&run, row, first_landmark, {}});
      if (last) chosen.frames.back().wheels = readings_between(run, *last, row);
      last = row;
    }
  }
  return chosen;
}

Sighted sight(const std::vector<runlog::RunData>& runs, const ChosenFrames& chosen, const vision::Rig& rig,
              const std::function<void(double)>& progress) {
  Sighted sighted;
  for (const runlog::RunData& run : runs) {
    const auto targets = config::to_targets(run.map);
    std::optional<vision::OutlineRanging> ranging;
    try {
      ranging.emplace(rig, targets, cv::Size(run.robot.lower.settings.width_px, run.robot.lower.settings.height_px),
                      cv::Size(run.robot.upper.settings.width_px, run.robot.upper.settings.height_px));
    } catch (const std::invalid_argument& error) {
      throw config::FileError("{}: {}", run.map.file.string(), error.what());
    }
    for (const ChosenFrames::Frame& frame : chosen.frames) {
      if (frame.run != &run) continue;
      const runlog::FrameRow& stamps = run.frames[frame.row];
      vision::CalibrationFrame& out = sighted.frames.emplace_back();
      out.wheels = frame.wheels;
      out.twist = twist_at(run, frame.row);
      const auto lower = read_rgb(runlog::lower_image_file(run.folder, stamps.frame), run.robot.lower);
      const auto upper = read_rgb(runlog::upper_image_file(run.folder, stamps.frame), run.robot.upper);
      if (!lower || !upper) {
        sighted.unreadable.push_back(lower ? upper.error() : lower.error());
        continue;
      }
      const auto measurements = ranging->measure(*lower, *upper);
      for (std::size_t i = 0; i < measurements.size(); ++i) {
        if (!is_trusted(measurements[i].verdict)) continue;
        const auto add = [&](vision::Side side, const std::optional<vision::Sighting>& sighting, double stamped_s) {
          if (!sighting) return;
          out.sightings.push_back({frame.first_landmark + i, side, *sighting, stamped_s - stamps.t_s});
        };
        add(vision::Side::kLower, measurements[i].lower_sighting, stamps.lower_t_s);
        add(vision::Side::kUpper, measurements[i].upper_sighting, stamps.upper_t_s);
      }
      progress(double(sighted.frames.size()) / double(chosen.frames.size()));
    }
  }
  return sighted;
}

std::vector<cv::Mat> images_for_circles(const ChosenFrames& chosen, vision::Side side) {
  std::vector<cv::Mat> images;
  const std::size_t count = std::min(kCircleImages, chosen.frames.size());
  for (std::size_t i = 0; i < count; ++i) {
    const ChosenFrames::Frame& frame =
        chosen.frames[i * (chosen.frames.size() - 1) / std::max<std::size_t>(1, count - 1)];
    const std::uint64_t number = frame.run->frames[frame.row].frame;
    const auto file = side == vision::Side::kLower ? runlog::lower_image_file(frame.run->folder, number)
                                                   : runlog::upper_image_file(frame.run->folder, number);
    auto rgb = runlog::read_rgb(file);
    if (rgb && (images.empty() || rgb->size() == images.front().size())) images.push_back(std::move(*rgb));
  }
  return images;
}

}  // namespace twocone::calibrate
