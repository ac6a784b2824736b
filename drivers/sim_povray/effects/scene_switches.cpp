// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <initializer_list>
#include <set>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "drivers/sim_povray/effects/expression_end.h"
#include "drivers/sim_povray/effects/scene_calls.h"

namespace twocone::sim_povray {
namespace {

using Kind = Token::Kind;

/// A range of characters of the text, its end excluded.
struct Range {
  std::size_t begin;
  std::size_t end;
};

/// Collects the changes to a text. Throws a SceneError at a position where a change is not possible.
class Edit {
 public:
  Edit(std::string_view text, const TokenTree& tree) : text_(text), tree_(tree) {}

  void without_shadows() {
    std::set<std::size_t> marked;
    for (const std::size_t i : words("shadowless")) marked.insert(tree_.around[i]);
    for (const std::size_t i : words("light_source")) {
      const std::size_t close = end_of_block(i);
      if (!marked.contains(i + 1)) insertions_.push_back(tree_.tokens[close].place.offset);
    }
  }

  void without_area_lights() {
    for (const std::size_t i : words("area_light")) {
      // Two vectors and two numbers; commas are optional.
      std::size_t end = i + 1;
      for (int argument = 0; argument < 4; ++argument) {
        const std::size_t next = after_expression(tree_, end);
        if (next == end) fail(i, "where the arguments of this 'area_light' end is not certain");
        end = argument < 3 && tree_.is(next, ',') ? next + 1 : next;
      }
      blank(i, end);
      while (end < tree_.tokens.size() && is_modifier(end)) end = blank_modifier(end);
    }
    for (std::size_t i = 0; i < tree_.tokens.size(); ++i) {
      if (is_modifier(i) && tree_.keyword(tree_.brace_around(i)) == "light_source") blank_modifier(i);
    }
  }

  void without_blocks(std::string_view keyword) {
    for (const std::size_t i : words(keyword)) {
      // A declared block does nothing by itself, and a name without a value would be an error.
      if (i > 0 && tree_.is(i - 1, '=')) continue;
      const std::size_t close = end_of_block(i);
      for (std::size_t j = i; j < close; ++j) {
        if (tree_.is_directive(j, "declare") || tree_.is_directive(j, "macro") || tree_.is_directive(j, "include")) {
          fail(j, fmt::format("this stands in a '{}' that is to be left out", keyword));
        }
      }
      blank(i, close + 1);
    }
  }

  [[nodiscard]] std::string result() {
    std::string text(text_);
    for (const Range& range : blanks_) {
      std::for_each(text.begin() + std::ptrdiff_t(range.begin), text.begin() + std::ptrdiff_t(range.end), [](char& c) {
        if (c != '\n' && c != '\r') c = ' ';
      });
    }
    std::sort(insertions_.begin(), insertions_.end());
    std::string edited;
    edited.reserve(text.size() + insertions_.size() * kShadowless.size());
    std::size_t done = 0;
    for (const std::size_t offset : insertions_) {
      if (text[offset] != '}') continue;  // inside a block that is left out
      edited.append(text, done, offset - done).append(kShadowless);
      done = offset;
    }
    return edited.append(text, done);
  }

 private:
  static constexpr std::string_view kShadowless = " shadowless ";

  [[noreturn]] void fail(std::size_t i, const std::string& why) const { throw SceneError{tree_.tokens[i].place, why}; }

  [[nodiscard]] std::vector<std::size_t> words(std::string_view word) const {
    std::vector<std::size_t> found;
    for (std::size_t i = 0; i < tree_.tokens.size(); ++i) {
      if (tree_.is(i, word)) found.push_back(i);
    }
    return found;
  }

  [[nodiscard]] std::size_t end_of_block(std::size_t i) const {
    if (!tree_.is(i + 1, '{')) fail(i, fmt::format("this '{}' has no braces behind it", tree_.tokens[i].text));
    const std::size_t close = tree_.partner[i + 1];
    const auto leaks = [&](std::size_t j) {
      return tree_.tokens[j].kind == Kind::kWord && tree_.leaky_macros.contains(tree_.tokens[j].text);
    };
    bool certain = close != kNowhere;
    for (std::size_t j = i; certain && j < close; ++j) certain = !leaks(j);
    if (!certain) {
      fail(i, fmt::format("where this '{}' ends depends on a condition or a macro", tree_.tokens[i].text));
    }
    return close;
  }

  [[nodiscard]] bool is_modifier(std::size_t i) const {
    constexpr std::array<std::string_view, 5> kModifiers{"adaptive", "jitter", "circular", "orient",
                                                         "area_illumination"};
    return std::any_of(kModifiers.begin(), kModifiers.end(), [&](std::string_view word) { return tree_.is(i, word); });
  }

