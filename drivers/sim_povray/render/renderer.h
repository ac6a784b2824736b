// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "drivers/sim_povray/render/povray/povray.h"
#include "drivers/sim_povray/render/render_job.h"

namespace twocone::sim_povray {

struct RenderSettings;

/// Renders images in the background. Any thread.
class Renderer {
 public:
  /// Called once for each submission, from a thread of the renderer (or, by its destructor, from the caller's). Must
  /// not call the renderer and must not block.
  using Done = std::function<void(ImageResult)>;

  virtual ~Renderer() = default;
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;

  /// Submits an image. Does not wait. Every submission is answered, even if the renderer is destroyed first
  /// (kDisconnected).
  /// Errors: those of Povray::render.
  virtual void submit(RenderJob job, Done done) = 0;

  /// Describes how it works, for a run's record; if it fell back to another method, also the reason.
  [[nodiscard]] virtual std::string describe() const = 0;

 protected:
  Renderer() = default;
};

/// Makes a renderer as `settings` state: with held processes, or with one process per image. It starts no thread or
/// process before the first submission. @throws std::system_error if the machine has no descriptor left
std::unique_ptr<Renderer> make_renderer(Povray povray, const RenderSettings& settings);

}  // namespace twocone::sim_povray
