// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace twocone::sim_povray {

/// How one wheel turns over one step: told u until `driven_s`, told to stand from then on, and following at once or
/// behind a first-order lag, w' = (u - w) / lag:
///     w(t) = u + (w0 - u) e^(-t/lag),   angle(t) = u t + (w0 - u) lag (1 - e^(-t/lag)),
/// in either of its two parts. Exact, whatever the length.
struct WheelCourse {
  double begin_radps = 0;    ///< w0; without lag it does not count
  double command_radps = 0;  ///< u
  double driven_s = 0;       ///< >= 0
  double lag_s = 0;          ///< >= 0

  /// Since the beginning of the step.
  [[nodiscard]] double turned_rad(double time_s) const;
  /// With lag: nearer than 1e-12 rad/s to what it is told counts as there, so that a wheel does come to stand.
  [[nodiscard]] double speed_radps(double time_s) const;
};

}  // namespace twocone::sim_povray
