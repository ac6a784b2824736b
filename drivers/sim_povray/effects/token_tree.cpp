// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/effects/token_tree.h"

#include <algorithm>

#include "drivers/sim_povray/scene/scene_text.h"

namespace twocone::sim_povray {
namespace {

using Kind = Token::Kind;

/// Directives that end a branch of a section and begin the next.
const std::set<std::string_view> kNextBranch{"else", "elseif", "case", "range"};

class Pairing {
 public:
  explicit Pairing(std::string_view text) : lexer_(text) {}

  TokenTree run() {
    for (Token token = lexer_.next(); token.kind != Kind::kEnd; token = lexer_.next()) {
      if (token.kind == Kind::kName) continue;
      if (token.kind == Kind::kDirective) {
        directive(token);
      } else if (!dead()) {
        add(token);
      }
    }
    if (!open_.empty()) tree_.leaks = true;
    return std::move(tree_);
  }

 private:
  struct Open {
    std::size_t index = 0;
    bool section = false;
    bool uneven = false;  // of a section: its brackets do not match within each branch
    bool outer_dead = false;
    Branches branches{};
  };

  [[nodiscard]] bool dead() const {
    return !sections_.empty() && (open_[sections_.back()].outer_dead || open_[sections_.back()].branches.dead);
  }

  void add(const Token& token) {
    const std::size_t index = tree_.tokens.size();
    if (token.is('}') || token.is(')') || token.is(']')) close(token, index);
    tree_.tokens.push_back(token);
    tree_.partner.push_back(kNowhere);
    tree_.around.push_back(open_.empty() ? kNowhere : open_.back().index);
    if (token.is('{') || token.is('(') || token.is('[')) open_.push_back({.index = index});
  }

  void close(const Token& token, std::size_t index) {
    const char opener = token.is('}') ? '{' : token.is(')') ? '(' : '[';
    const auto top_is_bracket = [this] { return !open_.empty() && !open_.back().section; };
    if (opener == '{') {
      while (top_is_bracket() && !tree_.tokens[open_.back().index].is('{')) open_.pop_back();
    }
    if (open_.empty()) {
      tree_.leaks = true;
    } else if (open_.back().section) {
      open_.back().uneven = true;
    } else if (tree_.tokens[open_.back().index].is(opener)) {
      tree_.partner[open_.back().index] = index;
      open_.pop_back();
    }
  }

  void directive(const Token& token) {
    if (section_begun_by(token.text)) {
      const bool seen = !dead();
      if (seen) add(token);
      Open open{.index = seen ? tree_.tokens.size() - 1 : kNowhere, .section = true, .outer_dead = !seen};
      open.branches.enter(token.text == "if" ? literal_condition(lexer_) : Truth::kUnknown);
      sections_.push_back(open_.size());
      open_.push_back(open);
      return;
    }
    const bool ends = token.text == "end";
    if (!sections_.empty() && (ends || kNextBranch.contains(token.text))) {
      drop_brackets();
      if (ends) {
        end_section();
      } else {
        open_.back().branches.enter(token.text == "elseif" ? literal_condition(lexer_)
                                    : token.text == "else" ? Truth::kTrue
                                                           : Truth::kUnknown);
      }
    }
    if (!dead()) add(token);
  }

  /// Drops the brackets that a branch leaves open.
  void drop_brackets() {
    const std::size_t section = sections_.back();
    if (open_.size() > section + 1) open_[section].uneven = true;
    open_.resize(section + 1);
  }

  void end_section() {
    const Open section = open_.back();
    open_.pop_back();
    sections_.pop_back();
    if (section.index == kNowhere) return;
    tree_.partner[section.index] = tree_.tokens.size();
    if (!section.uneven) return;
    if (tree_.tokens[section.index].text == "macro") {
      const std::size_t name = section.index + 1;
      if (name < tree_.tokens.size()) tree_.leaky_macros.insert(tree_.tokens[name].text);
      return;
    }
    if (!sections_.empty()) {
      open_[sections_.back()].uneven = true;
    }
    // It is unknown which bracket the section closed, so no bracket around it has a certain end.
    while (!open_.empty() && !open_.back().section) open_.pop_back();
  }

