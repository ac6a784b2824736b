// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <string_view>

#include <fmt/format.h>

#include "apps/as_built/as_built.h"
#include "apps/config/to_layers.h"
#include "base/hash.h"
#include "base/random.h"

namespace twocone::as_built {
namespace {

/// The random numbers of a robot, each by its name.
class Draws {
 public:
  explicit Draws(std::uint64_t seed) : seed_(seed) {}

  /// Returns a number in [0, 1).
  [[nodiscard]] double fraction(std::string_view name) const {
    const std::uint64_t hash = base::fnv1a(name);
    std::seed_seq words{std::uint32_t(seed_), std::uint32_t(seed_ >> 32U), std::uint32_t(hash),
                        std::uint32_t(hash >> 32U)};
    std::mt19937_64 engine(words);
    return base::fraction(engine);
  }
  [[nodiscard]] double within(std::string_view name, double half_width) const {
    return half_width * (2 * fraction(name) - 1);
  }
  [[nodiscard]] double up_to(std::string_view name, double most) const { return most * fraction(name); }
  [[nodiscard]] double between(std::string_view name, const std::array<double, 2>& ends) const {
    return ends[0] + (ends[1] - ends[0]) * fraction(name);
  }
  [[nodiscard]] double direction_rad(std::string_view name) const { return within(name, std::numbers::pi); }
  [[nodiscard]] bool coin(std::string_view name) const { return fraction(name) < 0.5; }

