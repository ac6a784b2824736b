// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "base/child_process.h"
#include "drivers/sim_povray/camera/camera_stage.h"
#include "drivers/sim_povray/pixel_truth.h"
#include "hal/image.h"

namespace twocone::sim_povray {

class Povray;
struct RenderSettings;

/// A range of columns and rows of an image, from 0, ends included.
struct Window {
  int first_column = 0, last_column = 0;
  int first_row = 0, last_row = 0;

  friend bool operator==(const Window&, const Window&) = default;
};

/// A scene prepared for one view, with the poses left open: the common part of all images of the view.
struct ViewTemplate {
  std::string scene{};          ///< the scene's text, in which poses are used but not declared
  std::size_t pose_offset = 0;  ///< offset in `scene` for an image's own text, before the first use
  std::string pose_prefix{};    ///< of the names that a pose declares (Scene::prefix())
  int carrier = -1;             ///< which of the moved blocks carries the camera; -1: unknown
  int width_px = 0;
  int height_px = 0;
  int antialias = 1;               ///< rays per pixel side
  int quality = 9;                 ///< POV-Ray's +Q
  double unit_m = 1;               ///< metres in one POV-Ray unit; of RenderJob::truth
  std::optional<Window> window{};  ///< part of the image that is rendered; the rest is black
  /// Why a process cannot be held between images (RenderChoice::one_shot). Empty: it can.
  std::string one_shot{};
};

/// An image to render.
struct RenderJob {
  std::string label;  ///< for messages: "frame 12, view lower"
  std::shared_ptr<const ViewTemplate> view_template;
  /// One line of POV-Ray's language that declares where things are. It has no line break, so that POV-Ray's line
  /// numbers are those of the scene file.
  std::string pose;
  /// Called once for an image that succeeds, before it is handed over, by the same thread; not called if the system
  /// does not report the use. The function must neither block nor throw. Empty: no call.
  std::function<void(const base::ProcessUse&)> used{};
  /// Called likewise with what the image's pixels show. Empty: that is not wanted, and costs nothing. Only the native
  /// renderer knows it; see NativeRenderer.
  TruthReceiver truth{};
  /// The rows that are wanted; what the others show is undefined. None: all are.
  std::optional<RowRange> rows{};
};

/// Renders images in the background. May be used from any thread.
class Renderer {
 public:
  /// Called once for each submission, from a thread of the renderer (or, by its destructor, from the caller's). The
  /// function must not call the renderer and must not block.
  using Done = std::function<void(ImageResult)>;

  virtual ~Renderer() = default;
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;

  /// Submits an image without waiting. Every submission is answered, even if the renderer is destroyed first
  /// (kDisconnected).
  /// Errors: those of Povray::render.
  virtual void submit(RenderJob job, Done done) = 0;

  /// While a token of this function lives, the renderer may hold submissions back, so that it can decide for all views
  /// of a run at once how to render them. Take one before a view is prepared, and release it afterwards.
  [[nodiscard]] virtual std::shared_ptr<void> expect_view() { return nullptr; }
  /// Makes ready what all images of a view share. Waits until it is done.
  /// @param pose RenderJob::pose of the view's first image
  virtual void prepare(const std::shared_ptr<const ViewTemplate>& view_template, const std::string& pose) {
    static_cast<void>(view_template);
    static_cast<void>(pose);
  }

  /// Describes how it works, for a run's record; if it fell back to another method, also the reason.
  [[nodiscard]] virtual std::string describe() const = 0;

 protected:
  Renderer() = default;
};

/// Makes a renderer as `settings` state: with held processes, or with one process per image. It starts no thread or
/// process before the first submission. @throws std::system_error if the machine has no descriptor left
std::unique_ptr<Renderer> make_renderer(Povray povray, const RenderSettings& settings);

}  // namespace twocone::sim_povray