  /// Blanks a modifier, and returns the index behind it.
  std::size_t blank_modifier(std::size_t i) {
    std::size_t end = i + 1;
    if (tree_.is(i, "adaptive")) {
      end = after_expression(tree_, end);
      if (end == i + 1) fail(i, "where the argument of this 'adaptive' ends is not certain");
    } else if (tree_.is(i, "area_illumination")) {
      for (const std::string_view word : {"on", "off", "yes", "no", "true", "false"}) {
        if (tree_.is(i + 1, word)) end = i + 2;
      }
      if (end == i + 1 && i + 1 < tree_.tokens.size() && tree_.tokens[i + 1].kind == Kind::kNumber) {
        end = after_expression(tree_, end);
      }
    }
    blank(i, end);
    return end;
  }

  void blank(std::size_t first, std::size_t end) {
    const Token& last = tree_.tokens[end - 1];
    blanks_.push_back({tree_.tokens[first].place.offset, last.place.offset + last.text.size()});
  }

  std::string_view text_;
  const TokenTree& tree_;
  std::vector<Range> blanks_;
  std::vector<std::size_t> insertions_;
};

/// An effect that may be switched off, with its key in the map and the change to the text.
struct Switch {
  bool on;
  Feature feature;
  std::string_view key;
  void (*take_out)(Edit&);
};

/// Returns the first use of any of `features`; else the first include that could not be read, which may use one; else
/// empty.
std::string reason(const SceneCalls& calls, std::initializer_list<Feature> features) {
  for (const Feature feature : features) {
    if (const Call* call = calls.find(feature)) return fmt::format("{}: {}", call->place(), call->word);
  }
  return calls.unread.empty() ? std::string() : calls.unread.front();
}

}  // namespace

Result<std::string> switched(const Scene& scene, const SceneCalls& calls, const SceneSwitches& switches) {
  std::vector<Switch> off{
      {switches.shadows, Feature::kShadows, "shadows", [](Edit& edit) { edit.without_shadows(); }},
      {switches.area_lights, Feature::kAreaLights, "area_lights", [](Edit& edit) { edit.without_area_lights(); }},
      {switches.photons, Feature::kPhotons, "photons", [](Edit& edit) { edit.without_blocks("photons"); }},
      {switches.radiosity, Feature::kRadiosity, "radiosity", [](Edit& edit) { edit.without_blocks("radiosity"); }},
      {switches.media, Feature::kMedia, "media", [](Edit& edit) {
         edit.without_blocks("media");
         edit.without_blocks("fog");
       }}};
  std::erase_if(off, [](const Switch& effect) { return effect.on; });
  const auto refused = [](const std::string& place, std::string_view key, const std::string& why) {
    return Error(ErrorCode::kRefused, "{}: the map's `effects: {{{}: false}}` cannot be done: {}", place, key, why);
  };
  for (const Switch& effect : off) {
    const auto is_included = [&](const Call& call) { return call.feature == effect.feature && call.included; };
    const auto there = std::ranges::find_if(calls.all, is_included);
    if (there != calls.all.end()) {
      return refused(there->place(), effect.key,
                     fmt::format("this '{}' stands in a file that the scene includes; only the scene's own text is "
                                 "changed",
                                 there->word));
    }
    if (!calls.unread.empty()) {
      return refused(scene.path(), effect.key, "it is not known what the scene includes: " + calls.unread.front());
    }
  }

  std::string text = scene.text();
  if (!off.empty()) {
    const TokenTree tree = take_apart(scene.text());
    Edit edit(scene.text(), tree);
    for (const Switch& effect : off) {
      try {
        effect.take_out(edit);
      } catch (const SceneError& error) {
        return refused(fmt::format("{}:{}", scene.path(), error.place.line), effect.key, error.message);
      }
    }
    text = edit.result();
  }
  // POV-Ray uses the last value that it reads.
  if (switches.reflection_depth) {
    text += fmt::format("\nglobal_settings {{ max_trace_level {} }}\n", *switches.reflection_depth);
  }
  return text;
}

Result<RenderChoice> choose_rendering(const Scene& scene, const SceneSwitches& switches, const SceneAccess& access) {
  RenderChoice choice{scene, find_calls(scene, access)};
  if (switches != SceneSwitches{}) {
    auto text = switched(scene, choice.calls, switches);
    if (!text) return text.error();
    auto changed = Scene::parse(*std::move(text), scene.path());
    if (!changed) return changed.error();
    choice.scene = *std::move(changed);
    choice.calls = find_calls(choice.scene, access);
  }

  const std::string why_full =
      reason(choice.calls, {Feature::kMedia, Feature::kPhotons, Feature::kRadiosity, Feature::kSubsurface});
  choice.quality = why_full.empty() ? kPlainQuality : kFullQuality;
  choice.why_whole =
      reason(choice.calls, {Feature::kPhotons, Feature::kRadiosity, Feature::kSubsurface, Feature::kRandom});
  // With photons, an image of a process affects the next one (measured).
  choice.one_shot = reason(choice.calls, {Feature::kFrameNumber, Feature::kPhotons});
  return choice;
}

}  // namespace twocone::sim_povray
