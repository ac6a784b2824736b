// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/effects/scene_calls.h"

#include <algorithm>
#include <charconv>
#include <map>
#include <memory>
#include <set>
#include <unordered_map>
#include <utility>

#include <fmt/format.h>

#include "drivers/sim_povray/effects/expression_end.h"
#include "drivers/sim_povray/scene/evaluator.h"

namespace twocone::sim_povray {
namespace {

using Kind = Token::Kind;

/// Words that use a feature wherever they are.
const std::unordered_map<Feature, std::set<std::string_view>> kWords{
    {Feature::kTransparency, {"rgbf", "rgbt", "rgbft", "srgbf", "srgbt", "srgbft", "ior"}},
    {Feature::kAreaLights, {"area_light"}},
    {Feature::kMedia, {"media", "fog"}},
    {Feature::kPhotons, {"photons"}},
    {Feature::kRandom, {"jitter", "crand"}},
    {Feature::kSubsurface, {"subsurface"}},
    {Feature::kFrameNumber,
     {"frame_number", "clock_on", "initial_frame", "final_frame", "clock_delta", "initial_clock", "final_clock",
      "clock"}},
};

bool is_zero_reflection(const TokenTree& tree, std::size_t i) {
  if (!tree.is(i, '{')) return is_zero(tree, i);
  return is_zero(tree, i + 1) && tree.is(i + 2, '}');
}

std::optional<Feature> feature_of(const TokenTree& tree, std::size_t i) {
  const std::string_view word = tree.tokens[i].text;
  if (word == "reflection" || word == "refraction") {
    // `photons { reflection on }` concerns photons.
    if (tree.around[i] != kNowhere && tree.keyword(tree.around[i]) == "photons") return std::nullopt;
    if (word == "refraction") return Feature::kTransparency;
    return is_zero_reflection(tree, i + 1) ? std::nullopt : std::optional(Feature::kReflection);
  }
  if (word == "filter" || word == "transmit") {
    return is_zero(tree, i + 1) ? std::nullopt : std::optional(Feature::kTransparency);
  }
  if (word == "radiosity") {
    // In an object it only states the importance of the object.
    return tree.is(i + 1, '{') && tree.is(i + 2, "importance") ? std::nullopt : std::optional(Feature::kRadiosity);
  }
  for (const auto& [feature, words] : kWords) {
    if (words.contains(word)) return feature;
  }
  return std::nullopt;
}

/// A file, with marks for its lights that cast no shadows.
struct File {
  std::string path;
  std::string text;
  TokenTree tree;
  std::vector<bool> shadowless;  // by the index of a light's brace
};

class Scanner {
 public:
  explicit Scanner(const IncludeReader& read) : read_(read) {}

  SceneCalls run(std::string_view text, const std::string& path) {
    walk(open(path, std::string(text)), kRoot, 0);
    SceneCalls calls;
    const std::vector<bool> live = live_names();
    for (Found& found : found_) {
      if (live[found.owner]) calls.all.push_back(std::move(found.call));
    }
    std::set<std::string> reported;
    calls.endless = endless_;
    for (const auto& [owner, why] : unread_) {
      if (live[owner] && reported.insert(why).second) calls.unread.push_back(why);
    }
    calls.max_trace_level = max_trace_level_;
    calls.strings = std::move(strings_);
    return calls;
  }

 private:
  /// A name as a number. Text outside all declarations belongs to kRoot, the empty name.
  using Name = std::size_t;
  static constexpr Name kRoot = 0;

  struct Found {
    Name owner;
    Call call;
  };
  struct Included {
    const File* file = nullptr;
    std::string why_not;
  };
  struct Owner {
    Name name;
    std::size_t end;
    bool value;  // the value of a declaration, not a macro's body
  };

  Name number(std::string_view name) { return names_.try_emplace(name, names_.size()).first->second; }

