// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "base/child_process.h"
#include "hal/image.h"

namespace twocone::sim_povray {

/// A range of columns and rows of an image, from 0, ends included.
struct Window {
  int first_column = 0, last_column = 0;
  int first_row = 0, last_row = 0;

  friend bool operator==(const Window&, const Window&) = default;
};

/// A scene prepared for one view, with the poses left open: the common part of all images of the view.
struct ViewTemplate {
  std::string scene;            ///< the scene's text, in which poses are used but not declared
  std::size_t pose_offset = 0;  ///< offset in `scene` for an image's own text, before the first use
  int width_px = 0;
  int height_px = 0;
  int antialias = 1;             ///< rays per pixel side
  int quality = 9;               ///< POV-Ray's +Q
  std::optional<Window> window;  ///< part of the image that is rendered; the rest is black
  /// Why a process cannot be held between images (RenderChoice::one_shot). Empty: it can.
  std::string one_shot;
};

/// One image to render.
struct RenderJob {
  std::string label;  ///< for messages: "frame 12, view lower"
  std::shared_ptr<const ViewTemplate> view_template;
  /// One line of POV-Ray's language that declares where things are. No line break, so that POV-Ray's line numbers are
  /// those of the scene file.
  std::string pose;
  /// Called once for an image that succeeds, before it is handed over, by the same thread; not called if the system
  /// does not report the use. Must neither block nor throw. Empty: no call.
  std::function<void(const base::ProcessUse&)> used{};
};

}  // namespace twocone::sim_povray
