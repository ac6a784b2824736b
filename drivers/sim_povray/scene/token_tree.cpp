// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/scene/token_tree.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <system_error>
#include <utility>

#include <fmt/format.h>

namespace twocone::sim_povray {
namespace {

using Kind = Token::Kind;

/// The limit of POV-Ray 3.7, which refuses one section more.
constexpr std::size_t kMostSections = 199;
/// POV-Ray has no limit here, but this one keeps the work in proportion to the text. Scenes written by programs have
/// about thirty.
constexpr std::size_t kMostBraces = 256;

enum class Truth { kFalse, kTrue, kUnknown };

/// Returns the value of the condition right after its directive if it is a literal: (0), (1), ((-2.5)), (false), (yes),
/// ...; else kUnknown.
Truth literal_condition(Lexer ahead) try {
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
} catch (const SceneError&) {
  return Truth::kUnknown;  // the text ends here, which is found again when this place is reached
}

/// The branches of one `#if` or `#switch`, entered one after the other.
struct Branches {
  Truth reached = Truth::kTrue;  // whether the present branch's condition is evaluated at all
  bool dead = false;             // the present branch is certainly not taken
  bool uncertain = false;        // the present branch may or may not be taken, or is taken more than once

  void enter(Truth condition) {
    dead = reached == Truth::kFalse || condition == Truth::kFalse;
    uncertain = !dead && !(reached == Truth::kTrue && condition == Truth::kTrue);
    if (condition == Truth::kTrue) {
      reached = Truth::kFalse;
    } else if (condition == Truth::kUnknown && reached == Truth::kTrue) {
      reached = Truth::kUnknown;
    }
  }
};

/// An open brace, parenthesis or bracket.
struct Bracket {
  std::size_t token = kNowhere;        // its index, or that of the macro's name that opened it
  bool fresh = true;                   // nothing but comments inside so far
  bool certain = true;                 // no macro and no condition decides whether it is open
  std::size_t uncertain = 0;           // conditions, loops and macros around it
  std::optional<std::size_t> named{};  // index among the blocks
};
using Brackets = std::vector<Bracket>;

/// An `#if ... #end` or a similar section, while it is open.
struct Section {
  SectionKind kind = SectionKind::kIf;
  Token directive{};
  std::size_t token = kNowhere;  // index of the directive, unless outer_dead
  bool outer_dead = false;
  bool in_branch = true;  // false between #switch and its first #case
  bool uneven = false;    // its brackets do not match within each branch
  Branches branches{};
  Brackets at_start{};
  std::optional<Brackets> after_first{};  // the first branch that is not dead gives the open brackets behind #end
  std::size_t closes = 0;                 // number of braces of its caller that a macro closes
};

/// Numbers of braces that a call of a macro closes and then opens.
struct MacroBraces {
  std::size_t closes = 0;
  std::size_t opens = 0;
};

class Pairing {
 public:
  explicit Pairing(std::string_view text) : lexer_(text) {}

  TokenTree run() {
    try {
      for (Token token = lexer_.next(); token.kind != Kind::kEnd; token = lexer_.next()) take(token);
    } catch (const SceneError& error) {
      tree_.unfinished = error;
      fault(error.place, error.message);
    }
    // Sections are checked first, because an #if without #end explains the braces inside it, and not the reverse.
    if (!sections_.empty()) {
      const Token& directive = sections_.back().directive;
      fault(directive.place, fmt::format("this #{} has no #end", directive.text));
    }
    const auto open =
        std::find_if(brackets_.rbegin(), brackets_.rend(), [this](const Bracket& b) { return symbol(b) == '{'; });
    if (open != brackets_.rend()) fault(tree_.tokens[open->token].place, "this '{' is never closed");
    if (!brackets_.empty()) tree_.leaks = true;
    std::ranges::sort(tree_.outline.blocks, {}, [](const NamedBlock& block) { return block.place.offset; });
    return std::move(tree_);
  }

