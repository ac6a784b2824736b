// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <utility>

#include "hal/image.h"

namespace twocone::runlog {

/// The images of a run folder by camera and sequence number, for simulated cameras
/// (sim_povray::SessionSettings::stored).
class StoredImages {
 public:
  /// Takes the frames in frames.csv. @throws config::FileError
  explicit StoredImages(std::filesystem::path folder);

  [[nodiscard]] int frames() const { return frames_; }
  /// Returns FrameRow::host_t_s of the last frame; 0: none.
  [[nodiscard]] double last_host_t_s() const { return last_host_t_s_; }

  /// Returns null if the image is missing or unreadable. The camera then renders it again.
  [[nodiscard]] std::shared_ptr<const Image> operator()(const std::string& camera, std::uint64_t sequence) const;

 private:
  std::filesystem::path folder_;
  std::map<std::pair<std::string, std::uint64_t>, std::uint64_t> frame_of_;
  int frames_ = 0;
  double last_host_t_s_ = 0;
};

}  // namespace twocone::runlog
