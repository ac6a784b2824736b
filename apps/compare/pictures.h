// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "apps/compare/matching.h"
#include "apps/compare/side.h"
#include "hal/result.h"
#include "vision/picture_quality.h"

namespace twocone::compare {

/// What the pictures of one view tell by themselves, both runs.
struct ViewPictures {
  vision::NoiseSamples simulated_noise, real_noise;
  std::vector<double> simulated_blur_px, real_blur_px;
  std::vector<vision::Transfer> transfers;  ///< of each pair that shows about the same
};

struct Pictures {
  std::array<ViewPictures, 2> views;    ///< lower, upper
  std::vector<std::string> unreadable;  ///< pictures, with the reason; the first few
  std::size_t unreadable_count = 0;
};

struct PictureWork {
  std::filesystem::path folder;  ///< results of finished parts are kept there, for a comparison that was cut off
  std::string key;               ///< of what is compared: parts of another comparison are not taken
  int every = 1;                 ///< of the real run's frames, >= 1
  int jobs = 1;                  ///< threads, >= 1
  std::function<void(double)> progress;
  const std::atomic<bool>* stop = nullptr;  ///< set from outside: no further part is begun
};

/// Goes through both runs' pictures, in parts of kPartFrames real frames each, which are merged in order: the answer
/// does not depend on jobs or on how often the work was begun. In memory are a part's pictures alone.
/// @param by_pose each of these pairs is compared, the simulated turned by the difference of the headings; a real frame
/// without a partner is measured by itself, beside a simulated one of the same share of the run
/// Errors: kRefused: stopped from outside. @throws runs::DiskError
Result<Pictures> measure_pictures(const Side& simulated, const Side& real, const std::vector<Match>& by_pose,
                                  const PictureWork& work);
constexpr std::size_t kPartFrames = 25;

}  // namespace twocone::compare
