// SPDX-License-Identifier: Apache-2.0
#include "apps/compare/show/page.h"

#include <fmt/format.h>

#include "apps/compare/show/page_style.h"
#include "apps/compare/show/sections.h"
#include "apps/compare/show/wording.h"
#include "apps/report/kit/html.h"

namespace twocone::compare {
namespace {

namespace html = report::html;

std::string named(const std::string& name) { return name.empty() ? "not named" : name; }

std::string what_html(const Comparison& comparison) {
  std::string text = html::facts(
      {{"simulated", fmt::format("{}, {} frames{}", named(comparison.simulated), comparison.simulated_frames,
                                 comparison.is_rendered ? ", rendered at the real run's poses" : "")},
       {"real", fmt::format("{}, {} frames", named(comparison.real), comparison.real_frames)},
       {"matched",
        fmt::format("{} frames by time, {} by pose", comparison.matched_by_time, comparison.matched_by_pose)},
       {"poses of the real robot", comparison.reference.empty() ? "unknown" : comparison.reference}});
  if (!comparison.notes.empty()) text += html::text("h3", "Notes") + html::list(comparison.notes);
  return html::section("what", "What was compared", text);
}

/// A section of the page, with its link.
struct Part {
  std::string id, title, inner;
};

std::string page_of(const Comparison& comparison, const std::vector<Part>& parts,
                    const std::vector<std::string>& notes) {
  const std::string title =
      fmt::format("twocone compare: {} against {}", named(comparison.simulated), named(comparison.real));
  const std::string verdict = headline(comparison);
  constexpr std::size_t kLong = 160;  // longer texts need a smaller type size
  std::string main =
      html::text("h1", title) +
      html::text("p", verdict, verdict.size() > kLong ? "class=\"headline long\"" : "class=\"headline\"");
  if (const std::string tests = headline_tests(comparison); !tests.empty()) main += html::text("p", tests);
  std::vector<std::pair<std::string, std::string>> places{{"what", "What was compared"}};
  std::string sections;
  for (const Part& part : parts) {
    places.emplace_back(part.id, part.title);
    sections += html::section(part.id, part.title, part.inner);
  }
  main += html::navigation(places) + what_html(comparison) + sections;
  main += html::section("page-notes", "Notes on this page",
                        notes.empty() ? html::text("p", "Nothing is missing.") : html::list(notes));
  return html::document(title, std::string(report::style()) + std::string(page_style()), html::element("main", main),
                        std::string(report::script()) + std::string(page_script()));
}

}  // namespace

Status write_page(const Comparison& comparison, const std::filesystem::path& folder) {
  const std::filesystem::path figures = folder / "figures";
  const report::Gnuplot gnuplot("gnuplot", figures);
  if (Status ready = gnuplot.prepare(); !ready) return ready;

  std::vector<std::string> notes;
  const report::DrawingTools tools{gnuplot, figures, notes};
  std::vector<Part> parts{{"why", "Causes", causes_html(comparison)},
                          {"gaps", "Gaps before and after", gaps_html(comparison)},
                          {"stages", "Stage by stage", stages_html(comparison)}};
  const auto add = [&](const char* id, const char* title, std::string inner, const char* missing) {
    if (inner.empty()) {
      notes.emplace_back(missing);
    } else {
      parts.push_back({id, title, std::move(inner)});
    }
  };
  add("frames", "Frames", exhibits_html(comparison, notes), "No frames are shown: there is no matched pair of images.");
  add("residuals", "Residuals", report::figures_html(draw_residuals(comparison, tools)),
      "No range residuals are shown.");
  add("paths-over", "Paths", report::figures_html(draw_paths(comparison, tools)), "No paths are shown.");
  return report::write_file(folder / "compare.html", page_of(comparison, parts, notes));
}

}  // namespace twocone::compare
