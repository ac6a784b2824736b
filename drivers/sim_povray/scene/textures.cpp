// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "drivers/sim_povray/scene/evaluation.h"

namespace twocone::sim_povray {
namespace {

/// Patterns by keyword. Their scenes: checker (parts/room.inc), brick, cells, gradient, wood and bozo (lab.pov), boxed
/// (workshop.pov), radial (parts/robot.inc).
const std::map<std::string_view, Pattern> kPatterns{
    {"checker", Pattern::kChecker},   {"brick", Pattern::kBrick}, {"cells", Pattern::kCells},
    {"gradient", Pattern::kGradient}, {"boxed", Pattern::kBoxed}, {"radial", Pattern::kRadial},
    {"wood", Pattern::kWood},         {"bozo", Pattern::kBozo},
};
const std::map<std::string_view, Wave> kWaves{
    {"ramp_wave", Wave::kRamp},       {"triangle_wave", Wave::kTriangle}, {"sine_wave", Wave::kSine},
    {"scallop_wave", Wave::kScallop}, {"cubic_wave", Wave::kCubic},       {"poly_wave", Wave::kPoly},
};

/// The time of a colour doubles with each level of pigments in maps.
constexpr int kMostNested = 10;
/// POV-Ray accepts no more.
constexpr std::size_t kMostEntries = 256;
/// A pigment that is declared again and again from itself ends here; that of a person has less than ten.
constexpr std::size_t kMostSteps = 1000;

constexpr std::string_view kNotInPigment = "is not supported in a pigment";

}  // namespace

void move_pigment(Pigment& pigment, const Transform& transform) {
  if (!pigment.steps.empty()) {
    if (auto* last = std::get_if<Transform>(&pigment.steps.back())) {
      *last = last->then(transform);
      return;
    }
  }
  pigment.steps.emplace_back(transform);
}

bool Evaluation::read_transformation(const Token& token, Placing& placing) {
  const auto add = [&](const Transform& transform) {
    if (placing.mover) unsupported(token, "follows the pose of a program, which must be the last transformation");
    placing.transform = placing.transform.then(transform);
  };
  if (token.text == "translate") {
    add(Transform::translation(vector()));
  } else if (token.text == "rotate") {
    add(Transform::rotation(vector()));
  } else if (token.text == "scale") {
    Vec3 by = vector();
    // POV-Ray takes 0 as 1.
    for (double* component : {&by.x, &by.y, &by.z}) *component = *component == 0 ? 1 : *component;
    add(Transform::scaling(by));
  } else if (token.text == "matrix") {
    expect('<');
    std::array<double, 12> given{};
    for (double& value : given) {
      value = number();
      (void)accept(',');
    }
    expect('>');
    const auto transform = Transform::matrix(
        {Vec3{given[0], given[1], given[2]}, Vec3{given[3], given[4], given[5]}, Vec3{given[6], given[7], given[8]}},
        {given[9], given[10], given[11]});
    if (!transform) unsupported(token, "has no inverse");
    add(*transform);
  } else if (token.text == "transform") {
    const auto* known = find_as<Placing>(peek().text);
    const Placing given = known != nullptr ? *known : read_placing();
    if (known != nullptr) (void)next();
    add(given.transform);
    placing.mover = given.mover;
  } else {
    return false;
  }
  return true;
}

Placing Evaluation::read_placing() {
  const Level level(*this);
  expect('{');
  Placing placing;
  for (Token token = next(); !token.is('}'); token = next()) {
    if (read_transformation(token, placing)) continue;
    const std::string& prefix = settings_.pose_prefix;
    if (const auto* known = find_as<Placing>(token.text)) {
      if (placing.mover) unsupported(token, "follows the pose of a program");
      placing.transform = placing.transform.then(known->transform);
      placing.mover = known->mover;
    } else if (!prefix.empty() && token.text.starts_with(prefix)) {
      const std::string slot(token.text.substr(prefix.size()));
      placing.mover = slot == "V" ? kViewMover : std::atoi(slot.c_str() + 1);
    } else {
      unsupported(token, "is not a transformation that is supported");
    }
  }
  return placing;
}

PatternStep Evaluation::read_warp() {
  expect('{');
  const Token kind = next();
  PatternStep step;
  if (kind.text == "repeat") {
    RepeatWarp repeat;
    const Vec3 width = vector();
    repeat.axis = width.x != 0 ? 0 : width.y != 0 ? 1 : 2;
    repeat.width = width.x + width.y + width.z;
    if (repeat.width == 0 || (width.x != 0) + (width.y != 0) + (width.z != 0) != 1) {
      unsupported(kind, "needs a width along one axis");
    }
    for (Token token = next(); !token.is('}'); token = next()) {
      if (token.text == "offset") {
        repeat.offset = vector();
      } else if (token.text == "flip") {
        repeat.flip = vector();
      } else {
        unsupported(token, "is not supported in this warp");
      }
    }
    step = repeat;
  } else if (kind.text == "turbulence") {
    Turbulence turbulence;
    turbulence.amount = vector();
    for (Token token = next(); !token.is('}'); token = next()) {
      if (token.text == "octaves") {
        turbulence.octaves = int(number());
      } else if (token.text == "lambda") {
        turbulence.lambda = number();
      } else if (token.text == "omega") {
        turbulence.omega = number();
      } else if (!token.is(',')) {
        unsupported(token, "is not supported in this warp");
      }
    }
    step = turbulence;
  } else {
    unsupported(kind, "is a warp that is not supported");
  }
  return step;
}

ColourMap Evaluation::read_map(bool of_pigments) {
  expect('{');
  ColourMap map;
  for (Token token = next(); !token.is('}'); token = next()) {
    if (const auto* known = find_as<ColourMap>(token.text)) {
      map = *known;
      continue;
    }
    if (!token.is('[')) unsupported(token, "is not an entry of a map");
    PigmentEntry entry;
    entry.at = number();
    (void)accept(',');
    if (of_pigments) {
      Pigment pigment;
      read_pigment_parts(pigment);
      entry.pigment = std::make_shared<const Pigment>(std::move(pigment));
    } else {
      entry.colour = colour();
      // The form of old scenes: two ends of a range, each with its colour.
      if (!peek().is(']')) unsupported(peek(), "stands after the colour of an entry");
    }
    expect(']');
    map.push_back(std::move(entry));
    if (map.size() > kMostEntries) fail_at_limit(fmt::format("a map has more than {} entries", kMostEntries));
  }
  if (map.empty()) fail("this map is empty");
  return map;
}

/// Reads the two colours or pigments of a checker or brick.
std::vector<PigmentEntry> Evaluation::read_list() {
  std::vector<PigmentEntry> list;
  while (list.size() < 2) {
    const Token token = peek();
    PigmentEntry entry;
    if (token.text == "pigment") {
      (void)next();
      entry.pigment = std::make_shared<const Pigment>(read_pigment());
    } else if (begins_colour(token)) {
      entry.colour = colour();
    } else {
      break;
    }
    list.push_back(std::move(entry));
    (void)accept(',');
  }
  if (list.size() != 2) unsupported(peek(), "stands where the second colour of a checker or brick is expected");
  return list;
}

bool Evaluation::read_pattern(std::string_view word, Pigment& pigment) {
  const auto found = kPatterns.find(word);
  if (found == kPatterns.end()) return false;
  // A map stays, a plain colour or a list of two does not: measured.
  const bool has_map =
      pigment.pattern != Pattern::kColour && pigment.pattern != Pattern::kChecker && pigment.pattern != Pattern::kBrick;
  if (!has_map) pigment.entries.clear();
  pigment.pattern = found->second;
  if (pigment.pattern == Pattern::kGradient) {
    pigment.axis = vector();
  } else if (pigment.pattern == Pattern::kChecker || pigment.pattern == Pattern::kBrick) {
    pigment.entries = read_list();
  }
  return true;
}

bool Evaluation::read_wave(const Token& token, Pigment& pigment) {
  const std::string_view word = token.text;
  if (const auto wave = kWaves.find(word); wave != kWaves.end()) {
    pigment.wave = wave->second;
    const Token after = peek();
    if (*pigment.wave == Wave::kPoly && (after.kind == Token::Kind::kNumber || after.is('('))) {
      pigment.poly_exponent = number();
    }
  } else if (word == "frequency") {
    pigment.frequency = number();
  } else if (word == "phase") {
    pigment.phase = number();
  } else {
    return false;
  }
  // Its two colours are a map whose default frequency is 0.
  if (pigment.pattern == Pattern::kChecker || pigment.pattern == Pattern::kBrick) {
    unsupported(token, "is not supported in a checker or brick");
  }
  return true;
}

bool Evaluation::read_pigment_part(const Token& token, Pigment& pigment) {
  const std::string_view word = token.text;
  Placing placing;
  const auto turbulence = [&]() -> Turbulence& {
    if (!pigment.turbulence) pigment.turbulence.emplace();
    return *pigment.turbulence;
  };
  if (read_transformation(token, placing)) {
    if (placing.mover) unsupported(token, "gives a pigment the pose of a program");
    move_pigment(pigment, placing.transform);
  } else if (const auto* known = find_as<Pigment>(word)) {
    pigment = *known;
  } else if (word == "color_map" || word == "colour_map" || word == "pigment_map") {
    pigment.entries = read_map(word == "pigment_map");
  } else if (word == "brick_size") {
    pigment.brick_size = vector();
  } else if (word == "mortar") {
    pigment.mortar = number();
  } else if (word == "turbulence") {
    turbulence().amount = vector();
  } else if (word == "octaves") {
    turbulence().octaves = int(number());
  } else if (word == "lambda") {
    turbulence().lambda = number();
  } else if (word == "omega") {
    turbulence().omega = number();
  } else if (word == "warp") {
    pigment.steps.push_back(read_warp());
  } else if (word == "quick_color" || word == "quick_colour") {
    (void)colour_value();
  } else if (!read_pattern(word, pigment) && !read_wave(token, pigment)) {
    return false;
  }
  return true;
}

void Evaluation::check_size(Pigment& pigment) {
  pigment.nesting = 0;
  for (const PigmentEntry& entry : pigment.entries) {
    if (entry.pigment != nullptr) pigment.nesting = std::max(pigment.nesting, entry.pigment->nesting + 1);
  }
  if (pigment.nesting > kMostNested) fail_at_limit(fmt::format("pigments are nested more than {} deep", kMostNested));
  if (pigment.steps.size() > kMostSteps) {
    fail_at_limit(fmt::format("a pigment has more than {} transformations and warps", kMostSteps));
  }
}

void Evaluation::read_pigment_parts(Pigment& pigment) {
  while (true) {
    const Token token = next();
    if (token.is('}') || token.is(']')) {
      check_size(pigment);
      return put_back(token);
    }
    if (token.is(',')) continue;
    if (token.kind == Token::Kind::kWord && read_pigment_part(token, pigment)) continue;
    if (!begins_colour(token)) {
      if (const auto* why = find_as<Unusable>(token.text)) throw EvaluationError{why->why};
      unsupported(token, kNotInPigment);
    }
    put_back(token);
    pigment.pattern = Pattern::kColour;
    pigment.entries = {{0, colour(), nullptr}};
  }
}

Pigment Evaluation::change_pigment(Pigment pigment) {
  const Level level(*this);
  expect('{');
  read_pigment_parts(pigment);
  expect('}');
  return pigment;
}

Finish Evaluation::change_finish(Finish finish) {
  expect('{');
  const std::map<std::string_view, double Finish::*> numbers{
      {"brilliance", &Finish::brilliance}, {"phong", &Finish::phong},         {"phong_size", &Finish::phong_size},
      {"specular", &Finish::specular},     {"roughness", &Finish::roughness}, {"diffuse", &Finish::diffuse},
  };
  for (Token token = next(); !token.is('}'); token = next()) {
    const std::string_view word = token.text;
    if (const auto* known = find_as<Finish>(word)) {
      finish = *known;
    } else if (const auto part = numbers.find(word); part != numbers.end()) {
      if (peek().text == "albedo") unsupported(peek(), "is not supported in a finish");
      finish.*part->second = number();
      if (peek_symbol() == ',') unsupported(token, "with a second number is not supported in a finish");
    } else if (word == "ambient") {
      finish.ambient = grey_or_colour();
    } else if (word == "emission") {
      finish.emission = grey_or_colour();
    } else if (word == "metallic") {
      const Token after = peek();
      finish.metallic = after.kind == Token::Kind::kNumber || after.is('(') ? number() : 1;
    } else if (word == "reflection") {
      if (accept('{')) {
        finish.reflection = grey_or_colour();
        if (!accept('}')) unsupported(peek(), "is not supported in a reflection");
      } else {
        finish.reflection = grey_or_colour();
      }
    } else if (const auto* why = find_as<Unusable>(word)) {
      throw EvaluationError{why->why};
    } else {
      unsupported(token, "is not supported in a finish");
    }
  }
  return finish;
}

Texture Evaluation::read_texture() {
  const Level level(*this);
  expect('{');
  Texture texture = default_;
  for (Token token = next(); !token.is('}'); token = next()) {
    Placing placing;
    if (read_transformation(token, placing)) {
      if (placing.mover) unsupported(token, "gives a texture the pose of a program");
      move_pigment(texture.pigment, placing.transform);
    } else if (const auto* known = find_as<Texture>(token.text)) {
      texture = *known;
    } else if (token.text == "pigment") {
      texture.pigment = change_pigment(texture.pigment);
    } else if (token.text == "finish") {
      attempt([&] { texture.finish = change_finish(texture.finish); }, false);
    } else if (is_lenient() && token.text == "normal") {
      skip_argument();
    } else if (const auto* why = find_as<Unusable>(token.text)) {
      throw EvaluationError{why->why};
    } else {
      unsupported(token, "is not supported in a texture");
    }
  }
  return texture;
}

}  // namespace twocone::sim_povray
