// SPDX-License-Identifier: Apache-2.0
#include "apps/compare/compare.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "apps/config/robot_writer.h"
#include "apps/runlog/version.h"
#include "vision/image_quality.h"

namespace twocone::compare {
namespace {

std::vector<std::string> header(const Outcome& outcome, const char* what) {
  const Comparison& c = outcome.comparison;
  std::vector<std::string> lines{fmt::format("{} by twocone {}, commit {}.", what, runlog::version(), runlog::commit()),
                                 fmt::format("  simulated run {}", c.simulated), fmt::format("  real run {}", c.real)};
  std::vector<std::string> names;
  for (const Source* const source : c.sources_with(SourceVerdict::kDiffers)) names.push_back(source->name());
  lines.push_back(names.empty() ? "No difference was found."
                                : fmt::format("Found to differ: {}.", fmt::join(names, ", ")));
  return lines;
}

void add_camera_effects(const Outcome& outcome, vision::Side view, sim_povray::CameraEffects& effects) {
  const std::vector<Source>& sources = outcome.comparison.sources;
  if (const Source* const gain = find_differing(sources, Cause::kExposureAndColour, view)) {
    double log_gain = 0;
    for (std::size_t colour = 0; colour < 3; ++colour) log_gain += std::log(gain->components[colour].real) / 3;
    effects.gain *= std::exp(log_gain);
    // The difference of real and simulated does not contain a vignette that both have.
    const Component& vignetting = gain->components[3];
    if (std::abs(vignetting.real) >= 3 * vignetting.sigma) {
      effects.vignetting = std::clamp(effects.vignetting + vignetting.real, 0.0, 1.0);
    }
  }
  if (find_differing(sources, Cause::kNoise, view)) {
    if (const auto noise = vision::fit_noise(outcome.images.views[std::size_t(view)].real_noise)) {
      effects.full_well_electrons = noise->full_well_electrons();
      effects.read_noise_electrons = noise->read_noise_electrons();
    }
  }
  if (const Source* const blur = find_differing(sources, Cause::kSharpness, view)) {
    const double more_px = vision::defocus_radius_px(blur->components[0].simulated, blur->components[0].real);
    effects.defocus_px = std::hypot(effects.defocus_px, more_px);
  }
  if (const Source* const shutter = find_differing(sources, Cause::kRollingShutter, view)) {
    effects.readout_s = std::max(0.0, effects.readout_s + shutter->components[0].difference() / 1e3);
  }
  if (const Source* const lost = find_differing(sources, Cause::kFramesLost, view)) {
    effects.drop_probability = std::clamp(lost->components[0].real / 100, 0.0, 0.99);
  }
  double late_s = 0;
  if (const Source* const latency = find_differing(sources, Cause::kLatency))
    late_s += latency->components[0].difference() / 1e3;
  if (const Source* const skew = find_differing(sources, Cause::kSkew)) {
    // The stamp of the earlier view is the late one.
    const double upper_later_s = skew->components[0].difference() / 1e3;
    late_s += std::max(0.0, view == vision::Side::kUpper ? -upper_later_s : upper_later_s);
  }
  effects.stamp_late_s = std::max(0.0, effects.stamp_late_s + late_s);
}

/// Rounds to four digits, more than any measurement here has, so that people can read the files.
double rounded(double value) { return value == 0 ? 0 : std::stod(fmt::format("{:.4g}", value)); }

void round(sim_povray::CameraEffects& effects) {
  for (double* const value :
       {&effects.gain, &effects.full_well_electrons, &effects.read_noise_electrons, &effects.vignetting,
        &effects.defocus_px, &effects.readout_s, &effects.drop_probability, &effects.stamp_late_s}) {
    *value = rounded(*value);
  }
}

}  // namespace

std::string corrected_robot(const Outcome& outcome, const std::filesystem::path& new_file) {
  config::Robot robot = outcome.comparison.real_robot;
  robot.rig = outcome.calibration->rig;
  robot.drive.wheel_radius_m = outcome.calibration->drive.wheel_radius_m;
  robot.drive.wheel_separation_m = outcome.calibration->drive.wheel_separation_m;
  return config::robot_text(robot.file, new_file, robot, header(outcome, "Rig and wheels as found in a real run"));
}

std::string like_the_real(const Outcome& outcome, const std::filesystem::path& new_file) {
  const Comparison& c = outcome.comparison;
  config::Robot robot = c.simulated_robot;
  add_camera_effects(outcome, vision::Side::kLower, robot.lower.effects);
  add_camera_effects(outcome, vision::Side::kUpper, robot.upper.effects);
  round(robot.lower.effects);
  round(robot.upper.effects);
  if (find_differing(c.sources, Cause::kWheelRadius) || find_differing(c.sources, Cause::kWheelSeparation)) {
    // Belief and truth are equal: both are those of the corrected real robot.
    robot.drive.wheel_radius_m = outcome.calibration->drive.wheel_radius_m;
    robot.drive.wheel_separation_m = outcome.calibration->drive.wheel_separation_m;
    robot.effects.wheel_radius_m.reset();
    robot.effects.wheel_separation_m.reset();
  }
  if (const Source* const slip = find_differing(c.sources, Cause::kSlip))
    robot.effects.slip = rounded(slip->components[0].real / 100);
  if (const Source* const rate = find_differing(c.sources, Cause::kFrameRate)) {
    robot.lower.rate_hz = robot.upper.rate_hz = rounded(rate->components[0].real);
  }
  return config::robot_text(robot.file, new_file, robot,
                            header(outcome, "A simulation that behaves like a real run, made"));
}

}  // namespace twocone::compare
