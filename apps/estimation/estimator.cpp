// SPDX-License-Identifier: Apache-2.0
#include "apps/estimation/estimator.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "apps/config/to_layers.h"
#include "apps/config/yaml/text_file.h"
#include "apps/estimation/image_as_mat.h"
#include "localisation/paper_trilateration.h"

namespace twocone::estimation {
namespace {

using Ranging = std::variant<vision::PaperRanging, vision::OutlineRanging>;

Ranging make_ranging(Method method, const config::Robot& robot, const config::Map& map, cv::Size lower, cv::Size upper,
                     const std::vector<std::size_t>& wanted, const vision::BeliefErrors& errors) {
  try {
    const vision::Rig rig = config::to_rig(robot);
    const std::vector<Landmark> targets = config::to_targets(map);
    if (method == Method::kPaper) return vision::PaperRanging(rig, targets, lower, upper, wanted);
    return vision::OutlineRanging(rig, targets, lower, upper, wanted, errors);
  } catch (const std::invalid_argument& error) {
    throw config::FileError("{} with {}: {}", robot.file.string(), map.file.string(), error.what());
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

/// Returns the stage in the robot file, or nothing for `adaptive`.
std::optional<vision::Stage> stage_of(const config::Robot& robot) {
  const std::string& name = robot.estimator.stage;
  if (name == kAdaptive) return std::nullopt;
  for (const vision::Stage stage : {vision::Stage::kFound, vision::Stage::kCoarse, vision::Stage::kFine}) {
    if (name == to_string(stage)) return stage;
  }
  throw config::FileError("{}: estimator.stage is '{}', must be found, coarse, fine or {}", robot.file.string(), name,
                          kAdaptive);
}

/// Returns the indices of the landmarks to look for, or an empty list for all.
std::vector<std::size_t> wanted_of(const config::Robot& robot, const config::Map& map) {
  std::vector<std::string> names;
  for (const config::Landmark& landmark : map.landmarks) names.push_back(landmark.name);
  std::vector<std::size_t> wanted;
  std::vector<std::string> unknown;
  for (const std::string& name : robot.estimator.landmarks) {
    const auto at = std::find(names.begin(), names.end(), name);
    if (at == names.end()) {
      unknown.push_back(fmt::format("'{}'", name));
    } else {
      wanted.push_back(std::size_t(at - names.begin()));
    }
  }
  if (unknown.empty()) return wanted;
  throw config::FileError("{}: estimator.landmarks has {}, which {} does not; there are: {}", robot.file.string(),
                          fmt::join(unknown, ", "), map.file.string(), fmt::join(names, ", "));
}

bool is_outside(const config::Bounds& bounds, const std::optional<Eigen::Vector2d>& position_m,
                const std::optional<Eigen::Matrix3d>& covariance) {
  if (!position_m || !covariance) return false;
  const Eigen::Vector2d nearest_m(std::clamp(position_m->x(), bounds.min_x_m, bounds.max_x_m),
                                  std::clamp(position_m->y(), bounds.min_y_m, bounds.max_y_m));
  const Eigen::Vector2d out_m = *position_m - nearest_m;
  const double distance_m = out_m.norm();
  if (distance_m == 0) return false;
  const Eigen::Vector2d normal = out_m / distance_m;
  return distance_m > kOutsideSigmas * std::sqrt(normal.dot(covariance->topLeftCorner<2, 2>() * normal));
}

}  // namespace

double steady_time_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

Estimator::Estimator(Method method, const config::Robot& robot, const config::Map& map, std::function<double()> clock_s)
    : landmarks_m_(config::to_landmark_positions(map)),
      belief_errors_(config::to_belief_errors(robot, map)),
      bounds_(map.bounds),
      lower_size_(robot.lower.settings.width_px, robot.lower.settings.height_px),
      upper_size_(robot.upper.settings.width_px, robot.upper.settings.height_px),
      centres_px_{Eigen::Vector2d(robot.rig.lower.centre_px[0], robot.rig.lower.centre_px[1]),
                  Eigen::Vector2d(robot.rig.upper.centre_px[0], robot.rig.upper.centre_px[1])},
      keys_(robot.estimator),
      stage_(stage_of(robot)),
      clock_s_(std::move(clock_s)),
      wanted_(wanted_of(robot, map)),
      ranging_(make_ranging(method, robot, map, lower_size_, upper_size_, wanted_, belief_errors_.vision)) {
  if (keys_.plan && method == Method::kOutline) scanner_.emplace(robot, map);
  if (!wanted_.empty()) return;
  wanted_.resize(map.landmarks.size());
  std::iota(wanted_.begin(), wanted_.end(), std::size_t(0));
}

FrameAnswer Estimator::answer_by_outline(const vision::OutlineRanging& ranging, const cv::Mat& lower,
                                         const cv::Mat& upper, const std::optional<vision::FrameMotion>& motion,
                                         double begin_s) const {
  FrameAnswer answer;
  vision::FrameObservation observation = ranging.look(lower, upper, motion);
  if (stage_) {
    observation.take(wanted_, *stage_);
    answer.ranges = observation.measurements();
    const double ranged_s = thread_time_s();
    answer.fix = fix_of_outline(answer.ranges, landmarks_m_, keys_.bearings, belief_errors_.places);
    answer.timing.localisation_s = thread_time_s() - ranged_s;
  } else {
    answer = refine_adaptively(observation, landmarks_m_, belief_errors_.places, centres_px_, keys_, clock_s_, begin_s);
  }
  check_bounds(bounds_, answer.fix);
  answer.timing.refined = observation.refined();
  return answer;
}

Result<FrameAnswer> Estimator::answer(const Image& lower, const Image& upper,
                                      const std::optional<vision::FrameMotion>& motion) const {
  Image lower_rgb;
  Image upper_rgb;
  const auto below = as_rgb(lower, lower_size_, "lower", lower_rgb);
  if (!below) return below.error();
  const auto above = as_rgb(upper, upper_size_, "upper", upper_rgb);
  if (!above) return above.error();

  FrameAnswer answer;
  const double begin_s = clock_s_();
  const double begin_cpu_s = thread_time_s();
  if (const auto* paper = std::get_if<vision::PaperRanging>(&ranging_)) {
    answer.ranges = paper->measure(*below, *above);
    const double ranged_s = thread_time_s();
    answer.fix = fix_of_paper(answer.ranges, landmarks_m_);
    answer.timing.localisation_s = thread_time_s() - ranged_s;
  } else {
    answer = answer_by_outline(std::get<vision::OutlineRanging>(ranging_), *below, *above, motion, begin_s);
  }
  if (scanner_) answer.scan = scanner_->scan(*below, *above);
  answer.timing.vision_s = thread_time_s() - begin_cpu_s - answer.timing.localisation_s;
  answer.timing.wall_s = clock_s_() - begin_s;
  const bool is_bound = std::holds_alternative<vision::OutlineRanging>(ranging_) && !stage_ && keys_.budget_s;
  answer.timing.is_over_budget = is_bound && answer.timing.wall_s > *keys_.budget_s;
  return answer;
}

void check_bounds(const config::Bounds& bounds, localisation::Fix& fix) {
  using localisation::FixVerdict;
  if (fix.verdict != FixVerdict::kOk && fix.verdict != FixVerdict::kAmbiguous) return;
  const bool is_ambiguous = fix.verdict == FixVerdict::kAmbiguous;
  const bool is_first_out = is_outside(bounds, fix.position_m, fix.covariance);
  const bool is_other_out = is_ambiguous && is_outside(bounds, fix.other_position_m, fix.other_covariance);
  if (!is_first_out && !is_other_out) return;
  if (is_ambiguous && is_first_out != is_other_out) {
    fix.verdict = FixVerdict::kOk;
    if (is_first_out) {
      fix.position_m = fix.other_position_m;
      fix.heading_rad = fix.other_heading_rad;
      fix.covariance = fix.other_covariance;
    }
  } else {
    fix.verdict = FixVerdict::kOutOfBounds;
  }
  fix.other_position_m.reset();
  fix.other_heading_rad.reset();
  fix.other_covariance.reset();
}

}  // namespace twocone::estimation