  const File& open(std::string path, std::string text) {
    File& file = *files_.emplace_back(std::make_unique<File>());
    file.path = std::move(path);
    file.text = std::move(text);
    file.tree = take_apart(file.text);
    if (const auto& error = file.tree.unfinished) {
      unread_.emplace_back(kRoot, fmt::format("{}:{}: {}", file.path, error->place.line, error->message));
    }
    everything_lives_ = everything_lives_ || file.tree.leaks;
    for (const std::string_view macro : file.tree.leaky_macros) leaky_.insert(number(macro));
    file.shadowless.resize(file.tree.tokens.size());
    for (std::size_t i = 0; i < file.tree.tokens.size(); ++i) {
      const std::size_t around = file.tree.around[i];
      if (around != kNowhere && file.tree.is(i, "shadowless")) file.shadowless[around] = true;
    }
    return file;
  }

  void walk(const File& file, Name base, std::size_t depth) {
    const TokenTree& tree = file.tree;
    std::vector<Owner> owners{{base, kNowhere, false}};
    for (std::size_t i = 0; i < tree.tokens.size(); ++i) {
      while (i >= owners.back().end) owners.pop_back();
      const Token& token = tree.tokens[i];
      if (token.kind == Kind::kDirective) {
        if (token.text == "include") {
          include(file, i, owners.back().name, depth);
        } else if (token.text == "declare" || token.text == "local" || token.text == "macro") {
          const Declaration found = declaration(tree, i);
          if (found.name == kNowhere) continue;
          owners.push_back(
              {number(tree.tokens[found.name].text), std::min(found.end, owners.back().end), token.text != "macro"});
          declared_.insert(owners.back().name);
          i = found.name;
        }
      } else if (token.kind == Kind::kString) {
        // A file that is opened for writing is not read, and POV-Ray's own message is better.
        if (!tree.is(i + 1, "write") && !tree.is(i + 1, "append"))
          strings_.push_back({file.path, token.place.line, std::string(token.text.substr(1, token.text.size() - 2))});
      } else if (token.kind == Kind::kWord) {
        if (leaky_.contains(number(token.text))) {
          // The macro may close the value's braces: the end of the value is then unknown.
          while (owners.back().value) owners.pop_back();
          if (owners.size() > 1) leaky_.insert(owners.back().name);
          if (owners.size() == 1 && base != kRoot) everything_lives_ = true;
        }
        word(file, i, owners.back().name, depth);
      }
    }
  }

  void word(const File& file, std::size_t i, Name owner, std::size_t depth) {
    const TokenTree& tree = file.tree;
    const Token& token = tree.tokens[i];
    uses_.emplace_back(owner, number(token.text));
    if (token.text == "max_trace_level" && i + 1 < tree.tokens.size() && tree.tokens[i + 1].kind == Kind::kNumber &&
        after_expression(tree, i + 1) == i + 2) {
      int level = 0;
      const std::string_view digits = tree.tokens[i + 1].text;
      const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), level);
      if (error == std::errc() && end == digits.data() + digits.size()) max_trace_level_ = level;
    }
    std::optional<Feature> feature = feature_of(tree, i);
    if (token.text == "light_source" && !(tree.is(i + 1, '{') && file.shadowless[i + 1])) feature = Feature::kShadows;
    if (!feature) return;
    found_.push_back(
        {owner, {*feature, file.path, token.place.line, std::string(token.text), depth > 0, token.place.offset}});
  }

