// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <stdexcept>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "apps/compare/both_runs.h"
#include "apps/compare/comparison.h"
#include "tests/support/lab_robot.h"

namespace twocone::compare {

inline config::Robot made_up_robot(const std::string& driver) {
  config::Robot robot = testing_support::with_images(testing_support::lab_robot(driver), 320, 240, 118);
  robot.lower.settings.rate_hz = robot.upper.settings.rate_hz = 10;
  return robot;
}

inline vision::Rig made_up_rig() {
  const auto view = [](double lens_height_m) {
    vision::MirrorViewSettings settings;
    settings.cone = {.rim_radius_m = 0.06, .lens_to_tip_m = 0.12};
    settings.lens_height_m = lens_height_m;
    settings.centre_px = {159.5, 119.5};
    settings.rim_radius_px = 118;
    return vision::MirrorView(settings);
  };
  return {view(0.25), view(0.55)};
}

/// Returns an invented calibration: every number of a rig that sources need, each observed with `sigma` (SI) and
/// without correlation.
inline vision::CalibrationResult made_up_result(double sigma = 1e-3) {
  vision::CalibrationResult result;
  result.verdict = vision::CalibrationVerdict::kOk;
  result.wheel_scale = 1;
  const auto add = [&](const std::string& name, double after) {
    result.parameters.push_back({name, after, after, sigma, 1, true, false});
  };
  for (const std::string view : {"lower.", "upper."}) {
    add(view + "rim_radius_px", 118);
    add(view + "centre_px.column", 159.5);
    add(view + "centre_px.row", 119.5);
    add(view + "tilt_rad.x", 0);
    add(view + "tilt_rad.y", 0);
    add(view + "apex_rad", 1.57);
    add(view + "mirror_radius_m", 0.06);
    add(view + "lens_to_tip_m", 0.12);
    add(view + "readout_s", 0);
  }
  add("upper.azimuth_minus_lower_rad", 0);
  add("upper.axis_offset_minus_lower_m.x", 0);
  add("upper.axis_offset_minus_lower_m.y", 0);
  add("mirror_separation_m", 0.30);
  add("lens_height_m", 0.25);
  add("upper.skew_s", 0);
  add("latency_s", 0);
  add("wheel_radius_m", 0.05);
  add("wheel_ratio", 1);
  add("wheel_separation_m", 0.30);
  const auto count = Eigen::Index(result.parameters.size());
  result.covariance = Eigen::MatrixXd::Identity(count, count) * sigma * sigma;
  return result;
}

/// Returns a side on a straight line at 10 Hz, without images on disk.
inline Side made_up_side(const std::string& driver, const vision::CalibrationResult& result, std::size_t frames = 40) {
  const vision::Rig rig = made_up_rig();
  Side side{.name = driver == "sim_povray" ? "runs/simulated" : "runs/real",
            .run = {},
            .method = "outline",
            .believed = rig,
            .found = rig,
            .reference_is = "truth",
            .is_reference_apart = true};
  side.run.robot = made_up_robot(driver);
  for (std::size_t i = 0; i < frames; ++i) {
    runlog::FrameRow row;
    const double t_s = double(i) / 10, x_m = 0.05 * double(i);
    row.frame = row.lower_sequence = row.upper_sequence = i;
    row.t_s = row.lower_t_s = row.upper_t_s = t_s;
    side.run.frames.push_back(row);
    side.run.drive.push_back({t_s, {}, {}, x_m / 0.05, x_m / 0.05});
    side.run.odometry.push_back({t_s, x_m, 0, 0});
    side.reference.emplace_back(runlog::PoseRow{t_s, x_m, 0, 0});
  }
  vision::CalibrationProblem problem{rig, vision::WheelBelief{0.05, 0.30}, {}, {}, {}, {}};
  vision::CalibrationFrame frame;
  frame.wheels.resize(2);
  problem.frames.assign(frames, frame);
  side.calibration = calibrate::Report{.runs = {side.name},
                                       .robot = "robots/mine.yaml",
                                       .result = result,
                                       .problem = problem,
                                       .before = rig,
                                       .after = rig,
                                       .rig = side.run.robot.rig,
                                       .drive = side.run.robot.drive,
                                       .slip = 0.01};
  return side;
}

/// Returns the element of which `projection` is `value`. @throws std::out_of_range if there is none
template <typename Elements, typename Value, typename Projection>
auto& element_of(Elements& elements, const Value& value, Projection projection) {
  const auto at = std::ranges::find(elements, value, projection);
  if (at == elements.end()) throw std::out_of_range(fmt::format("there is no {}", value));
  return *at;
}

inline vision::CalibratedParameter& parameter(vision::CalibrationResult& result, const std::string& name) {
  return element_of(result.parameters, name, &vision::CalibratedParameter::name);
}

inline Eigen::Index index_of(const vision::CalibrationResult& result, const std::string& name) {
  return &element_of(result.parameters, name, &vision::CalibratedParameter::name) - result.parameters.data();
}

inline Source source_of(const std::vector<Source>& sources, const std::string& name) {
  return element_of(sources, name, &Source::name);
}

/// Returns the components of a source of cause kExposureAndColour.
inline std::vector<Component> gains(double red, double green, double blue, double vignetting) {
  return {{"gain.red", "1", 1, red, 0.01},
          {"gain.green", "1", 1, green, 0.01},
          {"gain.blue", "1", 1, blue, 0.01},
          {"vignetting", "1", 0, vignetting, 0.02}};
}

inline std::vector<std::string> names_of(const std::vector<Source>& sources, SourceVerdict verdict) {
  std::vector<std::string> names;
  for (const Source& source : sources) {
    if (source.verdict == verdict) names.push_back(source.name());
  }
  return names;
}

}  // namespace twocone::compare
