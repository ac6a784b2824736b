// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/scene/scene.h"

#include <algorithm>
#include <map>
#include <optional>

#include <fmt/format.h>

#include "drivers/sim_povray/scene/scene_text.h"

namespace twocone::sim_povray {
namespace {

/// The limit of POV-Ray 3.7, which refuses one section more.
constexpr std::size_t kMostSections = 199;
/// POV-Ray has no limit here, but this one keeps the work in proportion to the text. Scenes written by programs have
/// about thirty.
constexpr std::size_t kMostBraces = 256;

/// An open brace, parenthesis or bracket.
struct Frame {
  char symbol = '{';
  Place place{};
  std::string_view keyword{};
  std::size_t begin = 0;               // offset of the keyword
  bool declared = false;               // on the right of `=`
  bool fresh = true;                   // nothing but comments inside so far
  std::size_t uncertain = 0;           // conditions, loops and macros around it
  std::optional<std::size_t> named{};  // index among the blocks
};
using Frames = std::vector<Frame>;

/// An `#if ... #end` or a similar section, while it is open.
struct Section {
  SectionKind kind = SectionKind::kIf;
  std::string_view directive{};
  Place place{};
  bool outer_dead = false;
  bool in_branch = true;  // false between #switch and its first #case
  Branches branches{};
  Frames at_start{};
  std::optional<Frames> after_first{};  // the first branch that is not dead gives the open braces behind #end

  // For a macro only:
  std::string_view macro{};
  std::size_t base = 0;    // number of braces open before it
  std::size_t closes = 0;  // number of braces of its caller that it closes
};

/// Numbers of braces that a call of a macro closes and then opens.
struct MacroBraces {
  std::size_t closes = 0;
  std::size_t opens = 0;
};

class Outliner {
 public:
  explicit Outliner(std::string_view text) : lexer_(text) {}

  SceneOutline run() {
    while (true) {
      const Token token = lexer_.next();
      if (token.kind == Token::Kind::kEnd) break;
      take(token);
    }
    // Sections are checked first, because an #if without #end explains the braces inside it, and not the reverse.
    if (!sections_.empty()) {
      throw SceneError{sections_.back().place, fmt::format("this #{} has no #end", sections_.back().directive)};
    }
    const auto open = std::find_if(frames_.rbegin(), frames_.rend(), [](const Frame& f) { return f.symbol == '{'; });
    if (open != frames_.rend()) throw SceneError{open->place, "this '{' is never closed"};
    std::ranges::sort(outline_.blocks, {}, [](const NamedBlock& block) { return block.place.offset; });
    return std::move(outline_);
  }

 private:
  [[nodiscard]] bool dead() const {
    return !sections_.empty() && (sections_.back().outer_dead || sections_.back().branches.dead);
  }

  [[nodiscard]] std::size_t uncertain() const {
    return std::size_t(
        std::count_if(sections_.begin(), sections_.end(), [](const Section& s) { return s.branches.uncertain; }));
  }

  void take(const Token& token) {
    if (token.kind == Token::Kind::kDirective) {
      directive(token);
      if (!dead()) touch();
      previous_ = before_previous_ = {};
      return;
    }
    if (dead()) return;
    if (token.kind == Token::Kind::kName) return name(token);
    if (token.is('{') || token.is('(') || token.is('[')) {
      touch();
      open(token);
    } else if (token.is('}')) {
      close_brace(token.place);
    } else if (token.is(')') || token.is(']')) {
      const char partner = token.is(')') ? '(' : '[';
      if (!frames_.empty() && frames_.back().symbol == partner) frames_.pop_back();
    } else {
      touch();
      if (token.kind == Token::Kind::kWord) call(token);
    }
    before_previous_ = previous_;
    previous_ = token;
  }

  void touch() {
    if (!frames_.empty()) frames_.back().fresh = false;
  }

  void open(const Token& token) {
    Frame frame{.symbol = token.text.front(), .place = token.place, .begin = token.place.offset};
    if (token.is('{') && previous_.kind == Token::Kind::kWord) {
      frame.keyword = previous_.text;
      frame.begin = previous_.place.offset;
      frame.declared = before_previous_.is('=');
    }
    push(frame);
  }

  void push(Frame frame) {
    if (frames_.size() >= kMostBraces) {
      throw SceneError{frame.place,
                       fmt::format("more than {} braces, parentheses or brackets are open here", kMostBraces)};
    }
    frame.uncertain = uncertain();
    frames_.push_back(frame);
  }

  void close_brace(const Place& place) {
    while (!frames_.empty() && frames_.back().symbol != '{' && frames_.size() > base()) frames_.pop_back();
    if (frames_.size() <= base()) {
      Section* macro = innermost_macro();
      if (macro == nullptr) throw SceneError{place, "this '}' closes nothing"};
      if (++macro->closes > kMostBraces) {
        throw SceneError{place, fmt::format("a macro here closes more than {} braces", kMostBraces)};
      }
      return;
    }
    const Frame frame = frames_.back();
    frames_.pop_back();
    if (!frame.named) return;
    NamedBlock& block = outline_.blocks[*frame.named];
    if (block.close == 0) block.close = place.offset;
    if (block.obstacle.empty() && uncertain() != frame.uncertain) {
      block.obstacle = fmt::format("its closing brace, in line {}, is {}", place.line, innermost_uncertain());
    }
  }

