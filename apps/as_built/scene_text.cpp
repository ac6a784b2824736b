// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <iterator>
#include <numbers>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "apps/as_built/as_built.h"
#include "vision/bands/band_code.h"

namespace twocone::as_built {
namespace {

/// Everything about a texture is stated, because a scene's #default may be anything.
constexpr const char* kTextures = R"(
#version 3.7;
#declare Built_Mirror = texture { pigment { color rgb 0 } finish { ambient 0 diffuse 0 reflection 0.9 } }
#declare Built_Dark = texture { pigment { color rgb 0.09 } finish { ambient 0.3 diffuse 0.6 reflection 0 } }
#declare Built_Pale = texture { pigment { color rgb 0.60 } finish { ambient 0.3 diffuse 0.6 reflection 0 } }
)";

/// Returns the angle of POV-Ray's `rotate`, in degrees, for a turn of the world's frame: the opposite sign. A sum with
/// 0 is never -0.
double turned(double angle_rad) { return 0 - angle_rad * 180 / std::numbers::pi; }

/// Writes POV-Ray's left-handed frame with y up: world (x, y, z) is <x, z, y>. A turn counter-clockwise about z, as
/// seen from above, is one by the negative angle about POV-Ray's y, and likewise for the other axes.
class SceneText {
 public:
  explicit SceneText(const AsBuilt& drawn) : drawn_(drawn), robot_(drawn.built) {}

  std::string write() {
    print("\n// ---- the robot as built{}", kTextures);
    const config::Rig& rig = robot_.rig;
    const double lower_lens_m = rig.lens_height_m;
    const double upper_lens_m =
        lower_lens_m + rig.lower.lens_to_tip_m + rig.mirror_separation_m - rig.upper.lens_to_tip_m;
    print("union {{\n  //*PMName robot\n");
    body(lower_lens_m, upper_lens_m);
    unit(rig.lower, drawn_.lower, lower_lens_m);
    unit(rig.upper, drawn_.upper, upper_lens_m);
    print("  {}\n}}\n", placed());
    camera("lower", rig.lower, drawn_.lower, robot_.lower.settings, lower_lens_m);
    camera("upper", rig.upper, drawn_.upper, robot_.upper.settings, upper_lens_m);
    print("\n// ---- the landmarks as they stand\n");
    for (std::size_t i = 0; i < drawn_.landmarks.size(); ++i) {
      landmark(drawn_.built_map.landmarks[i], drawn_.landmarks[i]);
    }
    return std::move(text_);
  }

 private:
  template <typename... Values>
  void print(fmt::format_string<Values...> format, Values&&... values) {
    fmt::format_to(std::back_inserter(text_), format, std::forward<Values>(values)...);
  }

  [[nodiscard]] double per_m() const { return 1 / drawn_.built_map.unit_m; }

  /// Returns the transformation from the body's frame, in metres, to the scene.
  [[nodiscard]] std::string placed() const {
    const Pose2 start = robot_.start.value_or(Pose2{});
    return fmt::format("scale {} rotate <0, {}, 0> translate <{}, 0, {}>", per_m(), turned(start.heading_rad),
                       start.x_m * per_m(), start.y_m * per_m());
  }

  /// Returns the transformation of a mirror and its camera, as one, from their own frame, whose origin is the lens, to
  /// the body's: R_y(tilt.y) R_x(tilt.x) about the lens.
  static std::string mounted(const config::RigView& view, double lens_m) {
    return fmt::format("rotate <{}, 0, 0> rotate <0, 0, {}> translate <{}, {}, {}>", turned(view.tilt_rad[0]),
                       turned(view.tilt_rad[1]), view.axis_offset_m[0], lens_m, view.axis_offset_m[1]);
  }

