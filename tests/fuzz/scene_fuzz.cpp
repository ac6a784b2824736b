// SPDX-License-Identifier: Apache-2.0
// Feeds changed scenes to all code that reads a scene's text. Each call must end in time and without a crash, and a
// scene after switching must still be a scene. A build with TWOCONE_SANITIZE finds more.
//
//   scene_fuzz INPUTS SEED FILE...
#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <fstream>
#include <iterator>
#include <limits>
#include <optional>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "drivers/sim_povray/effects/scene_calls.h"
#include "drivers/sim_povray/render/native/tile_tracer.h"
#include "drivers/sim_povray/render/native/traced_scene.h"
#include "drivers/sim_povray/scene/evaluator.h"
#include "drivers/sim_povray/scene/scene.h"

namespace {

using namespace twocone::sim_povray;  // NOLINT(google-build-using-namespace): this is a separate program
using Clock = std::chrono::steady_clock;

/// The largest input in bytes. Scenes are cut to pieces of this size, so that a million inputs take minutes.
constexpr std::size_t kLargest = 4096;
/// Some inputs are much larger, to find code whose time grows faster than the size.
constexpr std::size_t kHuge = std::size_t{64} * 1024;
constexpr int kHugeEvery = 5000;
/// The time limit for one input. A common input takes some 100 us; even under a sanitizer and on a busy machine it
/// stays far below this.
constexpr std::chrono::seconds kSlow{5};

constexpr std::array<std::string_view, 68> kWords{"{",
                                                  "}",
                                                  "(",
                                                  ")",
                                                  "[",
                                                  "]",
                                                  "<",
                                                  ">",
                                                  ",",
                                                  ";",
                                                  "=",
                                                  "+",
                                                  "-",
                                                  "*",
                                                  ".",
                                                  "#",
                                                  "\"",
                                                  "/*",
                                                  "*/",
                                                  "//",
                                                  "\n",
                                                  "\\",
                                                  "#if (0)",
                                                  "#if (1)",
                                                  "#if (X)",
                                                  "#ifdef (X)",
                                                  "#else",
                                                  "#elseif (1)",
                                                  "#end",
                                                  "#while (1)",
                                                  "#for (I,0,1)",
                                                  "#switch (X)",
                                                  "#case (1)",
                                                  "#range (0,1)",
                                                  "#break",
                                                  "#macro A()",
                                                  "#macro B(C)",
                                                  "A()",
                                                  "B(1)",
                                                  "#declare X = ",
                                                  "#local Y = ",
                                                  "#include \"a.inc\"",
                                                  "#include \"b.inc\"",
                                                  "#include X",
                                                  "light_source {",
                                                  "shadowless",
                                                  "area_light",
                                                  "adaptive 1",
                                                  "jitter",
                                                  "photons {",
                                                  "radiosity {",
                                                  "media {",
                                                  "fog {",
                                                  "reflection",
                                                  "transmit",
                                                  "texture {",
                                                  "function {",
                                                  "array[2] {",
                                                  "union {",
                                                  "//*PMName robot\n",
                                                  "camera {",
                                                  "clock",
                                                  "max_trace_level",
                                                  "1e9",
                                                  "0",
                                                  "X",
                                                  "\x1a",
                                                  "\xEF\xBB\xBF"};

class Mutator {
 public:
  Mutator(std::vector<std::string> seeds, std::uint64_t seed) : seeds_(std::move(seeds)), random_(seed) {}

  std::string next(std::size_t largest) {
    std::string text = piece(largest);
    const std::size_t changes = 1 + below(8);
    for (std::size_t i = 0; i < changes; ++i) change(text, largest);
    if (text.size() > largest) text.resize(largest);
    return text;
  }

  std::size_t below(std::size_t end) { return end == 0 ? 0 : std::size_t(random_() % end); }

 private:
  std::string piece(std::size_t largest) {
    const std::string& whole = seeds_[below(seeds_.size())];
    if (whole.size() <= largest) return whole;
    return whole.substr(below(whole.size() - largest), largest);
  }

  void change(std::string& text, std::size_t largest) {
    const std::size_t at = below(text.size() + 1);
    switch (below(7)) {
      case 0:  // changes a byte
        if (at < text.size()) text[at] = char(below(256));
        return;
      case 1:
        text.resize(at);
        return;
      case 2:  // removes some bytes
        text.erase(at, below(64));
        return;
      case 3:  // inserts a piece of another scene
        text.insert(at, piece(largest / 4));
        return;
      case 4:
        text.insert(at, fmt::format(" {} ", kWords[below(kWords.size())]));
        return;
      case 5: {  // moves a piece
        const std::size_t length = below(40);
        const std::string taken = text.substr(at, length);
        text.erase(at, length);
        text.insert(below(text.size() + 1), taken);
        return;
      }
      default: {  // inserts one or two words many times
        const std::string_view first = kWords[below(kWords.size())];
        const std::string_view second = below(2) == 0 ? std::string_view() : kWords[below(kWords.size())];
        const std::size_t times = 1 + below(largest / 4);
        std::string run;
        for (std::size_t i = 0; i < times; ++i) run.append(first).append(" ").append(second);
        text.insert(at, run);
      }
    }
  }

