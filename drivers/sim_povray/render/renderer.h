// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "drivers/sim_povray/render/picture.h"
#include "drivers/sim_povray/render/povray.h"

namespace twocone::sim_povray {

struct RenderSettings;

/// Makes pictures in the background. Any thread.
class Renderer {
 public:
  /// Called once for each submission, from a thread of the renderer (or, by its destructor, from the caller's). Must
  /// not call the renderer and must not block.
  using Done = std::function<void(ImageResult)>;

  virtual ~Renderer() = default;
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;

  /// Does not wait. Every submission is answered, also when the renderer is destroyed first (kDisconnected).
  /// Errors: those of Povray::render.
  virtual void submit(RenderJob job, Done done) = 0;

  /// How it works, for a run's record; what it fell back to, and why.
  [[nodiscard]] virtual std::string describe() const = 0;

 protected:
  Renderer() = default;
};

/// Pictures as `settings` say: from held processes, or one process per picture. No thread or process before the first
/// submission. @throws std::system_error if the machine has no descriptor left
std::unique_ptr<Renderer> make_renderer(Povray povray, const RenderSettings& settings);

}  // namespace twocone::sim_povray
