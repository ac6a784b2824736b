// SPDX-License-Identifier: Apache-2.0
#include <string>

#include <fmt/format.h>

#include "base/errors.h"
#include "drivers/sim_povray/place.h"
#include "drivers/sim_povray/session_settings.h"

namespace twocone::sim_povray {
namespace {

void take(base::Complaints& complaints, const RenderSettings& render) {
  if (render.povray.empty()) complaints.add("render.povray is empty");
  if (render.processes < 1) complaints.add("render.processes is {}, must be >= 1", render.processes);
  if (render.timeout.count() <= 0) complaints.add("render.timeout is {} ms, must be > 0", render.timeout.count());
}

void take(base::Complaints& complaints, const std::string& name, const FloorPoint& point) {
  complaints.finite(name + ".x_m", point.x_m, "m");
  complaints.finite(name + ".y_m", point.y_m, "m");
}

void take(base::Complaints& complaints, const std::string& name, const Pose2& pose) {
  complaints.finite(name + ".x_m", pose.x_m, "m");
  complaints.finite(name + ".y_m", pose.y_m, "m");
  complaints.finite(name + ".heading_rad", pose.heading_rad, "rad");
}

void take(base::Complaints& complaints, const MovingThing& thing) {
  const std::string name = fmt::format("moving '{}'", thing.name);
  if (thing.name.empty()) complaints.add("a moving thing has no name");
  complaints.positive(name + ".speed_mps", thing.speed_mps, "m/s");
  complaints.positive(name + ".radius_m", thing.radius_m, "m");
  if (thing.path_m.size() < 2) complaints.add("{}.path_m has {} points, must be >= 2", name, thing.path_m.size());
  for (std::size_t i = 0; i < thing.path_m.size(); ++i) {
    take(complaints, fmt::format("{}.path_m[{}]", name, i), thing.path_m[i]);
    if (i > 0 && thing.path_m[i] == thing.path_m[i - 1]) {
      complaints.add("{0}.path_m[{1}] is that of [{2}], must differ", name, i, i - 1);
    }
  }
}

void take(base::Complaints& complaints, const WheelSettings& wheels) {
  complaints.positive("wheels.separation_m", wheels.separation_m, "m");
  complaints.positive("wheels.radius_m", wheels.radius_m, "m");
  complaints.not_negative("wheels.slip", wheels.slip, "");
  complaints.positive("wheels.slip_correlation_s", wheels.slip_correlation_s, "s");
  complaints.not_negative("wheels.lag_s", wheels.lag_s, "s");
  if (wheels.encoder_counts_per_turn < 0) {
    complaints.add("wheels.encoder_counts_per_turn is {}, must be >= 0", wheels.encoder_counts_per_turn);
  }
}

void take(base::Complaints& complaints, const CameraEffects& effects) {
  complaints.positive("effects.gain", effects.gain, "");
  complaints.not_negative("effects.full_well_electrons", effects.full_well_electrons, "electrons");
  complaints.not_negative("effects.read_noise_electrons", effects.read_noise_electrons, "electrons");
  if (effects.read_noise_electrons > 0 && effects.full_well_electrons == 0) {
    complaints.add("effects.read_noise_electrons is {}, needs full_well_electrons > 0", effects.read_noise_electrons);
  }
  if (!(effects.vignetting >= 0 && effects.vignetting <= 1)) {
    complaints.add("effects.vignetting is {}, must be 0 to 1", effects.vignetting);
  }
  complaints.not_negative("effects.defocus_px", effects.defocus_px, "px");
  complaints.not_negative("effects.exposure_time_s", effects.exposure_time_s, "s");
  complaints.not_negative("effects.readout_s", effects.readout_s, "s");
  complaints.within("effects.shutter_samples", effects.shutter_samples, 2, 64);
  const std::size_t terms = effects.distortion.size();
  if (terms != 0 && terms != 4 && terms != 5) complaints.add("effects.distortion has {} terms, must be 4 or 5", terms);
  for (const double term : effects.distortion) complaints.finite("effects.distortion", term, "");
  if (terms != 0) complaints.positive("effects.distortion_focal_px", effects.distortion_focal_px, "px");
  complaints.probability("effects.drop_probability", effects.drop_probability);
  complaints.probability("effects.late_probability", effects.late_probability);
  if (!(effects.stamp_late_s >= 0 && effects.stamp_late_s <= kMaxStampLate_s)) {
    complaints.add("effects.stamp_late_s is {} s, must be 0 to {}", effects.stamp_late_s, kMaxStampLate_s);
  }
  const std::size_t colours = effects.colour_gain.size();
  if (colours != 0 && colours != 3) complaints.add("effects.colour_gain has {} numbers, must be 3", colours);
  for (const double gain : effects.colour_gain) complaints.positive("effects.colour_gain", gain, "");
  if (!(effects.flicker >= 0 && effects.flicker <= 1)) {
    complaints.add("effects.flicker is {}, must be 0 to 1", effects.flicker);
  }
  complaints.within("effects.jpeg_quality", effects.jpeg_quality, 0, 100);
}

}  // namespace

std::string_view to_string(RendererKind kind) {
  switch (kind) {
    case RendererKind::kAuto:
      return "auto";
    case RendererKind::kNative:
      return "native";
    case RendererKind::kPovray:
      break;
  }
  return "povray";
}

std::optional<RendererKind> renderer_named(std::string_view name) {
  for (const RendererKind kind : {RendererKind::kAuto, RendererKind::kNative, RendererKind::kPovray}) {
    if (to_string(kind) == name) return kind;
  }
  return std::nullopt;
}

void check(const RenderSettings& settings) {
  base::Complaints complaints;
  take(complaints, settings);
  complaints.raise("RenderSettings");
}

void check(const PlaceSettings& settings) {
  base::Complaints complaints;
  if (settings.scene.empty()) complaints.add("scene is empty");
  complaints.positive("unit_m", settings.unit_m, "m");
  if (settings.walls) {
    const Bounds& walls = *settings.walls;
    complaints.span("walls.", 'x', walls.min_x_m, walls.max_x_m);
    complaints.span("walls.", 'y', walls.min_y_m, walls.max_y_m);
  }
  for (const Solid& solid : settings.solids) {
    if (const auto* disc = std::get_if<Disc>(&solid.shape)) {
      take(complaints, solid.name, disc->centre);
      complaints.positive(solid.name + ".radius_m", disc->radius_m, "m");
    } else {
      const Outline& outline = std::get<Outline>(solid.shape);
      if (outline.size() < 3) complaints.add("{} has {} corners, must be >= 3", solid.name, outline.size());
      for (const FloorPoint& corner : outline) take(complaints, solid.name, corner);
    }
  }
  for (const MovingThing& thing : settings.moving) take(complaints, thing);
  if (settings.switches.reflection_depth) {
    complaints.within("switches.reflection_depth", *settings.switches.reflection_depth, 1, 256);
  }
  take(complaints, settings.render);
  complaints.raise("PlaceSettings");
}

void check(const SessionSettings& settings) {
  const RobotBody& body = settings.body;
  base::Complaints complaints;
  take(complaints, "start", body.start);
  if (body.begin) take(complaints, "begin", *body.begin);
  complaints.not_negative("radius_m", body.radius_m, "m");
  take(complaints, body.wheels);
  if (body.command_timeout.count() <= 0) {
    complaints.add("command_timeout is {} ns, must be > 0", body.command_timeout.count());
  }
  if (body.physics) {
    complaints.positive("physics.mass_kg", body.physics->mass_kg, "kg");
    complaints.positive("physics.wheel_friction", body.physics->wheel_friction, "");
    complaints.not_negative("physics.body_friction", body.physics->body_friction, "");
    // The moment of inertia is that of a disc.
    if (body.radius_m == 0) complaints.add("radius_m is 0 m, physics needs > 0");
  }
  if (settings.run_ahead_frames < 1) {
    complaints.add("run_ahead_frames is {}, must be >= 1", settings.run_ahead_frames);
  }
  try {
    twocone::check(settings.drive);
  } catch (const std::invalid_argument& e) {
    complaints.add("drive: {}", e.what());
  }
  complaints.raise("SessionSettings");
}

void check(const ViewSettings& settings) {
  base::Complaints complaints;
  if (settings.camera_name.empty()) complaints.add("camera_name is empty");
  // POV-Ray accepts +R up to 9.
  complaints.within("antialias", settings.antialias, 1, 9);
  take(complaints, settings.effects);
  complaints.raise("ViewSettings");
}

}  // namespace twocone::sim_povray
