// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "drivers/sim_povray/scene/vector3.h"

/// What a scene's text describes, once its declarations, macros and loops are evaluated. Coordinates are POV-Ray's.
namespace twocone::sim_povray {

using Colour = Vec3;  ///< linear red, green and blue

/// Six octaves of noise that displace a point, as POV-Ray's `turbulence`.
struct Turbulence {
  Vec3 amount{};
  int octaves = 6;
  double lambda = 2;
  double omega = 0.5;

  friend bool operator==(const Turbulence&, const Turbulence&) = default;
};

/// `warp { repeat AXIS*WIDTH offset OFFSET flip FLIP }`
struct RepeatWarp {
  int axis = 0;
  double width = 1;
  Vec3 offset{};
  Vec3 flip{};  ///< each component 0 or 1

  friend bool operator==(const RepeatWarp&, const RepeatWarp&) = default;
};

/// One of the maps that lead from a pattern's own coordinates to the surface. `warp { turbulence }` is a Turbulence.
using PatternStep = std::variant<Transform, RepeatWarp, Turbulence>;

enum class Pattern { kColour, kChecker, kBrick, kCells, kGradient, kBoxed, kRadial, kWood, kBozo };
enum class Wave { kRamp, kTriangle, kSine, kScallop, kCubic, kPoly };

struct Pigment;

/// An entry of a colour map or pigment map: `pigment` if it is not null, else `colour`.
struct PigmentEntry {
  double at = 0;
  Colour colour{};
  std::shared_ptr<const Pigment> pigment{};
};

struct Pigment {
  Pattern pattern = Pattern::kColour;
  /// kColour: one entry. kChecker and kBrick without a map: two entries (brick: mortar, then brick; checker: the cell
  /// at the origin's positive corner first). Else the map, in the order of the text; empty: POV-Ray's default map. A
  /// lenient evaluation leaves those of kColour empty if it does not understand the pigment.
  std::vector<PigmentEntry> entries{{}};
  Vec3 axis{};                 ///< kGradient
  Vec3 brick_size{8, 3, 4.5};  ///< kBrick
  double mortar = 0.5;         ///< kBrick
  double frequency = 1;
  double phase = 0;
  std::optional<Wave> wave{};              ///< the pattern's own if none
  double poly_exponent = 1;                ///< Wave::kPoly
  std::optional<Turbulence> turbulence{};  ///< the keyword in the pigment, not in a warp
  std::vector<PatternStep> steps{};        ///< in the order of the text: the first is the nearest to the pattern
  int nesting = 0;                         ///< of pigments in its entries
};

struct Finish {
  Colour ambient{0.1, 0.1, 0.1};
  Colour emission{};
  double diffuse = 0.6;
  double brilliance = 1;
  double phong = 0;
  double phong_size = 40;
  double specular = 0;
  double roughness = 0.05;
  double metallic = 0;
  Colour reflection{};
};

struct Texture {
  Pigment pigment{};
  Finish finish{};
};

struct Box {
  Vec3 low, high;
};
struct Sphere {
  Vec3 centre;
  double radius;
};
/// A cone or cylinder; open: without the discs at its ends.
struct Cone {
  Vec3 base;
  double base_radius;
  Vec3 cap;
  double cap_radius;
  bool open = false;
};
struct FlatDisc {
  Vec3 centre;
  Vec3 normal;
  double radius;
  double hole_radius = 0;
};
/// Inside is where dot(p, normal) < distance * |normal|... as POV-Ray's `plane { normal, distance }`.
struct Plane {
  Vec3 normal;
  double distance;
};
/// About the y axis, in the plane y = 0.
struct Torus {
  double major_radius;
  double minor_radius;
};
/// Points (x, z) of a closed contour; the last is the first again.
using Contour = std::vector<std::pair<double, double>>;
/// `prism` with linear splines and linear sweep along y. Inside by the even-odd rule.
struct Prism {
  double low, high;
  std::vector<Contour> contours;
  bool open = false;
};
/// A x^2 + B y^2 + C z^2 + D xy + E xz + F yz + G x + H y + I z + J = 0; inside is < 0.
struct Quadric {
  Vec3 squares, products, linear;  ///< products: xy, xz, yz
  double constant;
};
/// In the plane z = 0 of its own coordinates, points (x, y); even-odd rule.
struct Polygon {
  std::vector<Contour> contours;
};

struct Object;
enum class Combination { kUnion, kMerge, kIntersection, kDifference };
struct Csg {
  Combination combination = Combination::kUnion;
  std::vector<Object> parts;
};

using Shape = std::variant<Box, Sphere, Cone, FlatDisc, Plane, Torus, Prism, Quadric, Polygon, Csg>;

struct Object {
  Shape shape;
  Transform
      placed{};  ///< from the shape's own coordinates to the scene's, or to its mover's; parts of a Csg have theirs
  std::shared_ptr<const Texture> texture{};  ///< null: that of the Csg around it
  std::vector<Object> clipped_by{};
  bool inverse = false;
  bool no_shadow = false;
  bool no_image = false;
  bool no_reflection = false;
  bool is_bound = false;                      ///< the shape only bounds that of the text (EvaluatorSettings::leniency)
  int mover = -1;                             ///< index of the pose that moves it (PoseSlots); -1: it stands still
  std::string name{};                         ///< of a named block; empty: none
  std::shared_ptr<const std::string> file{};  ///< where its statement begins
  int line = 0;
};

struct LightSource {
  Vec3 position{};
  Colour colour{};
  bool is_spot = false;
  Vec3 point_at{0, 0, 1};
  double radius_deg = 30;
  double falloff_deg = 45;
  double tightness = 0;
  double fade_distance = 0;
  double fade_power = 0;    ///< 0: the light does not fade
  bool shadowless = false;  ///< nor do its highlights show
  int mover = -1;
};

/// A perspective camera: the pixel at (u, v), each from -1/2 to 1/2 to the right and upwards, looks along
/// direction + u right + v up.
struct PerspectiveCamera {
  Vec3 location{};
  Vec3 direction{0, 0, 1};
  Vec3 right{1.33, 0, 0};
  Vec3 up{0, 1, 0};
  int mover = -1;
};

/// `sky_sphere`: pigments from the innermost layer to the outermost, all opaque: only the last counts.
struct EvaluatedScene {
  std::vector<Object> objects{};
  std::vector<LightSource> lights{};
  std::optional<PerspectiveCamera> camera{};
  Colour background{};
  std::optional<Pigment> sky{};
  Colour ambient_light{1, 1, 1};
  int max_trace_level = 5;
  double adc_bailout = 1.0 / 255;
  /// For each file that was read, the offsets of the words that were evaluated. The others are in branches that are not
  /// taken, and in macros that are not called.
  std::map<std::string, std::vector<bool>> reached_words{};
};

}  // namespace twocone::sim_povray
