// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/scene/scene_condition.h"

#include <charconv>
#include <cmath>
#include <map>
#include <system_error>

namespace twocone::sim_povray {

std::optional<SectionKind> section_begun_by(std::string_view directive) {
  static const std::map<std::string_view, SectionKind> kKinds{
      {"if", SectionKind::kIf},         {"ifdef", SectionKind::kIf},   {"ifndef", SectionKind::kIf},
      {"switch", SectionKind::kSwitch}, {"while", SectionKind::kLoop}, {"for", SectionKind::kLoop},
      {"macro", SectionKind::kMacro}};
  const auto found = kKinds.find(directive);
  return found == kKinds.end() ? std::nullopt : std::optional(found->second);
}

Truth literal_condition(Lexer ahead) {
  int parentheses = 0;
  Token token = ahead.next();
  for (; token.is('('); token = ahead.next()) ++parentheses;
  while (token.is('-') || token.is('+')) token = ahead.next();
  Truth truth = Truth::kUnknown;
  if (token.kind == Token::Kind::kNumber) {
    double value = 0;
    const auto [end, error] = std::from_chars(token.text.data(), token.text.data() + token.text.size(), value);
    if (error != std::errc() || end != token.text.data() + token.text.size()) return Truth::kUnknown;
    // POV-Ray takes numbers this near to 0 as false.
    constexpr double kFalseBelow = 1e-10;
    truth = std::abs(value) < kFalseBelow ? Truth::kFalse : Truth::kTrue;
  } else if (token.text == "false" || token.text == "no" || token.text == "off") {
    truth = Truth::kFalse;
  } else if (token.text == "true" || token.text == "yes" || token.text == "on") {
    truth = Truth::kTrue;
  }
  if (parentheses == 0) return Truth::kUnknown;
  for (; parentheses > 0; --parentheses) {
    if (!ahead.next().is(')')) return Truth::kUnknown;
  }
  return truth;
}

void Branches::enter(Truth condition) {
  dead = reached == Truth::kFalse || condition == Truth::kFalse;
  uncertain = !dead && !(reached == Truth::kTrue && condition == Truth::kTrue);
  if (condition == Truth::kTrue) {
    reached = Truth::kFalse;
  } else if (condition == Truth::kUnknown && reached == Truth::kTrue) {
    reached = Truth::kUnknown;
  }
}

}  // namespace twocone::sim_povray
