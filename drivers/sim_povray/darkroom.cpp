// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/darkroom.h"

#include <exception>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "drivers/sim_povray/effects/camera_stage.h"

namespace twocone::sim_povray {
namespace {

/// The exposures of one picture, as they come in.
class Development {
 public:
  explicit Development(PictureOrder order) : order_(std::move(order)), exposures_(order_.poses.size()) {}

  [[nodiscard]] const PictureOrder& order() const { return order_; }
  [[nodiscard]] std::shared_future<ImageResult> picture() { return promise_.get_future().share(); }

  void take(std::size_t number, ImageResult exposure) {
    {
      const std::lock_guard lock(mutex_);
      if (exposure) {
        exposures_[number] = *std::move(exposure);
      } else if (!error_) {
        error_ = exposure.error();
      }
      if (++arrived_ < exposures_.size()) return;
    }
    // The last one in: nobody else touches this any more.
    promise_.set_value(finished());
  }

  void tell(const ProcessUse& use) const { order_.rendered({order_.camera, order_.tick, use.cpu, use.peak_bytes}); }

  void fail(const Error& error) { promise_.set_value(error); }

 private:
  ImageResult finished() {
    if (error_) return *error_;
    if (!changes_pixels(order_.effects)) return exposures_.front();
    try {
      return std::make_shared<const Image>(
          develop(order_.effects, exposures_, order_.seed, order_.camera, order_.tick));
    } catch (const std::exception& e) {  // std::bad_alloc; exposures of different sizes would be our bug
      return Error{ErrorCode::kUnavailable, fmt::format("{}: {}", order_.label, e.what())};
    }
  }

  const PictureOrder order_;
  std::promise<ImageResult> promise_;
  std::mutex mutex_;
  std::vector<std::shared_ptr<const Image>> exposures_;
  std::size_t arrived_ = 0;
  std::optional<Error> error_;
};

}  // namespace

ComingMould::ComingMould(std::function<MouldResult()> make) {
  maker_ = std::thread([this, make = std::move(make)] {
    MouldResult made = make();
    std::unique_lock lock(mutex_);
    mould_ = std::move(made);
    // Under the lock, so that an order that comes now goes behind those that have waited.
    for (const Then& then : waiting_) then(*mould_);
    waiting_.clear();
  });
}

ComingMould::~ComingMould() {
  if (maker_.joinable()) maker_.join();
}

void ComingMould::when_ready(Then then) {
  const std::lock_guard lock(mutex_);
  if (mould_) {
    then(*mould_);
  } else {
    waiting_.push_back(std::move(then));
  }
}

std::shared_future<ImageResult> take_picture(Renderer& renderer, ComingMould& mould, PictureOrder order) {
  auto development = std::make_shared<Development>(std::move(order));
  auto picture = development->picture();
  mould.when_ready([&renderer, development](const MouldResult& ready) {
    if (!ready) return development->fail(ready.error());
    const PictureOrder& wanted = development->order();
    for (std::size_t i = 0; i < wanted.poses.size(); ++i) {
      RenderJob job{wanted.label, *ready, wanted.poses[i]};
      if (wanted.rendered) job.used = [development](const ProcessUse& use) { development->tell(use); };
      renderer.submit(std::move(job),
                      [development, i](ImageResult exposure) { development->take(i, std::move(exposure)); });
    }
  });
  return picture;
}

}  // namespace twocone::sim_povray
