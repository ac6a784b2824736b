// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "drivers/sim_povray/pixel_truth.h"

namespace twocone::runs {

/// Keeps what images show from their rendering until their frame is stored (run --truth). May be used from any thread.
class TruthCollector {
 public:
  /// @param step the sequence number of the image's frame
  void put(const std::string& camera, std::uint64_t step, sim_povray::PixelTruth truth) {
    const std::lock_guard lock(mutex_);
    kept_.insert_or_assign({camera, step}, std::move(truth));
  }

  /// Returns and removes the truth of an image. Nothing: the image was not rendered. Forgets that of earlier images of
  /// the camera: their frames were skipped.
  std::optional<sim_povray::PixelTruth> take(const std::string& camera, std::uint64_t step) {
    const std::lock_guard lock(mutex_);
    std::optional<sim_povray::PixelTruth> truth;
    const auto found = kept_.find({camera, step});
    const auto end = kept_.upper_bound({camera, step});
    if (found != kept_.end()) truth = std::move(found->second);
    kept_.erase(kept_.lower_bound({camera, 0}), end);
    return truth;
  }

 private:
  std::mutex mutex_;
  std::map<std::pair<std::string, std::uint64_t>, sim_povray::PixelTruth> kept_;
};

}  // namespace twocone::runs
