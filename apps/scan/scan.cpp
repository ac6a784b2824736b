// SPDX-License-Identifier: Apache-2.0
#include "apps/scan/scan.h"

#include <bit>
#include <cmath>
#include <iterator>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <opencv2/core.hpp>

#include "apps/config/to_layers.h"
#include "apps/estimation/scanner.h"
#include "apps/estimation/track.h"
#include "apps/runlog/answer_rows.h"
#include "apps/runlog/run_data.h"
#include "apps/runlog/storage/disk.h"
#include "apps/runlog/storage/image_file.h"
#include "apps/runlog/storage/locked_folder.h"
#include "apps/runlog/summary/summary.h"
#include "base/errors.h"
#include "localisation/plan_fix.h"

namespace twocone::scan {
namespace {

namespace fs = std::filesystem;

void add_rows(std::string& text, const runlog::FrameRow& frame, const std::vector<vision::Beam>& beams,
              ScanCounts& counts) {
  for (const vision::Beam& beam : beams) {
    const bool is_known = beam.state != vision::BeamState::kUnknown;
    ++(beam.state == vision::BeamState::kOccupied ? counts.occupied : is_known ? counts.free : counts.unknown);
  }
  for (const runlog::ScanRow& row : runlog::to_rows(frame.frame, frame.t_s, beams)) text += to_line(row) + '\n';
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

/// Places frames on the map's floor plan, one after the other.
class PlanTrack {
 public:
  PlanTrack(const runlog::RunData& run, int every)
      : run_(run),
        every_(every),
        plan_(config::to_floor_plan(run.map)),
        start_(config::to_start_pose(run.robot)),
        truths_(runlog::at_frames(run, run.truth)) {}

  void add(std::size_t row, const std::vector<vision::Beam>& beams) {
    const bool is_vague = !last_row_ || *last_row_ + std::size_t(every_) != row;
    const auto fix = estimation::place_on_plan(plan_, beams, expected_at(row), is_vague);
    if (!fix) return;
    last_row_ = row;
    last_ = fix->pose;
    ++counts_.placed;
    const Eigen::Matrix3d& c = fix->covariance;
    fmt::format_to(std::back_inserter(text_),
                   "{},{},{:.6f},{:.6f},{:.7f},{:.4e},{:.4e},{:.4e},{:.4e},{:.4e},{:.4e},{},{:.5f}\n",
                   run_.frames[row].frame, run_.frames[row].t_s, fix->pose.x_m, fix->pose.y_m, fix->pose.heading_rad,
                   c(0, 0), c(0, 1), c(1, 1), c(0, 2), c(1, 2), c(2, 2), fix->used, fix->rms_m);
    if (truths_[row]) judge(*fix, *truths_[row]);
  }

  [[nodiscard]] const std::string& text() const { return text_; }
  void add_to(ScanCounts& counts) const {
    counts.placed = counts_.placed;
    if (judged_ == 0) return;
    counts.position_error_m = position_m_ / judged_;
    counts.heading_error_rad = heading_rad_ / judged_;
    counts.position_held = double(position_held_) / judged_;
    counts.heading_held = double(heading_held_) / judged_;
  }

 private:
  [[nodiscard]] Pose2 expected_at(std::size_t row) const {
    if (!last_row_) return start_;
    if (run_.odometry.empty()) return last_;
    // The last pose, moved as the wheels have moved since.
    const runlog::PoseRow& then = run_.odometry[*last_row_];
    const runlog::PoseRow& now = run_.odometry[row];
    const Eigen::Rotation2Dd turn(last_.heading_rad - then.heading_rad);
    const Eigen::Vector2d moved_m = turn * Eigen::Vector2d(now.x_m - then.x_m, now.y_m - then.y_m);
    return {last_.x_m + moved_m.x(), last_.y_m + moved_m.y(),
            base::wrap_angle_rad(last_.heading_rad + now.heading_rad - then.heading_rad)};
  }
  void judge(const localisation::PlanFix& fix, const runlog::PoseRow& truth) {
    const Eigen::Vector2d off_m(fix.pose.x_m - truth.x_m, fix.pose.y_m - truth.y_m);
    const double off_rad = base::wrap_angle_rad(fix.pose.heading_rad - truth.heading_rad);
    ++judged_;
    position_m_ += off_m.norm();
    heading_rad_ += std::abs(off_rad);
    const Eigen::Matrix2d covariance = fix.covariance.topLeftCorner<2, 2>();
    if (off_m.dot(covariance.inverse() * off_m) < runlog::k95Ellipse) ++position_held_;
    if (std::abs(off_rad) < runlog::k95Sigmas * std::sqrt(fix.covariance(2, 2))) ++heading_held_;
  }

  const runlog::RunData& run_;
  int every_;  ///< such frame is added
  localisation::FloorPlan plan_;
  Pose2 start_;
  std::vector<std::optional<runlog::PoseRow>> truths_;
  std::optional<std::size_t> last_row_;
  Pose2 last_;
  std::string text_ =
      "frame,t_s,x_m,y_m,heading_rad,var_x_m2,cov_xy_m2,var_y_m2,cov_x_heading_m_rad,cov_y_heading_m_rad,"
      "var_heading_rad2,beams,rms_m\n";
  ScanCounts counts_;
  int judged_ = 0, position_held_ = 0, heading_held_ = 0;
  double position_m_ = 0, heading_rad_ = 0;
};

}  // namespace

fs::path plan_file(const fs::path& run) { return run / "plan.csv"; }
fs::path scan_file(const fs::path& run) { return run / "scan.csv"; }

Result<ScanCounts> scan(const fs::path& folder, const ScanOptions& options) {
  if (options.every < 1) throw base::InvalidArgument("scan: every is {}, must be >= 1", options.every);
  (void)runlog::read_run_yaml(folder);  // throws before a folder without a run is locked
  const runlog::RunLock lock(folder);
  const runlog::RunData run = runlog::read_run(folder);
  const vision::DenseRanging ranging = estimation::dense_ranging(run.robot, run.map);
  const auto poses = runlog::at_frames(run, run.estimate);
  ScanCounts counts;
  std::optional<PlanTrack> plan;
  if (options.plan) plan.emplace(run, options.every);
  std::string text = runlog::TableReader<runlog::ScanRow>::header() + '\n';
  const fs::path clouds = runlog::cloud_file(folder, 0).parent_path();
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
    const std::vector<vision::Beam> beams = scan_of(image, options.settings);
    add_rows(text, run.frames[row], beams, counts);
    if (plan) plan->add(row, beams);
    counts.points += cv::countNonZero(image.verdict == static_cast<int>(vision::DenseVerdict::kOk));
    if (options.clouds) {
      runlog::write_whole(new_clouds / runlog::cloud_file(folder, run.frames[row].frame).filename(),
                          cloud_of(image, poses[row]));
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
  if (plan) {
    runlog::write_whole(plan_file(folder), plan->text());
    plan->add_to(counts);
  }
  if (options.clouds) {
    runlog::remove_whole(clouds);
    fs::rename(new_clouds, clouds);
  }
  return counts;
}

}  // namespace twocone::scan
