// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>
#include <Eigen/Eigenvalues>

#include "apps/calibrate/report_json.h"
#include "apps/report/kit/svg.h"
#include "apps/survey/survey.h"
#include "vision/uncertain_rig.h"

namespace twocone::survey {
namespace {

// Chi-squared of two degrees of freedom at 95 %.
constexpr double k95 = 5.991;

/// The 95 % ellipse of a landmark's place.
struct Ellipse {
  double major_m = 0, minor_m = 0;
  double direction_rad = 0;  ///< of the major axis, from world x
};

Eigen::Matrix2d covariance_of(const Report& report, std::size_t landmark) {
  const Eigen::Index at = vision::kRigNumbers + vision::kLandmarkNumbers * Eigen::Index(landmark);
  return report.solution.result.belief_covariance.block<2, 2>(at, at);
}

Ellipse ellipse_of(const Eigen::Matrix2d& covariance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(covariance);
  const Eigen::Vector2d lengths = (k95 * eigen.eigenvalues().cwiseMax(0)).cwiseSqrt();
  const Eigen::Vector2d major = eigen.eigenvectors().col(1);
  return {lengths[1], lengths[0], std::atan2(major.y(), major.x())};
}

}  // namespace

std::string table(const Report& report) {
  const vision::CalibrationResult& result = report.solution.result;
  std::string text = fmt::format("{:<12}{:>17}{:>17}{:>15}{:>15}{:>11}{:>10}\n", "landmark", "x mm", "y mm", "top mm",
                                 "radius mm", "sightings", "left out");
  for (const SurveyedLandmark& l : report.landmarks) {
    const auto number = [](double value_m, double sigma_m) {
      return fmt::format("{:.1f} +- {:.1f}", 1000 * value_m, 1000 * sigma_m);
    };
    const Landmark& m = l.landmark;
    text += fmt::format("{:<12}{:>17}{:>17}{:>15}{:>15}{:>11}{:>10}\n", m.name, number(m.x_m, m.sigma.x_m),
                        number(m.y_m, m.sigma.y_m), number(m.top_m, m.sigma.top_m),
                        number(m.radius_m, m.sigma.radius_m), l.sightings, l.outliers);
  }
  text += fmt::format(
      "{} of {} frames used, {} rounds{}; residuals, rms of a pixel coordinate: lower {:.3f} px, upper {:.3f} px\n",
      result.frames_used, result.frames_used + result.frames_dropped, report.solution.rounds,
      report.solution.is_settled ? "" : " (not settled)", result.rms_after_px[0], result.rms_after_px[1]);
  for (const MovedLandmark& moved : report.moved) {
    text += fmt::format("{} was moved by ({:+.1f}, {:+.1f}) mm, +- {:.1f}\n", moved.name, 1000 * moved.by_m.x(),
                        1000 * moved.by_m.y(), 1000 * moved.sigma_m);
  }
  for (const std::string& sentence : report.left_out) text += sentence + "\n";
  return text;
}

std::string to_json(const Report& report) {
  using Json = nlohmann::ordered_json;
  Json json = calibrate::solution_json(report.solution);
  json["rig"] = report.calibrated ? "found" : "held";
  json["rms_px"] = report.solution.result.rms_after_px;
  for (std::size_t i = 0; i < report.landmarks.size(); ++i) {
    const SurveyedLandmark& l = report.landmarks[i];
    const Landmark& m = l.landmark;
    const Ellipse ellipse = ellipse_of(covariance_of(report, i));
    json["landmarks"].push_back(
        {{"name", m.name},
         {"colour", m.colour},
         {"x_m", m.x_m},
         {"y_m", m.y_m},
         {"top_m", m.top_m},
         {"radius_m", m.radius_m},
         {"sigma_m", {m.sigma.x_m, m.sigma.y_m, m.sigma.top_m, m.sigma.radius_m}},
         {"ellipse_95",
          {{"major_m", ellipse.major_m}, {"minor_m", ellipse.minor_m}, {"direction_rad", ellipse.direction_rad}}},
         {"sightings", l.sightings},
         {"outliers", l.outliers}});
  }
  json["moved"] = Json::array();
  for (const MovedLandmark& moved : report.moved) {
    json["moved"].push_back(
        {{"name", moved.name}, {"by_m", {moved.by_m.x(), moved.by_m.y()}}, {"sigma_m", moved.sigma_m}});
  }
  json["left_out"] = report.left_out;
  json["belief"] = calibrate::belief_json(report.solution);
  return json.dump(2) + "\n";
}

std::string figure(const Report& report) {
  constexpr double kWidth_px = 900;
  constexpr double kMargin_px = 40;
  constexpr double kHead_px = 30;
  Bounds box = report.bounds;
  double greatest_m = 0;
  for (std::size_t i = 0; i < report.landmarks.size(); ++i) {
    const Landmark& l = report.landmarks[i].landmark;
    box.min_x_m = std::min(box.min_x_m, l.x_m - l.radius_m);
    box.max_x_m = std::max(box.max_x_m, l.x_m + l.radius_m);
    box.min_y_m = std::min(box.min_y_m, l.y_m - l.radius_m);
    box.max_y_m = std::max(box.max_y_m, l.y_m + l.radius_m);
    greatest_m = std::max(greatest_m, ellipse_of(covariance_of(report, i)).major_m);
  }
  const double per_m = (kWidth_px - 2 * kMargin_px) / (box.max_x_m - box.min_x_m);
  const double height_px = (box.max_y_m - box.min_y_m) * per_m + 2 * kMargin_px + kHead_px;
  const auto x = [&](double x_m) { return kMargin_px + (x_m - box.min_x_m) * per_m; };
  const auto y = [&](double y_m) { return kHead_px + kMargin_px + (box.max_y_m - y_m) * per_m; };
  // The greatest ellipse is drawn some 40 px long, by a round factor.
  constexpr double kLongest_px = 40;
  const double factor =
      greatest_m > 0 ? std::max(1.0, std::pow(10, std::floor(std::log10(kLongest_px / (greatest_m * per_m))))) : 1;
  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0:.0f}\" height=\"{1:.0f}\" viewBox=\"0 0 {0:.0f} {1:.0f}\" "
      "font-family=\"sans-serif\" font-size=\"14\" fill=\"#333333\">\n<title>The surveyed landmarks from "
      "above</title>\n"
      "<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n<text x=\"{2:.0f}\" y=\"20\" font-weight=\"bold\">"
      "Surveyed landmarks; 95 % ellipses of their places, {3:.0f} times as large; the robot's path</text>\n"
      "<rect x=\"{4:.1f}\" y=\"{5:.1f}\" width=\"{6:.1f}\" height=\"{7:.1f}\" fill=\"none\" stroke=\"#999999\"/>\n",
      kWidth_px, height_px, kMargin_px, factor, x(report.bounds.min_x_m), y(report.bounds.max_y_m),
      (report.bounds.max_x_m - report.bounds.min_x_m) * per_m, (report.bounds.max_y_m - report.bounds.min_y_m) * per_m);
  std::string path;
  for (const auto& pose : report.solution.result.poses) {
    if (pose) path += fmt::format("{:.1f},{:.1f} ", x(pose->x()), y(pose->y()));
  }
  svg += fmt::format("<polyline points=\"{}\" fill=\"none\" stroke=\"#0072b2\" stroke-width=\"1.5\"/>\n", path);
  for (std::size_t i = 0; i < report.landmarks.size(); ++i) {
    const Landmark& l = report.landmarks[i].landmark;
    const Ellipse ellipse = ellipse_of(covariance_of(report, i));
    svg += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{:.1f}\" fill=\"{}\" fill-opacity=\"0.4\"/>\n",
                       x(l.x_m), y(l.y_m), l.radius_m * per_m, report::own_colour(l.colour));
    svg += fmt::format(
        "<ellipse rx=\"{:.1f}\" ry=\"{:.1f}\" transform=\"translate({:.1f} {:.1f}) rotate({:.1f})\" fill=\"none\" "
        "stroke=\"#222222\"/>\n",
        factor * ellipse.major_m * per_m, factor * ellipse.minor_m * per_m, x(l.x_m), y(l.y_m),
        -ellipse.direction_rad * 180 / std::numbers::pi);
    svg += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\">{}</text>\n", x(l.x_m) + l.radius_m * per_m + 4, y(l.y_m) - 6,
                       report::escape(l.name));
  }
  return svg + "</svg>\n";
}

}  // namespace twocone::survey
