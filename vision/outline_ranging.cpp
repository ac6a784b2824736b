// SPDX-License-Identifier: Apache-2.0
#include "vision/outline_ranging.h"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>

#include "base/errors.h"
#include "base/plane.h"
#include "vision/bands/band_code.h"
#include "vision/method_arguments.h"
#include "vision/outline/ranging_impl.h"

namespace twocone::vision {
namespace {

void check(const std::vector<Landmark>& targets, cv::Size lower, cv::Size upper) {
  base::Complaints bad;
  check_sizes(bad, lower, upper);
  for (const Landmark& target : targets) {
    check_radius(bad, target);
    bad.require(base::is_positive(target.top_m), "top of '{}' is {} m, must be > 0", target.name, target.top_m);
    if (target.bands &&
        (target.bands->number < 1 || target.bands->number > kBandNumbers || !base::is_positive(target.bands->cell_m))) {
      bad.add("bands of '{}' have number {} and cells of {} m, must be 1 to {} and > 0", target.name,
              target.bands->number, target.bands->cell_m, kBandNumbers);
    }
    if (target.greatest_range_m && !(*target.greatest_range_m > target.radius_m)) {
      bad.add("greatest range of '{}' is {} m, must be > its radius, {} m", target.name, *target.greatest_range_m,
              target.radius_m);
    }
  }
  bad.raise("method outline");
}

constexpr std::size_t kNoHue = std::numeric_limits<std::size_t>::max();

/// Returns for each target the index of its colour among the distinct ones; kNoHue of a banded one.
std::vector<std::size_t> hues_of(const std::vector<Landmark>& targets) {
  std::vector<std::size_t> hues;
  std::size_t distinct = 0;
  for (std::size_t k = 0; k < targets.size(); ++k) {
    if (targets[k].bands) {
      hues.push_back(kNoHue);
      continue;
    }
    const auto same = std::find_if(targets.begin(), targets.begin() + std::ptrdiff_t(k), [&](const Landmark& other) {
      return !other.bands && other.colour == targets[k].colour;
    });
    const auto first = std::size_t(same - targets.begin());
    hues.push_back(first == k ? distinct++ : hues[first]);
  }
  return hues;
}

std::vector<Eigen::Vector3d> distinct_colours(const std::vector<Landmark>& targets,
                                              const std::vector<std::size_t>& hues) {
  std::vector<Eigen::Vector3d> colours;
  for (std::size_t k = 0; k < targets.size(); ++k) {
    if (hues[k] == colours.size()) colours.emplace_back(targets[k].colour.data());
  }
  return colours;
}

}  // namespace

std::string_view to_string(Stage stage) {
  constexpr std::array<std::string_view, 3> kNames{"found", "coarse", "fine"};
  static_assert(std::size_t(Stage::kFine) + 1 == kNames.size());
  return kNames.at(std::size_t(stage));
}

OutlineRanging::Impl::Impl(const Rig& the_rig, const std::vector<Landmark>& all, cv::Size lower_size,
                           cv::Size upper_size, const std::vector<std::size_t>& which, const BeliefErrors& errors)
    : belief(the_rig, errors.rig),
      times(errors.times),
      sighting_px(errors.sighting_px),
      by_shared(errors.landmarks.empty() ? std::vector<BySharedErrors<kLandmarkNumbers>>(all.size())
                                         : errors.landmarks),
      targets(all),
      hues(hues_of(all)),
      table(distinct_colours(all, hues)),
      views{ViewFitter(belief.rig().lower, lower_size, table), ViewFitter(belief.rig().upper, upper_size, table)},
      wanted(all.size(), which.empty()),
      wanted_hues(table.size(), which.empty()) {
  check(targets, lower_size, upper_size);
  if (by_shared.size() != targets.size()) {
    throw base::InvalidArgument("method outline: errors of {} landmarks, must be of {}", by_shared.size(),
                                targets.size());
  }
  for (const std::size_t k : which) {
    wanted.at(k) = true;
    if (hues[k] != kNoHue) wanted_hues[hues[k]] = true;
  }
  const auto is_banded = [](const Landmark& target) { return target.bands.has_value(); };
  if (std::ranges::any_of(targets, is_banded)) {
    for (const Side side : {Side::kLower, Side::kUpper}) {
      band_finders.emplace_back(of_view(belief.rig(), side), views[std::size_t(side)].size());
    }
  }
  for (const Landmark& target : targets) {
    least_px.push_back({least_area_px(belief.rig().lower, target), least_area_px(belief.rig().upper, target)});
  }
}

double OutlineRanging::Impl::late_s(std::size_t view, const Sighting& seen, const FrameMotion& motion) const {
  const auto& [stamp_late_s, readout_s] = belief.rig().exposures[view];
  return (view == 1 ? motion.upper_later_s : 0) + stamp_late_s + share(view, seen) * readout_s;
}

Triangulation OutlineRanging::Impl::place(std::size_t k, const Sighting* lower, const Sighting* upper,
                                          const std::optional<double>& top_m,
                                          const std::optional<FrameMotion>& motion) const {
  std::array<const Sighting*, 2> seen{lower, upper};
  std::array<Sighting, 2> counted;
  BySharedErrors<2> late = BySharedErrors<2>::Zero(2, motion ? times.cols() : 0);
  for (std::size_t view = 0; view < 2; ++view) {
    if (seen[view] == nullptr) continue;
    Sighting& sighting = counted[view] = *seen[view];
    sighting.covariance_px2 += sighting_px * sighting_px * Eigen::Matrix2d::Identity();
    if (motion) {
      late.row(Eigen::Index(view)) =
          times.row(kLateOfLower + int(view)) + share(view, sighting) * times.row(kReadoutOfLower + int(view));
      const MirrorView& mirror = of_view(belief.rig(), Side(view));
      sighting.pixel_px =
          pixel_at_frame(mirror, sighting.pixel_px, targets[k], motion->twist, late_s(view, sighting, *motion));
    }
    seen[view] = &sighting;
  }
  const auto doubt = late.cols() > 0 ? std::optional(TimeDoubt{motion->twist, &late}) : std::nullopt;
  return triangulate(belief, by_shared[k], seen[0], seen[1], targets[k].radius_m, top_m, doubt);
}

Cylinder OutlineRanging::Impl::when_exposed(std::size_t view, const Cylinder& at_frame,
                                            const std::optional<FrameMotion>& motion) const {
  if (!motion) return at_frame;
  const MirrorView& mirror = of_view(belief.rig(), Side(view));
  const Eigen::Vector2d place_m = at_frame.place_m();
  const auto near_m = near_top_point(mirror, place_m, at_frame.radius_m, at_frame.top_m);
  const auto pixel_px = near_m ? mirror.project(*near_m) : std::nullopt;
  if (!pixel_px) return at_frame;
  return at_frame.at(place_after(place_m, motion->twist, late_s(view, Sighting{*pixel_px}, *motion)));
}

double OutlineRanging::Impl::share(std::size_t view, const Sighting& seen) const {
  return readout_share(seen, views[view].size().height);
}

bool OutlineRanging::Impl::is_same_colour(std::size_t k) const {
  return hues[k] != kNoHue && table.is_ambiguous(hues[k]);
}

bool OutlineRanging::Impl::shares_hue(std::size_t k) const { return std::ranges::count(hues, hues[k]) > 1; }

bool OutlineRanging::Impl::shares_number(std::size_t k) const {
  return std::ranges::count_if(targets, [&](const Landmark& other) {
           return other.bands && other.bands->number == targets[k].bands->number;
         }) > 1;
}

Surface OutlineRanging::Impl::surface_of(std::size_t k) const {
  return {hues[k] != kNoHue ? static_cast<std::uint8_t>(hues[k] + 1) : std::uint8_t(0)};
}

OutlineRanging::OutlineRanging(const Rig& rig, const std::vector<Landmark>& targets, cv::Size lower_size,
                               cv::Size upper_size, const std::vector<std::size_t>& wanted, const BeliefErrors& errors)
    : impl_(std::make_shared<Impl>(rig, targets, lower_size, upper_size, wanted, errors)) {}

std::vector<RangeMeasurement> OutlineRanging::measure(const cv::Mat& lower, const cv::Mat& upper,
                                                      const std::optional<FrameMotion>& motion,
                                                      const ExpectedPlaces& expected) const {
  FrameObservation observation = look(lower, upper, motion, expected);
  std::vector<std::size_t> all(impl_->targets.size());
  std::iota(all.begin(), all.end(), std::size_t(0));
  observation.take(all, Stage::kFine);
  return observation.measurements();
}

}  // namespace twocone::vision
