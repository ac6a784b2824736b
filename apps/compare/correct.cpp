// SPDX-License-Identifier: Apache-2.0
#include "apps/compare/correct.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "apps/config/robot_writer.h"
#include "apps/runlog/version.h"
#include "vision/image_quality.h"

namespace twocone::compare {
namespace {

const Source* differing(const Comparison& comparison, const std::string& kind, const std::string& where = "") {
  const auto at = std::find_if(comparison.sources.begin(), comparison.sources.end(), [&](const Source& s) {
    return s.kind == kind && s.where == where && s.verdict == SourceVerdict::kDiffers;
  });
  return at == comparison.sources.end() ? nullptr : &*at;
}

std::vector<std::string> header(const Outcome& outcome, const char* what) {
  const Comparison& c = outcome.comparison;
  std::vector<std::string> lines{fmt::format("{} by twocone {}, commit {}.", what, runlog::version(), runlog::commit()),
                                 fmt::format("  simulated run {}", c.simulated), fmt::format("  real run {}", c.real)};
  std::string names;
  for (const Source& source : c.sources) {
    if (source.verdict == SourceVerdict::kDiffers) names += (names.empty() ? "" : ", ") + source.name();
  }
  lines.push_back(names.empty() ? "No difference was found." : "Found to differ: " + names + ".");
  return lines;
}

void add_camera_effects(const Outcome& outcome, std::size_t view, sim_povray::CameraEffects& effects) {
  const Comparison& c = outcome.comparison;
  const std::string where = view == 0 ? "lower" : "upper";
  if (const Source* const gain = differing(c, "exposure and colour", where)) {
    double log_gain = 0;
    for (std::size_t colour = 0; colour < 3; ++colour) log_gain += std::log(gain->components[colour].real) / 3;
    effects.gain *= std::exp(log_gain);
    // The difference of real and simulated does not contain a vignette that both have.
    const Component& vignetting = gain->components[3];
    if (std::abs(vignetting.real) >= 3 * vignetting.sigma) {
      effects.vignetting = std::clamp(effects.vignetting + vignetting.real, 0.0, 1.0);
    }
  }
  if (differing(c, "noise", where)) {
    if (const auto noise = vision::fit_noise(outcome.images.views[view].real_noise)) {
      effects.full_well_electrons = noise->full_well_electrons();
      effects.read_noise_electrons = noise->read_noise_electrons();
    }
  }
  if (const Source* const blur = differing(c, "sharpness", where)) {
    const double more_px = vision::defocus_radius_px(blur->components[0].simulated, blur->components[0].real);
    effects.defocus_px = std::hypot(effects.defocus_px, more_px);
  }
  if (const Source* const shutter = differing(c, "rolling shutter", where)) {
    effects.readout_s = std::max(0.0, effects.readout_s + shutter->components[0].difference() / 1e3);
  }
  if (const Source* const lost = differing(c, "frames lost", where)) {
    effects.drop_probability = std::clamp(lost->components[0].real / 100, 0.0, 0.99);
  }
  double late_s = 0;
  if (const Source* const latency = differing(c, "latency")) late_s += latency->components[0].difference() / 1e3;
  if (const Source* const skew = differing(c, "skew")) {
    // The stamp of the earlier view is the late one.
    const double upper_later_s = skew->components[0].difference() / 1e3;
    late_s += std::max(0.0, view == 1 ? -upper_later_s : upper_later_s);
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
  add_camera_effects(outcome, 0, robot.lower.effects);
  add_camera_effects(outcome, 1, robot.upper.effects);
  round(robot.lower.effects);
  round(robot.upper.effects);
  if (differing(c, "wheel radius") || differing(c, "wheel separation")) {
    // Belief and truth are equal: both are those of the corrected real robot.
    robot.drive.wheel_radius_m = outcome.calibration->drive.wheel_radius_m;
    robot.drive.wheel_separation_m = outcome.calibration->drive.wheel_separation_m;
    robot.effects.wheel_radius_m.reset();
    robot.effects.wheel_separation_m.reset();
  }
  if (const Source* const slip = differing(c, "slip")) robot.effects.slip = rounded(slip->components[0].real / 100);
  if (const Source* const rate = differing(c, "frame rate")) {
    robot.lower.rate_hz = robot.upper.rate_hz = rounded(rate->components[0].real);
  }
  return config::robot_text(robot.file, new_file, robot,
                            header(outcome, "A simulation that behaves like a real run, made"));
}

void advise(std::vector<Source>& sources) {
  for (Source& source : sources) {
    if (source.verdict != SourceVerdict::kDiffers) continue;
    const auto kinds = [&source](std::initializer_list<const char*> names) {
      return std::any_of(names.begin(), names.end(), [&source](const char* name) { return source.kind == name; });
    };
    if (kinds({"focal length", "centre", "tilt", "mirror shape", "mirrors' alignment", "mirrors' heights"})) {
      source.advice =
          "put the real numbers into the real robot's `rig:` (--write-robot does), or move camera and mirror";
    } else if (kinds({"wheel radius", "wheel ratio", "wheel separation"})) {
      source.advice = "put the real numbers into `drive:` (--write-robot does)";
    } else if (source.kind == "landmark") {
      source.advice = "measure this landmark again: its place in the real map is wrong";
    } else if (source.kind == "frames lost") {
      source.advice = "check cable, bus and load (twocone doctor); in the simulation set drop_probability";
    } else if (kinds({"frame rate", "stamped skew"})) {
      source.advice = "set the cameras' rate, or trigger both together; in the simulation set rate_hz";
    } else if (kinds({"skew", "latency"})) {
      source.advice = "correct the stamps, or trigger both together; in the simulation set stamp_late_s";
    } else if (source.kind == "rolling shutter") {
      source.advice = "use a shorter readout or slower turns; in the simulation set readout_s";
    } else if (source.kind == "exposure and colour") {
      source.advice = "set exposure, gain and white balance; in the simulation set gain, vignetting";
    } else if (source.kind == "noise") {
      source.advice = "use more light; in the simulation set full_well_electrons, read_noise_electrons";
    } else if (source.kind == "sharpness") {
      source.advice = "focus the lens; in the simulation set defocus_px";
    } else if (source.kind == "slip") {
      source.advice = "check floor and tyres; in the simulation set slip";
    }
  }
}

}  // namespace twocone::compare
