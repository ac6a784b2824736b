// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "apps/compare/show/sections.h"
#include "apps/compare/show/wording.h"
#include "apps/report/kit/html.h"

namespace twocone::compare {
namespace {

namespace html = report::html;
using report::escape;

/// Returns a cell with one line for each item; an en dash without any.
template <typename Items, typename Line>
std::string lines(const Items& items, Line line) {
  std::vector<std::string> texts;
  texts.reserve(items.size());
  for (const auto& item : items) texts.push_back(escape(line(item)));
  return texts.empty() ? "\u2013" : fmt::format("{}", fmt::join(texts, "<br/>"));
}

std::string table_of(const std::vector<const Source*>& sources, const std::string& caption, bool differs) {
  std::vector<std::string> heads{"source", "number", "simulated", "real", "real \u2212 simulated", "p-value"};
  if (differs) heads.insert(heads.end(), {"explains", "hard to distinguish from"});
  html::Table table(caption, html::head_row(heads), "class=\"sources\"");
  for (const Source* source : sources) {
    // The cells of numbers have as many lines each, so that those of one component are level.
    std::vector<std::string> cells{
        escape(source->name()),
        lines(source->components, [](const Component& c) { return c.name; }),
        lines(source->components, [](const Component& c) { return to_precision_of(c.sigma, c.simulated); }),
        lines(source->components, [](const Component& c) { return to_precision_of(c.sigma, c.real); }),
        lines(source->components,
              [](const Component& c) { return with_sigma(c.difference(), c.sigma) + unit_after("\u00a0", c.unit); }),
        escape(chance(source->p_value))};
    if (differs) {
      cells.push_back(lines(source->shares, [](const Share& share) {
        return fmt::format("{} of {}", percent(share.share), to_string(share.of));
      }));
      cells.push_back(lines(source->confusable, [](const std::string& other) { return other; }));
    }
    table.add(cells);
  }
  return table.str();
}

std::string advice_html(const std::vector<const Source*>& sources) {
  std::string items;
  for (const Source* source : sources) {
    items += html::element("li", html::text("strong", source->name() + ":") + escape(source->advice()));
  }
  return html::text("h3", "What to change") + html::element("ul", items);
}

std::string folded(const std::string& title, const std::string& inner) {
  return html::element("details", html::text("summary", title) + inner);
}

std::string test_sentence(const Comparison& comparison, std::size_t tested) {
  if (tested == 0) return "No source was tested.";
  std::string text = fmt::format(
      "{} source{} tested by \u03c7\u00b2 against no difference. A whole comparison of two equal robots raises a "
      "false alarm with probability {:.2g}",
      tested, tested == 1 ? " was" : "s were", comparison.false_alarm);
  if (comparison.level > 0) text += fmt::format(", so a source counts as different where p < {:.2g}", comparison.level);
  return text + ".";
}

}  // namespace

std::string causes_html(const Comparison& comparison) {
  const std::vector<const Source*> differing = sources_by_share(comparison);
  const std::vector<const Source*> agreeing = comparison.sources_with(SourceVerdict::kAgrees);
  const std::vector<const Source*> undetermined = comparison.sources_with(SourceVerdict::kCannotTell);
  std::string text = html::text("p", test_sentence(comparison, differing.size() + agreeing.size()));
  if (!differing.empty()) {
    text += table_of(differing, "Sources that differ, sorted by the largest part of a gap that they explain", true);
    text += html::text("p",
                       "\u00b1: standard deviation. Explains: the part of a gap that disappears when this source is "
                       "corrected, shared among the sources; negative where a source hides a part of another's effect.",
                       "class=\"soft\"");
    text += advice_html(differing);
  }
  if (!agreeing.empty()) {
    text += folded(fmt::format("Tested without a difference: {}", agreeing.size()),
                   table_of(agreeing, "Sources whose difference is within the noise", false));
  }
  if (!undetermined.empty()) {
    std::vector<std::string> reasons;
    reasons.reserve(undetermined.size());
    for (const Source* source : undetermined) {
      reasons.push_back(source->name() + ": " + (source->reason.empty() ? "no reason is given" : source->reason));
    }
    text += folded(fmt::format("Cannot be determined: {}", undetermined.size()), html::list(reasons));
  }
  return text;
}

}  // namespace twocone::compare