  void name(const Token& token) {
    if (frames_.empty() || frames_.back().symbol != '{' || !frames_.back().fresh) {
      outline_.strays.push_back({std::string(token.text), token.place});
      return;
    }
    Frame& frame = frames_.back();
    touch();
    frame.named = outline_.blocks.size();
    NamedBlock block{std::string(token.text), std::string(frame.keyword), token.place, frame.begin, 0, {}};
    if (uncertain() > 0) {
      block.obstacle = "it is " + innermost_uncertain();
    } else if (frames_.size() > 1) {
      const Frame& outer = frames_[frames_.size() - 2];
      block.obstacle =
          outer.symbol != '{'
              ? fmt::format("it is inside the '{}' of line {}", outer.symbol, outer.place.line)
              : fmt::format("it is inside the {} of line {}",
                            outer.keyword.empty() ? "braces" : fmt::format("'{}'", outer.keyword), outer.place.line);
    } else if (frame.declared) {
      block.obstacle = "it is the value of a #declare or #local, not an object that stands in the scene";
    }
    outline_.blocks.push_back(std::move(block));
  }

  // ---- macros

  [[nodiscard]] Section* innermost_macro() {
    const auto found = std::find_if(sections_.rbegin(), sections_.rend(),
                                    [](const Section& s) { return s.kind == SectionKind::kMacro; });
    return found == sections_.rend() ? nullptr : &*found;
  }
  [[nodiscard]] std::size_t base() {
    const Section* macro = innermost_macro();
    return macro == nullptr ? 0 : macro->base;
  }

  void call(const Token& token) {
    const auto found = macros_.find(token.text);
    if (found == macros_.end()) return;
    for (std::size_t i = 0; i < found->second.closes; ++i) close_brace(token.place);
    for (std::size_t i = 0; i < found->second.opens; ++i) {
      push({.place = token.place, .keyword = token.text, .begin = token.place.offset, .fresh = false});
    }
  }

  // ---- directives

  void directive(const Token& token) {
    const std::string_view word = token.text;
    if (const auto kind = section_begun_by(word)) {
      begin(*kind, token, word == "if" ? literal_condition(lexer_) : Truth::kUnknown);
    } else if (word == "elseif") {
      branch(token, SectionKind::kIf, literal_condition(lexer_));
    } else if (word == "case" || word == "range") {
      branch(token, SectionKind::kSwitch, Truth::kUnknown);
    } else if (word == "else") {
      const bool in_switch = !sections_.empty() && sections_.back().kind == SectionKind::kSwitch;
      branch(token, in_switch ? SectionKind::kSwitch : SectionKind::kIf, in_switch ? Truth::kUnknown : Truth::kTrue);
    } else if (word == "end") {
      end(token);
    }
  }

  void begin(SectionKind kind, const Token& token, Truth condition) {
    if (sections_.size() >= kMostSections) {
      throw SceneError{token.place, fmt::format("more than {} conditions, loops and macros are open here; POV-Ray "
                                                "takes no more",
                                                kMostSections)};
    }
    Section section{.kind = kind,
                    .directive = token.text,
                    .place = token.place,
                    .outer_dead = dead(),
                    .in_branch = kind != SectionKind::kSwitch,
                    .at_start = frames_};
    if (kind == SectionKind::kMacro) {
      section.macro = lexer_.next().text;
      section.base = frames_.size();
    }
    section.branches.enter(condition);
    sections_.push_back(std::move(section));
  }

  void branch(const Token& token, SectionKind kind, Truth condition) {
    if (sections_.empty() || sections_.back().kind != kind) {
      throw SceneError{token.place, fmt::format("this #{} belongs to no {}", token.text,
                                                kind == SectionKind::kIf ? "#if" : "#switch")};
    }
    Section& section = sections_.back();
    leave_branch(section);
    frames_ = section.at_start;
    section.in_branch = true;
    section.branches.enter(condition);
  }

  void leave_branch(Section& section) {
    if (section.in_branch && !section.branches.dead && !section.outer_dead && !section.after_first)
      section.after_first = frames_;
  }

  void end(const Token& token) {
    if (sections_.empty()) throw SceneError{token.place, "this #end ends nothing"};
    Section& section = sections_.back();
    if (section.kind == SectionKind::kMacro) {
      if (!section.outer_dead) {
        const auto opens =
            std::size_t(std::count_if(frames_.begin() + std::ptrdiff_t(std::min(section.base, frames_.size())),
                                      frames_.end(), [](const Frame& f) { return f.symbol == '{'; }));
        macros_[section.macro] = {section.closes, opens};
        frames_ = section.at_start;
      }
    } else {
      leave_branch(section);
      frames_ = section.after_first.value_or(section.at_start);
    }
    sections_.pop_back();
  }

  [[nodiscard]] std::string innermost_uncertain() const {
    const auto found =
        std::find_if(sections_.rbegin(), sections_.rend(), [](const Section& s) { return s.branches.uncertain; });
    if (found == sections_.rend()) return "outside the condition that it was opened under";
    const int line = found->place.line;
    switch (found->kind) {
      case SectionKind::kIf:
      case SectionKind::kSwitch:
        return fmt::format("under a condition that needs evaluating (#{} in line {})", found->directive, line);
      case SectionKind::kLoop:
        return fmt::format("in a loop (#{} in line {})", found->directive, line);
      case SectionKind::kMacro:
        return fmt::format("in a macro (#macro {} in line {})", found->macro, line);
    }
    return "";
  }

  Lexer lexer_;
  SceneOutline outline_;
  Frames frames_;
  std::vector<Section> sections_;
  std::map<std::string_view, MacroBraces> macros_;
  Token previous_;
  Token before_previous_;
};

}  // namespace

SceneOutline outline(std::string_view text) { return Outliner(text).run(); }

}  // namespace twocone::sim_povray
