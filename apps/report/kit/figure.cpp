// SPDX-License-Identifier: Apache-2.0
#include "apps/report/kit/figure.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "apps/report/kit/html.h"

namespace twocone::report {
namespace {

/// Luminance at which a colour's contrast with white is 3 to 1, as WCAG 2.1 requires of graphics: (1 + 0.05) / (Y +
/// 0.05).
constexpr double kLightestLine = 0.30;

int srgb_code(double linear) {
  const double value = std::isfinite(linear) ? std::clamp(linear, 0.0, 1.0) : 0.0;
  const double coded = value <= 0.0031308 ? 12.92 * value : 1.055 * std::pow(value, 1 / 2.4) - 0.055;  // IEC 61966-2-1
  return static_cast<int>(std::lround(255 * coded));
}

/// Returns a figure with its caption.
std::string figure_html(const Figure& figure) {
  std::string caption = html::text("strong", figure.title + ".");
  if (!figure.number.empty()) caption += html::text("span", fmt::format("The paper's {}. ", figure.number));
  caption = html::element("figcaption", caption + escape(figure.caption));
  return html::element("figure", inline_svg(figure.svg, figure.stem) + caption,
                       fmt::format("id=\"{}\"{}", escape(figure.stem), figure.wide ? " class=\"wide\"" : ""));
}

}  // namespace

std::string own_colour(const std::array<double, 3>& colour) {
  return fmt::format("#{:02x}{:02x}{:02x}", srgb_code(colour[0]), srgb_code(colour[1]), srgb_code(colour[2]));
}

std::string line_colour(const std::array<double, 3>& colour) {
  const double luminance = 0.2126 * colour[0] + 0.7152 * colour[1] + 0.0722 * colour[2];  // ITU-R BT.709
  const double factor = luminance > kLightestLine ? kLightestLine / luminance : 1.0;
  return own_colour({colour[0] * factor, colour[1] * factor, colour[2] * factor});
}

Figure drawn(const DrawingTools& tools, Figure figure, Plot plot) {
  plot.stem = figure.stem;
  plot.title = figure.title;
  if (Result<std::string> svg = tools.gnuplot.draw(plot)) {
    figure.svg = *std::move(svg);
  } else {
    tools.notes.push_back("The figure \"" + figure.title + "\" is missing: " + svg.error().message);
  }
  return figure;
}

std::string figures_html(const std::vector<Figure>& figures) {
  std::string text;
  for (const Figure& figure : figures) {
    if (!figure.svg.empty()) text += figure_html(figure);
  }
  return text.empty() ? "" : html::element("div", text, "class=\"figures\"");
}

}  // namespace twocone::report