 private:
  void fault(const Place& place, std::string message) {
    if (!tree_.fault) tree_.fault = {place, std::move(message)};
    tree_.leaks = true;
  }
  /// Goes on as outside of everything, so that the work stays in proportion to the text.
  void too_deep(const Place& place, std::string message) {
    fault(place, std::move(message));
    brackets_.clear();
    sections_.clear();
  }

  [[nodiscard]] char symbol(const Bracket& bracket) const {
    const Token& token = tree_.tokens[bracket.token];
    return token.kind == Kind::kWord ? '{' : token.text.front();  // a macro opens braces
  }
  [[nodiscard]] std::string_view keyword(const Bracket& bracket) const {
    const Token& token = tree_.tokens[bracket.token];
    return token.kind == Kind::kWord ? token.text : tree_.keyword(bracket.token);
  }

  [[nodiscard]] bool dead() const {
    return !sections_.empty() && (sections_.back().outer_dead || sections_.back().branches.dead);
  }

  [[nodiscard]] std::size_t uncertain() const {
    return std::size_t(
        std::count_if(sections_.begin(), sections_.end(), [](const Section& s) { return s.branches.uncertain; }));
  }

  /// Returns whether the bracket was opened in the present branch of the innermost section.
  [[nodiscard]] bool is_inside(const Bracket& bracket) const {
    return sections_.empty() || bracket.token > sections_.back().token;
  }

  [[nodiscard]] std::size_t around() const {
    for (auto bracket = brackets_.rbegin(); bracket != brackets_.rend() && is_inside(*bracket); ++bracket) {
      if (bracket->certain) return bracket->token;
    }
    return sections_.empty() ? kNowhere : sections_.back().token;
  }

  void take(const Token& token) {
    if (token.kind == Kind::kDirective) return directive(token);
    if (dead()) return;
    if (token.kind == Kind::kName) return name(token);
    const std::size_t index = tree_.tokens.size();
    if (token.is('}')) {
      close_brace(token.place, index);
    } else if (token.is(')') || token.is(']')) {
      close_parenthesis(token.is(')') ? '(' : '[', index);
    }
    add(token);
    if (token.is('{') || token.is('(') || token.is('[')) {
      push({.token = index});
    } else if (token.kind == Kind::kWord && !(index > 0 && tree_.is_directive(index - 1, "macro"))) {
      call(token, index);
    }
  }

  void add(const Token& token) {
    tree_.tokens.push_back(token);
    tree_.partner.push_back(kNowhere);
    tree_.around.push_back(around());
    if (!brackets_.empty()) brackets_.back().fresh = false;
  }

  // ---- brackets

  bool push(Bracket bracket) {
    if (brackets_.size() >= kMostBraces) {
      too_deep(tree_.tokens[bracket.token].place,
               fmt::format("more than {} braces, parentheses or brackets are open here", kMostBraces));
      return false;
    }
    bracket.uncertain = uncertain();
    brackets_.push_back(bracket);
    return true;
  }

  /// Something is closed that a condition opened, or that is not of the present branch.
  void mark_uneven() { (sections_.empty() ? tree_.leaks : sections_.back().uneven) = true; }

  void pair(const Bracket& bracket, std::size_t index) {
    if (bracket.certain && is_inside(bracket)) {
      tree_.partner[bracket.token] = index;
    } else {
      mark_uneven();
    }
  }

  void close_parenthesis(char opener, std::size_t index) {
    if (!brackets_.empty() && symbol(brackets_.back()) == opener) {
      pair(brackets_.back(), index);
      brackets_.pop_back();
    } else if (brackets_.empty() || !is_inside(brackets_.back())) {
      mark_uneven();
    }
  }

  /// @param index of the closing brace; kNowhere: a macro closes it
  void close_brace(const Place& place, std::size_t index) {
    while (!brackets_.empty() && symbol(brackets_.back()) != '{' && brackets_.size() > base()) brackets_.pop_back();
    if (brackets_.size() <= base()) return close_brace_of_caller(place);
    const Bracket bracket = brackets_.back();
    brackets_.pop_back();
    if (index != kNowhere) {
      pair(bracket, index);
    } else if (!is_inside(bracket)) {
      mark_uneven();
    }
    if (!bracket.named) return;
    NamedBlock& block = tree_.outline.blocks[*bracket.named];
    if (block.close == 0) block.close = place.offset;
    if (block.obstacle.empty() && uncertain() != bracket.uncertain) {
      block.obstacle = fmt::format("its closing brace, in line {}, is {}", place.line, innermost_uncertain());
    }
  }

