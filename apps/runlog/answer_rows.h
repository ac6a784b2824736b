// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "apps/config/map_file.h"
#include "apps/estimation/estimator.h"
#include "apps/estimation/track.h"
#include "apps/runlog/run_data.h"

namespace twocone::runlog {

/// An answer as rows of the tables, compared with the truth if it is known.
struct AnswerRows {
  std::vector<RangeRow> ranges;
  std::vector<FixRow> fixes;  ///< one, or two for an ambiguous frame
  std::vector<SightingRow> sightings;
  /// The time and work for the answer (timing.h).
  std::optional<TimingRow> timing{};
  /// The result of the track (track.h); estimate.tum is written from it too.
  std::optional<TrackRow> track{};
};
/// @param answer ranges in the map's order; its fix's outliers are indices of them
/// @param truth the true pose; null on hardware
AnswerRows to_rows(std::uint64_t frame, double t_s, const estimation::FrameAnswer& answer, const config::Map& map,
                   const PoseRow* truth);

/// Returns a row of track.csv. @param fix the fix from which `answer` was made
TrackRow to_row(std::uint64_t frame, double t_s, const localisation::Fix& fix, const estimation::TrackAnswer& answer);

}  // namespace twocone::runlog
