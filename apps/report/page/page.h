// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "apps/report/figures/figures.h"
#include "apps/report/kit/figure.h"

namespace twocone::report {

/// Figures that belong together. Figures without an SVG are left out, and so is a group without figures and tables.
struct FigureGroup {
  std::string id;  ///< in the page's HTML
  std::string title;
  std::vector<Figure> figures{};
  std::string tables{};  ///< HTML, shown before the figures
};

/// Everything that the page shows.
struct PageContent {
  const runlog::RunData& run;
  const runlog::Summary& summary;
  const runlog::Summary* baseline = nullptr;  ///< of method `paper` on the same frames
  std::vector<FigureGroup> groups;
  std::vector<FrameView> frames;
  std::vector<std::string> notes;
};

/// Returns report.html: one page that needs no other file. It is UTF-8 and well-formed XML, and equal content gives
/// equal bytes.
std::string page(const PageContent& content);

// The parts of the page that describe in words and tables how a run went. Each returns HTML, except headline().

/// Returns the result in one sentence, plain text.
std::string headline(const runlog::Summary& summary);

/// Returns the most important numbers.
std::string tiles(const runlog::Summary& summary);

/// Returns the criterion of success, whether the run met it, and how accurate the ground truth is.
std::string rules(const PageContent& content);

std::string range_table(const PageContent& content);
std::string coverage_table(const PageContent& content);
std::string position_table(const PageContent& content);

}  // namespace twocone::report
