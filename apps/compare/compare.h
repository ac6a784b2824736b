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
#include "apps/compare/images.h"
#include "apps/compare/stages.h"
#include "hal/result.h"

namespace twocone::compare {

struct Settings {
  std::filesystem::path simulated, real;  ///< run folders
  std::filesystem::path real_poses;       ///< given trajectory of the real run, TUM; empty: none
  std::filesystem::path work;             ///< folder of finished parts; the same command continues from them
  bool is_rendered = false;               ///< `simulated` was made by render_again()
  int fit_frames = 150;                   ///< frames that each calibration uses, >= 4
  int every = 1;                          ///< the images of every such real frame are measured, >= 1
  int jobs = 2;                           ///< threads, >= 1
  double false_alarm = 1e-3;              ///< probability for the whole comparison, in (0, 1)
  Limits limits;
  /// Called with the fraction done, in [0, 1], and the name of the work that follows. May be empty.
  std::function<void(double, std::string_view)> progress;
  const std::atomic<bool>* stop = nullptr;
};

/// The results of a comparison, with the data that correct robot files.
struct Outcome {
  Comparison comparison;
  Images images;
  std::optional<calibrate::Report> calibration;  ///< of the real run
};

/// Compares two runs of one robot. Where both were run among the same landmarks, images are compared too.
/// Errors: kBadData (the runs cannot be compared, one line), kCancelled (stopped). @throws config::FileError,
/// runlog::DiskError, std::invalid_argument for settings
Result<Outcome> compare(const Settings& settings);

/// Returns the differences, the gaps and the stages as text for a terminal; at most 100 columns.
std::string table(const Comparison& comparison);
/// Returns compare.json: all results, in the units that each number names.
std::string to_json(const Comparison& comparison);

}  // namespace twocone::compare
