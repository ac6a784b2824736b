// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <utility>

#include "drivers/sim_povray/scene/evaluation.h"

namespace twocone::sim_povray {
namespace {

using Kind = Token::Kind;

/// A box around points.
struct PointBox {
  static constexpr double kFar = std::numeric_limits<double>::max();
  Box box{{kFar, kFar, kFar}, {-kFar, -kFar, -kFar}};

  void add(const Vec3& point, double radius = 0) {
    const Vec3 half{radius, radius, radius};
    box = {lowest(box.low, point - half), highest(box.high, point + half)};
  }
};

}  // namespace

bool has_bound(std::string_view word) {
  static const std::set<std::string_view> kWords{
      "bicubic_patch", "blob", "height_field",    "isosurface",   "julia_fractal",  "lathe", "mesh",    "mesh2",
      "parametric",    "sor",  "smooth_triangle", "sphere_sweep", "superellipsoid", "text",  "triangle"};
  return kWords.contains(word);
}

void Evaluation::note(std::vector<std::string>& list, const std::string& message) {
  constexpr std::size_t kMostNotes = 100;  // no person reads more
  if (list.size() > kMostNotes || std::ranges::find(list, message) != list.end()) return;
  list.push_back(list.size() < kMostNotes ? message : "more, which are not listed");
}

void Evaluation::note_use(std::string_view name) {
  const auto found = notes_of_declared_.find(name);
  if (found == notes_of_declared_.end()) return;
  count_tokens(found->second.left_out.size() + found->second.bounded.size());
  for (const std::string& message : found->second.left_out) note(notes_.left_out, message);
  for (const std::string& message : found->second.bounded) note(notes_.bounded, message);
}

void Evaluation::recover(int braces, std::size_t inputs) {
  while (inputs_.size() > inputs) {
    braces_ = inputs_.back().braces;
    inputs_.pop_back();
  }
  while (true) {
    try {
      if (braces_ < braces || (braces_ == braces && !peek().is('{'))) return;
      if (next().kind == Kind::kEnd) fail_at_limit("a '{' is never closed");
    } catch (const EvaluationError& error) {
      if (error.is_limit) throw;
    }
  }
}

void Evaluation::recover_from(const Token& token, int braces, std::size_t inputs, std::size_t sections) {
  if (inputs_.size() < inputs) return;
  if (inputs_.size() > inputs || braces_ > braces) recover(braces, inputs);
  auto& open = inputs_.back().sections;
  const bool begins = section_begun_by(token.text).has_value();
  // A section whose condition is not understood is left out with all its branches.
  if (begins && open.size() == sections) open.push_back({SectionKind::kIf});
  if (begins || token.text == "end") {
    if (!open.empty()) leave_section();
    return;
  }
  skip_line(token.place.line);
  if (peek_symbol() == '{') skip_block();
}

void Evaluation::skip_line(int line) {
  const std::size_t inputs = inputs_.size();
  while (true) {
    const Token token = raw();
    const bool goes_on = inputs_.size() == inputs && token.place.line == line && token.kind != Kind::kDirective &&
                         token.kind != Kind::kEnd && !token.is('{') && !token.is('}');
    if (goes_on) continue;
    inputs_.back().pushed = token;
    return;
  }
}

void Evaluation::skip_argument() {
  if (peek().is('{')) skip_block();
}

void Evaluation::read_bound_part(const Token& token, Object& object) {
  if (token.text == "contained_by") {
    expect('{');
    if (auto container = read_object(next())) {
      object.shape = std::move(container->shape);
      object.placed = container->placed.then(object.placed);
    }
    expect('}');
  } else if (token.is('{')) {
    leave_block(braces_ - 1);
  } else if (token.kind == Kind::kWord) {
    skip_argument();
  }
}

Shape Evaluation::read_bound(std::string_view word) {
  const auto comma = [this] { (void)accept(','); };
  const auto next_vector = [&] {
    const Vec3 v = vector();
    comma();
    return v;
  };
  const auto next_number = [&] {
    const double value = number();
    comma();
    return value;
  };
  const auto next_count = [&] {
    const double count = next_number();
    if (!(count >= 0 && count <= double(settings_.most_objects))) fail("this number of points is not supported");
    return int(count);
  };
  PointBox around;
  const auto add_triangle = [&](bool has_normals) {
    for (int i = 0; i < 3; ++i) {
      around.add(next_vector());
      if (has_normals) (void)next_vector();
    }
  };
  if (word == "height_field") return Box{{0, 0, 0}, {1, 1, 1}};
  if (word == "julia_fractal") return Sphere{{}, 2};
  if (word == "superellipsoid" || word == "isosurface" || word == "parametric") return Box{{-1, -1, -1}, {1, 1, 1}};
  if (word == "text") {
    (void)(accept("ttf") || accept("internal"));
    if (peek().kind == Kind::kNumber) {
      (void)number();
    } else {
      (void)string();
    }
    comma();
    const std::string letters = string();
    comma();
    // No letter of POV-Ray's fonts is wider than it is high.
    return Box{{0, -0.35, 0}, {double(letters.size()), 1, next_number()}};
  }
  if (word == "triangle" || word == "smooth_triangle") {
    add_triangle(word == "smooth_triangle");
  } else if (word == "bicubic_patch") {
    while (!peek().is('<')) {
      if (next().is('}')) fail("a bicubic_patch without points");
    }
    for (int i = 0; i < 16; ++i) around.add(next_vector());
  } else if (word == "mesh") {
    for (Token part = peek(); part.text == "triangle" || part.text == "smooth_triangle"; part = peek()) {
      (void)next();
      const int braces = braces_;
      expect('{');
      add_triangle(part.text == "smooth_triangle");
      leave_block(braces);
    }
  } else if (word == "mesh2") {
    if (!accept("vertex_vectors")) fail("a mesh2 that does not begin with its vertices");
    expect('{');
    for (int left = next_count(); left > 0; --left) around.add(next_vector());
    expect('}');
  } else if (word == "blob") {
    Csg parts;
    while (true) {
      const Token token = next();
      if (token.text == "threshold") {
        (void)number();
      } else if (token.text == "component") {
        (void)next_number();
        const double radius = next_number();
        count_objects(1);
        parts.parts.push_back(
            {.shape = Sphere{next_vector(), radius}, .file = inputs_.back().file->shared_path, .line = line_});
      } else if (auto part = read_object(token)) {
        parts.parts.push_back(*std::move(part));
      } else {
        put_back(token);
        if (parts.parts.empty()) fail("a blob without components");
        return parts;
      }
    }
  } else if (word == "sphere_sweep") {
    (void)next();  // its kind of spline
    for (int left = next_count(); left > 0; --left) {
      const Vec3 centre = next_vector();
      around.add(centre, next_number());
    }
  } else {  // lathe, sor: a contour that is turned about the y axis
    if (peek().text.ends_with("_spline")) (void)next();
    double radius = 0;
    for (int left = next_count(); left > 0; --left) {
      const Vec3 corner = next_vector();
      radius = std::max(radius, std::abs(corner.x));
      around.add({0, corner.y, 0});
    }
    return Cone{around.box.low, radius, around.box.high, radius};
  }
  if (around.box.low.x > around.box.high.x) fail("a shape without points");
  return around.box;
}

}  // namespace twocone::sim_povray
