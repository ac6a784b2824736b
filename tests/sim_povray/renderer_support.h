// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <future>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "drivers/sim_povray/render/renderer.h"
#include "drivers/sim_povray/scene/scene.h"
#include "tests/sim_povray/test_support.h"

namespace twocone::sim_povray {

/// Submits a job. The future holds its image.
inline std::future<ImageResult> ordered(Renderer& renderer, RenderJob job) {
  auto promise = std::make_shared<std::promise<ImageResult>>();
  auto future = promise->get_future();
  renderer.submit(std::move(job), [promise](ImageResult image) { promise->set_value(std::move(image)); });
  return future;
}

/// A view of a scene with a robot. job() renders it at a numbered pose along a curve.
class View {
 public:
  View(const std::filesystem::path& path, const std::string& camera, int width_px, int height_px, int antialias = 1)
      : scene_(value(Scene::read(path))) {
    ViewTemplate view_template =
        scene_.view_template({value(scene_.object("robot"))}, value(scene_.camera(camera)), "");
    view_template.width_px = width_px;
    view_template.height_px = height_px;
    view_template.antialias = antialias;
    set(view_template);
  }

  [[nodiscard]] const ViewTemplate& view_template() const { return *view_template_; }
  void set(const ViewTemplate& view_template) { view_template_ = std::make_shared<const ViewTemplate>(view_template); }
  [[nodiscard]] RenderJob job(int pose) const {
    const double turn_rad = 0.37 * pose;
    const FloorMotion motion{std::cos(turn_rad), std::sin(turn_rad), 0.041 * pose, -0.023 * pose};
    return {"frame " + std::to_string(pose), view_template_, scene_.pose_text({motion}, motion, 0.05)};
  }

 private:
  Scene scene_;
  std::shared_ptr<const ViewTemplate> view_template_;
};

/// Renders the poses 0, 1, ... of each view in turn. All jobs are submitted at once.
inline std::vector<ImageResult> images(Renderer& renderer, const std::vector<View>& views, int poses) {
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