  Lexer lexer_;
  TokenTree tree_;
  std::vector<Open> open_;
  std::vector<std::size_t> sections_;  // indices in open_
};

const std::set<std::string_view> kColourWords{"color", "colour", "rgb",   "rgbf",   "rgbt",    "rgbft",
                                              "srgb",  "srgbf",  "srgbt", "srgbft", "red",     "green",
                                              "blue",  "filter", "gray",  "grey",   "transmit"};

bool is_colour_word(const TokenTree& tree, std::size_t i) {
  return i < tree.tokens.size() && tree.tokens[i].kind == Kind::kWord && kColourWords.contains(tree.tokens[i].text);
}

/// The limit of tokens in an expression, which prevents text without an end from being read again and again.
constexpr std::size_t kLongest = 4096;

bool is_operator(const TokenTree& tree, std::size_t i) {
  return tree.is(i, '+') || tree.is(i, '-') || tree.is(i, '*') || tree.is(i, '/') || tree.is(i, '%') || tree.is(i, '^');
}

/// Returns the index behind the `>` that closes the `<` at `i`, or kNowhere.
std::size_t after_vector(const TokenTree& tree, std::size_t i) {
  int open = 0;
  const std::size_t last = std::min(tree.tokens.size(), i + kLongest);
  while (i < last) {
    const Token& token = tree.tokens[i];
    if (token.kind == Kind::kDirective || token.is('{') || token.is('}') || token.is(';')) return kNowhere;
    if (token.is('(') || token.is('[')) {
      if (tree.partner[i] == kNowhere) return kNowhere;
      i = tree.partner[i];
    } else if (token.is('<')) {
      ++open;
    } else if (token.is('>') && --open == 0) {
      return i + 1;
    }
    ++i;
  }
  return kNowhere;
}

/// Returns the index behind the operand at `i`, or kNowhere.
std::size_t after_operand(const TokenTree& tree, std::size_t i) {
  while (tree.is(i, '+') || tree.is(i, '-') || tree.is(i, '!') || is_colour_word(tree, i)) ++i;
  if (i >= tree.tokens.size()) return kNowhere;
  const Token& token = tree.tokens[i];
  if (token.is('<')) {
    i = after_vector(tree, i);
  } else if (token.is('(')) {
    if (tree.partner[i] == kNowhere) return kNowhere;
    i = tree.partner[i] + 1;
  } else if (token.kind == Kind::kNumber || token.kind == Kind::kString) {
    ++i;
  } else if (token.kind == Kind::kWord && !tree.is(i + 1, '{')) {
    for (++i; tree.is(i, '(') || tree.is(i, '['); ++i) {
      if (tree.partner[i] == kNowhere) return kNowhere;
      i = tree.partner[i];
    }
  } else {
    return kNowhere;
  }
  // The component of a vector or colour.
  while (tree.is(i, '.') && i + 1 < tree.tokens.size() && tree.tokens[i + 1].kind == Kind::kWord) i += 2;
  return i;
}

/// Returns the index behind a value that is a block; `i` if it is not a block.
std::size_t after_block(const TokenTree& tree, std::size_t i) {
  std::size_t brace = i + 1;
  if (tree.is(i, "function") && tree.is(brace, '(') && tree.partner[brace] != kNowhere) {
    brace = tree.partner[brace] + 1;
  }
  if (tree.is(i, "array")) {
    while (tree.is(brace, '[') && tree.partner[brace] != kNowhere) brace = tree.partner[brace] + 1;
    if (!tree.is(brace, '{')) return brace;
  }
  if (!tree.is(brace, '{') || tree.partner[brace] == kNowhere) return i;
  std::size_t end = tree.partner[brace] + 1;
  // Layers of one texture.
  while (tree.is(i, "texture") && tree.is(end, "texture") && tree.is(end + 1, '{') &&
         tree.partner[end + 1] != kNowhere) {
    end = tree.partner[end + 1] + 1;
  }
  return end;
}

std::size_t after_value(const TokenTree& tree, std::size_t i) {
  if (i >= tree.tokens.size()) return i;
  if (tree.tokens[i].kind == Kind::kWord && (tree.is(i + 1, '{') || tree.is(i, "function") || tree.is(i, "array"))) {
    return after_block(tree, i);
  }
  std::size_t end = after_expression(tree, i);
  // `Red filter 0.5`
  while (end > i && is_colour_word(tree, end)) {
    const std::size_t next = after_expression(tree, end);
    if (next == end) break;
    end = next;
  }
  return end;
}

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

std::size_t after_expression(const TokenTree& tree, std::size_t i) {
  std::size_t end = after_operand(tree, i);
  while (end != kNowhere && is_operator(tree, end)) {
    end = end - i > kLongest ? kNowhere : after_operand(tree, end + 1);
  }
  return end == kNowhere ? i : end;
}

Declaration declaration(const TokenTree& tree, std::size_t directive) {
  const auto is_word = [&tree](std::size_t i) { return i < tree.tokens.size() && tree.tokens[i].kind == Kind::kWord; };
  Declaration result;
  std::size_t i = directive + 1;
  if (tree.is_directive(directive, "macro")) {
    if (!is_word(i) || tree.partner[directive] == kNowhere) return {};
    return {i, i + 1, tree.partner[directive]};
  }
  while (tree.is(i, "deprecated") || tree.is(i, "once") ||
         (i < tree.tokens.size() && tree.tokens[i].kind == Kind::kString)) {
    ++i;
  }
  if (!is_word(i)) return {};
  result.name = i++;
  while (tree.is(i, '[') && tree.partner[i] != kNowhere) i = tree.partner[i] + 1;
  if (!tree.is(i, '=')) return {};
  result.value = i + 1;
  result.end = after_value(tree, result.value);
  return result;
}

bool is_zero(const TokenTree& tree, std::size_t i) {
  if (i >= tree.tokens.size() || tree.tokens[i].kind != Kind::kNumber) return false;
  if (tree.tokens[i].text.find_first_not_of("0.") != std::string_view::npos) return false;
  return !is_operator(tree, i + 1) && !tree.is(i + 1, ',');
}

}  // namespace twocone::sim_povray
