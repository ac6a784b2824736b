// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "apps/compare/show/sections.h"
#include "apps/compare/show/wording.h"
#include "apps/report/kit/figure.h"
#include "apps/report/kit/html.h"

namespace twocone::compare {
namespace {

namespace html = report::html;
using report::escape;

// Sizes in the drawing's own units.
constexpr double kWidth = 1000, kNamesEnd = 250, kBarsEnd = 850;
constexpr double kTop = 40, kBar = 14, kBarStep = 17, kGapStep = 2 * kBarStep + 20, kBottom = 8;

std::string svg_text(double x, double y, std::string_view anchor, std::string_view text, std::string_view more = "") {
  return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\" fill=\"#333333\"{}{}>{}</text>\n", x, y,
                     anchor, more.empty() ? "" : " ", more, escape(text));
}

std::string svg_bar(double x, double y, double width, double height, std::string_view colour) {
  return fmt::format("<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"{}\"/>\n", x, y, width,
                     height, colour);
}

double drawable(double value) { return std::isfinite(value) ? std::max(value, 0.0) : 0; }

/// Returns the bars of one gap. Each gap has its own scale, because their units differ.
std::string bars_of(const Gap& gap, double y) {
  const double floor = drawable(gap.floor.value_or(0));
  const double most = std::max({drawable(gap.before), drawable(gap.after), floor});
  const double scale = most > 0 ? (kBarsEnd - kNamesEnd) / most : 0;
  const std::string unit = unit_after(" ", gap.unit);
  std::string svg = svg_text(kNamesEnd - 12, y + kBarStep + 4, "end", to_string(gap.of), "font-weight=\"600\"");
  double top = y;
  for (const auto& [value, colour] :
       {std::pair{gap.before, report::kFixColour}, std::pair{gap.after, report::kOdometryColour}}) {
    const double width = drawable(value) * scale;
    svg += svg_bar(kNamesEnd, top, width, kBar, colour);
    svg += svg_text(std::max(kNamesEnd + width, kNamesEnd + floor * scale) + 8, top + kBar - 2, "start",
                    plain_number(value) + unit);
    top += kBarStep;
  }
  if (!gap.floor) return svg;
  return svg + fmt::format(
                   "<path d=\"M{0:.1f},{1:.1f}V{2:.1f}\" stroke=\"{3}\" stroke-width=\"2\" "
                   "stroke-dasharray=\"4 3\"/>\n",
                   kNamesEnd + floor * scale, y - 5, y + kBarStep + kBar + 5, report::kTruthColour);
}

std::string legend() {
  double x = kNamesEnd;
  std::string svg;
  for (const auto& [word, colour] : {std::pair{"before", report::kFixColour},
                                     std::pair{"after correction of the differences", report::kOdometryColour}}) {
    svg += svg_bar(x, 10, kBar, kBar, colour) + svg_text(x + kBar + 6, 10 + kBar - 2, "start", word);
    x += word == std::string_view("before") ? 100 : 300;
  }
  svg += fmt::format("<path d=\"M{:.1f},8v18\" stroke=\"{}\" stroke-width=\"2\" stroke-dasharray=\"4 3\"/>\n", x,
                     report::kTruthColour);
  return svg + svg_text(x + 8, 10 + kBar - 2, "start", "floor");
}

std::string drawing_of(const std::vector<Gap>& gaps) {
  double y = kTop + 8;
  std::string bars;
  for (const Gap& gap : gaps) {
    bars += bars_of(gap, y);
    y += kGapStep;
  }
  return fmt::format(
             "<svg viewBox=\"0 0 {:.0f} {:.0f}\" xmlns=\"http://www.w3.org/2000/svg\" role=\"img\" "
             "font-family=\"sans-serif\" font-size=\"14\">\n<title>Gaps before and after</title>\n",
             kWidth, y + kBottom) +
         legend() + bars + "</svg>\n";
}

}  // namespace

std::string gaps_html(const Comparison& comparison) {
  if (comparison.gaps.empty()) return html::text("p", "No gap was measured.");
  html::Table table("The same in numbers",
                    html::head_row({"gap", "unit", "before", "after", "floor", "unexplained", "unnamed"}));
  const auto share = [](const std::optional<double>& value) {
    return value ? escape(percent(*value)) : std::string("\u2013");
  };
  for (const Gap& gap : comparison.gaps) {
    table.add({escape(to_string(gap.of)), escape(gap.unit), escape(plain_number(gap.before)),
               escape(plain_number(gap.after)), escape(plain_number(gap.floor)), share(gap.unexplained),
               share(gap.unnamed)});
  }
  const std::string caption = html::text("strong", "Distance of the real run from a run without any difference.") +
                              escape(
                                  " Each gap has its own scale. Floor: the gap of the simulation, or of noise. "
                                  "Unexplained: the part of the gap that remains after the correction. Unnamed: the "
                                  "part that is corrected by numbers of the calibration that no source names as "
                                  "different.");
  return html::element("figure", drawing_of(comparison.gaps) + html::element("figcaption", caption),
                       "class=\"wide\" id=\"gap-bars\"") +
         table.str();
}

}  // namespace twocone::compare