  /// Writes what carries the mirrors. Its measures follow from those of the robot, as in the lab: nothing but the mast,
  /// behind the axis, is between the heights that a mirror sees.
  void body(double lower_lens_m, double upper_lens_m) {
    const double radius_m = robot_.body_radius_m;
    const double mirror_m = robot_.rig.lower.mirror_radius_m;
    const double deck_m = 0.72 * lower_lens_m;
    const double mast_m = 0.66 * radius_m;
    const double top_m = upper_lens_m + robot_.rig.upper.lens_to_tip_m + 2.2 * mirror_m;
    const double wheel_m = robot_.drive.wheel_radius_m;
    const double side_m = robot_.drive.wheel_separation_m / 2;
    print("  cylinder {{ <0, {}, 0>, <0, {}, 0>, {} texture {{ Built_Dark }} }}\n", 0.5 * wheel_m, deck_m,
          0.9 * radius_m);
    for (const double y_m : {-side_m, side_m}) {
      print("  cylinder {{ <0, {0}, {1}>, <0, {0}, {2}>, {0} texture {{ Built_Pale }} }}\n", wheel_m,
            y_m - 0.1 * wheel_m, y_m + 0.1 * wheel_m);
    }
    print("  cylinder {{ <{0}, {1}, 0>, <{0}, {2}, 0>, {3} texture {{ Built_Pale }} }}   // mast\n", -mast_m, deck_m,
          top_m, 0.067 * mirror_m);
    for (const double z_m : {lower_lens_m - mirror_m, upper_lens_m - mirror_m, top_m - 0.25 * mirror_m}) {
      print("  cylinder {{ <{0}, {1}, 0>, <0, {1}, 0>, {2} texture {{ Built_Pale }} }}\n", -mast_m, z_m,
            0.083 * mirror_m);
    }
    print("  cylinder {{ <0, {}, 0>, <0, {}, 0>, {} texture {{ Built_Pale }} }}\n", top_m - mirror_m,
          top_m - 0.25 * mirror_m, 0.13 * mirror_m);
  }

  void unit(const config::RigView& view, const ViewFlaws& flaws, double lens_m) {
    const double radius_m = view.mirror_radius_m;
    const double height_m = radius_m / std::tan(view.apex_rad / 2);
    const double tip_m = view.lens_to_tip_m;
    const double rim_m = tip_m + height_m;
    print("  union {{\n    cylinder {{ <0, {}, 0>, <0, {}, 0>, {} texture {{ Built_Dark }} }}\n", -0.9 * radius_m,
          -0.08 * radius_m, 0.38 * radius_m);
    if (flaws.bulge_m == 0) {
      print("    cone {{ <0, {}, 0>, 0, <0, {}, 0>, {} open texture {{ Built_Mirror }} }}\n", tip_m, rim_m, radius_m);
    } else {
      bulging_mirror(view, flaws.bulge_m, height_m);
    }
    print("    cylinder {{ <0, {}, 0>, <0, {}, 0>, {} texture {{ Built_Dark }} }}\n    {}\n  }}\n", rim_m,
          rim_m + radius_m / 6, radius_m, mounted(view, lens_m));
  }

  /// Writes the quadric r^2 = t^2 y^2 + c y (height - y), with t = tan(apex / 2) and y from the tip. It has the cone's
  /// tip and rim. At half the height it is c height / 4 more than the cone's r^2, which is (t height / 2 + b)^2 for
  /// c = 4 b (t height + b) / height^2; and b is the bulge divided by cos(apex / 2), since the bulge is across the
  /// surface. For c > 0 the tip is round, with a radius of curvature of c height / 2.
  void bulging_mirror(const config::RigView& view, double bulge_m, double height_m) {
    const double b = bulge_m / std::cos(view.apex_rad / 2);
    const double t = std::tan(view.apex_rad / 2);
    const double c = 4 * b * (t * height_m + b) / (height_m * height_m);
    // The cylinder ends the quadric at tip and rim, and is wider than it everywhere between.
    print(
        "    intersection {{   // bulges by {} m\n"
        "      quadric {{ <1, {}, 1>, <0, 0, 0>, <0, {}, 0>, 0 }}\n"
        "      cylinder {{ <0, 0, 0>, <0, {}, 0>, {} }}\n"
        "      texture {{ Built_Mirror }} translate {}*y\n    }}\n",
        bulge_m, c - t * t, -c * height_m, height_m, 1.1 * view.mirror_radius_m, view.lens_to_tip_m);
  }

