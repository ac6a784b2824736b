// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "apps/tradeoff/choice.h"
#include "apps/tradeoff/sweep.h"

namespace twocone::tradeoff {

/// Returns errors.csv: the settings and all results that do not depend on the machine's speed. It has a row for each
/// setting, in the plan's order. Numbers are the shortest digits that give the same double. An empty field means that
/// the number does not exist, or that the interval has no limit. Columns:
///
///     width_px height_px antialias   of the images; rays per pixel side
///     effects                        scene, flat, noise
///     estimator enough_m             paper, found, coarse, fine, adaptive; precision at which adaptive stops
///     landmarks bearings             number searched for; 1: bearings are used, 0: ranges only
///     rate_hz frames                 rate of the frames that are used; frames for one answer
///     frames_observed answered       frames that require an answer; number of them with exactly one position
///     position_mean_m position_mean_low_m position_mean_high_m   absolute error, 95 % interval over episodes
///     position_rmse_... position_p95_... position_max_m          the same; 95 % quantile; the largest, no interval
///     heading_..._rad range_..._m    the same for heading and for ranges to landmarks
///     coverage coverage_low coverage_high   share of answers whose own 95 % ellipse contains the truth
///     bound_m                        root mean square of the Cramer-Rao bound of the position
std::string errors_csv(const Sweep& sweep);
/// Returns tradeoff.csv: the same rows and columns, followed by processor times of one frame, memory and frontiers:
///
///     render_median_s render_median_low_s render_median_high_s   of both images, POV-Ray's
///     render_spread_s                from the first to the third quartile
///     render_p95_s render_p95_low_s render_p95_high_s            95 % quantile
///     vision_... localisation_... robot_...   the same; robot: vision and localisation of one frame together
///     simulation_s simulation_low_s simulation_high_s            robot_p95_s + render_median_s
///     peak_bytes render_bytes        of the program, of the largest POV-Ray process
///     robot_frontier simulation_frontier   1: the setting is on this frontier
std::string tradeoff_csv(const Sweep& sweep);
/// Returns tradeoff.json: the sweep with its rule, conclusions and growth in sentences. Each of its settings has the
/// columns of tradeoff.csv as keys, and its description.
std::string tradeoff_json(const Sweep& sweep);
/// Returns index.html, the viewer with tradeoff.json: both planes of error over cost, with each setting under the
/// pointer, and a table of all settings. It links to tradeoff.csv, errors.csv and tradeoff.json beside it.
/// @param choice marked in the planes; may be null
std::string page(const Sweep& sweep, const Choice* choice);
/// Returns the text for the terminal, at most 120 columns of plain ASCII: header lines, the rule, the settings on a
/// frontier by rising simulation time, the baseline, the unchanged robot file, counts, conclusions, and growth.
std::string table(const Sweep& sweep);

}  // namespace twocone::tradeoff
