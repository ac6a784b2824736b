// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "apps/calibrate/calibrate.h"
#include "apps/compare/comparison.h"
#include "apps/compare/pictures.h"
#include "apps/compare/stages.h"
#include "hal/result.h"

namespace twocone::compare {

struct Settings {
  std::filesystem::path simulated, real;  ///< run folders
  std::filesystem::path real_poses;       ///< given trajectory of the real run, TUM; empty: none
  std::filesystem::path work;             ///< folder for what has been measured, to go on from
  bool is_rendered = false;               ///< `simulated` was made by render_again()
  int fit_frames = 150;                   ///< that each calibration looks at, >= 4
  int held_out_frames = 60;               ///< from which the gap of ranges is told, >= 1
  int every = 1;                          ///< real frame whose pictures are measured, >= 1
  int jobs = 2;                           ///< threads, >= 1
  double false_alarm = 1e-3;              ///< of the whole comparison, in (0, 1)
  Limits limits;
  /// Told about the work: fraction done in [0, 1], what is being done. May be empty.
  std::function<void(double, std::string_view)> progress;
  const std::atomic<bool>* stop = nullptr;
};

/// What was found, and what robot files are corrected by.
struct Outcome {
  Comparison comparison;
  Pictures pictures;
  std::optional<calibrate::Report> calibration;  ///< of the real run
};

/// Compares two runs of one robot. Where both were run among the same landmarks, pictures are compared too.
/// Errors: kBadData (nothing to compare, one line), kRefused (stopped). @throws files::FileError, runs::DiskError,
/// std::invalid_argument for settings
Result<Outcome> compare(const Settings& settings);

/// For a terminal: what differs, the gaps, the table; at most 100 columns.
std::string table(const Comparison& comparison);
/// compare.json: all of it, in the units that each number names.
std::string to_json(const Comparison& comparison);

}  // namespace twocone::compare
