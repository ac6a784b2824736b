// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "apps/report/figures/figure.h"
#include "apps/report/figures/view_figures.h"

namespace twocone::report {

/// Figures that belong together. Those without an SVG are left out; a group without any and without tables too.
struct FigureGroup {
  std::string id;  ///< in the page
  std::string title;
  std::string intro;  ///< plain text, may be empty
  std::vector<Figure> figures;
  std::string tables{};  ///< HTML, before the figures
};

/// All that the page shows.
struct PageContent {
  const runs::RunData& run;
  const runs::Summary& summary;
  const runs::Summary* baseline = nullptr;  ///< of method `paper` on the same frames
  std::vector<FigureGroup> groups;
  std::vector<FrameView> frames;
  std::vector<std::string> notes;
};

/// A figure with its caption.
std::string figure_html(const Figure& figure);

/// report.html: one page that needs no other file. UTF-8, well-formed XML too, the same bytes for the same content.
std::string page(const PageContent& content);

}  // namespace twocone::report
