// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/render/mirror_finder.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <string_view>

#include <fmt/format.h>

namespace twocone::sim_povray {
namespace {

/// The number of teeth is a prime, so that no regular set of directions coincides with them. Each flank is about three
/// degrees wide. Its straight line therefore stays outside the inner circle if the mirror's radius is below 4000 px.
constexpr int kTeeth = 53;

/// Returns the corners of the hole, in pixels from its centre, closed as POV-Ray's `polygon` requires.
std::string jagged_circle(double radius_px) {
  std::string corners;
  for (int i = 0; i <= 2 * kTeeth; ++i) {
    const double angle_rad = std::numbers::pi * (i % (2 * kTeeth)) / kTeeth;
    const double r = radius_px + (i % 2 == 0 ? 0 : kMaskTeeth_px);
    corners += fmt::format(", <{:.6f}, {:.6f}>", r * std::cos(angle_rad), r * std::sin(angle_rad));
  }
  return corners;
}

/// Parts of a perspective camera that define the directions of its pixels, and those that move it.
const std::set<std::string_view> kVectors{"location", "direction", "up", "right", "sky", "look_at", "angle"};
const std::set<std::string_view> kTransformations{"translate", "rotate", "scale", "matrix", "transform"};

/// Parts that spread the rays of a pixel or change their directions.
const std::set<std::string_view> kBlur{"aperture", "normal", "blur_samples", "focal_point", "confidence", "variance"};

struct CameraParts {
  std::map<std::string_view, std::string> vectors;  ///< by keyword, as the scene writes them, without comments
  std::string transformations;
};

bool is_keyword(const Token& token) {
  return token.kind == Token::Kind::kWord && (kVectors.contains(token.text) || kTransformations.contains(token.text));
}

/// Takes the camera statement apart. Errors: kRefused, with the reason.
Result<CameraParts> parts_of(std::string_view statement) {
  const auto refuse = [](const std::string& why) { return Error{ErrorCode::kRefused, why}; };
  Lexer lexer(statement);
  (void)lexer.next();  // camera
  (void)lexer.next();  // {
  CameraParts parts;
  std::string* open = nullptr;  // the part that the next tokens belong to
  std::size_t previous_end = 0;
  int depth = 0;
  for (Token token = lexer.next(); token.kind != Token::Kind::kEnd; token = lexer.next()) {
    if (token.kind == Token::Kind::kName) continue;
    if (token.kind == Token::Kind::kDirective) return refuse(fmt::format("its statement holds a #{}", token.text));
    if (depth == 0 && is_keyword(token)) {
      if (kTransformations.contains(token.text)) {
        open = &parts.transformations;
        *open += fmt::format(" {}", token.text);
      } else {
        open = &parts.vectors[token.text];
        open->clear();  // the last one counts
      }
    } else if (open == nullptr) {
      if (token.text != "perspective") return refuse(fmt::format("its statement begins with '{}'", token.text));
    } else if (depth == 0 && (token.is('{') && open != &parts.transformations)) {
      return refuse(fmt::format("its statement holds more than where it looks: a block in line {}", token.place.line));
    } else {
      if (kBlur.contains(token.text)) return refuse(fmt::format("it has a '{}'", token.text));
      // A blank only where the scene has a gap: `a.x` and `W(1)` stay in one piece.
      if (token.place.offset != previous_end || open->empty()) *open += ' ';
      *open += token.text;
    }
    if (token.is('{') || token.is('(') || token.is('<') || token.is('[')) ++depth;
    if (token.is('}') || token.is(')') || token.is('>') || token.is(']')) --depth;
    previous_end = token.place.offset + token.text.size();
  }
  return parts;
}

/// Returns whether the text sets a version before 3.5. There, the parts of a camera take effect in the order in which
/// they are written.
bool has_old_version(std::string_view text) {
  Lexer lexer(text);
  for (Token token = lexer.next(); token.kind != Token::Kind::kEnd; token = lexer.next()) {
    if (token.kind != Token::Kind::kDirective || token.text != "version") continue;
    const Token number = lexer.next();
    double version = 0;
    std::from_chars(number.text.data(), number.text.data() + number.text.size(), version);
    if (number.kind != Token::Kind::kNumber || version < 3.5) return true;
  }
  return false;
}

}  // namespace

Result<CameraVectors> camera_vectors(const Scene& scene, const NamedBlock& camera) {
  if (has_old_version(scene.text())) {
    return Error{ErrorCode::kRefused, "the scene's #version is below 3.5, where cameras follow other rules"};
  }
  const auto parts = parts_of(std::string_view(scene.text()).substr(camera.begin, camera.close - camera.begin));
  if (!parts) return parts.error();
  const auto part = [&parts](std::string_view name, const char* otherwise) {
    const auto found = parts->vectors.find(name);
    return found == parts->vectors.end() ? std::string(otherwise) : found->second;
  };
  const bool has_angle = parts->vectors.contains("angle");
  const bool has_look_at = parts->vectors.contains("look_at");
  const std::string& p = scene.prefix();
  // `+ <0,0,0>` makes a vector of a value that may be a single number.
  std::string sdl = fmt::format(
      "#declare {0}Location = {1} + <0,0,0>; #declare {0}Direction = {2} + <0,0,0>; "
      "#declare {0}Right = {3} + <0,0,0>; #declare {0}Up = {4} + <0,0,0>; ",
      p, part("location", "<0,0,0>"), part("direction", "<0,0,1>"), part("right", "<1.33,0,0>"), part("up", "<0,1,0>"));
  if (has_angle) {
    sdl += fmt::format(
        "#declare {0}Angle = {1}; "
        "#if ({0}Angle > 0) #declare {0}Direction = vnormalize({0}Direction) * vlength({0}Right) / 2 / "
        "tan(radians({0}Angle / 2)); #end ",
        p, part("angle", ""));
  }
  if (has_look_at) {
    sdl += fmt::format(
        "#declare {0}Hand = (vdot(vcross({0}Up, {0}Direction), {0}Right) > 0 ? 1 : -1); "
        "#declare {0}Ahead = vnormalize({1} + <0,0,0> - {0}Location); "
        "#declare {0}Side = vcross({2} + <0,0,0>, {0}Ahead); "
        "#if (max(abs({0}Side.x), abs({0}Side.y), abs({0}Side.z)) < 1e-10) #declare {0}Side = {0}Right; #end "
        "#declare {0}Side = vnormalize({0}Side); #declare {0}Direction = {0}Ahead * vlength({0}Direction); "
        "#declare {0}Up = vcross({0}Ahead, {0}Side) * vlength({0}Up); "
        "#declare {0}Right = {0}Side * vlength({0}Right) * {0}Hand; ",
        p, part("look_at", ""), part("sky", "<0,1,0>"));
  }
  return CameraVectors{std::move(sdl), parts->transformations};
}

Result<std::string> camera_mask(const Scene& scene, const NamedBlock& camera, const Circle& circle, int width_px,
                                int height_px) {
  const auto vectors = camera_vectors(scene, camera);
  if (!vectors) return vectors.error();
  const double far_column = std::max(circle.centre.column_px, width_px - 1 - circle.centre.column_px) + 1;
  const double far_row = std::max(circle.centre.row_px, height_px - 1 - circle.centre.row_px) + 1;
  const double corner_px = std::hypot(far_column, far_row);
  if (corner_px <= circle.radius_px + kMaskTeeth_px) return Error{ErrorCode::kRefused, "the mirror fills the image"};

  const std::string& p = scene.prefix();
  std::string sdl = vectors->declarations;
  // In the pane's own coordinates, x and y are columns and rows from the circle's centre, in pixels. The pane is at 0.2
  // % of the coordinates: nearer than any object that a camera may have in front of it, and still far above the
  // rounding of POV-Ray's bounding boxes, which are single precision.
  sdl += fmt::format(
      "#declare {0}Depth = 0.002 * max(1, vlength({0}Location)) / vlength({0}Direction); "
      "#declare {0}X = {0}Right * {0}Depth / {1}; #declare {0}Y = -{0}Up * {0}Depth / {2}; "
      "#declare {0}Z = vnormalize({0}Direction) * vlength({0}X); "
      "#declare {0}Centre = {0}Location + {0}Direction * {0}Depth + {0}X * ({3}) + {0}Y * ({4}); ",
      p, width_px, height_px, circle.centre.column_px + 0.5 - width_px / 2.0,
      circle.centre.row_px + 0.5 - height_px / 2.0);
  // The outer corners lie beyond the image's.
  sdl += fmt::format("polygon {{ {0}, <-{1}, -{1}>, <{1}, -{1}>, <{1}, {1}>, <-{1}, {1}>, <-{1}, -{1}>{2} ",
                     5 + 2 * kTeeth + 1, corner_px, jagged_circle(circle.radius_px));
  sdl += fmt::format(
      "matrix <{0}X.x, {0}X.y, {0}X.z, {0}Y.x, {0}Y.y, {0}Y.z, {0}Z.x, {0}Z.y, {0}Z.z, {0}Centre.x, {0}Centre.y, "
      "{0}Centre.z>{1} ",
      p, vectors->transformations);
  sdl +=
      "hollow no_shadow no_reflection no_radiosity photons { pass_through collect off } texture { pigment { color "
      "rgb 0 } finish { ambient 0 diffuse 0 emission 0 phong 0 specular 0 reflection 0 } } }";
  return sdl;
}

}  // namespace twocone::sim_povray
