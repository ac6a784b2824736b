// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "drivers/sim_povray/render/picture.h"
#include "drivers/sim_povray/render/pose_lease.h"
#include "drivers/sim_povray/render/povray.h"
#include "drivers/sim_povray/render/renderer.h"
#include "drivers/sim_povray/render/started_child.h"

namespace twocone::sim_povray {

/// A job with who wants it.
struct Order {
  RenderJob job;
  Renderer::Done done;
  std::uint64_t number = 0;  ///< counts submissions
  int failures = 0;          ///< processes that it has been lost with
  int stale = 0;             ///< processes that went on before its pose was there
  /// By its process, once it is drawn. None: the system does not tell. Memory is looked up only if the job asks.
  std::optional<ProcessUse> use{};
};

/// A mould as held processes read it: at the place of the pose it includes the file behind the lease, and refuses a
/// pose that is not that of the frame.
class HeldScene {
 public:
  /// @throws std::system_error
  explicit HeldScene(const Mould& mould);
  [[nodiscard]] int fd() const { return fd_.get(); }
  [[nodiscard]] std::string pose_text(int frame, const std::string& pose) const;
  /// Whether POV-Ray gave up because of an old pose: its door was opened by force.
  static bool is_stale(const std::string& errors);

 private:
  std::string serial_name_;
  UniqueFd fd_;
};

/// A POV-Ray process that renders the frames of an endless animation, and at each waits for its pose. One thread.
class HeldPovray {
 public:
  using SteadyTime = std::chrono::steady_clock::time_point;
  enum class State {
    kComing,   ///< starting, or between two frames; POV-Ray sleeps 0.2 s there
    kWaiting,  ///< for a pose
    kDrawing,  ///< `order` holds the job
  };

  /// Starts it; pictures go into `folder`, which it makes. @throws std::system_error
  HeldPovray(const Povray& povray, const Mould& mould, const HeldScene& scene, const std::filesystem::path& folder);

  [[nodiscard]] State state() const { return state_; }
  [[nodiscard]] const StartedChild& child() const { return child_; }
  [[nodiscard]] SteadyTime since() const { return since_; }  ///< when it came into its state
  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }
  [[nodiscard]] const std::string& errors() const { return errors_; }

  /// Looks at the door: kComing becomes kWaiting where somebody stands there.
  void look();
  /// Whether the door could not be closed yet, so that look() must be called again soon.
  [[nodiscard]] bool is_open() const { return !leased_; }
  /// kWaiting becomes kDrawing. @throws std::system_error
  void draw(Order order);
  /// The file that its present frame goes into.
  [[nodiscard]] std::filesystem::path picture() const;
  /// kDrawing becomes kComing: its picture is there.
  Order finish();
  /// The job that it will not finish.
  std::optional<Order> take_order() { return std::exchange(order_, std::nullopt); }
  /// false when there will be no more.
  bool drain_errors();
  /// Kills and reaps it. What waitpid() says.
  int end() { return child_.end(); }

 private:
  void enter(State state);

  const HeldScene& scene_;
  std::filesystem::path folder_;
  PoseLease lease_;
  bool leased_ = false;
  StartedChild child_;
  State state_ = State::kComing;
  SteadyTime since_ = std::chrono::steady_clock::now();
  int frame_ = 1;
  std::chrono::nanoseconds cpu_until_last_{0};
  std::optional<Order> order_;
  std::string errors_;
};

}  // namespace twocone::sim_povray