  void close_brace_of_caller(const Place& place) {
    Section* macro = innermost_macro();
    if (macro == nullptr) return fault(place, "this '}' closes nothing");
    mark_uneven();
    if (++macro->closes > kMostBraces) {
      too_deep(place, fmt::format("a macro here closes more than {} braces", kMostBraces));
    }
  }

  void name(const Token& token) {
    if (brackets_.empty() || symbol(brackets_.back()) != '{' || !brackets_.back().fresh) {
      tree_.outline.strays.push_back({std::string(token.text), token.place});
      return;
    }
    Bracket& bracket = brackets_.back();
    bracket.fresh = false;
    bracket.named = tree_.outline.blocks.size();
    NamedBlock block{.name = std::string(token.text), .keyword = std::string(keyword(bracket)), .place = token.place};
    const std::size_t begin = bracket.token - (block.keyword.empty() ? 0 : 1);
    block.begin = tree_.tokens[begin].place.offset;
    if (uncertain() > 0) {
      block.obstacle = "it is " + innermost_uncertain();
    } else if (brackets_.size() > 1) {
      const Bracket& outer = brackets_[brackets_.size() - 2];
      const std::string_view word = keyword(outer);
      block.obstacle = fmt::format("it is inside the {} of line {}",
                                   symbol(outer) != '{' ? fmt::format("'{}'", symbol(outer))
                                   : word.empty()       ? "braces"
                                                        : fmt::format("'{}'", word),
                                   tree_.tokens[outer.token].place.line);
    } else if (!block.keyword.empty() && begin > 0 && tree_.is(begin - 1, '=')) {
      block.obstacle = "it is the value of a #declare or #local, not an object that stands in the scene";
    }
    tree_.outline.blocks.push_back(std::move(block));
  }

  // ---- macros

  [[nodiscard]] Section* innermost_macro() {
    const auto found = std::find_if(sections_.rbegin(), sections_.rend(),
                                    [](const Section& s) { return s.kind == SectionKind::kMacro; });
    return found == sections_.rend() ? nullptr : &*found;
  }
  [[nodiscard]] std::string_view macro_name(const Section& macro) const {
    return macro.token + 1 < tree_.tokens.size() ? tree_.tokens[macro.token + 1].text : std::string_view();
  }
  [[nodiscard]] std::size_t base() {
    const Section* macro = innermost_macro();
    return macro == nullptr ? 0 : macro->at_start.size();
  }

  void call(const Token& token, std::size_t index) {
    const auto found = macros_.find(token.text);
    if (found == macros_.end()) return;
    const MacroBraces braces = found->second;
    for (std::size_t i = 0; i < braces.closes; ++i) close_brace(token.place, kNowhere);
    for (std::size_t i = 0; i < braces.opens; ++i) {
      if (!push({.token = index, .fresh = false, .certain = false})) return;
    }
  }

  // ---- directives

  void directive(const Token& token) {
    const std::string_view word = token.text;
    if (const auto kind = section_begun_by(word)) {
      const bool outer_dead = dead();
      if (!outer_dead) add(token);
      return begin(*kind, token, outer_dead);
    }
    if (word == "elseif") {
      branch(token, SectionKind::kIf, literal_condition(lexer_));
    } else if (word == "case" || word == "range") {
      branch(token, SectionKind::kSwitch, Truth::kUnknown);
    } else if (word == "else") {
      const bool in_switch = !sections_.empty() && sections_.back().kind == SectionKind::kSwitch;
      branch(token, in_switch ? SectionKind::kSwitch : SectionKind::kIf, in_switch ? Truth::kUnknown : Truth::kTrue);
    } else if (word == "end") {
      end(token);
    }
    if (!dead()) add(token);
  }

