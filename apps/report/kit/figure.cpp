// SPDX-License-Identifier: Apache-2.0
#include "apps/report/kit/figure.h"

#include <fmt/format.h>

#include "apps/report/kit/html.h"
#include "apps/report/kit/markup.h"

namespace twocone::report {
namespace {

/// Returns a figure with its caption.
std::string figure_html(const Figure& figure) {
  std::string caption = html::text("strong", figure.title + ".");
  if (!figure.number.empty()) caption += html::text("span", fmt::format("The paper's {}. ", figure.number));
  caption = html::element("figcaption", caption + escape(figure.caption));
  return html::element("figure", inline_svg(figure.svg, figure.stem) + caption,
                       fmt::format("id=\"{}\"{}", escape(figure.stem), figure.wide ? " class=\"wide\"" : ""));
}

}  // namespace

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
