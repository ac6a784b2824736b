// SPDX-License-Identifier: Apache-2.0
#include "apps/compare/findings.h"

#include <algorithm>

#include <Eigen/Geometry>

#include "apps/config/to_layers.h"
#include "apps/estimation/estimator.h"
#include "apps/runlog/storage/image_file.h"

namespace twocone::compare {
namespace {

bool is_of_time(const Source& source) { return source.cause == Cause::kSkew || source.cause == Cause::kRollingShutter; }

/// One held-out frame.
struct HeldOutFrame {
  const Side& real;
  const std::vector<Source>& sources;
  const std::vector<vision::Rig>& put_back;  ///< for each source, the found rig with its numbers as believed
  std::optional<BodyTwist> twist;
  runlog::PoseRow reference;
  double upper_later_s = 0;  ///< by the stamps

  using Seen = std::optional<vision::Sighting>;

  /// Returns a sighting as an exposure at the frame's time, which is that of the lower image's middle row, would have
  /// given it.
  /// @param found exposures that count where they differ from the believed ones
  [[nodiscard]] Seen in_time(const vision::Rig& rig, const std::vector<const Source*>& found, vision::Side side,
                             Seen seen, const Landmark& target) const {
    if (!seen || !twist) return seen;
    const auto& believed = real.believed.exposures;
    const bool is_upper = side == vision::Side::kUpper;
    double late_s = is_upper ? believed[1].late_s - believed[0].late_s : 0;
    double readout_s = believed[std::size_t(side)].readout_s;
    for (const Source* source : found) {
      const double real_s = source->components[0].real / 1e3;
      if (source->cause == Cause::kSkew && is_upper) late_s = real_s;
      if (source->cause == Cause::kRollingShutter && source->view == side) readout_s = real_s;
    }
    if (is_upper) late_s += upper_later_s;
    const int height_px = of_view(real.run.robot, side).settings.height_px;
    late_s += vision::readout_share(*seen, height_px) * readout_s;
    seen->pixel_px = vision::pixel_at_frame(of_view(rig, side), seen->pixel_px, target, *twist, late_s);
    return seen;
  }

  /// Likewise, with all differences of timing that were found, except that of `left_as_it_is`.
  [[nodiscard]] Seen in_time_but(const Source* left_as_it_is, vision::Side side, const Seen& seen,
                                 const Landmark& target) const {
    std::vector<const Source*> found;
    for (const Source& source : sources) {
      if (source.differs() && is_of_time(source) && &source != left_as_it_is) found.push_back(&source);
    }
    return in_time(real.found, found, side, seen, target);
  }

  /// Returns the body's pose at the frame's time, from `ranges` of the found rig. Requires that they were measured at
  /// `reference` or nearby.
  [[nodiscard]] std::optional<runlog::PoseRow> fixed_in_time(const std::vector<vision::RangeMeasurement>& ranges,
                                                             const std::vector<Landmark>& targets,
                                                             const std::vector<Eigen::Vector2d>& landmarks_m) const {
    std::vector<vision::RangeMeasurement> measured(ranges.size());
    for (std::size_t k = 0; k < ranges.size(); ++k) {
      if (!ranges[k].range_m) continue;
      const Seen lower = in_time_but(nullptr, vision::Side::kLower, ranges[k].lower_sighting, targets[k]);
      const Seen upper = in_time_but(nullptr, vision::Side::kUpper, ranges[k].upper_sighting, targets[k]);
      measured[k] = range_under(real.found, lower, upper, targets[k]);
    }
    return pose_of(estimation::fix_of_outline(measured, landmarks_m, true), reference.t_s);
  }

  [[nodiscard]] std::optional<HeldOutRange> range_of(const vision::RangeMeasurement& m, const Landmark& target,
                                                     const Eigen::Vector2d& landmark_m) const {
    if (!m.range_m || !m.sigma_range_m) return std::nullopt;
    const Eigen::Vector2d to_m = localisation::in_body(pose_of(reference), landmark_m);
    const Seen &lower = m.lower_sighting, &upper = m.upper_sighting;
    const auto by = [&](const vision::Rig& rig, const Source* left_as_it_is) {
      return triangulated(rig, in_time_but(left_as_it_is, vision::Side::kLower, lower, target),
                          in_time_but(left_as_it_is, vision::Side::kUpper, upper, target), target);
    };
    const auto before_m = triangulated(real.believed, in_time(real.believed, {}, vision::Side::kLower, lower, target),
                                       in_time(real.believed, {}, vision::Side::kUpper, upper, target), target);
    const auto after_m = by(real.found, nullptr);
    if (!before_m || !after_m) return std::nullopt;
    HeldOutRange range{*before_m - to_m.norm(), *after_m - to_m.norm(), *m.sigma_range_m, {}};
    for (std::size_t s = 0; s < sources.size(); ++s) {
      const Source& source = sources[s];
      double part_m = 0;
      if (!source.differs()) {
        // adds nothing
      } else if (source.cause == Cause::kLandmark && source.landmark == target.name && source.components.size() == 2) {
        // The map's distance is too short by the shift of the landmark along the line of sight.
        const Eigen::Vector2d shift_m = Eigen::Vector2d(source.components[0].real, source.components[1].real) / 1e3;
        part_m = (landmark_m - Eigen::Vector2d(reference.x_m, reference.y_m)).normalized().dot(shift_m);
        range.after_m -= part_m;
      } else if (is_of_time(source)) {
        part_m = by(real.found, &source).value_or(*after_m) - *after_m;
      } else {
        part_m = by(put_back[s], nullptr).value_or(*after_m) - *after_m;
      }
      range.parts_m.push_back(part_m);
    }
    return range;
  }

