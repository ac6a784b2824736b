// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "base/child_process.h"
#include "drivers/sim_povray/place.h"
#include "drivers/sim_povray/render/native/native_view.h"
#include "drivers/sim_povray/render/povray/povray.h"
#include "drivers/sim_povray/render/povray/scene_access.h"
#include "drivers/sim_povray/render/renderer.h"

namespace twocone::sim_povray {

struct NativeSettings {
  std::filesystem::path scene;  ///< for messages
  SceneAccess access;           ///< what the scene may read
  /// Where the outcomes of checks are kept between runs; empty: nowhere.
  std::filesystem::path cache{};
  /// Receives one line for a person if POV-Ray renders after all. Called from any thread.
  std::function<void(const std::string&)> notice{};
  /// RenderSettings::chosen
  std::function<void(RendererKind, bool is_checked)> chosen{};
};

/// Returns the folder of this program in the user's cache: below XDG_CACHE_HOME, else ~/.cache. Empty: neither is set.
std::filesystem::path user_cache();

/// Returns the indices of the pixels that differ by more than one level of 255 in a channel.
/// @param a,b kRgb8, of the same size
std::vector<std::size_t> differing_pixels(const Image& a, const Image& b);
/// Renders a view's image without anti-aliasing, in the calling thread.
Image plain_image_of(const NativeView& view, const Poses& poses);

/// POV-Ray, which the native renderer is compared with and gives way to.
struct Reference {
  Povray povray;
  std::unique_ptr<Renderer> renderer;
};

/// Renders with the native tracer where it is known to agree with POV-Ray.
///
/// The first image of each view is rendered by both, without anti-aliasing and with it if it is ordered. If more than
/// kMostDifferent (kMostDifferentSmoothed) of the mirror's pixels differ by more than one level of 255, or if the scene
/// uses what the tracer does not know, POV-Ray renders all images from then on; a job that wants the truth then fails
/// with kRefused and the reason. There is no thread before the first
/// view is prepared.
class NativeRenderer final : public Renderer {
 public:
  static constexpr double kMostDifferent = 0.001;
  /// Of smoothed images: a pixel whose centre differs changes those beside it.
  static constexpr double kMostDifferentSmoothed = 0.005;

  /// @param reference none: nothing is checked, and a scene that the tracer does not know is an error
  NativeRenderer(NativeSettings settings, std::optional<Reference> reference);
  /// Answers what waits with kDisconnected.
  ~NativeRenderer() override;

  void submit(RenderJob job, Done done) override;
  [[nodiscard]] std::shared_ptr<void> expect_view() override;
  void prepare(const std::shared_ptr<const ViewTemplate>& view_template, const std::string& pose) override;
  [[nodiscard]] std::string describe() const override;

 private:
  struct Order {
    RenderJob job;
    Done done;
  };
  struct Task;
  /// Images that nobody uses any more: an image of some 100 KB costs more to allocate than to take from here.
  class SpareImages;

  /// Returns the file that is there if the view agreed before. @param read_files paths and digests of included files
  [[nodiscard]] std::filesystem::path remembered(const ViewTemplate& view_template,
                                                 const std::string& read_files) const;
  /// Returns why POV-Ray must render the view; empty: the tracer agrees with it.
  [[nodiscard]] std::string difference(const NativeView& view, const ViewTemplate& view_template,
                                       const std::string& pose) const;
  enum class Smoothing { kNone, kAsOrdered };
  [[nodiscard]] std::string difference(const NativeView& view, const ViewTemplate& view_template,
                                       const std::string& pose, Smoothing smoothing) const;
  void release();
  void start(Order order);
  void work();

  const NativeSettings settings_;
  const std::shared_ptr<SpareImages> spare_images_;
  std::optional<Reference> reference_;
  base::StopSignal stop_;
  mutable std::mutex mutex_;  // protects all members below
  std::condition_variable changed_;
  bool is_chosen_ = false;
  int expected_ = 0;      // views that are being prepared
  std::string obstacle_;  // why POV-Ray renders; empty: it does not
  std::map<const ViewTemplate*, std::shared_ptr<const NativeView>> views_;
  std::vector<std::shared_ptr<const ViewTemplate>> templates_;  // keeps the keys of views_ alive
  std::deque<Order> held_;
  std::deque<std::shared_ptr<Task>> tasks_;  // to be rendered, oldest first
  bool stopping_ = false;
  std::vector<std::thread> workers_;
};

}  // namespace twocone::sim_povray
