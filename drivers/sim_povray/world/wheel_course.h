// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace twocone::sim_povray {

/// Rotation of one wheel over one step. It is commanded u until `driven_s` and 0 from then on, and follows immediately
/// or with a first-order lag, w' = (u - w) / lag:
///     w(t) = u + (w0 - u) e^(-t/lag),   angle(t) = u t + (w0 - u) lag (1 - e^(-t/lag)),
/// in each of its two parts. Exact for any length.
struct WheelCourse {
  double begin_radps = 0;    ///< w0; not used without lag
  double command_radps = 0;  ///< u
  double driven_s = 0;       ///< >= 0
  double lag_s = 0;          ///< >= 0

  /// Returns the angle turned since the beginning of the step.
  [[nodiscard]] double turned_rad(double time_s) const;
  /// With lag, a speed nearer than 1e-12 rad/s to the command counts as reached, so that a wheel does stop.
  [[nodiscard]] double speed_radps(double time_s) const;
};

}  // namespace twocone::sim_povray
