// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/scene/scene_text.h"

#include <map>

namespace twocone::sim_povray {
namespace {

constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
constexpr std::string_view kNameMark = "//*PMName";

// <cctype> is not used: it depends on the locale, and POV-Ray's language does not.
bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_word_begin(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
bool is_word(char c) { return is_word_begin(c) || is_digit(c); }
bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r' || c == '\v' || c == '\f'; }
bool is_in_line(char c) { return c != '\n' && c != '\r'; }
bool continues_character(char c) { return (static_cast<unsigned char>(c) & 0xC0U) == 0x80U; }

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return text;
}

}  // namespace

Lexer::Lexer(std::string_view text) : text_(text) {
  if (text_.starts_with(kByteOrderMark)) here_.offset = kByteOrderMark.size();
}

void Lexer::step() {
  const char c = at();
  ++here_.offset;
  if (c == '\n' || (c == '\r' && at() != '\n')) {
    ++here_.line;
    here_.column = 1;
  } else if (!continues_character(c)) {
    ++here_.column;
  }
}

void Lexer::skip_block_comment() {
  const Place begin = here_;
  int depth = 0;
  do {
    if (done()) throw SceneError{begin, "this comment has no end (comments nest: each '/*' needs its own '*/')"};
    const bool opens = at() == '/' && at(1) == '*';
    const bool closes = at() == '*' && at(1) == '/';
    if (opens) ++depth;
    if (closes) --depth;
    step();
    if (opens || closes) step();
  } while (depth > 0);
}

std::string_view Lexer::take_while(bool (*belongs)(char)) {
  const std::size_t begin = here_.offset;
  while (!done() && belongs(at())) step();
  return since(begin);
}

std::string_view Lexer::take_number() {
  const std::size_t begin = here_.offset;
  take_while([](char c) { return is_digit(c) || c == '.'; });
  const bool sign = at(1) == '+' || at(1) == '-';
  if ((at() == 'e' || at() == 'E') && is_digit(at(sign ? 2 : 1))) {
    step();
    if (sign) step();
    take_while(is_digit);
  }
  return since(begin);
}

std::string_view Lexer::take_string() {
  const Place begin = here_;
  step();
  while (!done() && at() != '"') {
    if (at() == '\\') step();
    if (!done()) step();
  }
  if (done()) throw SceneError{begin, "this string has no closing quote"};
  step();
  return since(begin.offset);
}

/// Skips blanks and comments. Returns true if it found a name comment, which is then in `name`.
bool Lexer::skip_blanks(Token& name) {
  while (!done()) {
    if (is_blank(at())) {
      step();
    } else if (at() == '/' && at(1) == '*') {
      skip_block_comment();
    } else if (at() == '/' && at(1) == '/') {
      const Place begin = here_;
      const std::string_view line = take_while(is_in_line);
      if (!line.starts_with(kNameMark)) continue;
      const std::string_view rest = line.substr(kNameMark.size());
      if (rest.empty() || !is_blank(rest.front()) || trimmed(rest).empty()) continue;
      name = {Token::Kind::kName, trimmed(rest), begin};
      return true;
    } else {
      break;
    }
  }
  return false;
}

Token Lexer::next() {
  Token name;
  if (skip_blanks(name)) return name;
  const Place begin = here_;
  if (done()) return {Token::Kind::kEnd, {}, begin};
  if (is_word_begin(at())) return {Token::Kind::kWord, take_while(is_word), begin};
  if (is_digit(at()) || (at() == '.' && is_digit(at(1)))) return {Token::Kind::kNumber, take_number(), begin};
  if (at() == '"') return {Token::Kind::kString, take_string(), begin};
  const std::string_view symbol = text_.substr(here_.offset, 1);
  step();
  if (symbol != "#") return {Token::Kind::kSymbol, symbol, begin};
  // A name comment between `#` and its word names nothing.
  while (skip_blanks(name)) {
  }
  return {Token::Kind::kDirective, take_while(is_word), begin};
}

std::optional<SectionKind> section_begun_by(std::string_view directive) {
  static const std::map<std::string_view, SectionKind> kKinds{
      {"if", SectionKind::kIf},         {"ifdef", SectionKind::kIf},   {"ifndef", SectionKind::kIf},
      {"switch", SectionKind::kSwitch}, {"while", SectionKind::kLoop}, {"for", SectionKind::kLoop},
      {"macro", SectionKind::kMacro}};
  const auto found = kKinds.find(directive);
  return found == kKinds.end() ? std::nullopt : std::optional(found->second);
}

}  // namespace twocone::sim_povray
