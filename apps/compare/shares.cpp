// SPDX-License-Identifier: Apache-2.0
#include "apps/compare/findings.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/Core>

#include "apps/compare/both_runs.h"
#include "localisation/trajectory_error.h"

namespace twocone::compare {
namespace {

/// The measurements of a gap, with the part that each source adds to each measurement.
class Projection {
 public:
  explicit Projection(std::vector<Source>& sources) : sources_(sources), along_(sources.size(), 0) {}

  /// @param source one of those of the constructor
  void add(double gap, const Source& source, double part) {
    along_[std::size_t(&source - sources_.data())] += gap * part;
  }
  /// @param after the remainder of `gap` after correction
  void add(double gap, double after) {
    squares_ += gap * gap;
    left_ += gap * after;
  }

  /// Writes the shares into the sources and the remainder into the gap.
  void put_into(Gap& gap) {
    if (!(squares_ > 0)) return;
    gap.unexplained = left_ / squares_;
    gap.unnamed = 1 - *gap.unexplained;
    for (std::size_t k = 0; k < sources_.size(); ++k) {
      if (!sources_[k].differs() || along_[k] == 0) continue;
      sources_[k].shares.push_back({gap.of, along_[k] / squares_});
      *gap.unnamed -= along_[k] / squares_;
    }
  }

