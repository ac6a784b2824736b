// SPDX-License-Identifier: Apache-2.0
#include "apps/compare/compare.h"

#include <fmt/format.h>

#include "apps/compare/show/sections.h"
#include "apps/report/kit/html.h"

namespace twocone::compare {
namespace {

namespace html = report::html;

// The styles that the page needs in addition to the report's. Neither text holds < or &, so that the page stays
// well-formed XML.
constexpr std::string_view kStyle = R"css(
.headline.long { font-size: clamp(1.15rem, 2.4vw, 1.45rem); max-width: 46em; }
.light { white-space: nowrap; font-weight: 600; }
.light.green { color: var(--good); }
.light.amber { color: var(--amber); }
.light.red { color: var(--red); }
:root { --amber: #8a5a00; --red: #b3160a; }
@media (prefers-color-scheme: dark) { :root { --amber: #e8b24a; --red: #ff7b6b; } }
.sources th, .sources td { vertical-align: top; }
.sources td:nth-child(2), .sources th:nth-child(2), .sources td:nth-child(n+7), .sources th:nth-child(n+7) {
  text-align: left;
}
.sources { font-size: .92rem; }
.sources th, .sources td { padding: .34rem .42rem; }
.stages small { color: var(--soft); margin-right: .6em; }
.stages td, .stages th { vertical-align: top; }
.stages td:last-child, .stages thead th:last-child { text-align: left; white-space: normal; min-width: 9rem; }
.stages td:nth-child(2), .stages th:nth-child(2), .stages td:nth-child(7), .stages th:nth-child(7) {
  text-align: left;
}
.stages .stage th { padding-top: 1rem; color: var(--accent); }
details { margin: .75rem 0; }
summary { cursor: pointer; font-weight: 600; }
.sliders { background: var(--card); border: 1px solid var(--line); border-radius: 8px; padding: 0 0 .7rem;
  position: sticky; top: 0; z-index: 1; }
.sliders label, .sliders span { white-space: nowrap; color: var(--soft); }
.sliders label { min-width: 8.5em; }
.pairs { display: grid; grid-template-columns: 1fr 1fr; gap: .75rem; margin: .75rem 0; }
.pairs figure { margin: 0; }
.pairs figcaption { padding: .4rem .8rem .5rem; }
.over { opacity: var(--real, .5); }
.frame > figure { margin-bottom: .75rem; }
.strips { display: grid; grid-template-columns: 6.5rem 1fr; gap: 2px 0; align-items: center; }
.strips .strip-name { font-size: .88rem; color: var(--soft); padding-left: .8rem; }
.bearings { position: relative; height: 1.3rem; margin-left: 6.5rem; font-size: .8rem; color: var(--soft); }
.bearings span { position: absolute; left: 50%; transform: translateX(-50%); }
.bearings span:first-child { left: 0; transform: none; }
.bearings span:nth-child(2) { left: 25%; }
.bearings span:nth-child(4) { left: 75%; }
.bearings span:last-child { left: auto; right: 0; transform: none; }
.ramp { display: inline-block; width: 10rem; height: .8em; border: 1px solid var(--line); margin: 0 .4em;
  vertical-align: -.05em; }
@media (max-width: 560px) { .bearings span:nth-child(even) { display: none; } }
@media print {
  .sliders { display: none; }
  .ramp { print-color-adjust: exact; -webkit-print-color-adjust: exact; }
}
)css";

// The script of the blend's slider. Without it the real image lies half transparent over the simulated one.
constexpr std::string_view kScript = R"js(
(function () {
  var blend = document.getElementById("blend");
  if (!blend) { return; }
  function show() { document.documentElement.style.setProperty("--real", Number(blend.value) / 100); }
  blend.disabled = false;
  blend.addEventListener("input", show);
  show();
}());
)js";

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
  main += html::section("page-notes", "Notes on this page", html::list(notes, "Nothing is missing."));
  return html::document(title, fmt::format("{}{}", report::style(), kStyle), html::element("main", main),
                        fmt::format("{}{}", report::script(), kScript));
}

}  // namespace

Status write_page(const Comparison& comparison, const std::filesystem::path& folder) {
  const report::Gnuplot gnuplot{"gnuplot", folder / "figures"};
  if (Status ready = gnuplot.prepare(); !ready) return ready;

  std::vector<std::string> notes;
  const report::DrawingTools tools{gnuplot, notes};
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
