// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string_view>
#include <tuple>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "apps/calibrate/calibrate.h"
#include "apps/calibrate/report_json.h"
#include "apps/config/calibration_file.h"
#include "apps/runlog/version.h"
#include "vision/uncertain_rig.h"

namespace twocone::calibrate {
namespace {

using namespace std::string_view_literals;

/// A parameter in the units of the table: millimetres, degrees, pixels and milliseconds.
struct Shown {
  std::string name;
  std::string unit;
  double factor = 1;
};

Shown shown(const std::string& name) {
  constexpr double kDegrees = 180 / std::numbers::pi;
  for (const auto& [ending, unit, factor] :
       {std::tuple{"_px"sv, "px", 1.0}, {"_rad"sv, "deg", kDegrees}, {"_m"sv, "mm", 1000.0}, {"_s"sv, "ms", 1000.0}}) {
    const std::size_t at = name.rfind(ending);
    const std::size_t end = at + ending.size();
    if (at == std::string::npos || (end != name.size() && name[end] != '.')) continue;
    return {name.substr(0, at) + name.substr(end), unit, factor};
  }
  return {name, "", 1};
}

/// Returns the number of decimals that shows two digits of sigma.
int decimals_for(double sigma) {
  if (!(sigma > 0)) return 4;
  return std::clamp(1 - static_cast<int>(std::floor(std::log10(sigma))), 0, 6);
}

std::string circles_line(const char* view, const ViewCircles& circles) {
  std::string line = fmt::format("{:6}", view);
  if (circles.rim) {
    line += fmt::format("  rim centre ({:.2f}, {:.2f}) +- {:.2f}, radius {:.2f} +- {:.2f} px, {:.0f} % of it seen",
                        circles.rim->centre_px.x(), circles.rim->centre_px.y(), circles.rim->sigma_centre_px,
                        circles.rim->radius_px, circles.rim->sigma_radius_px, 100 * circles.rim->support);
  } else {
    line += "  no rim is seen against its surroundings";
  }
  if (circles.tip) {
    line += fmt::format("\n        tip ({:.2f}, {:.2f}) +- {:.2f} px, where upright edges meet",
                        circles.tip->centre_px.x(), circles.tip->centre_px.y(), circles.tip->sigma_px);
  }
  return line + "\n";
}

// ---- the figure: an SVG, written directly, because lines and circles need no plotting program

constexpr double kPanel_px = 420;
constexpr double kMargin_px = 20;
constexpr double kHead_px = 64;

/// Returns the factor that draws a residual of size rms about 12 px long, as 1, 2 or 5 times a power of ten.
double magnification(double rms_px) {
  const double wanted = 12 / std::max(rms_px, 1e-6);
  const double power = std::pow(10, std::floor(std::log10(wanted)));
  const double lead = wanted / power;
  return power * (lead >= 5 ? 5 : lead >= 2 ? 2 : 1);
}

/// Draws one half of the figure: the residuals before the calibration, or those after it.
std::string draw(const Report& report, vision::Side side, bool is_after) {
  const vision::Rig& rig = is_after ? report.after : report.before;
  const vision::MirrorViewSettings& s = of_view(rig, side).settings();
  const auto& rms_px = is_after ? report.result.rms_after_px : report.result.rms_before_px;
  const double of_view_px = rms_px[std::size_t(side)];
  const double left_px = is_after ? kPanel_px : 0;
  const double scale = (kPanel_px / 2 - kMargin_px) / s.rim_radius_px;
  const double times = magnification(of_view_px);
  const auto place = [&](const Eigen::Vector2d& pixel_px) -> Eigen::Vector2d {
    return Eigen::Vector2d(left_px + kPanel_px / 2, kHead_px + kPanel_px / 2) + scale * (pixel_px - s.centre_px);
  };
  const Eigen::Vector2d centre = place(s.centre_px);
  std::string svg = fmt::format(
      "<text x=\"{:.1f}\" y=\"38\">{}: rms {:.3f} px, drawn {:g} times</text>\n"
      "<circle cx=\"{:.2f}\" cy=\"{:.2f}\" r=\"{:.2f}\" fill=\"none\" stroke=\"#777777\"/>\n"
      "<path d=\"M {:.2f} {:.2f} h 8 M {:.2f} {:.2f} v 8\" stroke=\"#777777\"/>\n",
      left_px + kMargin_px, is_after ? "after" : "before", of_view_px, times, centre.x(), centre.y(),
      scale * s.rim_radius_px, centre.x() - 4, centre.y(), centre.x(), centre.y() - 4);
  // One pixel of the image is `scale` pixels of the figure.
  for (const vision::SightingResidual& r : report.result.residuals) {
    const vision::LandmarkSighting& sighting = report.problem.frames[r.frame].sightings[r.sighting];
    if (sighting.side != side) continue;
    const Eigen::Vector2d from = place(sighting.sighting.pixel_px);
    Eigen::Vector2d arrow = times * (is_after ? r.after_px : r.before_px);
    // The length is limited, because the arrow of an outlier could cross the whole figure.
    if (arrow.norm() > 60) arrow *= 60 / arrow.norm();
    const char* colour = r.outlier ? "#cc3311" : "#0077bb";
    svg += fmt::format(
        "<path d=\"M {:.2f} {:.2f} l {:.2f} {:.2f}\" stroke=\"{}\"/><circle cx=\"{:.2f}\" cy=\"{:.2f}\" r=\"1.2\" "
        "fill=\"{}\"/>\n",
        from.x(), from.y(), arrow.x(), arrow.y(), colour, from.x(), from.y(), colour);
  }
  return svg;
}

}  // namespace

std::string table(const Report& report) {
  const vision::CalibrationResult& r = report.result;
  std::string text =
      fmt::format("twocone {}, commit {}, {}\n", runlog::version(), runlog::commit(), runlog::compiler());
  text += fmt::format("calibration of the rig of {}\n", report.robot);
  for (const std::string& run : report.runs) text += fmt::format("  from {}\n", run);
  if (report.found) {
    text += "\nfrom the images alone:\n";
    for (const std::string& line : estimation::lines_of(*report.found)) text += fmt::format("  {}\n", line);
    for (const auto& [key, in_file, seen] : report.replaced) {
      text += in_file.empty() ? fmt::format("  rig.{} is {}, as seen; the robot file has none\n", key, seen)
                              : fmt::format("  rig.{} is {}, as seen, instead of {}\n", key, seen, in_file);
    }
    if (report.found->missing() != vision::NotFound::kNothing) {
      text += fmt::format("  not everything was found, so the robot file is the start: {}\n",
                          estimation::what_to_change(*report.found));
    }
    if (report.exchanged) {
      text +=
          "  the cameras are exchanged: the new robot file exchanges cameras.lower and cameras.upper;\n"
          "  a run with the old file has them the wrong way round, and so have recordings\n";
    }
    text += "\n";
  }
  text += fmt::format(
      "{} frames ({} more without two landmarks), {} sightings in the lower and {} in the upper view, {} outliers\n\n",
      r.frames_used, r.frames_dropped, r.sightings[0], r.sightings[1], r.outliers);
  text += fmt::format("{:34} {:4} {:>12} {:>12} {:>10} {:>9}\n", "", "", "before", "after", "sigma", "change");
  bool was_derived = false;
  for (const vision::CalibratedParameter& p : r.parameters) {
    if (p.derived && !was_derived) text += "follows from these:\n";
    was_derived = p.derived;
    const Shown s = shown(p.name);
    const int decimals = decimals_for(p.sigma * s.factor);
    text += fmt::format("{:34} {:4} {:12.{}f} ", s.name, s.unit, p.before * s.factor, decimals);
    if (p.observed) {
      text += fmt::format("{:12.{}f} {:10.{}f} {:7.1f} s\n", p.after * s.factor, decimals, p.sigma * s.factor, decimals,
                          (p.after - p.before) / p.sigma);
    } else if (p.derived) {
      text += fmt::format("{:12.{}f} {:10.{}f}  not observed\n", p.after * s.factor, decimals, p.sigma * s.factor,
                          decimals);
    } else {
      text += fmt::format("{:>12} {:10.{}f}  not observed\n", "kept", p.sigma * s.factor, decimals);
    }
  }
  text +=
      "\nchange: in sigmas. not observed: the drive measures it less precisely than the prior, so it\n"
      "keeps its value and the sigma of the prior.\n\n";
  text += circles_line("lower", report.circles[0]);
  text += circles_line("upper", report.circles[1]);
  text += fmt::format(
      "\nresiduals of the sightings, rms of a pixel coordinate: lower {:.3f} -> {:.3f} px, upper {:.3f} -> {:.3f} px\n",
      r.rms_before_px[0], r.rms_after_px[0], r.rms_before_px[1], r.rms_after_px[1]);
  text += fmt::format(
      "they scatter {:.2f} times as much as they state{}\n"
      "an error of {:.3f} px is common to each landmark in a view; more frames do not average it away\n",
      r.sighting_scale, r.sighting_scale > 1 ? "; all sigmas are scaled by this factor" : "", r.systematic_px);
  text += fmt::format("{} rounds of sighting and solving{}\n", report.rounds,
                      report.is_settled ? "" : "; the last one still moved a number by more than 0.3 of its sigma");
  if (r.wheel_scale > 0) {
    text += fmt::format("the wheels scatter {:.2f} times as much as a slip of {} would make them\n", r.wheel_scale,
                        report.slip);
  }
  return text;
}

nlohmann::ordered_json belief_json(const Report& report) {
  config::Map map;
  map.landmarks = report.result.landmarks;
  const Eigen::Index count = report.result.belief_covariance.rows();
  Eigen::MatrixXd covariance = report.result.belief_covariance;
  // Without a motion of the body there is nothing to learn about the times, which keep their own uncertainty.
  const config::RigSigma& believed = report.believed;
  const double times_s[vision::kTimeNumbers]{believed.late_s, believed.late_s, believed.readout_s, believed.readout_s};
  for (int i = 0; i < vision::kTimeNumbers; ++i) {
    double& variance = covariance(count - vision::kTimeNumbers + i, count - vision::kTimeNumbers + i);
    if (variance == 0) variance = times_s[i] * times_s[i];
  }
  // A robot file has one radius for both wheels, so that a ratio other than 1 is an error of it.
  const Eigen::Index ratio = count - vision::kTimeNumbers - 2;
  const auto& parameters = report.result.parameters;
  const auto found = std::ranges::find(parameters, "wheel_ratio", &vision::CalibratedParameter::name);
  const double off = found == parameters.end() ? 0 : found->after - 1;
  const double variance = covariance(ratio, ratio) + off * off;
  covariance.row(ratio).setZero();
  covariance.col(ratio).setZero();
  covariance(ratio, ratio) = variance;

  const Eigen::VectorXd rig = vision::numbers_of(report.after);
  std::vector<double> values(rig.begin(), rig.end());
  for (const Landmark& l : report.result.landmarks) {
    values.insert(values.end(), {l.x_m, l.y_m, l.top_m, l.radius_m});
  }
  values.insert(values.end(), {report.drive.wheel_radius_m, 1.0, report.drive.wheel_separation_m});
  const config::RigView &lower = report.rig.lower, &upper = report.rig.upper;
  values.insert(values.end(), {lower.late_s, upper.late_s, lower.readout_s, upper.readout_s});
  nlohmann::ordered_json belief{{"names", config::belief_names(map)}, {"values", values}};
  for (const auto& row : covariance.rowwise()) {
    belief["covariance"].push_back(std::vector<double>(row.begin(), row.end()));
  }
  return belief;
}

nlohmann::ordered_json solution_json(const Report& report) {
  const vision::CalibrationResult& r = report.result;
  nlohmann::ordered_json json;
  json["twocone"] = runlog::version();
  json["commit"] = runlog::commit();
  json["compiler"] = runlog::compiler();
  json["robot"] = report.robot;
  json["runs"] = report.runs;
  json["rounds"] = report.rounds;
  json["settled"] = report.is_settled;
  json["frames"] = r.frames_used;
  json["frames_dropped"] = r.frames_dropped;
  json["outliers"] = r.outliers;
  json["sighting_scale"] = r.sighting_scale;
  json["systematic_px"] = r.systematic_px;
  if (r.wheel_scale > 0) json["wheel_scale"] = r.wheel_scale;
  return json;
}

std::string to_json(const Report& report) {
  using Json = nlohmann::ordered_json;
  const vision::CalibrationResult& r = report.result;
  Json json = solution_json(report);
  if (report.found) {
    Json& found = json["from_images"];
    found["lines"] = estimation::lines_of(*report.found);
    found["exchanged"] = report.exchanged;
    found["missing"] = to_string(report.found->missing());
    found["replaced"] = Json::array();
    for (const auto& [key, in_file, seen] : report.replaced) {
      found["replaced"].push_back({{"key", "rig." + key}, {"in_file", in_file}, {"seen", seen}});
    }
  }
  for (const std::size_t view : {0, 1}) {
    Json& node = json["views"][view == 0 ? "lower" : "upper"];
    node["sightings"] = r.sightings[view];
    node["rms_before_px"] = r.rms_before_px[view];
    node["rms_after_px"] = r.rms_after_px[view];
    if (const auto& rim = report.circles[view].rim) {
      node["rim"] = {{"centre_px", {rim->centre_px.x(), rim->centre_px.y()}},
                     {"sigma_centre_px", rim->sigma_centre_px},
                     {"radius_px", rim->radius_px},
                     {"sigma_radius_px", rim->sigma_radius_px},
                     {"support", rim->support}};
    }
    if (const auto& tip = report.circles[view].tip) {
      node["tip"] = {{"centre_px", {tip->centre_px.x(), tip->centre_px.y()}}, {"sigma_px", tip->sigma_px}};
    }
  }
  json["parameters"] = Json::array();
  for (const vision::CalibratedParameter& p : r.parameters) {
    json["parameters"].push_back({{"name", p.name},
                                  {"before", p.before},
                                  {"after", p.after},
                                  {"sigma", p.sigma},
                                  {"prior_sigma", p.prior_sigma},
                                  {"change_in_sigmas", (p.after - p.before) / p.sigma},
                                  {"observed", p.observed},
                                  {"derived", p.derived}});
  }
  if (report.has_one_map) json["belief"] = belief_json(report);
  return json.dump(2) + "\n";
}

std::string residual_figure(const Report& report, vision::Side side) {
  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0:.0f}\" height=\"{1:.0f}\" viewBox=\"0 0 {0:.0f} {1:.0f}\" "
      "font-family=\"sans-serif\" font-size=\"14\" fill=\"#333333\">\n<title>Residuals in the {2} view before and "
      "after calibration</title>\n<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n"
      "<text x=\"{3:.0f}\" y=\"18\" font-weight=\"bold\">{2} view: measured minus predicted</text>\n",
      2 * kPanel_px, kPanel_px + kHead_px + kMargin_px, to_string(side), kMargin_px);
  for (const bool is_after : {false, true}) svg += draw(report, side, is_after);
  if (report.result.outliers > 0) {
    svg += fmt::format("<text x=\"{:.0f}\" y=\"{:.0f}\" fill=\"#cc3311\">red: outliers, left out</text>\n", kMargin_px,
                       kPanel_px + kHead_px + kMargin_px / 2);
  }
  return svg + "</svg>\n";
}

}  // namespace twocone::calibrate
