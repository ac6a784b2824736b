// SPDX-License-Identifier: Apache-2.0
#include "apps/scan/scan.h"

#include <bit>
#include <cmath>
#include <iterator>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <Eigen/Geometry>
#include <opencv2/core.hpp>

#include "apps/config/to_layers.h"
#include "apps/runlog/run_data.h"
#include "apps/runlog/storage/disk.h"
#include "apps/runlog/storage/image_file.h"
#include "apps/runlog/storage/locked_folder.h"
#include "base/errors.h"

namespace twocone::scan {
namespace {

namespace fs = std::filesystem;

constexpr const char* kClouds = "clouds";

void add_rows(std::string& text, const runlog::FrameRow& frame, const std::vector<vision::Beam>& beams,
              ScanCounts& counts) {
  const double width_rad = 2 * std::numbers::pi / double(beams.size());
  for (std::size_t k = 0; k < beams.size(); ++k) {
    const vision::Beam& beam = beams[k];
    const bool is_known = beam.state != vision::BeamState::kUnknown;
    const bool is_occupied = beam.state == vision::BeamState::kOccupied;
    ++(is_occupied ? counts.occupied : is_known ? counts.free : counts.unknown);
    fmt::format_to(std::back_inserter(text), "{},{},{:.5f},{},{},{}\n", frame.frame, frame.t_s,
                   -std::numbers::pi + width_rad * (double(k) + 0.5), to_string(beam.state),
                   is_known ? fmt::format("{:.4f}", beam.range_m) : "",
                   is_occupied ? fmt::format("{:.4f}", beam.sigma_m) : "");
  }
}

/// Appends a float in the byte order of little-endian files.
void append(std::string& bytes, double value) {
  const auto bits = std::bit_cast<std::uint32_t>(static_cast<float>(value));
  for (int shift = 0; shift < 32; shift += 8) bytes.push_back(static_cast<char>(bits >> shift & 0xFFU));
}

/// @param pose of the body in the world; nothing: the points stay in the body's frame
std::string cloud_of(const vision::RangeImage& image, const std::optional<runlog::PoseRow>& pose) {
  const std::vector<vision::RangedPoint> points = points_of(image);
  const Pose2 at = pose ? Pose2{pose->x_m, pose->y_m, pose->heading_rad} : Pose2{};
  const Eigen::Rotation2Dd turn(at.heading_rad);
  std::string bytes;
  for (const auto& [point_m, sigma_m] : points) {
    const Eigen::Vector2d place_m = Eigen::Vector2d(at.x_m, at.y_m) + turn * point_m.head<2>();
    for (const double value : {place_m.x(), place_m.y(), point_m.z(), sigma_m}) append(bytes, value);
  }
  return fmt::format(
             "ply\nformat binary_little_endian 1.0\ncomment twocone, metres, {} frame, z up\nelement vertex {}\n"
             "property float x\nproperty float y\nproperty float z\nproperty float range_sigma\nend_header\n",
             pose ? "world" : "body", points.size()) +
         bytes;
}

}  // namespace

fs::path scan_file(const fs::path& run) { return run / "scan.csv"; }

Result<ScanCounts> scan(const fs::path& folder, const ScanOptions& options) {
  if (options.every < 1) throw base::InvalidArgument("scan: every is {}, must be >= 1", options.every);
  (void)runlog::read_run_yaml(folder);  // throws before a folder without a run is locked
  const runlog::RunLock lock(folder);
  const runlog::RunData run = runlog::read_run(folder);
  const config::BeliefErrors errors = config::to_belief_errors(run.robot, run.map);
  const cv::Size size(run.robot.lower.settings.width_px, run.robot.lower.settings.height_px);
  const vision::DenseRanging ranging(vision::UncertainRig(config::to_rig(run.robot), errors.vision.rig), size);
  const auto poses = runlog::at_frames(run, run.estimate);
  ScanCounts counts;
  std::string text = "frame,t_s,beam_rad,state,range_m,sigma_m\n";
  const fs::path clouds = folder / kClouds;
  const fs::path new_clouds = folder / "clouds.new";
  if (options.clouds) {
    runlog::remove_whole(new_clouds);
    runlog::make_folder(new_clouds);
  }
  std::optional<Error> first;
  for (std::size_t row = 0; row < run.frames.size(); row += std::size_t(options.every)) {
    if (options.stop && *options.stop) {
      if (options.clouds) runlog::remove_whole(new_clouds);
      return Error(ErrorCode::kCancelled, "stopped from outside; {} is as it was", folder.string());
    }
    const auto files = runlog::images_of(run, row);
    const auto lower = runlog::read_rgb(files[0], run.robot.lower.settings);
    const auto upper = runlog::read_rgb(files[1], run.robot.upper.settings);
    if (!lower || !upper) {
      if (!first) first = lower ? upper.error() : lower.error();
      ++counts.without_images;
      continue;
    }
    const vision::RangeImage image = ranging.measure(*lower, *upper);
    add_rows(text, run.frames[row], scan_of(image, options.settings), counts);
    counts.points += cv::countNonZero(image.verdict == static_cast<int>(vision::DenseVerdict::kOk));
    if (options.clouds) {
      runlog::write_whole(new_clouds / fmt::format("{:06}.ply", run.frames[row].frame), cloud_of(image, poses[row]));
      ++counts.clouds;
    }
    ++counts.frames;
    if (options.progress) options.progress(double(row + 1) / double(run.frames.size()));
  }
  if (counts.frames == 0) {
    if (options.clouds) runlog::remove_whole(new_clouds);
    return Error(first ? first->code : ErrorCode::kNotFound, "{}: no frame has both its images{}; nothing was changed",
                 folder.string(), first ? fmt::format(" ({})", first->message) : "");
  }
  runlog::write_whole(scan_file(folder), text);
  if (options.clouds) {
    runlog::remove_whole(clouds);
    fs::rename(new_clouds, clouds);
  }
  return counts;
}

}  // namespace twocone::scan
