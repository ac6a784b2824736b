// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "drivers/sim_povray/render/renderer.h"

namespace twocone::sim_povray {

/// Time limit of an image that is finished by hand. Only a broken implementation takes this long.
inline constexpr std::chrono::seconds kHandLimit{10};
/// The duration of a test that waits for a time-out. It is clearly longer than an immediate return.
inline constexpr std::chrono::milliseconds kHandTimeout{50};

/// A renderer whose images the test finishes by finish() or fail(); or it finishes them at once.
class HandRenderer final : public Renderer {
 public:
  struct Desk {
    bool at_once = false;
    std::mutex mutex;  // several robots submit from several threads
    std::vector<RenderJob> jobs;
    std::vector<Done> done;
    void finish(std::size_t i) { done.at(i)(std::make_shared<const Image>()); }
    void fail(std::size_t i) { done.at(i)(Error{ErrorCode::kDisconnected, "crashed"}); }
  };
  explicit HandRenderer(std::shared_ptr<Desk> desk) : desk_(std::move(desk)) {}
  void submit(RenderJob job, Done done) override {
    const std::lock_guard lock(desk_->mutex);
    desk_->jobs.push_back(std::move(job));
    desk_->done.push_back(std::move(done));
    if (desk_->at_once) desk_->finish(desk_->done.size() - 1);
  }
  [[nodiscard]] std::string describe() const override { return "by hand"; }

 private:
  std::shared_ptr<Desk> desk_;
};

}  // namespace twocone::sim_povray
