// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "apps/calibrate/calibrate.h"

// The SVG consists of lines and circles and is written directly. Arrows over a circle need no plotting program.
namespace twocone::calibrate {
namespace {

constexpr double kPanel_px = 420;
constexpr double kMargin_px = 20;
constexpr double kHead_px = 64;

struct Panel {
  const char* title;
  Eigen::Vector2d vision::SightingResidual::*which;
  const vision::MirrorView& view;
  double rms_px;
};

/// Returns 1, 2 or 5 times a power of ten, so that a residual of the rms is drawn about 12 px long.
double magnification(double rms_px) {
  const double wanted = 12 / std::max(rms_px, 1e-6);
  const double power = std::pow(10, std::floor(std::log10(wanted)));
  const double lead = wanted / power;
  return power * (lead >= 5 ? 5 : lead >= 2 ? 2 : 1);
}

std::string draw(const Report& report, vision::Side side, const Panel& panel, double left_px) {
  const vision::MirrorViewSettings& s = panel.view.settings();
  const double scale = (kPanel_px / 2 - kMargin_px) / s.rim_radius_px;
  const double times = magnification(panel.rms_px);
  const auto place = [&](const Eigen::Vector2d& pixel_px) -> Eigen::Vector2d {
    return Eigen::Vector2d(left_px + kPanel_px / 2, kHead_px + kPanel_px / 2) + scale * (pixel_px - s.centre_px);
  };
  const Eigen::Vector2d centre = place(s.centre_px);
  std::string svg = fmt::format(
      "<text x=\"{:.1f}\" y=\"38\">{}: rms {:.3f} px, drawn {:g} times</text>\n"
      "<circle cx=\"{:.2f}\" cy=\"{:.2f}\" r=\"{:.2f}\" fill=\"none\" stroke=\"#777777\"/>\n"
      "<path d=\"M {:.2f} {:.2f} h 8 M {:.2f} {:.2f} v 8\" stroke=\"#777777\"/>\n",
      left_px + kMargin_px, panel.title, panel.rms_px, times, centre.x(), centre.y(), scale * s.rim_radius_px,
      centre.x() - 4, centre.y(), centre.x(), centre.y() - 4);
  // One pixel of the image is `scale` pixels of the figure.
  for (const vision::SightingResidual& r : report.result.residuals) {
    const vision::LandmarkSighting& sighting = report.problem.frames[r.frame].sightings[r.sighting];
    if (sighting.side != side) continue;
    const Eigen::Vector2d from = place(sighting.sighting.pixel_px);
    Eigen::Vector2d arrow = times * (r.*panel.which);
    // The arrow of an outlier could cross the whole figure.
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

std::string residual_figure(const Report& report, vision::Side side) {
  const std::size_t view = side == vision::Side::kLower ? 0 : 1;
  const bool is_lower = side == vision::Side::kLower;
  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0:.0f}\" height=\"{1:.0f}\" viewBox=\"0 0 {0:.0f} {1:.0f}\" "
      "font-family=\"sans-serif\" font-size=\"14\" fill=\"#333333\">\n<title>Residuals in the {2} view before and "
      "after "
      "calibration</title>\n<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n"
      "<text x=\"{3:.0f}\" y=\"18\" font-weight=\"bold\">{2} view: measured minus predicted</text>\n",
      2 * kPanel_px, kPanel_px + kHead_px + kMargin_px, to_string(side), kMargin_px);
  svg += draw(report, side,
              {"before", &vision::SightingResidual::before_px, is_lower ? report.before.lower : report.before.upper,
               report.result.rms_before_px[view]},
              0);
  svg += draw(report, side,
              {"after", &vision::SightingResidual::after_px, is_lower ? report.after.lower : report.after.upper,
               report.result.rms_after_px[view]},
              kPanel_px);
  if (report.result.outliers > 0) {
    svg += fmt::format("<text x=\"{:.0f}\" y=\"{:.0f}\" fill=\"#cc3311\">red: outliers, left out</text>\n", kMargin_px,
                       kPanel_px + kHead_px + kMargin_px / 2);
  }
  return svg + "</svg>\n";
}

}  // namespace twocone::calibrate
