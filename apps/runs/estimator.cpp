// SPDX-License-Identifier: Apache-2.0
#include "apps/runs/estimator.h"

#include <cassert>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

#include "apps/files/file_error.h"
#include "apps/files/to_layers.h"
#include "localisation/paper_trilateration.h"

namespace twocone::runs {
namespace {

vision::PaperRanging make_ranging(const files::Robot& robot, const files::Map& map, cv::Size lower, cv::Size upper) {
  try {
    return {files::to_rig(robot), files::to_targets(map), lower, upper};
  } catch (const std::invalid_argument& error) {
    throw files::FileError(fmt::format("{} with {}: {}", robot.file.string(), map.file.string(), error.what()));
  }
}

/// Pixels of `image` as vision sees them, without a copy where they are rgb already. `converted` owns what had to be.
Result<cv::Mat> as_rgb(const Image& image, cv::Size wanted, const char* view, Image& converted) {
  if (image.width_px != wanted.width || image.height_px != wanted.height) {
    return Error{ErrorCode::kBadData, fmt::format("the {} picture has {} x {} pixels, the robot file says {} x {}",
                                                  view, image.width_px, image.height_px, wanted.width, wanted.height)};
  }
  auto rgb = to_rgb8(image);
  if (!rgb) return Error{rgb.error().code, fmt::format("{}: {}", view, rgb.error().message)};
  converted = std::move(*rgb);
  return cv::Mat(converted.height_px, converted.width_px, CV_8UC3, converted.bytes.data());
}

}  // namespace

std::string_view to_string(Method method) {
  switch (method) {
    case Method::kPaper:
      return "paper";
  }
  assert(false);
  return "";
}

Method method_named(std::string_view name) {
  if (name == "paper") return Method::kPaper;
  throw std::invalid_argument(fmt::format("method '{}' is not in this version; there is: paper", name));
}

Estimator::Estimator([[maybe_unused]] Method method, const files::Robot& robot, const files::Map& map)
    : landmarks_m_(files::to_landmark_positions(map)),
      lower_size_(robot.lower.width_px, robot.lower.height_px),
      upper_size_(robot.upper.width_px, robot.upper.height_px),
      ranging_(make_ranging(robot, map, lower_size_, upper_size_)) {
  assert(method == Method::kPaper);
}

Result<FrameAnswer> Estimator::answer(const Image& lower, const Image& upper) const {
  Image lower_rgb;
  Image upper_rgb;
  const auto below = as_rgb(lower, lower_size_, "lower", lower_rgb);
  if (!below) return below.error();
  const auto above = as_rgb(upper, upper_size_, "upper", upper_rgb);
  if (!above) return above.error();

  FrameAnswer answer;
  answer.ranges = ranging_.measure(*below, *above);
  std::vector<localisation::LandmarkRange> ranges;
  for (std::size_t i = 0; i < answer.ranges.size(); ++i) {
    if (answer.ranges[i].range_m) ranges.push_back({landmarks_m_[i], *answer.ranges[i].range_m});
  }
  answer.fix = localisation::fix_by_triangle(ranges);
  return answer;
}

AnswerRows to_rows(std::uint64_t frame, double t_s, const FrameAnswer& answer, const files::Map& map,
                   const PoseRow* truth, const PoseRow& odometry) {
  AnswerRows rows;
  for (std::size_t i = 0; i < answer.ranges.size(); ++i) {
    const vision::RangeMeasurement& m = answer.ranges[i];
    const files::Landmark& landmark = map.landmarks[i];
    RangeRow row;
    row.frame = frame;
    row.t_s = t_s;
    row.landmark = landmark.name;
    row.verdict = to_string(m.verdict);
    row.range_m = m.range_m;
    row.sigma_range_m = m.sigma_range_m;
    row.bearing_rad = m.bearing_rad;
    row.sigma_bearing_rad = m.sigma_bearing_rad;
    row.disparity_px = m.disparity_px;
    if (truth) row.true_range_m = std::hypot(landmark.x_m - truth->x_m, landmark.y_m - truth->y_m);
    rows.ranges.push_back(std::move(row));
  }

  const localisation::Fix& fix = answer.fix;
  FixRow row;
  row.frame = frame;
  row.t_s = t_s;
  row.verdict = to_string(fix.verdict);
  row.heading_rad = fix.heading_rad;
  if (fix.covariance) {
    row.var_x_m2 = (*fix.covariance)(0, 0);
    row.cov_xy_m2 = (*fix.covariance)(0, 1);
    row.var_y_m2 = (*fix.covariance)(1, 1);
    row.var_heading_rad2 = (*fix.covariance)(2, 2);
  }
  if (truth) {
    row.true_x_m = truth->x_m;
    row.true_y_m = truth->y_m;
  }
  for (const auto& position : {fix.position_m, fix.other_position_m}) {
    if (!position) continue;
    row.x_m = position->x();
    row.y_m = position->y();
    if (truth) row.error_m = std::hypot(position->x() - truth->x_m, position->y() - truth->y_m);
    rows.fixes.push_back(row);
  }
  if (rows.fixes.empty()) rows.fixes.push_back(row);
  // Of two answers nobody knows which is right: neither is an estimate.
  if (fix.position_m && !fix.other_position_m) {
    rows.estimate =
        PoseRow{t_s, fix.position_m->x(), fix.position_m->y(), fix.heading_rad.value_or(odometry.heading_rad)};
  }
  return rows;
}

}  // namespace twocone::runs