  std::vector<std::string> seeds_;
  std::mt19937_64 random_;
};

struct Tally {
  std::size_t accepted = 0;
  std::size_t switched = 0;
  std::size_t calls = 0;
  std::size_t evaluated = 0;
};

/// Returns whether a macro has the name of the keyword that switching inserts. POV-Ray refuses such a scene.
bool has_misnamed_macro(const std::string& text) {
  Lexer lexer(text);
  Token before;
  for (Token token = lexer.next(); token.kind != Token::Kind::kEnd; token = lexer.next()) {
    const bool is_name = before.kind == Token::Kind::kDirective && before.text == "macro";
    if (is_name && token.text == "shadowless") return true;
    before = token;
  }
  return false;
}

/// Evaluates the scene and traces some rays through it.
/// @param leniency as EvaluatorSettings
void trace(const std::string& text, const IncludeReader& include, Leniency* leniency, Tally& tally) {
  // An endless loop ends at these limits, which many inputs reach.
  const EvaluatorSettings settings{
      .pose_prefix = "Twocone_", .most_tokens = 20'000, .most_objects = 20'000, .leniency = leniency};
  auto scene = evaluate(text, "fuzz.pov", include, settings);
  if (!scene) return;
  ++tally.evaluated;
  const TracedScene traced_scene(*std::move(scene));
  Poses poses;
  poses.movers.resize(1);
  const PosedScene posed(traced_scene, std::move(poses));
  static RayBundle bundle;
  static SeenTile seen;
  static Lane weights;
  bundle.used = 0xFF;
  bundle.t_max.fill(std::numeric_limits<double>::infinity());
  weights.fill(1);
  for (int i = 0; i < 8; ++i) {
    bundle.rays.origin.set(i, {0.1 * i, 1, -3});
    bundle.rays.direction.set(i, normalized({i % 3 - 1.0, i % 2 - 0.5, (i < 4 ? 0 : 1) - 0.5}));
  }
  fill_unused(bundle);
  trace_tile(posed, bundle, 1, kAllGroups, weights, seen);
}

/// Returns false if the scene after switching is no longer a scene.
bool read(Mutator& mutator, const std::string& text, Tally& tally) {
  // Included files are changed too, and include further files.
  const IncludeReader include = [&](const std::string& name) -> std::optional<IncludedFile> {
    if (mutator.below(8) == 0) return std::nullopt;
    return IncludedFile{name, mutator.next(kLargest)};
  };
  const SceneCalls calls = find_calls(text, "fuzz.pov", include);
  tally.calls += calls.all.size();
  trace(text, include, nullptr, tally);
  Leniency leniency;
  trace(text, include, &leniency, tally);
  const auto scene = Scene::parse(text, "fuzz.pov");
  if (!scene) return true;
  ++tally.accepted;
  for (const char* name : {"robot", "lower", "outside"}) {
    static_cast<void>(scene->object(name).has_value());
    static_cast<void>(scene->camera(name).has_value());
  }
  SceneSwitches off{false, false, false, false, false, {}};
  if (mutator.below(2) == 0) off.shadows = true;
  // Its own includes are empty, so that only the text itself is processed.
  const auto changed = switched(*scene,
                                find_calls(text, "fuzz.pov",
                                           [](const std::string&) {
                                             return std::optional(IncludedFile{"empty.inc", ""});
                                           }),
                                off);
  if (!changed) return true;
  ++tally.switched;
  return Scene::parse(*changed, "fuzz.pov").has_value() || has_misnamed_macro(text);
}

std::optional<std::uint64_t> number(std::string_view text) {
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() ? std::optional(value) : std::nullopt;
}

}  // namespace

int main(int argc, char** argv) {
  const std::vector<std::string> arguments(argv + 1, argv + argc);
  const auto inputs = arguments.empty() ? std::nullopt : number(arguments[0]);
  const auto seed = arguments.size() < 2 ? std::nullopt : number(arguments[1]);
  if (!inputs || !seed || arguments.size() < 3) {
    fmt::print(stderr, "usage: scene_fuzz INPUTS SEED FILE...\n");
    return 2;
  }
  std::vector<std::string> seeds;
  for (std::size_t i = 2; i < arguments.size(); ++i) {
    std::ifstream file(arguments[i], std::ios::binary);
    seeds.emplace_back(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
    if (!file) {
      fmt::print(stderr, "{}: cannot be read\n", arguments[i]);
      return 1;
    }
  }

  Mutator mutator(std::move(seeds), *seed);
  Tally tally;
  Clock::duration slowest{0};
  const auto begin = Clock::now();
  for (std::uint64_t i = 0; i < *inputs; ++i) {
    const std::string text = mutator.next(i % kHugeEvery == kHugeEvery - 1 ? kHuge : kLargest);
    const auto before = Clock::now();
    const bool good = read(mutator, text, tally);
    const auto took = Clock::now() - before;
    slowest = std::max(slowest, took);
    if (took > kSlow || !good) {
      std::ofstream("scene_fuzz_found.pov", std::ios::binary) << text;
      fmt::print(stderr, "input {} of seed {}: {} after {:.1f} s; it is in scene_fuzz_found.pov\n", i, *seed,
                 good ? "done" : "not a scene after switching", std::chrono::duration<double>(took).count());
      return 1;
    }
  }
  fmt::print("{} inputs, seed {}: {} accepted, {} switched, {} calls, {} evaluated; {:.1f} s, the slowest {:.1f} ms\n",
             *inputs, *seed, tally.accepted, tally.switched, tally.calls, tally.evaluated,
             std::chrono::duration<double>(Clock::now() - begin).count(),
             std::chrono::duration<double, std::milli>(slowest).count());
  return 0;
}
