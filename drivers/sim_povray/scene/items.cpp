// SPDX-License-Identifier: Apache-2.0
// What stands in a scene: its settings, lights and camera. Its objects are read by objects.cpp.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <set>
#include <utility>

#include "drivers/sim_povray/scene/evaluation.h"

namespace twocone::sim_povray {
namespace {

/// POV-Ray goes no deeper.
constexpr double kMostTraceLevel = 256;

/// Words of a scene that a lenient evaluation leaves out: they begin no shape.
bool shows_no_shape(std::string_view word) {
  static const std::set<std::string_view> kWords{"finish",       "fog",      "global_settings", "interior",
                                                 "light_source", "material", "media",           "normal",
                                                 "photons",      "pigment",  "rainbow",         "texture"};
  return kWords.contains(word);
}

}  // namespace

Evaluation::Evaluation(std::string_view text, const std::string& path, const IncludeReader& read,
                       const EvaluatorSettings& settings)
    : read_(read), settings_(settings), files_{{path, std::string(text)}} {
  inputs_.push_back({&files_.back(), Lexer(files_.back().text)});
}

EvaluatedScene Evaluation::run() {
  for (Token token = next(); token.kind != Token::Kind::kEnd; token = next()) {
    const bool is_sky = token.text == "background" || token.text == "sky_sphere";
    attempt([&] { read_item(token); }, !is_sky);
  }
  if (!inputs_.back().sections.empty()) fail("an #if, #while, #for, #switch or #macro has no #end");
  if (is_lenient()) {
    *settings_.leniency = std::move(notes_);
    return std::move(scene_);
  }
  if ((!has_version_ || version_ < 3.7) && !has_assumed_gamma_) {
    fail("without '#version 3.7' or assumed_gamma, POV-Ray codes colours otherwise, which is not supported");
  }
  if (version_ < 3.5) fail("a #version before 3.5 is not supported");
  if (!camera_obstacle_.empty()) throw EvaluationError{camera_obstacle_};
  for (SourceFile& file : files_) {
    std::vector<bool>& reached = scene_.reached_words[file.path];
    // A file that is included twice may be read differently.
    for (std::size_t i = 0; i < reached.size() && i < file.reached.size(); ++i) {
      if (reached[i]) file.reached[i] = true;
    }
    reached = std::move(file.reached);
  }
  return std::move(scene_);
}

void Evaluation::read_item(const Token& token) {
  if (token.is(';')) return;
  if (is_lenient() && (token.kind != Token::Kind::kWord || shows_no_shape(token.text))) return skip_argument();
  if (token.text == "global_settings") return read_global_settings();
  if (token.text == "light_source") {
    count_objects(1);
    scene_.lights.push_back(read_light());
  } else if (token.text == "camera") {
    // The last camera of a scene is the one that is used, so an earlier one may be of any kind.
    const int braces = braces_;
    try {
      scene_.camera = read_camera();
      camera_obstacle_.clear();
    } catch (const EvaluationError& error) {
      if (error.is_limit) throw;
      camera_obstacle_ = error.message;
      while (braces_ > braces) {
        if (next().kind == Token::Kind::kEnd) throw;
      }
    }
  } else if (token.text == "background") {
    expect('{');
    scene_.background = colour();
    expect('}');
  } else if (token.text == "sky_sphere") {
    expect('{');
    for (Token part = next(); !part.is('}'); part = next()) {
      Placing placing;
      if (part.text == "pigment") {
        scene_.sky = read_pigment();
      } else if (scene_.sky && read_transformation(part, placing) && !placing.mover) {
        scene_.sky->steps.emplace_back(placing.transform);
      } else {
        unsupported(part, "is not supported in a sky_sphere");
      }
    }
  } else if (auto object = read_object(token)) {
    if (object->texture == nullptr) object->texture = std::make_shared<const Texture>(default_);
    scene_.objects.push_back(*std::move(object));
  } else if (const auto* light = find_as<LightSource>(token.text)) {
    count_objects(1);
    scene_.lights.push_back(*light);
  } else {
    if (const auto* why = find_as<Unusable>(token.text)) throw EvaluationError{why->why};
    unsupported(token, "is not supported");
  }
}

void Evaluation::read_global_settings() {
  expect('{');
  for (Token token = next(); !token.is('}'); token = next()) {
    const std::string_view word = token.text;
    if (word == "assumed_gamma") {
      has_assumed_gamma_ = true;
      if (number() != 1) unsupported(token, "other than 1 is not supported");
    } else if (word == "max_trace_level") {
      scene_.max_trace_level = int(std::fmin(std::fmax(number(), 0), kMostTraceLevel));
    } else if (word == "adc_bailout") {
      scene_.adc_bailout = number();
      if (scene_.adc_bailout >= 1) unsupported(token, "of 1 or more is not supported");
    } else if (word == "ambient_light") {
      scene_.ambient_light = grey_or_colour();
    } else if (word == "max_intersections" || word == "number_of_waves" || word == "irid_wavelength") {
      (void)number();
    } else if (word == "charset") {
      (void)next();
    } else {
      unsupported(token, "is not supported in global_settings");
    }
  }
}

LightSource Evaluation::read_light() {
  expect('{');
  LightSource light;
  if (const auto* known = find_as<LightSource>(peek().text)) {
    light = *known;
    (void)next();
  } else {
    light.position = vector();
    (void)accept(',');
    light.colour = colour();
  }
  for (Token token = next(); !token.is('}'); token = next()) {
    Placing placing;
    const std::string_view word = token.text;
    if (read_transformation(token, placing)) {
      if (light.mover != -1) fail("a light is transformed after its pose by a program");
      light.position = placing.transform.point(light.position);
      light.point_at = placing.transform.point(light.point_at);
      if (placing.mover) light.mover = *placing.mover;
    } else if (word == "spotlight") {  // of this word and `shadowless`, the later one counts: measured
      light.is_spot = true;
      light.shadowless = false;
    } else if (word == "point_at") {
      light.point_at = vector();
    } else if (word == "radius") {
      light.radius_deg = number();
    } else if (word == "falloff") {
      light.falloff_deg = number();
    } else if (word == "tightness") {
      light.tightness = number();
    } else if (word == "fade_distance") {
      light.fade_distance = number();
    } else if (word == "fade_power") {
      light.fade_power = number();
    } else if (word == "shadowless") {
      light.shadowless = true;
      light.is_spot = false;
    } else if (!token.is(',')) {
      unsupported(token, "is not supported in a light_source");
    }
  }
  return light;
}

PerspectiveCamera Evaluation::read_camera() {
  expect('{');
  PerspectiveCamera camera;
  Vec3 sky{0, 1, 0};
  std::optional<Vec3> look_at;
  double angle_deg = 0;
  Placing placing;
  for (Token token = next(); !token.is('}'); token = next()) {
    const std::string_view word = token.text;
    if (word == "perspective") continue;
    if (const auto* known = find_as<PerspectiveCamera>(word)) {
      camera = *known;
    } else if (word == "location") {
      camera.location = vector();
    } else if (word == "direction") {
      camera.direction = vector();
    } else if (word == "right") {
      camera.right = vector();
    } else if (word == "up") {
      camera.up = vector();
    } else if (word == "sky") {
      sky = vector();
    } else if (word == "look_at") {
      look_at = vector();
    } else if (word == "angle") {
      angle_deg = number();
    } else if (!read_transformation(token, placing)) {
      if (is_lenient() && token.kind != Token::Kind::kEnd) {
        skip_argument();
        continue;
      }
      if (const auto* why = find_as<Unusable>(word)) throw EvaluationError{why->why};
      unsupported(token, "is not supported in a camera");
    }
  }
  // The order of the parts does not matter (camera_vectors() in mirror_finder.h states the same rules).
  if (angle_deg > 0) {
    camera.direction =
        normalized(camera.direction) * (length(camera.right) / 2 / std::tan(angle_deg * std::numbers::pi / 360));
  }
  if (look_at) {
    const bool left_handed = dot(cross(camera.up, camera.direction), camera.right) > 0;
    const Vec3 ahead = normalized(*look_at - camera.location);
    Vec3 side = cross(sky, ahead);
    if (std::max({std::abs(side.x), std::abs(side.y), std::abs(side.z)}) < 1e-10) side = camera.right;
    side = normalized(side);
    camera.direction = ahead * length(camera.direction);
    camera.up = cross(ahead, side) * length(camera.up);
    camera.right = side * (left_handed ? length(camera.right) : -length(camera.right));
  }
  camera.location = placing.transform.point(camera.location);
  camera.direction = placing.transform.direction(camera.direction);
  camera.right = placing.transform.direction(camera.right);
  camera.up = placing.transform.direction(camera.up);
  if (placing.mover) camera.mover = *placing.mover;
  return camera;
}

Result<EvaluatedScene> evaluate(std::string_view text, const std::string& path, const IncludeReader& read,
                                const EvaluatorSettings& settings) {
  try {
    return Evaluation(text, path, read, settings).run();
  } catch (const EvaluationError& error) {
    return Error{ErrorCode::kRefused, error.message};
  }
}

}  // namespace twocone::sim_povray
