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
#include "vision/image_quality.h"

namespace twocone::compare {

/// Measurements of the images of one view, for both runs.
struct ViewImages {
  vision::NoiseSamples simulated_noise, real_noise;
  std::vector<double> simulated_blur_px, real_blur_px;
  std::vector<vision::Transfer> transfers;  ///< of each pair of images from about the same place
};

struct Images {
  std::array<ViewImages, 2> views;      ///< lower, upper
  std::vector<std::string> unreadable;  ///< unreadable images with the reason; the first few
  std::size_t unreadable_count = 0;
};

struct ImageWork {
  std::filesystem::path folder;  ///< finished parts are stored here, so that an interrupted comparison can continue
  std::string key;               ///< identifies the comparison: parts of another one are not used
  int every = 1;                 ///< every such frame of the real run is used, >= 1
  int jobs = 1;                  ///< threads, >= 1
  std::function<void(double)> progress;
  const std::atomic<bool>* stop = nullptr;  ///< set from outside: no further part is started
};

/// Measures both runs' images in parts of kPartFrames real frames each. The parts are merged in order, so the result
/// does not depend on the number of jobs or of interruptions. Only the images of one part per job are in memory.
/// @param by_pose pairs to compare; the simulated image is turned by the difference of the headings. A real frame
/// without a partner is measured alone, beside a simulated one at the same fraction of the run
/// Errors: kCancelled (interrupted). @throws runlog::DiskError
Result<Images> measure_images(const Side& simulated, const Side& real, const std::vector<Match>& by_pose,
                              const ImageWork& work);
constexpr std::size_t kPartFrames = 25;

}  // namespace twocone::compare