  /// Returns the range from the sightings under `rig`, even if both views contradict each other under it. For this, the
  /// covariances are multiplied by kDoubt^2, which leaves the weights of the views unchanged.
  static std::optional<double> triangulated(const vision::Rig& rig, Seen lower, Seen upper, const Landmark& target) {
    constexpr double kDoubt = 30;
    for (Seen* const seen : {&lower, &upper}) {
      if (*seen) (*seen)->covariance_px2 *= kDoubt * kDoubt;
    }
    return range_under(rig, lower, upper, target).range_m;
  }
};

/// Returns frames in the middle between two that the calibration chose. For a run that is too short to have any, it
/// returns those that the calibration chose.
std::vector<std::size_t> rows_between(const std::vector<std::size_t>& chosen, int most) {
  std::vector<std::size_t> rows;
  for (std::size_t i = 0; i + 1 < chosen.size(); ++i) {
    if (chosen[i + 1] - chosen[i] >= 2) rows.push_back((chosen[i] + chosen[i + 1]) / 2);
  }
  if (rows.empty()) rows = chosen;
  const std::size_t every = (rows.size() + std::size_t(most) - 1) / std::size_t(most);
  std::vector<std::size_t> thinned;
  for (std::size_t i = 0; i < rows.size(); i += every) thinned.push_back(rows[i]);
  return thinned;
}

/// Returns the rig that the calibration found, with the numbers of one source set back to the believed ones.
vision::Rig with_believed(const Side& side, const Source& source) {
  vision::MirrorViewSettings lower = side.found.lower.settings(), upper = side.found.upper.settings();
  const vision::MirrorViewSettings &was_lower = side.believed.lower.settings(),
                                   &was_upper = side.believed.upper.settings();
  const bool is_lower = source.view == vision::Side::kLower;
  vision::MirrorViewSettings& view = is_lower ? lower : upper;
  const vision::MirrorViewSettings& was = is_lower ? was_lower : was_upper;
  if (source.cause == Cause::kFocalLength) view.rim_radius_px = was.rim_radius_px;
  if (source.cause == Cause::kCentre) view.centre_px = was.centre_px;
  if (source.cause == Cause::kTilt) view.tilt_rad = was.tilt_rad;
  if (source.cause == Cause::kMirrorShape) view.cone = was.cone;
  if (source.cause == Cause::kMirrorsAlignment) {
    upper.azimuth_rad = lower.azimuth_rad + was_upper.azimuth_rad - was_lower.azimuth_rad;
    upper.axis_offset_m = lower.axis_offset_m + was_upper.axis_offset_m - was_lower.axis_offset_m;
  }
  if (source.cause == Cause::kMirrorsHeights) {
    lower.lens_height_m = was_lower.lens_height_m;
    upper.lens_height_m = was_upper.lens_height_m;
  }
  vision::Rig rig = side.found;
  rig.lower = vision::MirrorView(lower);
  rig.upper = vision::MirrorView(upper);
  return rig;
}

}  // namespace

Result<std::vector<HeldOutRange>> held_out_ranges(const Side& real, const std::vector<Source>& sources, int most,
                                                  const std::function<void(double)>& progress) {
  std::vector<HeldOutRange> all;
  if (!real.calibration) return all;
  config::Robot robot = real.run.robot;
  robot.rig = real.calibration->rig;
  robot.rig.sigma = config::RigSigma{};  // one rig makes all these ranges, so that its doubt weighs none of them
  robot.estimator = {};
  const estimation::Estimator estimator(estimation::Method::kOutline, robot, real.run.map);
  const auto targets = config::to_targets(real.run.map);
  const auto landmarks_m = config::to_landmark_positions(real.run.map);
  std::vector<vision::Rig> rigs;
  rigs.reserve(sources.size());
  for (const Source& source : sources) rigs.push_back(with_believed(real, source));

  const auto rows = rows_between(calibrate::chosen_rows(real.run.frames.size(), real.chosen), most);
  for (std::size_t n = 0; n < rows.size(); ++n) {
    progress(double(n) / double(rows.size()));
    const std::size_t row = rows[n];
    const runlog::FrameRow& frame = real.run.frames[row];
    const auto files = images_of(real.run, row);
    const auto lower = runlog::read_image(files[0]), upper = runlog::read_image(files[1]);
    if (!lower || !upper) continue;  // unreadable images are reported elsewhere
    const auto answer = estimator.answer(*lower, *upper);
    if (!answer) return answer.error();
    auto reference = real.is_reference_apart ? real.reference[row] : pose_of(answer->fix, frame.t_s);
    if (!reference) continue;
    HeldOutFrame at{real, sources, rigs, runlog::twist_at(real.run, row), *reference, frame.skew_s};
    if (!real.is_reference_apart) {
      reference = at.fixed_in_time(answer->ranges, targets, landmarks_m);
      if (!reference) continue;
      at.reference = *reference;
    }
    for (std::size_t k = 0; k < targets.size(); ++k) {
      const auto range = at.range_of(answer->ranges[k], targets[k], landmarks_m[k]);
      if (range) all.push_back(*range);
    }
  }
  progress(1);
  return all;
}

}  // namespace twocone::compare
