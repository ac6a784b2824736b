// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "drivers/sim_povray/scene/evaluation.h"

namespace twocone::sim_povray {
namespace {

const std::map<std::string_view, Combination> kCombinations{{"union", Combination::kUnion},
                                                            {"merge", Combination::kMerge},
                                                            {"intersection", Combination::kIntersection},
                                                            {"difference", Combination::kDifference}};

/// Words of an object that change no pixel of an opaque scene without media, photons and radiosity, which is all that
/// is supported.
bool changes_nothing(std::string_view word) {
  return word == "hollow" || word == "sturm" || word == "no_radiosity" || word == "radiosity";
}

/// Returns the size of an object without its parts: 1 is a shape of one colour, some 400 bytes.
std::size_t own_size(const Object& object) {
  std::size_t size = 1;
  const auto add_corners = [&size](const std::vector<Contour>& contours) {
    for (const Contour& contour : contours) size += contour.size();
  };
  if (const auto* prism = std::get_if<Prism>(&object.shape)) add_corners(prism->contours);
  if (const auto* polygon = std::get_if<Polygon>(&object.shape)) add_corners(polygon->contours);
  constexpr std::size_t kEntries = 8;  // in 400 bytes
  if (object.texture != nullptr) {
    size += (object.texture->pigment.entries.size() + 4 * object.texture->pigment.steps.size()) / kEntries;
  }
  return size;
}

std::size_t size_with_parts(const Object& object) {
  std::size_t size = own_size(object);
  for (const Object& clip : object.clipped_by) size += size_with_parts(clip);
  if (const auto* csg = std::get_if<Csg>(&object.shape)) {
    for (const Object& part : csg->parts) size += size_with_parts(part);
  }
  return size;
}

/// Returns whether a part of the object only bounds that of the text.
bool holds_bound(const Object& object) {
  const auto* csg = std::get_if<Csg>(&object.shape);
  return object.is_bound || (csg != nullptr && std::ranges::any_of(csg->parts, holds_bound));
}

/// Returns a box around the prism with `conic_sweep`, whose section at height y is the contour times y.
Box box_of_conic(const Prism& prism) {
  Box box{{0, prism.low, 0}, {0, prism.high, 0}};
  const double most = std::max(std::abs(prism.low), std::abs(prism.high));
  for (const Contour& contour : prism.contours) {
    for (const auto& [x, z] : contour) {
      box.low = lowest(box.low, {most * x, prism.low, most * z});
      box.high = highest(box.high, {most * x, prism.low, most * z});
    }
  }
  return box;
}

void move_object(Object& object, const Transform& transform) {
  if (object.texture != nullptr && object.texture->pigment.pattern != Pattern::kColour) {
    Texture texture = *object.texture;
    move_pigment(texture.pigment, transform);
    object.texture = std::make_shared<const Texture>(std::move(texture));
  }
  for (Object& clip : object.clipped_by) move_object(clip, transform);
  if (auto* csg = std::get_if<Csg>(&object.shape)) {
    for (Object& part : csg->parts) move_object(part, transform);
  } else {
    object.placed = object.placed.then(transform);
  }
}

}  // namespace

void Evaluation::place(Object& object, const Placing& placing) {
  if (object.mover != -1) fail("an object is transformed after its pose by a program");
  count_tokens(size_with_parts(object));
  move_object(object, placing.transform);
  if (placing.mover) object.mover = *placing.mover;
}

Object Evaluation::copied(const Object& object) {
  count_objects(size_with_parts(object));
  return object;
}

std::string Evaluation::open_block() {
  expect('{');
  name_ = {};
  (void)peek();
  return std::string(name_);
}

std::optional<Object> Evaluation::read_object(const Token& token) {
  const Level level(*this);
  const std::string word(token.text);
  const auto file = inputs_.back().file->shared_path;
  const int line = token.place.line;
  std::string name;
  Object object;
  if (word == "object") {
    name = open_block();
    const Token inner = next();
    if (const auto* known = find_as<Object>(inner.text)) {
      note_use(inner.text);
      object = copied(*known);
    } else if (auto read = read_object(inner)) {
      object = *std::move(read);
    } else {
      if (const auto* why = find_as<Unusable>(inner.text)) throw EvaluationError{why->why};
      unsupported(inner, "is not an object that is supported");
    }
  } else if (const auto combination = kCombinations.find(is_lenient() && word == "light_group" ? "union" : word);
             combination != kCombinations.end()) {
    name = open_block();
    object.shape = read_csg(combination->second);
  } else if (word == "box" || word == "sphere" || word == "cylinder" || word == "cone" || word == "disc" ||
             word == "plane" || word == "torus" || word == "prism" || word == "quadric" || word == "polygon" ||
             (is_lenient() && has_bound(word))) {
    name = open_block();
    // `box { Name ... }` is a declared object, as `object { Name ... }`.
    if (const auto* known = find_as<Object>(peek().text)) {
      note_use(peek().text);
      object = copied(*known);
      (void)next();
    } else if (has_bound(word)) {
      object.shape = read_bound(word);
      object.is_bound = true;
      note(notes_.bounded, fmt::format("{}:{}: {}", *file, line, word));
    } else {
      object.shape = read_shape(word);
    }
  } else {
    // In a union, what is no shape ends the list of parts.
    if (is_lenient() && (word == "cubic" || word == "ovus" || word == "poly" || word == "quartic")) {
      unsupported(token, "is a shape that is not supported");
    }
    return std::nullopt;
  }
  read_object_parts(object);
  count_objects(own_size(object));
  object.file = file;
  object.line = line;
  if (!name.empty()) object.name = name;
  return object;
}

std::vector<Contour> Evaluation::read_contours(int count) {
  std::vector<Contour> contours;
  Contour open;
  for (int i = 0; i < count; ++i) {
    (void)accept(',');
    const Number corner = sum();
    open.emplace_back(corner.v[0], corner.size == 1 ? corner.v[0] : corner.v[1]);
    if (open.size() > 1 && open.back() == open.front()) contours.push_back(std::exchange(open, {}));
  }
  if (!open.empty()) {
    // POV-Ray closes it.
    open.push_back(open.front());
    contours.push_back(std::move(open));
  }
  return contours;
}

Shape Evaluation::read_shape(const std::string& word) {
  const auto comma = [this] { (void)accept(','); };
  const auto next_vector = [&] {
    comma();
    return vector();
  };
  const auto next_number = [&] {
    comma();
    return number();
  };
  constexpr double kMostCorners = 100'000;
  if (word == "box") {
    const Vec3 a = vector();
    const Vec3 b = next_vector();
    return Box{lowest(a, b), highest(a, b)};
  }
  if (word == "sphere") {
    const Vec3 centre = vector();
    return Sphere{centre, next_number()};
  }
  if (word == "cylinder" || word == "cone") {
    Cone cone{};
    cone.base = vector();
    if (word == "cone") cone.base_radius = next_number();
    cone.cap = next_vector();
    cone.cap_radius = next_number();
    if (word == "cylinder") cone.base_radius = cone.cap_radius;
    comma();
    cone.open = accept("open");
    return cone;
  }
  if (word == "disc") {
    FlatDisc disc{};
    disc.centre = vector();
    disc.normal = next_vector();
    disc.radius = next_number();
    if (accept(',')) disc.hole_radius = number();
    return disc;
  }
  if (word == "plane") {
    const Vec3 normal = vector();
    return Plane{normal, next_number()};
  }
  if (word == "torus") {
    const double major = number();
    return Torus{major, next_number()};
  }
  if (word == "quadric") {
    Quadric quadric{};
    quadric.squares = vector();
    quadric.products = next_vector();
    quadric.linear = next_vector();
    quadric.constant = next_number();
    return quadric;
  }
  if (word == "polygon") {
    const double count = number();
    if (!(count >= 3 && count <= kMostCorners)) fail("a polygon needs at least three corners");
    return Polygon{read_contours(int(count))};
  }
  Prism prism{};
  bool is_conic = false;
  for (Token here = peek(); here.text.ends_with("_spline") || here.text.ends_with("_sweep"); here = peek()) {
    if (!here.text.starts_with("linear_")) {
      // The points of a curve stand for it.
      if (!is_lenient()) unsupported(here, "is not supported in a prism");
      is_conic = is_conic || here.text == "conic_sweep";
    }
    (void)next();
  }
  prism.low = number();
  prism.high = next_number();
  const double count = next_number();
  if (!(count >= 3 && count <= kMostCorners)) fail("a prism needs at least three corners");
  prism.contours = read_contours(int(count));
  (void)accept(',');
  prism.open = accept("open");
  if (is_conic) return box_of_conic(prism);
  return prism;
}

Csg Evaluation::read_csg(Combination combination) {
  Csg csg{combination, {}};
  bool has_lights = false;
  while (true) {
    const Token token = next();
    bool is_part = false;
    const bool is_known = attempt([&] {
      if (auto part = read_object(token)) {
        is_part = true;
        // What is cut off by a box in place of a shape would be too much.
        const bool is_cut_off = combination == Combination::kDifference && !csg.parts.empty();
        if (!is_cut_off || !holds_bound(*part)) csg.parts.push_back(*std::move(part));
      }
    });
    // Without its first part nothing is left of a difference.
    if (!is_known && combination == Combination::kDifference && csg.parts.empty()) fail("its first part is not known");
    if (is_part || !is_known) continue;
    if (is_lenient() && token.text == "light_source") {
      has_lights = true;
      skip_argument();
      continue;
    }
    if (token.text == "light_source") unsupported(token, "in a union is not supported");
    put_back(token);
    if (has_lights && csg.parts.empty()) {
      // A union of lights shows nothing.
      csg.parts.push_back({.shape = Sphere{{}, 0}, .file = inputs_.back().file->shared_path, .line = line_});
    }
    if (csg.parts.empty()) unsupported(token, "stands where the first part of a union, difference, ... is expected");
    return csg;
  }
}

std::vector<Object> Evaluation::read_objects() {
  std::vector<Object> objects;
  for (Token token = next(); !token.is('}'); token = next()) {
    auto object = read_object(token);
    if (!object) {
      if (const auto* known = find_as<Object>(token.text)) {
        object = copied(*known);
      } else {
        unsupported(token, "is not an object that is supported here");
      }
    }
    objects.push_back(*std::move(object));
  }
  return objects;
}

void Evaluation::skip_block() {
  const int braces = braces_;
  if (accept('{')) leave_block(braces);
}

void Evaluation::leave_block(int braces) {
  while (braces_ > braces) {
    if (next().kind == Token::Kind::kEnd) fail("a '{' is never closed");
  }
}

bool Evaluation::read_object_part(const Token& token, Object& object) {
  const std::string_view word = token.text;
  const auto edit_texture = [&](auto edit) {
    Texture texture = object.texture != nullptr ? *object.texture : default_;
    edit(texture);
    object.texture = std::make_shared<const Texture>(std::move(texture));
  };
  Placing placing;
  // A pigment that is not understood has no entries.
  const auto attempt_texture = [&](auto read) {
    if (!attempt(read, false)) edit_texture([](Texture& texture) { texture.pigment = {.entries = {}}; });
  };
  if (read_transformation(token, placing)) {
    place(object, placing);
  } else if (word == "texture") {
    attempt_texture([&] { object.texture = std::make_shared<const Texture>(read_texture()); });
  } else if (word == "pigment") {
    attempt_texture(
        [&] { edit_texture([this](Texture& texture) { texture.pigment = change_pigment(texture.pigment); }); });
  } else if (word == "finish") {
    attempt([&] { edit_texture([this](Texture& texture) { texture.finish = change_finish(texture.finish); }); }, false);
  } else if (word == "no_shadow") {
    object.no_shadow = flag();
  } else if (word == "no_image") {
    object.no_image = flag();
  } else if (word == "no_reflection") {
    object.no_reflection = flag();
  } else if (word == "inverse") {
    object.inverse = !object.inverse;
  } else if (word == "clipped_by") {
    expect('{');
    std::ranges::move(read_objects(), std::back_inserter(object.clipped_by));
  } else if (word == "bounded_by" || word == "interior" || word == "photons") {
    // A bound that holds its object changes no pixel of it. One that does not hold it is not honoured.
    skip_block();
  } else if (changes_nothing(word)) {
    (void)flag();
  } else if (const auto* known = find_as<Texture>(word)) {
    object.texture = std::make_shared<const Texture>(*known);
  } else {
    return false;
  }
  return true;
}

void Evaluation::read_object_parts(Object& object) {
  for (Token token = next(); !token.is('}'); token = next()) {
    if (read_object_part(token, object)) continue;
    if (is_lenient()) {
      if (token.kind == Token::Kind::kEnd) fail_at_limit("an object has no '}'");
      read_bound_part(token, object);
      continue;
    }
    if (const auto* why = find_as<Unusable>(token.text)) throw EvaluationError{why->why};
    unsupported(token, "is not supported in an object");
  }
}

}  // namespace twocone::sim_povray