  void begin(SectionKind kind, const Token& token, bool outer_dead) {
    if (sections_.size() >= kMostSections) {
      return too_deep(token.place, fmt::format("more than {} conditions, loops and macros are open here; POV-Ray "
                                               "takes no more",
                                               kMostSections));
    }
    Section section{.kind = kind,
                    .directive = token,
                    .token = outer_dead ? kNowhere : tree_.tokens.size() - 1,
                    .outer_dead = outer_dead,
                    .in_branch = kind != SectionKind::kSwitch,
                    .at_start = brackets_};
    section.branches.enter(token.text == "if" ? literal_condition(lexer_) : Truth::kUnknown);
    sections_.push_back(std::move(section));
  }

  void branch(const Token& token, SectionKind kind, Truth condition) {
    if (sections_.empty() || sections_.back().kind != kind) {
      return fault(token.place,
                   fmt::format("this #{} belongs to no {}", token.text, kind == SectionKind::kIf ? "#if" : "#switch"));
    }
    Section& section = sections_.back();
    leave_branch(section);
    brackets_ = section.at_start;
    section.in_branch = true;
    section.branches.enter(condition);
  }

  void leave_branch(Section& section) {
    if (section.branches.dead || section.outer_dead) return;
    if (!brackets_.empty() && is_inside(brackets_.back())) section.uneven = true;
    if (section.in_branch && !section.after_first) section.after_first = brackets_;
  }

  void end(const Token& token) {
    if (sections_.empty()) return fault(token.place, "this #end ends nothing");
    leave_branch(sections_.back());
    const Section section = std::move(sections_.back());
    sections_.pop_back();
    if (section.outer_dead) return;
    tree_.partner[section.token] = tree_.tokens.size();
    if (section.kind == SectionKind::kMacro) {
      const std::size_t base = std::min(section.at_start.size(), brackets_.size());
      const auto opens = std::count_if(brackets_.begin() + std::ptrdiff_t(base), brackets_.end(),
                                       [this](const Bracket& b) { return symbol(b) == '{'; });
      const std::string_view name = macro_name(section);
      macros_[name] = {section.closes, std::size_t(opens)};
      if (section.uneven && !name.empty()) tree_.leaky_macros.insert(name);
      brackets_ = section.at_start;
      return;
    }
    brackets_ = section.after_first.value_or(section.at_start);
    if (!section.uneven) return;
    if (!sections_.empty()) sections_.back().uneven = true;
    // It is unknown which bracket the section closed, so no bracket around it has a certain end.
    for (auto bracket = brackets_.rbegin(); bracket != brackets_.rend() && is_inside(*bracket); ++bracket)
      bracket->certain = false;
  }

  [[nodiscard]] std::string innermost_uncertain() const {
    const auto found =
        std::find_if(sections_.rbegin(), sections_.rend(), [](const Section& s) { return s.branches.uncertain; });
    if (found == sections_.rend()) return "outside the condition that it was opened under";
    const auto& [kind, text, place] = found->directive;
    const int line = place.line;
    switch (found->kind) {
      case SectionKind::kIf:
      case SectionKind::kSwitch:
        return fmt::format("under a condition that needs evaluating (#{} in line {})", text, line);
      case SectionKind::kLoop:
        return fmt::format("in a loop (#{} in line {})", text, line);
      case SectionKind::kMacro:
        return fmt::format("in a macro (#macro {} in line {})", macro_name(*found), line);
    }
    return "";
  }

  Lexer lexer_;
  TokenTree tree_;
  Brackets brackets_;
  std::vector<Section> sections_;
  std::map<std::string_view, MacroBraces> macros_;
};

}  // namespace

std::string_view TokenTree::keyword(std::size_t i) const {
  return i != kNowhere && i > 0 && tokens[i].is('{') && tokens[i - 1].kind == Kind::kWord ? tokens[i - 1].text
                                                                                          : std::string_view();
}

std::size_t TokenTree::brace_around(std::size_t i) const {
  do {
    i = around[i];
  } while (i != kNowhere && !tokens[i].is('{'));
  return i;
}

TokenTree take_apart(std::string_view text) { return Pairing(text).run(); }

}  // namespace twocone::sim_povray
