// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>

#include <fmt/format.h>

#include "apps/compare/show/sections.h"
#include "apps/compare/show/wording.h"
#include "apps/report/kit/html.h"

namespace twocone::compare {
namespace {

namespace html = report::html;
using report::escape;

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
  const auto count = [&](Light light) {
    return std::count_if(comparison.rows.begin(), comparison.rows.end(),
                         [&](const Row& row) { return row.light == light; });
  };
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
