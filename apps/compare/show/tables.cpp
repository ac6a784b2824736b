// SPDX-License-Identifier: Apache-2.0
#include "apps/compare/show/sections.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "apps/report/kit/figure.h"
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
    // All cells of numbers have the same number of lines, which keeps the numbers of one component side by side.
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

std::string gap_of(const Row& row) {
  if (!row.gap || !row.gap_sigma || !(*row.gap_sigma > 0)) return plain_number(row.gap);
  return fmt::format("{}\u00a0\u00b1\u00a0{}", to_precision_of(*row.gap_sigma, *row.gap),
                     to_precision_of(*row.gap_sigma, *row.gap_sigma));
}

std::string limit_of(const Row& row) {
  const std::string key = row.limit && !row.limit_key.empty() ? html::text("small", row.limit_key) : "";
  return key + escape(plain_number(row.limit));
}

std::string lights_sentence(const Comparison& comparison) {
  const auto count = [&](Light light) { return std::ranges::count(comparison.rows, light, &Row::light); };
  const std::array<std::pair<Light, const char*>, 4> kMeanings{{{Light::kGreen, "within the limit"},
                                                                {Light::kAmber, "within twice the limit"},
                                                                {Light::kRed, "beyond twice the limit"},
                                                                {Light::kCannotTell, "with a sigma above the limit"}}};
  std::string text;
  for (const auto& [light, meaning] : kMeanings) {
    text += fmt::format("{}{} {} {}", text.empty() ? "" : ", ", light_html(light), count(light), meaning);
  }
  return html::element(
      "p", text + fmt::format("; {} without a limit, or without a number to compare with it.", count(Light::kNone)));
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

std::string stages_html(const Comparison& comparison) {
  if (comparison.rows.empty()) return html::text("p", "No stage was compared.");
  const std::vector<std::string> heads{"quantity", "unit", "simulated", "real", "gap", "limit", "light", "note"};
  html::Table table("Both sides, their gap and its limit", html::head_row(heads), "class=\"stages\"");
  std::optional<Stage> stage;
  for (const Row& row : comparison.rows) {
    if (row.stage != stage) {
      stage = row.stage;
      std::vector<std::string> title(heads.size());
      title.front() = escape(to_string(row.stage));
      table.add(title, "class=\"stage\"");
    }
    table.add({escape(row.name), escape(row.unit), escape(plain_number(row.simulated)), escape(plain_number(row.real)),
               escape(gap_of(row)), limit_of(row), light_html(row.light), escape(row.note)});
  }
  return lights_sentence(comparison) + table.str();
}

}  // namespace twocone::compare
