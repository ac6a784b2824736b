// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <utility>

#include "hal/image.h"

namespace twocone::runs {

/// The images of a run folder by camera and sequence number, as a simulated camera asks for them
/// (sim_povray::SeatSettings::stored).
class StoredImages {
 public:
  /// Of the frames that frames.csv has. @throws files::FileError
  explicit StoredImages(std::filesystem::path folder);

  [[nodiscard]] int frames() const { return frames_; }
  /// FrameRow::host_t_s of the last of them; 0: none.
  [[nodiscard]] double last_host_t_s() const { return last_host_t_s_; }

  /// Null: the run has none, or it cannot be read; then it is rendered anew.
  [[nodiscard]] std::shared_ptr<const Image> operator()(const std::string& camera, std::uint64_t sequence) const;

 private:
  std::filesystem::path folder_;
  std::map<std::pair<std::string, std::uint64_t>, std::uint64_t> frame_of_;
  int frames_ = 0;
  double last_host_t_s_ = 0;
};

}  // namespace twocone::runs
