// SPDX-License-Identifier: Apache-2.0
#include "apps/runs/estimator.h"

#include <algorithm>
#include <cassert>
#include <chrono>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <tuple>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "apps/files/file_error.h"
#include "apps/files/to_layers.h"
#include "apps/runs/adaptive.h"
#include "apps/runs/map_bounds.h"
#include "localisation/paper_trilateration.h"

namespace twocone::runs {
namespace {

using Ranging = std::variant<vision::PaperRanging, vision::FullRanging>;

Ranging make_ranging(Method method, const files::Robot& robot, const files::Map& map, cv::Size lower, cv::Size upper,
                     const std::vector<std::size_t>& wanted) {
  try {
    const vision::Rig rig = files::to_rig(robot);
    const std::vector<vision::Target> targets = files::to_targets(map);
    if (method == Method::kPaper) return vision::PaperRanging(rig, targets, lower, upper, wanted);
    return vision::FullRanging(rig, targets, lower, upper, wanted);
  } catch (const std::invalid_argument& error) {
    throw files::FileError(fmt::format("{} with {}: {}", robot.file.string(), map.file.string(), error.what()));
  }
}

localisation::Fix fix_of_paper(const std::vector<vision::RangeMeasurement>& measured,
                               const std::vector<Eigen::Vector2d>& landmarks_m) {
  std::vector<localisation::LandmarkRange> ranges;
  for (std::size_t i = 0; i < measured.size(); ++i) {
    if (measured[i].range_m) ranges.push_back({landmarks_m[i], *measured[i].range_m});
  }
  return localisation::fix_by_triangle(ranges);
}

constexpr std::string_view kAdaptive = "adaptive";

/// None: adaptive.
std::optional<vision::Stage> stage_of(const files::Robot& robot) {
  const std::string& name = robot.estimator.stage;
  if (name == kAdaptive) return std::nullopt;
  for (const vision::Stage stage : {vision::Stage::kFound, vision::Stage::kCoarse, vision::Stage::kFine}) {
    if (name == to_string(stage)) return stage;
  }
  throw files::FileError(fmt::format("{}: estimator.stage is '{}', must be found, coarse, fine or {}",
                                     robot.file.string(), name, kAdaptive));
}

/// Indices of the landmarks that are looked for; none: all.
std::vector<std::size_t> wanted_of(const files::Robot& robot, const files::Map& map) {
  std::vector<std::size_t> wanted;
  std::string bad;
  for (const std::string& name : robot.estimator.landmarks) {
    const auto at = std::find_if(map.landmarks.begin(), map.landmarks.end(),
                                 [&](const files::Landmark& landmark) { return landmark.name == name; });
    if (at == map.landmarks.end()) {
      bad += fmt::format("{}'{}'", bad.empty() ? "" : ", ", name);
    } else {
      wanted.push_back(std::size_t(at - map.landmarks.begin()));
    }
  }
  if (!bad.empty()) {
    std::vector<std::string> names;
    for (const files::Landmark& landmark : map.landmarks) names.push_back(landmark.name);
    throw files::FileError(fmt::format("{}: estimator.landmarks has {}, which {} does not; there are: {}",
                                       robot.file.string(), bad, map.file.string(), fmt::join(names, ", ")));
  }
  return wanted;
}

/// Pixels of `image` as vision sees them, without a copy where they are rgb already. `converted` owns what had to be.
Result<cv::Mat> as_rgb(const Image& image, cv::Size wanted, const char* view, Image& converted) {
  if (image.width_px != wanted.width || image.height_px != wanted.height) {
    return Error{ErrorCode::kBadData, fmt::format("the {} picture has {} x {} pixels, the robot file says {} x {}",
                                                  view, image.width_px, image.height_px, wanted.width, wanted.height)};
  }
  if (image.format == PixelFormat::kRgb8 && image.bytes.size() == 3 * std::size_t(wanted.area())) {
    // cv::Mat has no read-only form; vision takes it as const.
    return cv::Mat(wanted, CV_8UC3, const_cast<std::uint8_t*>(image.bytes.data()));
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
    case Method::kFull:
      return "full";
  }
  assert(false);
  return "";
}

std::vector<std::string> method_names() {
  return {std::string(to_string(Method::kPaper)), std::string(to_string(Method::kFull))};
}

Method method_named(std::string_view name) {
  for (const Method method : {Method::kPaper, Method::kFull}) {
    if (name == to_string(method)) return method;
  }
  throw std::invalid_argument(fmt::format("no method '{}'; there are: {}", name, fmt::join(method_names(), ", ")));
}

double steady_time_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

Estimator::Estimator(Method method, const files::Robot& robot, const files::Map& map, std::function<double()> clock_s)
    : landmarks_m_(files::to_landmark_positions(map)),
      bounds_(map.bounds),
      lower_size_(robot.lower.width_px, robot.lower.height_px),
      upper_size_(robot.upper.width_px, robot.upper.height_px),
      centres_px_{Eigen::Vector2d(robot.rig.lower.centre_px[0], robot.rig.lower.centre_px[1]),
                  Eigen::Vector2d(robot.rig.upper.centre_px[0], robot.rig.upper.centre_px[1])},
      keys_(robot.estimator),
      stage_(stage_of(robot)),
      clock_s_(std::move(clock_s)),
      wanted_(wanted_of(robot, map)),
      ranging_(make_ranging(method, robot, map, lower_size_, upper_size_, wanted_)) {
  if (!wanted_.empty()) return;
  wanted_.resize(map.landmarks.size());
  std::iota(wanted_.begin(), wanted_.end(), std::size_t(0));
}

void Estimator::answer_by_paper(const vision::PaperRanging& ranging, const cv::Mat& lower, const cv::Mat& upper,
                                FrameAnswer& answer) const {
  const double begin_s = thread_time_s();
  answer.ranges = ranging.measure(lower, upper);
  const double ranged_s = thread_time_s();
  answer.fix = fix_of_paper(answer.ranges, landmarks_m_);
  answer.effort.vision_s = ranged_s - begin_s;
  answer.effort.localisation_s = thread_time_s() - ranged_s;
}

void Estimator::answer_by_full(const vision::FullRanging& ranging, const cv::Mat& lower, const cv::Mat& upper,
                               double begin_s, FrameAnswer& answer) const {
  const double begin_cpu_s = thread_time_s();
  vision::Looking looking = ranging.look(lower, upper);
  if (stage_) {
    looking.take(wanted_, *stage_);
    answer.ranges = looking.measurements();
    const double ranged_s = thread_time_s();
    answer.fix = fix_of_full(answer.ranges, landmarks_m_, keys_.bearings);
    answer.effort.localisation_s = thread_time_s() - ranged_s;
  } else {
    const Adaptive adaptive(landmarks_m_, centres_px_, {keys_.bearings, keys_.enough_m, keys_.budget_s}, clock_s_,
                            begin_s);
    Adaptive::Answer refined = adaptive.run(looking);
    answer.ranges = std::move(refined.ranges);
    answer.fix = std::move(refined.fix);
    answer.effort.localisation_s = refined.localisation_s;
  }
  check_bounds(bounds_, answer.fix);
  answer.effort.vision_s = thread_time_s() - begin_cpu_s - answer.effort.localisation_s;
  answer.effort.refined = looking.refined();
}

Result<FrameAnswer> Estimator::answer(const Image& lower, const Image& upper) const {
  Image lower_rgb;
  Image upper_rgb;
  const auto below = as_rgb(lower, lower_size_, "lower", lower_rgb);
  if (!below) return below.error();
  const auto above = as_rgb(upper, upper_size_, "upper", upper_rgb);
  if (!above) return above.error();

  FrameAnswer answer;
  const double begin_s = clock_s_();
  if (const auto* paper = std::get_if<vision::PaperRanging>(&ranging_)) {
    answer_by_paper(*paper, *below, *above, answer);
  } else {
    answer_by_full(std::get<vision::FullRanging>(ranging_), *below, *above, begin_s, answer);
  }
  answer.effort.wall_s = clock_s_() - begin_s;
  const bool is_bound = std::holds_alternative<vision::FullRanging>(ranging_) && !stage_ && keys_.budget_s;
  answer.effort.is_over_budget = is_bound && answer.effort.wall_s > *keys_.budget_s;
  return answer;
}

namespace {

void add_sighting(std::uint64_t frame, double t_s, const std::string& landmark, const char* view,
                  const std::optional<vision::Sighting>& sighting, std::vector<SightingRow>& rows) {
  if (!sighting) return;
  const Eigen::Matrix2d& covariance = sighting->covariance_px2;
  rows.push_back({frame, t_s, landmark, view, sighting->pixel_px.x(), sighting->pixel_px.y(), covariance(0, 0),
                  covariance(0, 1), covariance(1, 1), sighting->edge_noise_px});
}

}  // namespace

AnswerRows to_rows(std::uint64_t frame, double t_s, const FrameAnswer& answer, const files::Map& map,
                   const PoseRow* truth) {
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
    add_sighting(frame, t_s, landmark.name, "lower", m.lower_sighting, rows.sightings);
    add_sighting(frame, t_s, landmark.name, "upper", m.upper_sighting, rows.sightings);
  }