  void include(const File& file, std::size_t directive, Name owner, std::size_t depth) {
    const TokenTree& tree = file.tree;
    const std::size_t i = directive + 1;
    const auto unread = [&](const std::string& why) {
      unread_.emplace_back(owner, fmt::format("{}:{}: {}", file.path, tree.tokens[directive].place.line, why));
    };
    if (i >= tree.tokens.size() || tree.tokens[i].kind != Kind::kString || tree.is(i + 1, '+')) {
      return unread("an #include whose name has to be evaluated");
    }
    const std::string name(tree.tokens[i].text.substr(1, tree.tokens[i].text.size() - 2));
    const auto [known, fresh] = included_.try_emplace(name);
    // Each owner walks through the file's content once.
    if (!walked_.emplace(&known->second, owner).second) return;
    Included& included = known->second;
    if (fresh) {
      auto content = read_(name);
      if (content && content->is_folder) {
        included.why_not = fmt::format("include \"{}\" is a folder, not a file", name);
        endless_ = fmt::format("{}:{}: {}", file.path, tree.tokens[directive].place.line, included.why_not);
      } else if (!content || !content->refusal.empty()) {
        included.why_not = fmt::format("\"{}\" cannot be read", name);
      } else if (bytes_ + content->text.size() > kMostIncludedBytes) {
        included.why_not = fmt::format("\"{}\" is not read: more than {} bytes are included", name, kMostIncludedBytes);
      } else {
        bytes_ += content->text.size();
        included.file = &open(std::move(content->path), std::move(content->text));
      }
    }
    if (included.file == nullptr) return unread(included.why_not);
    if (depth >= kDeepestInclude) return unread(fmt::format("\"{}\" is not read: too many files deep", name));
    work_ += included.file->text.size();
    if (work_ > kMostIncludedBytes) {
      return unread(fmt::format("\"{}\" is not read: more than {} bytes are included", name, kMostIncludedBytes));
    }
    walk(*included.file, owner, depth + 1);
  }

  /// Returns the names that live text uses, directly or through other names.
  std::vector<bool> live_names() {
    std::vector<bool> live(names_.size(), everything_lives_);
    if (everything_lives_) return live;
    std::sort(uses_.begin(), uses_.end());
    live[kRoot] = true;
    std::vector<Name> next{kRoot};
    while (!next.empty()) {
      const Name owner = next.back();
      next.pop_back();
      for (auto use = std::lower_bound(uses_.begin(), uses_.end(), std::pair(owner, Name{0}));
           use != uses_.end() && use->first == owner; ++use) {
        if (live[use->second] || !declared_.contains(use->second)) continue;
        live[use->second] = true;
        next.push_back(use->second);
      }
    }
    return live;
  }

  const IncludeReader& read_;
  std::vector<std::unique_ptr<File>> files_;
  std::map<std::string, Included> included_;           // by the name in #include
  std::set<std::pair<const Included*, Name>> walked_;  // with the owner of its content
  std::unordered_map<std::string_view, Name> names_{{std::string_view(), kRoot}};
  std::set<Name> declared_;
  std::set<Name> leaky_;                     // macros that may close or open brackets of their caller
  std::vector<std::pair<Name, Name>> uses_;  // an owner and a name that it uses
  std::vector<Found> found_;
  std::vector<std::pair<Name, std::string>> unread_;
  std::string endless_;
  std::vector<WrittenString> strings_;
  std::optional<int> max_trace_level_;
  std::size_t bytes_ = 0;
  std::size_t work_ = 0;
  bool everything_lives_ = false;
};

}  // namespace

std::string Call::place() const { return fmt::format("{}:{}", file, line); }

const Call* SceneCalls::find(Feature feature) const {
  const auto found = std::find_if(all.begin(), all.end(), [&](const Call& call) { return call.feature == feature; });
  return found == all.end() ? nullptr : &*found;
}

SceneCalls find_calls(const Scene& scene, const SceneAccess& access) {
  SceneAccess growing = access;
  SceneCalls calls = find_calls(scene.text(), scene.path(), include_reader(growing));
  const auto& all = growing.searched();
  for (std::size_t i = access.searched().size(); i < all.size(); ++i) calls.folders.push_back(all[i].string());

  // The images' size is not known here. The limits keep a scene that loops for long to a part of a second.
  const EvaluatorSettings settings{.width_px = 0, .height_px = 0, .most_tokens = 2'000'000};
  SceneAccess again = access;
  const auto evaluated = evaluate(scene.text(), scene.path(), include_reader(again), settings);
  if (!evaluated) return calls;
  std::erase_if(calls.all, [&reached = evaluated->reached_words](const Call& call) {
    const auto file = reached.find(call.file);
    return file == reached.end() || call.offset >= file->second.size() || !file->second[call.offset];
  });
  calls.max_trace_level = evaluated->max_trace_level;
  return calls;
}

SceneCalls find_calls(std::string_view text, const std::string& path, const IncludeReader& read) {
  return Scanner(read).run(text, path);
}

}  // namespace twocone::sim_povray
