// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/effects/expression_end.h"

#include <algorithm>
#include <set>
#include <string_view>

namespace twocone::sim_povray {
namespace {

using Kind = Token::Kind;

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
