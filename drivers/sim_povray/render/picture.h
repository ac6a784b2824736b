// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "hal/frame.h"

namespace twocone::sim_povray {

/// Columns and rows of a picture, from 0, ends included.
struct Window {
  int first_column = 0, last_column = 0;
  int first_row = 0, last_row = 0;

  friend bool operator==(const Window&, const Window&) = default;
};

/// What all pictures of one view have in common.
struct Mould {
  std::string scene;            ///< the scene's text, in which poses are used but not declared
  std::size_t pose_offset = 0;  ///< where in it a picture's own text goes, before the first use
  int width_px = 0;
  int height_px = 0;
  int antialias = 1;             ///< rays per pixel side
  int quality = 9;               ///< POV-Ray's +Q
  std::optional<Window> window;  ///< what of it is rendered; the rest is black
  /// Why a process cannot be held between pictures: the scene asks which frame of an animation it is. Empty: it can.
  std::string one_shot;
};

/// What a picture took of its process.
struct ProcessUse {
  std::chrono::nanoseconds cpu{0};  ///< processor time of all threads since the process's last picture, or its start
  std::uint64_t peak_bytes = 0;     ///< most memory that the process has held until then; 0: not known
};

/// One picture to make.
struct RenderJob {
  std::string label;  ///< for messages: "frame 12, view lower"
  std::shared_ptr<const Mould> mould;
  /// One line of POV-Ray's language that declares where things are. No line break, so that POV-Ray's line numbers are
  /// those of the scene file.
  std::string pose;
  /// Told once of a picture that comes out, before it is handed over, by the same thread; not where the system does not
  /// tell. Must neither block nor throw. Empty: nobody asks.
  std::function<void(const ProcessUse&)> used{};
};

}  // namespace twocone::sim_povray