  const localisation::Fix& fix = answer.fix;
  FixRow row;
  row.frame = frame;
  row.t_s = t_s;
  row.verdict = to_string(fix.verdict);
  for (const int index : fix.outliers) row.outliers.push_back(map.landmarks.at(std::size_t(index)).name);
  if (fix.unseen_direction) {
    row.unseen_x = fix.unseen_direction->x();
    row.unseen_y = fix.unseen_direction->y();
    row.unseen_heading = fix.unseen_direction->z();
  }
  if (truth) {
    row.true_x_m = truth->x_m;
    row.true_y_m = truth->y_m;
  }
  for (const auto& [position, heading_rad, covariance] :
       {std::tie(fix.position_m, fix.heading_rad, fix.covariance),
        std::tie(fix.other_position_m, fix.other_heading_rad, fix.other_covariance)}) {
    if (!position) continue;
    row.heading_rad = heading_rad;
    if (covariance) {
      row.var_x_m2 = (*covariance)(0, 0);
      row.cov_xy_m2 = (*covariance)(0, 1);
      row.var_y_m2 = (*covariance)(1, 1);
    } else {
      row.var_x_m2 = row.cov_xy_m2 = row.var_y_m2 = std::nullopt;
    }
    // A fix without a heading has no variance of one either.
    if (covariance && heading_rad) {
      row.cov_x_heading_m_rad = (*covariance)(0, 2);
      row.cov_y_heading_m_rad = (*covariance)(1, 2);
      row.var_heading_rad2 = (*covariance)(2, 2);
    } else {
      row.cov_x_heading_m_rad = row.cov_y_heading_m_rad = row.var_heading_rad2 = std::nullopt;
    }
    row.x_m = position->x();
    row.y_m = position->y();
    // What is no answer has no error either.
    if (truth && fix.verdict != localisation::FixVerdict::kOutOfBounds)
      row.error_m = std::hypot(position->x() - truth->x_m, position->y() - truth->y_m);
    rows.fixes.push_back(row);
  }
  if (rows.fixes.empty()) rows.fixes.push_back(row);
  return rows;
}

}  // namespace twocone::runs