  /// Writes a pinhole that looks up. The part of `direction` across the axis brings the tip to centre_px: in units of
  /// the image's height, the axis is where direction + right (column - middle) / width + up (middle - row) / height
  /// points at the tip.
  void camera(const char* name, const config::RigView& view, const ViewFlaws& flaws, const CameraSettings& size,
              double lens_m) {
    const double height_px = size.height_px;
    const double focal =
        (view.lens_to_tip_m / view.mirror_radius_m + 1 / std::tan(view.apex_rad / 2)) * view.rim_radius_px / height_px;
    const double right = (view.centre_px[0] - (size.width_px - 1) / 2.0) / height_px;
    const double down = (view.centre_px[1] - (size.height_px - 1) / 2.0) / height_px;
    const double up = view.mirrored ? 1 : -1;  // which way the image's upper edge is, along POV-Ray's z
    // The lens's place from the axis in the camera's own frame, before it is turned by the azimuth.
    const double cosine = std::cos(view.azimuth_rad), sine = std::sin(view.azimuth_rad);
    const auto& [off_x_m, off_y_m] = flaws.lens_off_axis_m;
    const double along_m = off_x_m * cosine + off_y_m * sine + 0, across_m = off_y_m * cosine - off_x_m * sine + 0;
    print("camera {{\n  //*PMName {}\n  perspective location <{}, 0, {}>\n", name, along_m, across_m);
    print("  direction <{}, {}, {}> up <0, 0, {}> right <{}/{}, 0, 0>\n", -right - focal * along_m / view.lens_to_tip_m,
          focal, up * down - focal * across_m / view.lens_to_tip_m, up, size.width_px, size.height_px);
    print("  rotate <0, {}, 0> {}\n  {}\n}}\n", turned(view.azimuth_rad), mounted(view, lens_m), placed());
  }

  /// Writes a matt cylinder. One that leans keeps the middle of its top where the map has it, or that of the line of
  /// its bands, at whose upper end it ends.
  void landmark(const Landmark& landmark, const LandmarkFlaws& flaws) {
    const double over_line_m = landmark.bands ? double(vision::kCellsOverLine) * landmark.bands->cell_m : 0;
    print("cylinder {{ <0, {}, 0>, <0, {}, 0>, {}   // {}\n", -landmark.top_m * per_m(), over_line_m * per_m(),
          landmark.radius_m * per_m(), landmark.name);
    print("  texture {{ pigment {{ ");
    if (landmark.bands) {
      bands(*landmark.bands, landmark.top_m);
    } else {
      const auto& [red, green, blue] = landmark.colour;
      print("color rgb <{}, {}, {}>", red, green, blue);
    }
    print(" }} finish {{ ambient 0.35 diffuse 0.62 reflection 0 }} }}\n");
    if (flaws.oval != 0) {
      print("  scale <{}, 1, {}> rotate <0, {}, 0>\n", 1 + flaws.oval / 2, 1 - flaws.oval / 2,
            turned(flaws.direction_rad));
    }
    if (flaws.lean_rad != 0) {
      print("  rotate <0, 0, {}> rotate <0, {}, 0>\n", turned(flaws.lean_rad), turned(flaws.direction_rad));
    }
    print("  translate <{}, {}, {}>\n}}\n", landmark.x_m * per_m(), landmark.top_m * per_m(), landmark.y_m * per_m());
  }

  /// Writes the pigment of bands whose line is at the height 0, on a grey pipe from -line_m on.
  void bands(const Bands& bands, double line_m) {
    const vision::BandCells cells = vision::band_cells(bands.number);
    const double over_line_m = double(vision::kCellsOverLine) * bands.cell_m;
    const double length_m = line_m + over_line_m;
    constexpr double kInk = 0.04;
    constexpr double kPaper = 0.80;
    constexpr double kPipe = 0.45;
    // A gradient from the foot (0) to the upper end (1).
    const double foot = 1 - double(vision::kBandCells) * bands.cell_m / length_m;
    print("gradient y color_map {{ [0 rgb {}] [{} rgb {}]", kPipe, foot, kPipe);
    for (std::size_t k = vision::kBandCells; k-- > 0;) {
      const double grey = cells[k] ? kPaper : kInk;
      print(" [{} rgb {}] [{} rgb {}]", 1 - double(k + 1) * bands.cell_m / length_m, grey,
            1 - double(k) * bands.cell_m / length_m, grey);
    }
    print(" }} scale {} translate {}*y", length_m * per_m(), -line_m * per_m());
  }

  const AsBuilt& drawn_;
  const config::Robot& robot_;
  std::string text_;
};

}  // namespace

std::string scene_text(const AsBuilt& drawn) { return SceneText(drawn).write(); }

}  // namespace twocone::as_built
