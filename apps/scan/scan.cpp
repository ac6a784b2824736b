// SPDX-License-Identifier: Apache-2.0
#include "apps/scan/scan.h"

#include <array>
#include <bit>
#include <cmath>
#include <iterator>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <opencv2/core.hpp>

#include "apps/config/to_layers.h"
#include "apps/estimation/image_as_mat.h"
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
  std::string points;
  long count = 0;
  const double cosine = pose ? std::cos(pose->heading_rad) : 1;
  const double sine = pose ? std::sin(pose->heading_rad) : 0;
  for (int a = 0; a < image.grid.azimuths; ++a) {
    for (int i = 0; i < image.grid.slopes; ++i) {
      if (image.verdict_at(a, i) != vision::DenseVerdict::kOk) continue;
      const double range_m = image.range_m.at<float>(a, i);
      const double bearing_rad = image.bearing_rad.at<float>(a, i);
      const double x_m = range_m * std::cos(bearing_rad);
      const double y_m = range_m * std::sin(bearing_rad);
      append(points, (pose ? pose->x_m : 0) + cosine * x_m - sine * y_m);
      append(points, (pose ? pose->y_m : 0) + sine * x_m + cosine * y_m);
      append(points, image.height_m.at<float>(a, i));
      append(points, image.sigma_m.at<float>(a, i));
      ++count;
    }
  }
  return fmt::format(
             "ply\nformat binary_little_endian 1.0\ncomment twocone, metres, {} frame, z up\nelement vertex {}\n"
             "property float x\nproperty float y\nproperty float z\nproperty float range_sigma\nend_header\n",
             pose ? "world" : "body", count) +
         points;
}

/// The pixels of an image, and what they are a view of.
struct PixelsOfImage {
  Image read, converted;
  cv::Mat rgb;
};
/// Errors: those of runlog::read_image() and estimation::as_rgb()
Status read_pixels(const fs::path& file, cv::Size size, const char* view, PixelsOfImage& pixels) {
  auto image = runlog::read_image(file);
  if (!image) return image.error();
  pixels.read = *std::move(image);
  const auto rgb = estimation::as_rgb(pixels.read, size, view, pixels.converted);
  if (!rgb) return rgb.error();
  pixels.rgb = *rgb;
  return {};
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
    std::array<PixelsOfImage, 2> pair;
    bool is_whole = true;
    for (std::size_t view = 0; view < pair.size(); ++view) {
      const auto read = read_pixels(files[view], size, view == 0 ? "lower" : "upper", pair[view]);
      if (read) continue;
      is_whole = false;
      if (!first) first = read.error();
    }
    if (!is_whole) {
      ++counts.without_images;
      continue;
    }
    const vision::RangeImage image = ranging.measure(pair[0].rgb, pair[1].rgb);
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
