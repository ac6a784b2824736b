// SPDX-License-Identifier: Apache-2.0
#include "apps/estimation/mapping.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>
#include <Eigen/Geometry>

#include "apps/config/yaml/text_file.h"
#include "apps/estimation/image_as_mat.h"
#include "localisation/odometry.h"
#include "vision/alike_radii.h"
#include "vision/hue_labels.h"

namespace twocone::estimation {
namespace {

// Landmarks that so many frames have shown are settled. Bands take longer: a screen, or a shelf, may be read as a
// number from where the robot is for a moment. So does what appears when the first kStart frames are over: it may be
// somebody who walks in.
constexpr std::size_t kSettled = 6;
constexpr std::size_t kSettledBands = 15;
constexpr std::size_t kStart = 30;
constexpr std::size_t kSettledLate = 45;
// The outlines are measured with tops, radii and their sigmas of this number of frames ago, or newer ones.
constexpr std::size_t kRenewedEvery = 15;
// Two things of one hue within this share of their range, or this far, are one.
constexpr double kSameShare = 0.25;
constexpr double kSame_m = 0.5;
// So are two whose edges are this close to each other, seen from the robot: a part of a landmark that stands behind
// something gives a wrong range.
constexpr double kSameDirection_rad = 0.03;
// Outlines of one landmark share an error over many frames: its light, and what is beside it. So one frame counts less
// than its noise alone says.
constexpr double kSharedError_px = 0.15;
// A landmark that so many frames have shown is not measured roughly any more.
constexpr std::size_t kWellKnown = 40;
// A width has two errors besides its noise. The brightness beside the landmark causes the first. Blur causes the
// second: kBlur_px2 over the width, since blur widens narrow landmarks most.
constexpr double kWidthError_px = 0.4;
constexpr double kBlur_px2 = 2;
// The frames of a drive share these errors. So this number of frames counts as one, and no width improves a radius that
// is known better than the errors allow.
constexpr double kWidthFrames = 30;
// A landmark is near within this share of the greatest range at which it was seen. One that was seen in n frames is
// removed when it was near, inside a view, and not seen in this number of frames and in kPatience n: it may stand
// behind an obstacle for long. What is not settled is removed when it was not seen for kPatienceUnsettled frames, near
// or not.
constexpr double kNearShare = 0.7;
constexpr std::size_t kLeastPatience = 150;
constexpr std::size_t kPatience = 5;
constexpr std::size_t kPatienceUnsettled = 60;
// A landmark that was contradicted in so many frames, and as often as it was seen, is removed.
constexpr std::size_t kContradicted = 45;
// One is found again if more than half of its widths, of so many or more, turn out to be those of a part of it.
constexpr std::size_t kLeastWidths = 20;
// A landmark's radius is compared with those of the others, once, when so many frames have shown it: ten seconds, in
// which the robot has seen most landmarks from several sides.
constexpr std::size_t kCompared = 150;
// Thinner things are edges between colours.
constexpr double kLeastRadius_m = 0.003;

// Relative standard deviation of each wheel's travel, on any floor. On a known map the fixes correct a slip; here the
// first landmarks take it over.
constexpr double kSlip = 0.02;

/// Counts the widths of a landmark in the views that show it, and returns whether one is that of a part of it.
bool is_hidden_in_part(const vision::RoughLandmark& thing, vision::UnhiddenWidth& unhidden) {
  bool is_hidden = false;
  for (std::size_t side = 0; side < thing.views.size(); ++side) {
    const auto& width = thing.views[side].width;
    if (!thing.is_shown[side] || !width) continue;
    unhidden.add(*width, thing.radius_m);
    if (unhidden.is_hidden(*width, thing.radius_m)) is_hidden = true;
  }
  return is_hidden;
}

/// Measures the radius by the widths of the outlines in the views, where they have them.
/// @param known_sigma_m standard deviation of what is known of it
void measure_radius(double known_sigma_m, vision::RoughLandmark& thing) {
  double sum = 0;
  double weights = 0;
  for (std::size_t side = 0; side < thing.views.size(); ++side) {
    if (!thing.is_shown[side] || !thing.views[side].width) continue;
    const vision::OutlineWidth& width = *thing.views[side].width;
    if (!(width.expected_px > 0)) continue;
    const double share_sigma =
        std::hypot(width.sigma_px, kWidthError_px, kBlur_px2 / width.expected_px) / width.expected_px;
    sum += width.seen_px / width.expected_px / (share_sigma * share_sigma);
    weights += 1 / (share_sigma * share_sigma);
  }
  if (!(weights > 0) || !(sum > 0) || known_sigma_m * std::sqrt(weights) < thing.radius_m) return;
  thing.radius_sigma_m = std::sqrt(kWidthFrames / weights) * thing.radius_m;
  thing.radius_m *= sum / weights;
}

/// Returns the place of a thing, body frame.
Eigen::Vector2d place_of(const vision::RoughLandmark& thing) {
  return {thing.range_m * std::cos(thing.bearing_rad), thing.range_m * std::sin(thing.bearing_rad)};
}

/// Returns whether a thing may stand at a place, body frame.
bool is_at(const vision::RoughLandmark& thing, const Eigen::Vector2d& place_m) {
  return (place_m - place_of(thing)).norm() < std::max(kSame_m, kSameShare * thing.range_m);
}

vision::Rig rig_of(const config::Robot& robot) {
  try {
    return config::to_rig(robot);
  } catch (const std::invalid_argument& error) {
    throw config::FileError("{}: {}", robot.file.string(), error.what());
  }
}

}  // namespace

config::Map without_landmarks(config::Map map) {
  map.landmarks.clear();
  map.without_sigma.clear();
  return map;
}

Mapping::Mapping(const config::Robot& robot, const config::Map& map)
    : robot_(robot),
      map_(without_landmarks(map)),
      rig_(rig_of(robot)),
      errors_(config::to_belief_errors(robot, map_).vision),
      lower_size_(robot.lower.settings.width_px, robot.lower.settings.height_px),
      upper_size_(robot.upper.settings.width_px, robot.upper.settings.height_px),
      filter_(rig_, errors_, config::to_wheels(robot), {.slip = kSlip}, config::to_belief_errors(robot, map_).wheels,
              config::to_start_pose(robot)) {
  robot_.estimator.landmarks.clear();
}

void Mapping::find_hues(const cv::Mat& lower, const cv::Mat& upper) {
  const auto image = [](const cv::Mat& rgb, const vision::MirrorView& view) -> vision::MirrorImage {
    return {rgb, view.settings().centre_px, view.settings().rim_radius_px};
  };
  const std::size_t before = colours_.size();
  for (const Eigen::Vector3d& colour : vision::find_hues({image(lower, rig_.lower), image(upper, rig_.upper)})) {
    const auto is_known = [&](const Eigen::Vector3d& known) {
      return vision::hue_distance_rad({known.x(), known.y(), known.z()}, {colour.x(), colour.y(), colour.z()}) <
             vision::HueLabels::kHueWindow_rad;
    };
    if (std::ranges::none_of(colours_, is_known)) colours_.push_back(colour);
  }
  if (colours_.size() == before && search_) return;
  search_.emplace(rig_, colours_, lower_size_, upper_size_, errors_);
}

MappedLandmark Mapping::landmark(std::size_t index) const {
  const localisation::FoundLandmark found = filter_.landmark(index);
  const Eigen::Vector4d sigma = found.covariance.diagonal().cwiseMax(0).cwiseSqrt();
  Landmark landmark = vision::looking_like(found.hue, colours_);
  landmark.name = follows_[index].name;
  landmark.x_m = found.numbers[vision::kPlaceX];
  landmark.y_m = found.numbers[vision::kPlaceY];
  landmark.radius_m = found.numbers[vision::kRadius];
  landmark.top_m = found.numbers[vision::kTop];
  landmark.sigma = {sigma[vision::kPlaceX], sigma[vision::kPlaceY], sigma[vision::kTop], sigma[vision::kRadius]};
  return {.name = follows_[index].name,
          .landmark = std::move(landmark),
          .place_m2 = found.covariance.topLeftCorner<2, 2>(),
          .sightings = found.sightings};
}

bool Mapping::is_settled(const localisation::FoundLandmark& landmark) {
  if (landmark.first_frame > kStart) return landmark.sightings >= kSettledLate;
  return landmark.sightings >= (landmark.hue >= vision::kBandedHue ? kSettledBands : kSettled);
}

std::vector<std::size_t> Mapping::settled() const {
  std::vector<std::size_t> settled;
  for (std::size_t i = 0; i < filter_.size(); ++i) {
    if (is_settled(filter_.landmark(i))) settled.push_back(i);
  }
  return settled;
}

std::vector<MappedLandmark> Mapping::landmarks() const {
  std::vector<MappedLandmark> landmarks;
  for (const std::size_t i : settled()) landmarks.push_back(landmark(i));
  return landmarks;
}

void Mapping::renew_ranging() {
  std::vector<std::size_t> now = settled();
  if (now == ranged_ && ranging_ && filter_.frames() < ranging_since_ + kRenewedEvery) return;
  ranged_ = std::move(now);
  ranging_since_ = filter_.frames();
  ranging_.reset();
  if (ranged_.empty()) return;
  map_.landmarks.clear();
  for (const std::size_t i : ranged_) map_.landmarks.push_back(landmark(i).landmark);
  ranging_.emplace(rig_, config::to_targets(map_), lower_size_, upper_size_, std::vector<std::size_t>(),
                   config::to_belief_errors(robot_, map_).vision);
}

std::vector<vision::RoughLandmark> Mapping::measured(const cv::Mat& lower, const cv::Mat& upper,
                                                     const std::optional<vision::FrameMotion>& motion) {
  std::vector<vision::RoughLandmark> things;
  if (!ranging_) return things;
  const localisation::Pose pose = filter_.pose().pose;
  vision::ExpectedPlaces expected;
  for (const std::size_t i : ranged_) {
    expected.emplace_back(localisation::in_body(pose, filter_.landmark(i).numbers.head<2>()));
  }
  const auto measurements = ranging_->measure(lower, upper, motion, expected);
  for (std::size_t k = 0; k < measurements.size(); ++k) {
    const vision::RangeMeasurement& m = measurements[k];
    const bool is_measured = m.verdict == vision::RangeVerdict::kOk || m.verdict == vision::RangeVerdict::kOneView;
    if (!is_measured || !m.range_m || !m.bearing_rad) continue;
    const localisation::FoundLandmark known = filter_.landmark(ranged_[k]);
    vision::RoughLandmark thing{
        .hue = known.hue,
        .views = {m.lower_sighting.value_or(vision::Sighting{}), m.upper_sighting.value_or(vision::Sighting{})},
        .is_shown = {m.lower_sighting.has_value(), m.upper_sighting.has_value()},
        .range_m = *m.range_m,
        .bearing_rad = *m.bearing_rad,
        .top_m = map_.landmarks[k].top_m,
        // The width is that of the radius with which the outline was made.
        .radius_m = map_.landmarks[k].radius_m};
    Follow& follow = follows_[ranged_[k]];
    const std::size_t before = follow.width.count();
    follow.is_hidden = is_hidden_in_part(thing, follow.width);
    if (follow.is_hidden) {
      follow.left_out += follow.width.count() - before;
      continue;
    }
    measure_radius(std::sqrt(known.covariance(vision::kRadius, vision::kRadius)), thing);
    const Landmark there{.radius_m = thing.radius_m, .top_m = thing.top_m};
    for (const vision::Side side : {vision::Side::kLower, vision::Side::kUpper}) {
      vision::Sighting& seen = thing.views[std::size_t(side)];
      seen.covariance_px2 += kSharedError_px * kSharedError_px * Eigen::Matrix2d::Identity();
      if (!motion) continue;
      const auto& [stamp_late_s, readout_s] = rig_.exposures[std::size_t(side)];
      const cv::Size& size = side == vision::Side::kLower ? lower_size_ : upper_size_;
      const double late_s = (side == vision::Side::kUpper ? motion->upper_later_s : 0) + stamp_late_s +
                            vision::readout_share(seen, size.height) * readout_s;
      seen.pixel_px = vision::pixel_at_frame(of_view(rig_, side), seen.pixel_px, there, motion->twist, late_s);
    }
    things.push_back(thing);
  }
  return things;
}

bool Mapping::is_known(const vision::RoughLandmark& thing, const std::vector<vision::RoughLandmark>& measured) const {
  const localisation::Pose pose = filter_.pose().pose;
  const auto is_here = [&](std::size_t i) {
    const localisation::FoundLandmark known = filter_.landmark(i);
    if (known.hue != thing.hue || (known.sightings < kWellKnown && !follows_[i].is_hidden)) return false;
    const Eigen::Vector2d place_m = localisation::in_body(pose, known.numbers.head<2>());
    const double turn_rad = localisation::wrap_angle_rad(std::atan2(place_m.y(), place_m.x()) - thing.bearing_rad);
    const double halves_rad =
        std::atan2(known.numbers[vision::kRadius], place_m.norm()) + std::atan2(thing.radius_m, thing.range_m);
    return is_at(thing, place_m) || std::abs(turn_rad) < halves_rad + kSameDirection_rad;
  };
  const auto is_same = [&](const vision::RoughLandmark& other) {
    return other.hue == thing.hue && is_at(thing, place_of(other));
  };
  return std::ranges::any_of(measured, is_same) || std::ranges::any_of(ranged_, is_here);
}

void Mapping::note_presence(const vision::RoughLandmark& thing) {
  const localisation::Pose pose = filter_.pose().pose;
  for (const std::size_t i : ranged_) {
    const localisation::FoundLandmark known = filter_.landmark(i);
    if (known.hue != thing.hue) continue;
    if (is_at(thing, localisation::in_body(pose, known.numbers.head<2>()))) follows_[i].is_there = true;
  }
}

void Mapping::go_by_bands() {
  if (has_bands_) return;
  const auto is_banded = [&](std::size_t i) { return filter_.landmark(i).hue >= vision::kBandedHue; };
  if (std::size_t(std::ranges::count_if(settled(), is_banded)) < vision::kBandsAlone) return;
  has_bands_ = true;
  for (std::size_t i = filter_.size(); i-- > 0;) {
    if (is_banded(i)) continue;
    filter_.remove(i);
    follows_.erase(follows_.begin() + std::ptrdiff_t(i));
  }
  ranging_.reset();
  ranged_.clear();
  search_.emplace(rig_, std::vector<Eigen::Vector3d>(), lower_size_, upper_size_, errors_);
}

void Mapping::follow() {
  follows_.resize(filter_.size());
  for (const std::size_t i : settled()) {
    std::string& name = follows_[i].name;
    if (!name.empty()) continue;
    const Landmark looks = vision::looking_like(filter_.landmark(i).hue, colours_);
    name = vision::looks_of(looks);
    if (!looks.bands) name += fmt::format(".{}", ++numbers_[name]);
  }
  const localisation::Pose pose = filter_.pose().pose;
  for (std::size_t i = filter_.size(); i-- > 0;) {
    const localisation::FoundLandmark known = filter_.landmark(i);
    const double range_m = localisation::in_body(pose, known.numbers.head<2>()).norm();
    Follow& follow = follows_[i];
    const std::size_t unseen = filter_.frames() - known.last_frame;
    if (unseen == 0) {
      follow.farthest_m = std::max(follow.farthest_m, range_m);
    } else if (follow.is_there) {
      ++follow.contradicted;
    } else if (range_m < kNearShare * follow.farthest_m && filter_.is_in_view(i)) {
      ++follow.missed;
    }
    follow.is_hidden = follow.is_there = false;
    const bool is_contradicted = follow.contradicted >= std::max(kContradicted, known.sightings);
    const std::size_t taken = follow.width.count() - follow.left_out;
    const bool was_hidden = taken >= kLeastWidths && follow.width.narrow_count() > follow.left_out + taken / 2;
    const bool is_missed = is_settled(known) ? follow.missed >= std::max(kLeastPatience, kPatience * known.sightings)
                                             : unseen >= kPatienceUnsettled;
    const bool is_edge = known.numbers[vision::kRadius] < kLeastRadius_m;
    if (!is_missed && !is_contradicted && !was_hidden && !is_edge) continue;
    filter_.remove(i);
    follows_.erase(follows_.begin() + std::ptrdiff_t(i));
  }
}

void Mapping::compare_radii() {
  const auto radius_of = [&](std::size_t i) -> vision::LogRadius {
    const localisation::FoundLandmark known = filter_.landmark(i);
    const double radius_m = known.numbers[vision::kRadius];
    return {std::log(radius_m), known.covariance(vision::kRadius, vision::kRadius) / (radius_m * radius_m)};
  };
  const std::vector<std::size_t> all = settled();
  std::vector<vision::LogRadius> radii;
  for (std::size_t k = 0; k < all.size(); ++k) {
    Follow& follow = follows_[all[k]];
    if (follow.is_compared || filter_.landmark(all[k]).sightings < kCompared) continue;
    follow.is_compared = true;
    if (radii.empty()) std::ranges::transform(all, std::back_inserter(radii), radius_of);
    const auto others = vision::as_the_others(radii, k);
    if (!others) continue;
    const double radius_m = std::exp(others->mean);
    filter_.update_radius(all[k], radius_m, radius_m * std::sqrt(others->variance));
  }
}

Result<MappedFrame> Mapping::answer(const Image& lower, const Image& upper,
                                    const std::optional<vision::FrameMotion>& motion, double t_s, double left_rad,
                                    double right_rad) {
  const double begin_s = steady_time_s();
  const double begin_cpu_s = thread_time_s();
  Image lower_rgb;
  Image upper_rgb;
  const auto below = as_rgb(lower, lower_size_, "lower", lower_rgb);
  if (!below) return below.error();
  const auto above = as_rgb(upper, upper_size_, "upper", upper_rgb);
  if (!above) return above.error();
  filter_.predict(t_s, left_rad, right_rad);
  if (filter_.frames() % kHuesEvery == 0 && !has_bands_) find_hues(*below, *above);
  renew_ranging();
  std::vector<vision::RoughLandmark> things = measured(*below, *above, motion);
  for (vision::RoughLandmark& thing : search_->look(*below, *above, motion)) {
    note_presence(thing);
    if (is_known(thing, things)) continue;
    // The error of a rough place is that of the search, which frames share: so many count as one.
    for (vision::Sighting& seen : thing.views) seen.covariance_px2 *= double(kSettled);
    things.push_back(std::move(thing));
  }
  MappedFrame frame;
  frame.timing.vision_s = thread_time_s() - begin_cpu_s;
  (void)filter_.observe(things);
  follow();
  compare_radii();
  go_by_bands();
  const localisation::PoseEstimate pose = filter_.pose();
  frame.track = {.use = things.empty() ? localisation::FixUse::kNoFix : localisation::FixUse::kTaken,
                 .state = localisation::FilterState::kTracking,
                 .position_m = Eigen::Vector2d(pose.pose.x_m, pose.pose.y_m),
                 .heading_rad = pose.pose.heading_rad,
                 .covariance = pose.covariance};
  frame.timing.localisation_s = thread_time_s() - begin_cpu_s - frame.timing.vision_s;
  frame.timing.wall_s = steady_time_s() - begin_s;
  frame.timing.refined = int(ranged_.size());
  return frame;
}

}  // namespace twocone::estimation