 private:
  std::uint64_t seed_;
};

void check(const Tolerances& t) {
  base::Complaints complaints;
  complaints.not_negative("centre_px", t.centre_px, "px");
  complaints.probability("rim", t.rim);
  complaints.not_negative("azimuth_rad", t.azimuth_rad, "rad");
  complaints.not_negative("tilt_rad", t.tilt_rad, "rad");
  complaints.not_negative("apex_rad", t.apex_rad, "rad");
  complaints.not_negative("mirror_radius_m", t.mirror_radius_m, "m");
  complaints.not_negative("lens_to_tip_m", t.lens_to_tip_m, "m");
  complaints.not_negative("mirror_separation_m", t.mirror_separation_m, "m");
  complaints.not_negative("lens_height_m", t.lens_height_m, "m");
  complaints.not_negative("axis_offset_m", t.axis_offset_m, "m");
  complaints.not_negative("distortion", t.distortion, "");
  complaints.probability("wheel_radius", t.wheel_radius);
  complaints.probability("wheel_separation", t.wheel_separation);
  complaints.not_negative("landmark_place_m", t.landmark_place_m, "m");
  complaints.not_negative("landmark_top_m", t.landmark_top_m, "m");
  complaints.not_negative("landmark_radius_m", t.landmark_radius_m, "m");
  complaints.not_negative("skew_s", t.skew_s, "s");
  complaints.not_negative("slip", t.slip, "");
  complaints.not_negative("read_noise_electrons", t.read_noise_electrons, "electrons");
  complaints.probability("vignetting", t.vignetting);
  complaints.not_negative("defocus_px", t.defocus_px, "px");
  complaints.not_negative("exposure_time_s", t.exposure_time_s, "s");
  complaints.not_negative("readout_s", t.readout_s, "s");
  for (const double electrons : t.full_well_electrons) {
    complaints.positive("full_well_electrons", electrons, "electrons");
  }
  complaints.raise("Tolerances");
}

/// Returns the greatest rim, in pixels, that stays within the image in each draw, with the edge beyond it that vision
/// needs to see it.
double greatest_rim_px(const config::RigView& view, const CameraSettings& camera, const Tolerances& t) {
  constexpr double kEdge_px = 2;
  const double middle_px = (std::min(camera.width_px, camera.height_px) - 1) / 2.0;
  // The rim's radius in focal lengths, where the lens moves it outwards by k1 r^2 + k2 r^4 of its radius; and a lens
  // off its axis moves it by as many rim radii as it is mirror radii off.
  const double r = 1 / (view.lens_to_tip_m / view.mirror_radius_m + 1 / std::tan(view.apex_rad / 2));
  const double moved = t.distortion * (r * r + r * r * r * r) + Unmodelled{}.lens_off_axis_m / view.mirror_radius_m;
  return (middle_px - t.centre_px - kEdge_px) / ((1 + t.rim) * (1 + moved));
}

/// Returns the view as its builder expects it.
config::RigView believed_view(const config::RigView& plan, const CameraSettings& camera, double rim_px) {
  config::RigView view;
  view.apex_rad = plan.apex_rad;
  view.mirror_radius_m = plan.mirror_radius_m;
  view.lens_to_tip_m = plan.lens_to_tip_m;
  view.centre_px = config::middle_px(camera);
  view.rim_radius_px = rim_px;
  view.mirrored = plan.mirrored;
  return view;
}

/// Draws one view, with the names `lower.centre_px.column` and so on. @param view the believed one, changed
void draw_view(const Draws& draws, const std::string& name, const Tolerances& t, config::RigView& view) {
  const auto add = [&](double& value, std::string_view key, double half_width) {
    value += draws.within(fmt::format("{}.{}", name, key), half_width);
  };
  add(view.centre_px[0], "centre_px.column", t.centre_px);
  add(view.centre_px[1], "centre_px.row", t.centre_px);
  add(view.rim_radius_px, "rim_radius_px", t.rim * view.rim_radius_px);
  add(view.azimuth_rad, "azimuth_rad", t.azimuth_rad);
  add(view.tilt_rad[0], "tilt_rad.x", t.tilt_rad);
  add(view.tilt_rad[1], "tilt_rad.y", t.tilt_rad);
  add(view.apex_rad, "apex_rad", t.apex_rad);
  add(view.mirror_radius_m, "mirror_radius_m", t.mirror_radius_m);
  add(view.lens_to_tip_m, "lens_to_tip_m", t.lens_to_tip_m);
  add(view.axis_offset_m[0], "axis_offset_m.x", t.axis_offset_m);
  add(view.axis_offset_m[1], "axis_offset_m.y", t.axis_offset_m);
}

/// Draws a lens for a view and gives it to the camera's effects, too. The simulated lens distorts about the image's
/// middle.
void draw_lens(const Draws& draws, const std::string& name, const Tolerances& t, const CameraSettings& camera,
               config::RigView& view, sim_povray::CameraEffects& effects) {
  effects.distortion.clear();
  effects.distortion_focal_px = 0;
  if (t.distortion == 0) return;
  const double focal_px =
      (view.lens_to_tip_m / view.mirror_radius_m + 1 / std::tan(view.apex_rad / 2)) * view.rim_radius_px;
  view.distortion = {draws.within(name + ".distortion.k1", t.distortion),
                     draws.within(name + ".distortion.k2", t.distortion), 0, 0};
  view.distortion_focal_px = {focal_px, focal_px};
  view.distortion_principal_px = config::middle_px(camera);
  effects.distortion = view.distortion;
  effects.distortion_focal_px = focal_px;
}

void draw_camera(const Draws& draws, const std::string& name, const Tolerances& t, sim_povray::CameraEffects& effects) {
  effects.full_well_electrons = draws.between(name + ".full_well_electrons", t.full_well_electrons);
  effects.read_noise_electrons = draws.up_to(name + ".read_noise_electrons", t.read_noise_electrons);
  effects.vignetting = draws.up_to(name + ".vignetting", t.vignetting);
  effects.defocus_px = draws.up_to(name + ".defocus_px", t.defocus_px);
  effects.exposure_time_s = draws.up_to("exposure_time_s", t.exposure_time_s);
  effects.readout_s = draws.up_to("readout_s", t.readout_s);
  effects.stamp_late_s = 0;
}

config::RigSigma rig_sigma(const Tolerances& t, double rim_px) {
  const auto sigma = [](double half_width) { return half_width / kHalfWidthInSigmas; };
  return {.mirror_radius_m = sigma(t.mirror_radius_m),
          .lens_to_tip_m = sigma(t.lens_to_tip_m),
          .mirror_separation_m = sigma(t.mirror_separation_m),
          .lens_height_m = sigma(t.lens_height_m),
          .apex_rad = sigma(t.apex_rad),
          .centre_px = sigma(t.centre_px),
          .rim_radius_px = sigma(t.rim * rim_px),
          .azimuth_rad = sigma(t.azimuth_rad),
          .tilt_rad = sigma(t.tilt_rad),
          .axis_offset_m = sigma(t.axis_offset_m),
          .late_s = sigma(t.skew_s),
          .readout_s = sigma(t.readout_s),
          .distortion = sigma(t.distortion)};
}

void draw_robot(const Draws& draws, const config::Robot& plan, const Tolerances& t, AsBuilt& drawn) {
  config::Robot& believed = drawn.believed = plan;
  const double rim_px = std::min({(plan.rig.lower.rim_radius_px + plan.rig.upper.rim_radius_px) / 2,
                                  greatest_rim_px(plan.rig.lower, plan.lower.settings, t),
                                  greatest_rim_px(plan.rig.upper, plan.upper.settings, t)});
  believed.rig.lower = believed_view(plan.rig.lower, plan.lower.settings, rim_px);
  believed.rig.upper = believed_view(plan.rig.upper, plan.upper.settings, rim_px);
  believed.rig.sigma = rig_sigma(t, rim_px);
  believed.rig.calibration.clear();  // it is that of the plan
  // The simulated wheels are equal.
  believed.drive.sigma =
      config::WheelSigma{.wheel_radius_m = t.wheel_radius * plan.drive.wheel_radius_m / kHalfWidthInSigmas,
                         .wheel_separation_m = t.wheel_separation * plan.drive.wheel_separation_m / kHalfWidthInSigmas,
                         .wheel_ratio = 0};

  config::Robot& built = drawn.built = believed;
  draw_view(draws, "lower", t, built.rig.lower);
  draw_view(draws, "upper", t, built.rig.upper);
  built.rig.mirror_separation_m += draws.within("mirror_separation_m", t.mirror_separation_m);
  built.rig.lens_height_m += draws.within("lens_height_m", t.lens_height_m);
  built.rig.sigma = config::RigSigma{};
  built.drive.wheel_radius_m *= 1 + draws.within("wheel_radius", t.wheel_radius);
  built.drive.wheel_separation_m *= 1 + draws.within("wheel_separation", t.wheel_separation);
  built.drive.sigma = config::WheelSigma{};

  built.effects.slip = draws.up_to("slip", t.slip);
  built.effects.wheel_radius_m = built.drive.wheel_radius_m;
  built.effects.wheel_separation_m = built.drive.wheel_separation_m;
  draw_lens(draws, "lower", t, plan.lower.settings, built.rig.lower, built.lower.effects);
  draw_lens(draws, "upper", t, plan.upper.settings, built.rig.upper, built.upper.effects);
  draw_camera(draws, "lower", t, built.lower.effects);
  draw_camera(draws, "upper", t, built.upper.effects);
  const double upper_later_s = draws.within("skew_s", t.skew_s);
  (upper_later_s > 0 ? built.upper : built.lower).effects.stamp_late_s = std::abs(upper_later_s);
  for (const auto& [view, camera] :
       {std::pair{&built.rig.lower, &built.lower}, std::pair{&built.rig.upper, &built.upper}}) {
    view->late_s = -camera->effects.stamp_late_s;
    view->readout_s = camera->effects.readout_s;
  }
}

void draw_landmarks(const Draws& draws, const config::Map& map, const Tolerances& t, AsBuilt& drawn) {
  drawn.believed_map = drawn.built_map = map;
  drawn.believed_map.without_sigma.clear();
  drawn.built_map.without_sigma.clear();
  for (Landmark& landmark : drawn.believed_map.landmarks) {
    landmark.sigma = {.x_m = t.landmark_place_m / kHalfWidthInSigmas,
                      .y_m = t.landmark_place_m / kHalfWidthInSigmas,
                      .top_m = t.landmark_top_m / kHalfWidthInSigmas,
                      .radius_m = t.landmark_radius_m / kHalfWidthInSigmas};
  }
  for (Landmark& landmark : drawn.built_map.landmarks) {
    const auto add = [&](double& value, std::string_view key, double half_width) {
      value += draws.within(fmt::format("landmark.{}.{}", landmark.name, key), half_width);
    };
    add(landmark.x_m, "x_m", t.landmark_place_m);
    add(landmark.y_m, "y_m", t.landmark_place_m);
    add(landmark.top_m, "top_m", t.landmark_top_m);
    add(landmark.radius_m, "radius_m", t.landmark_radius_m);
    landmark.sigma = {};
  }
}

void draw_unmodelled(const Draws& draws, const Unmodelled& u, AsBuilt& drawn) {
  const double off_rad = draws.direction_rad("lens_off_axis.direction");
  (draws.coin("lens_off_axis.view") ? drawn.lower : drawn.upper).lens_off_axis_m = {
      u.lens_off_axis_m * std::cos(off_rad), u.lens_off_axis_m * std::sin(off_rad)};
  (draws.coin("bulge.view") ? drawn.lower : drawn.upper).bulge_m = u.bulge_m;
  for (std::size_t i = 0; i < drawn.landmarks.size(); ++i) {
    const std::string name = "landmark." + drawn.built_map.landmarks[i].name;
    LandmarkFlaws& flaws = drawn.landmarks[i];
    const bool leans = draws.coin(name + ".leans");
    flaws.lean_rad = leans ? u.lean_rad : 0;
    flaws.oval = leans ? 0 : u.oval;
    flaws.direction_rad = draws.direction_rad(name + ".direction");
  }
  const std::vector<double> colour{1 + draws.within("colour.red", u.colour), 1,
                                   1 + draws.within("colour.blue", u.colour)};
  for (drivers::CameraPart* camera : {&drawn.built.lower, &drawn.built.upper}) {
    camera->effects.colour_gain = colour;
    camera->effects.flicker = u.flicker;
    camera->effects.jpeg_quality = u.jpeg_quality;
  }
}

}  // namespace

AsBuilt draw(const config::Robot& plan, const config::Map& map, std::uint64_t seed, const Tolerances& tolerances,
             const std::optional<Unmodelled>& unmodelled) {
  check(tolerances);
  const Draws draws(seed);
  AsBuilt drawn;
  drawn.seed = seed;
  draw_robot(draws, plan, tolerances, drawn);
  draw_landmarks(draws, map, tolerances, drawn);
  drawn.landmarks.resize(map.landmarks.size());
  if (unmodelled) draw_unmodelled(draws, *unmodelled, drawn);
  drawn.believed.effects = drawn.built.effects;
  drawn.believed.lower.effects = drawn.built.lower.effects;
  drawn.believed.upper.effects = drawn.built.upper.effects;
  static_cast<void>(config::to_rig(drawn.built));  // throws for a rig that cannot be
  return drawn;
}

}  // namespace twocone::as_built