 private:
  std::vector<Source>& sources_;
  std::vector<double> along_;
  double squares_ = 0, left_ = 0;
};

void add_range_gap(const std::vector<HeldOutRange>& held_out, std::vector<Source>& sources, std::vector<Gap>& gaps) {
  if (held_out.empty()) return;
  Moments before, after, floor;
  Projection projection(sources);
  for (const HeldOutRange& range : held_out) {
    before.add(range.before_m);
    after.add(range.after_m);
    floor.add(range.sigma_m);
    projection.add(range.before_m, range.after_m);
    for (std::size_t k = 0; k < sources.size(); ++k) projection.add(range.before_m, sources[k], range.parts_m[k]);
  }
  gaps.push_back({Quantity::kRange, "mm", 1e3 * *before.rms(), 1e3 * *after.rms(), 1e3 * *floor.rms()});
  projection.put_into(gaps.back());
}

/// Returns, for each stretch of the path, the motion by the wheels minus that of the reference, along and across,
/// metres.
std::vector<Eigen::Vector2d> stretch_errors(const std::vector<localisation::PosePair>& pairs) {
  std::vector<Eigen::Vector2d> errors;
  const auto ends = localisation::stretches(pairs, kOdometryStretch_m);
  for (std::size_t k = 1; k < ends.size(); ++k) {
    const localisation::PosePair &from = pairs[ends[k - 1]], &to = pairs[ends[k]];
    const localisation::Pose was = localisation::seen_from(from.reference, to.reference);
    const localisation::Pose measured = localisation::seen_from(from.estimate, to.estimate);
    errors.emplace_back(measured.x_m - was.x_m, measured.y_m - was.y_m);
  }
  return errors;
}

double rms(const std::vector<Eigen::Vector2d>& errors) {
  double sum = 0;
  for (const Eigen::Vector2d& e : errors) sum += e.squaredNorm();
  return errors.empty() ? 0 : std::sqrt(sum / double(errors.size()));
}

void add_odometry_gap(const BothRuns& runs, std::vector<Source>& sources, std::vector<Gap>& gaps) {
  const Side& real = runs.real;
  if (!real.calibration || real.run.drive.size() < real.run.frames.size()) return;
  const config::Drive& drive = real.run.robot.drive;
  const WheelsAs believed{drive.wheel_radius_m, drive.wheel_separation_m, 0};
  const Source* const latency = find_differing(sources, Cause::kLatency);
  const WheelsAs found{real.calibration->drive.wheel_radius_m, real.calibration->drive.wheel_separation_m,
                       latency ? latency->components[0].real / 1e3 : 0};
  const auto errors = [&](const WheelsAs& wheels) {
    return stretch_errors(pairs_with(real.reference, odometry_by(real.run, wheels)));
  };
  const auto before = errors(believed), after = errors(found);
  if (before.size() != after.size() || before.empty()) return;
  Projection projection(sources);
  for (std::size_t i = 0; i < before.size(); ++i) {
    for (const int axis : {0, 1}) projection.add(before[i][axis], after[i][axis]);
  }
  using Put = double WheelsAs::*;
  for (const auto& [cause, number] : {std::pair<Cause, Put>{Cause::kWheelRadius, &WheelsAs::radius_m},
                                      {Cause::kWheelSeparation, &WheelsAs::separation_m},
                                      {Cause::kLatency, &WheelsAs::latency_s}}) {
    const Source* const source = find_differing(sources, cause);
    if (!source) continue;
    WheelsAs put_back = found;
    put_back.*number = believed.*number;
    const auto with = errors(put_back);
    for (std::size_t i = 0; i < std::min(before.size(), with.size()); ++i) {
      const Eigen::Vector2d part = with[i] - after[i];
      for (const int axis : {0, 1}) projection.add(before[i][axis], *source, part[axis]);
    }
  }
  gaps.push_back(
      {Quantity::kOdometry, "mm/m", 1e3 * rms(before) / kOdometryStretch_m, 1e3 * rms(after) / kOdometryStretch_m});
  if (!runs.is_rendered) {
    const auto floor = stretch_errors(pairs_with(runs.simulated.reference, runs.simulated.run.odometry));
    gaps.back().floor = 1e3 * rms(floor) / kOdometryStretch_m;
  }
  projection.put_into(gaps.back());
}

void add_brightness_gap(const Images& images, std::vector<Source>& sources, std::vector<Gap>& gaps) {
  Moments before, after;
  Projection projection(sources);
  for (const vision::Side view : {vision::Side::kLower, vision::Side::kUpper}) {
    const Source* const source = find_differing(sources, Cause::kExposureAndColour, view);
    for (const vision::Transfer& t : images.views[std::size_t(view)].transfers) {
      for (std::size_t c = 0; c < 3; ++c) {
        const double found = source ? std::log(std::max(1e-9, source->components[c].real)) : 0;
        before.add(t.log_gain[c]);
        after.add(t.log_gain[c] - found);
        projection.add(t.log_gain[c], t.log_gain[c] - found);
        if (source) projection.add(t.log_gain[c], *source, found);
      }
    }
  }
  if (before.count == 0) return;
  gaps.push_back({Quantity::kBrightness, "%", 100 * *before.rms(), 100 * *after.rms(), 0});
  projection.put_into(gaps.back());
}

void add_noise_gap(std::vector<Source>& sources, std::vector<Gap>& gaps) {
  double before = 0, after = 0, floor = 0, count = 0;
  Projection projection(sources);
  for (const Source& source : sources) {
    if (source.cause != Cause::kNoise || source.components.empty()) continue;
    const Component& c = source.components[0];
    ++count;
    before += c.difference() * c.difference();
    floor += c.sigma * c.sigma;
    projection.add(c.difference(), source.differs() ? 0 : c.difference());
    if (source.differs()) projection.add(c.difference(), source, c.difference());
    // The uncertainty of the correction remains.
    after += source.differs() ? c.sigma * c.sigma : c.difference() * c.difference();
  }
  if (count == 0) return;
  gaps.push_back(
      {Quantity::kNoise, "grey", std::sqrt(before / count), std::sqrt(after / count), std::sqrt(floor / count)});
  projection.put_into(gaps.back());
}

}  // namespace

std::vector<localisation::PosePair> pairs_with(const std::vector<std::optional<runlog::PoseRow>>& reference,
                                               const std::vector<runlog::PoseRow>& odometry) {
  std::vector<localisation::PosePair> pairs;
  for (std::size_t i = 0; i < std::min(reference.size(), odometry.size()); ++i) {
    if (!reference[i]) continue;
    pairs.push_back({pose_of(*reference[i]), pose_of(odometry[i])});
  }
  return pairs;
}

std::vector<runlog::PoseRow> odometry_by(const runlog::RunData& run, const WheelsAs& wheels) {
  std::vector<runlog::PoseRow> poses;
  if (run.drive.empty() || run.odometry.empty()) return poses;
  localisation::Odometry odometry({wheels.radius_m, wheels.separation_m}, pose_of(run.odometry.front()));
  std::vector<runlog::PoseRow> read;
  for (std::size_t i = 0; i < std::min(run.frames.size(), run.drive.size()); ++i) {
    const localisation::Pose& pose = odometry.update(run.drive[i].left_rad, run.drive[i].right_rad);
    read.push_back({run.frames[i].t_s, pose.x_m, pose.y_m, pose.heading_rad});
  }
  if (wheels.latency_s == 0) return read;
  for (const runlog::PoseRow& now : read) {
    runlog::PoseRow then =
        pose_at(read, std::clamp(now.t_s - wheels.latency_s, read.front().t_s, read.back().t_s)).value_or(now);
    then.t_s = now.t_s;
    poses.push_back(then);
  }
  return poses;
}

std::vector<Gap> find_gaps(const BothRuns& runs, const std::vector<HeldOutRange>& held_out, const Images& images,
                           std::vector<Source>& sources) {
  std::vector<Gap> gaps;
  add_range_gap(held_out, sources, gaps);
  add_odometry_gap(runs, sources, gaps);
  add_brightness_gap(images, sources, gaps);
  add_noise_gap(sources, gaps);
  return gaps;
}

}  // namespace twocone::compare
