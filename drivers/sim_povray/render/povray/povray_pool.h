// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <deque>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "base/scratch_folder.h"
#include "drivers/sim_povray/render/povray/held_povray.h"

namespace twocone::sim_povray {

struct PoolSettings {
  int processes = 8;  ///< at one time, >= 1
  /// A process without work ends after this, at most half of lease-break-time.
  std::chrono::milliseconds idle{15'000};
  std::vector<std::filesystem::path> scratch_roots = base::scratch_roots();
  std::function<void(const std::string&)> notice{};  ///< RenderSettings::notice
};

/// The held POV-Ray processes and their orders. All of it runs in one thread, in which every signal is blocked; the
/// processes die with that thread.
///
/// A process belongs to a view template. One is started when a job finds none of its view template waiting, as long as
/// the view template has fewer than its share of `processes`. A slow program therefore keeps one process, and a fast
/// one gets all of them.
class PovrayPool {
 public:
  /// @throws std::system_error: no signals, no scratch folder
  PovrayPool(const Povray& povray, const PoolSettings& settings);
  /// Kills the processes; unfinished orders are answered with kDisconnected.
  ~PovrayPool();
  PovrayPool(const PovrayPool&) = delete;
  PovrayPool& operator=(const PovrayPool&) = delete;

  void add(Order order);
  /// Does all that can be done, and waits for the next event or until `wake_fd` is readable.
  void turn(int wake_fd);
  /// Returns why processes cannot be held on this machine, as found at work; then nothing more is done. Empty: they
  /// can.
  [[nodiscard]] const std::string& obstacle() const { return obstacle_; }
  /// Returns all unfinished orders, in the order of submission.
  std::vector<Order> give_back();

 private:
  using SteadyTime = HeldPovray::SteadyTime;
  using State = HeldPovray::State;
  struct Worker {
    std::unique_ptr<HeldPovray> povray;
    int watch = -1;  ///< inotify's watch of its folder
    bool errors_open = true;
    std::size_t polled = 0;  ///< index of the descriptors of its end and, next, of its errors in turn()'s list
  };
  struct Group {
    std::shared_ptr<const ViewTemplate> view_template;
    HeldScene scene;
    std::deque<Order> queue;
    std::vector<Worker> workers;
    std::size_t wanted = 0;
  };

  void hand_out();
  void staff();
  void start_worker(Group& group);
  bool free_a_place(const Group& taker);
  [[nodiscard]] std::size_t share() const;
  [[nodiscard]] std::size_t count() const;
  [[nodiscard]] int wait_ms() const;
  void take_images();
  void image_closed(Group& group, std::size_t worker);
  void check_time();
  void ended(Group& group, std::size_t worker);
  void drop(Group& group, std::size_t worker);
  void lose(Group& group, Order order, Error error);
  void forget_empty_groups();

  const Povray& povray_;
  const PoolSettings settings_;
  const std::chrono::nanoseconds idle_;
  base::ScratchFolder scratch_;
  base::UniqueFd signals_;
  base::UniqueFd files_;
  std::vector<std::unique_ptr<Group>> groups_;
  int started_ = 0;
  std::string obstacle_;
};

}  // namespace twocone::sim_povray
