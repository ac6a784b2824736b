// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/render/image_pipeline.h"

#include <exception>
#include <optional>
#include <utility>

#include "drivers/sim_povray/camera/camera_stage.h"

namespace twocone::sim_povray {
namespace {

/// Collects the shutter samples of one image.
class ImageAssembly {
 public:
  explicit ImageAssembly(ImageOrder order) : order_(std::move(order)), samples_(order_.poses.size()) {}

  [[nodiscard]] const ImageOrder& order() const { return order_; }
  [[nodiscard]] std::shared_future<ImageResult> image() { return promise_.get_future().share(); }

  void take(std::size_t number, ImageResult sample) {
    {
      const std::lock_guard lock(mutex_);
      if (sample) {
        samples_[number] = *std::move(sample);
      } else if (!error_) {
        error_ = sample.error();
      }
      if (++arrived_ < samples_.size()) return;
    }
    // The last sample has arrived, so no other thread uses this object any more.
    promise_.set_value(finished());
  }

  void report(const base::ProcessUse& use) const {
    order_.rendered({order_.camera, order_.step, use.cpu, use.peak_bytes});
  }

  void report(PixelTruth truth) const { order_.truth(order_.camera, order_.step, std::move(truth)); }

  void fail(const Error& error) { promise_.set_value(error); }

 private:
  ImageResult finished() {
    if (error_) return *error_;
    if (!changes_pixels(order_.effects)) return samples_.front();
    try {
      return std::make_shared<const Image>(
          develop(order_.effects, samples_, order_.seed, order_.camera, order_.step, order_.now));
    } catch (const std::exception& e) {  // std::bad_alloc; shutter samples of different sizes would be a bug here
      return Error(ErrorCode::kUnavailable, "{}: {}", order_.label, e.what());
    }
  }

  const ImageOrder order_;
  std::promise<ImageResult> promise_;
  std::mutex mutex_;
  std::vector<std::shared_ptr<const Image>> samples_;
  std::size_t arrived_ = 0;
  std::optional<Error> error_;
};

}  // namespace

FutureViewTemplate::FutureViewTemplate(std::function<ViewTemplateResult()> make) {
  maker_ = std::thread([this, make = std::move(make)] {
    ViewTemplateResult made = make();
    std::unique_lock lock(mutex_);
    view_template_ = std::move(made);
    // The calls are made under the lock, so that a new order is served after those that have waited.
    for (const Then& then : waiting_) then(*view_template_);
    waiting_.clear();
  });
}

FutureViewTemplate::~FutureViewTemplate() {
  if (maker_.joinable()) maker_.join();
}

void FutureViewTemplate::when_ready(Then then) {
  const std::lock_guard lock(mutex_);
  if (view_template_) {
    then(*view_template_);
  } else {
    waiting_.push_back(std::move(then));
  }
}

std::shared_future<ImageResult> take_image(Renderer& renderer, FutureViewTemplate& view_template, ImageOrder order) {
  auto assembly = std::make_shared<ImageAssembly>(std::move(order));
  auto image = assembly->image();
  view_template.when_ready([&renderer, assembly](const ViewTemplateResult& ready) {
    if (!ready) return assembly->fail(ready.error());
    const ImageOrder& wanted = assembly->order();
    const auto rows = rows_of_shutter_samples(wanted.effects, (*ready)->height_px);
    for (std::size_t i = 0; i < wanted.poses.size(); ++i) {
      RenderJob job{.label = wanted.label, .view_template = *ready, .pose = wanted.poses[i]};
      if (wanted.rendered) job.used = [assembly](const base::ProcessUse& use) { assembly->report(use); };
      if (wanted.truth && i == wanted.poses.size() / 2) {
        job.truth = [assembly](PixelTruth truth) { assembly->report(std::move(truth)); };
      } else if (i < rows.size()) {
        job.rows = rows[i];
      }
      renderer.submit(std::move(job), [assembly, i](ImageResult sample) { assembly->take(i, std::move(sample)); });
    }
  });
  return image;
}

}  // namespace twocone::sim_povray
