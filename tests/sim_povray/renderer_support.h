// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <future>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "drivers/sim_povray/render/renderer.h"
#include "drivers/sim_povray/scene/scene.h"

namespace twocone::sim_povray {

/// Submits; the answer comes by the future.
inline std::future<ImageResult> ordered(Renderer& renderer, RenderJob job) {
  auto promise = std::make_shared<std::promise<ImageResult>>();
  auto future = promise->get_future();
  renderer.submit(std::move(job), [promise](ImageResult picture) { promise->set_value(std::move(picture)); });
  return future;
}

/// A scene's view with its robot, whose pictures are ordered by the number of a pose along a curve.
class View {
 public:
  View(const std::filesystem::path& path, const std::string& camera, int width_px, int height_px, int antialias = 1)
      : scene_(value(Scene::read(path))) {
    Mould mould = scene_.mould({value(scene_.object("robot"))}, value(scene_.camera(camera)), "");
    mould.width_px = width_px;
    mould.height_px = height_px;
    mould.antialias = antialias;
    set(mould);
  }

  [[nodiscard]] const Mould& mould() const { return *mould_; }
  void set(const Mould& mould) { mould_ = std::make_shared<const Mould>(mould); }
  [[nodiscard]] RenderJob job(int pose) const {
    const double turn_rad = 0.37 * pose;
    const FloorMotion motion{std::cos(turn_rad), std::sin(turn_rad), 0.041 * pose, -0.023 * pose};
    return {"frame " + std::to_string(pose), mould_, scene_.pose_text({motion}, motion, 0.05)};
  }

 private:
  template <typename T>
  static T value(Result<T> result) {
    if (!result) throw std::runtime_error(result.error().message);
    return std::move(*result);
  }
  Scene scene_;
  std::shared_ptr<const Mould> mould_;
};

/// Pictures of poses 0, 1, ... of each view in turn, all ordered at once.
inline std::vector<ImageResult> pictures(Renderer& renderer, const std::vector<View>& views, int poses) {
  std::vector<std::future<ImageResult>> futures;
  for (int pose = 0; pose < poses; ++pose) {
    for (const View& view : views) futures.push_back(ordered(renderer, view.job(pose)));
  }
  std::vector<ImageResult> results;
  results.reserve(futures.size());
  for (auto& future : futures) results.push_back(future.get());
  return results;
}

}  // namespace twocone::sim_povray
