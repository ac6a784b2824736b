// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "drivers/sim_povray/render/renderer.h"
#include "drivers/sim_povray/sim_povray.h"

/// From the poses at some moments to one finished picture.
namespace twocone::sim_povray {

using MouldResult = Result<std::shared_ptr<const Mould>>;

/// A mould that may still be on its way: finding the mirror takes a second, which nobody should wait for. Any thread.
class ComingMould {
 public:
  explicit ComingMould(MouldResult mould) : mould_(std::move(mould)) {}
  /// Has a thread of its own until `make` returns. @throws std::system_error if there is no thread to be had
  explicit ComingMould(std::function<MouldResult()> make);
  /// Waits for `make`.
  ~ComingMould();
  ComingMould(const ComingMould&) = delete;
  ComingMould& operator=(const ComingMould&) = delete;

  using Then = std::function<void(const MouldResult&)>;
  /// Calls `then` once, at once or when the mould is there; in the order of the calls.
  void when_ready(Then then);

 private:
  std::mutex mutex_;
  std::optional<MouldResult> mould_;
  std::vector<Then> waiting_;
  std::thread maker_;
};

/// A picture that is asked for.
struct PictureOrder {
  std::string label;               ///< for messages: "frame 12, view lower"
  std::vector<std::string> poses;  ///< one for each exposure, as RenderJob::pose
  CameraEffects effects;
  std::uint64_t seed = 0;  ///< of the camera's noise
  std::string camera;
  std::uint64_t tick = 0;
  std::function<void(const RenderedPicture&)> rendered{};  ///< SeatSettings::rendered
};

/// Has the exposures rendered and the picture made of them. Does not wait; `renderer` must outlive the rendering, and
/// answers everything when it goes.
std::shared_future<ImageResult> take_picture(Renderer& renderer, ComingMould& mould, PictureOrder order);

}  // namespace twocone::sim_povray
