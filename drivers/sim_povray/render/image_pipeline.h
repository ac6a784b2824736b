// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "drivers/sim_povray/render/renderer.h"
#include "drivers/sim_povray/session_settings.h"

/// Makes one finished image from the poses at some moments.
namespace twocone::sim_povray {

using ViewTemplateResult = Result<std::shared_ptr<const ViewTemplate>>;

/// A view template that may still be in preparation: finding the mirror takes a second, and no caller should wait for
/// it. May be used from any thread.
class FutureViewTemplate {
 public:
  explicit FutureViewTemplate(ViewTemplateResult view_template) : view_template_(std::move(view_template)) {}
  /// Runs `make` in a thread of its own. @throws std::system_error if no thread is available
  explicit FutureViewTemplate(std::function<ViewTemplateResult()> make);
  /// Waits until `make` has returned.
  ~FutureViewTemplate();
  FutureViewTemplate(const FutureViewTemplate&) = delete;
  FutureViewTemplate& operator=(const FutureViewTemplate&) = delete;

  using Then = std::function<void(const ViewTemplateResult&)>;
  /// Calls `then` once, immediately or when the view template is ready, in the order of the requests.
  void when_ready(Then then);

 private:
  std::mutex mutex_;
  std::optional<ViewTemplateResult> view_template_;
  std::vector<Then> waiting_;
  std::thread maker_;
};

/// An order for one image.
struct ImageOrder {
  std::string label;               ///< for messages: "frame 12, view lower"
  std::vector<std::string> poses;  ///< one for each shutter sample, as RenderJob::pose
  CameraEffects effects;
  std::uint64_t seed = 0;  ///< of the camera's noise
  std::string camera;
  std::uint64_t step = 0;
  std::chrono::nanoseconds now{0};                       ///< simulated time of the step
  std::function<void(const RenderedImage&)> rendered{};  ///< SessionSettings::rendered
  std::function<void(const std::string& camera, std::uint64_t step, PixelTruth)> truth{};  ///< SessionSettings::truth
};

/// Renders the shutter samples and makes the image from them. Does not wait. `renderer` must outlive the rendering. Its
/// destructor answers every open submission.
std::shared_future<ImageResult> take_image(Renderer& renderer, FutureViewTemplate& view_template, ImageOrder order);

}  // namespace twocone::sim_povray
