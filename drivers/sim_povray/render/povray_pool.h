// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <deque>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "drivers/sim_povray/render/held_povray.h"
#include "drivers/sim_povray/render/scratch_folder.h"

namespace twocone::sim_povray {

struct PoolSettings {
  int processes = 8;  ///< at one time, >= 1
  /// A process without work ends after this, at most half of lease-break-time.
  std::chrono::milliseconds idle{15'000};
  std::vector<std::filesystem::path> scratch_roots = sim_povray::scratch_roots();
  std::function<void(const std::string&)> notice{};  ///< RenderSettings::notice
};

/// The held POV-Ray processes and what they have to do. All of it in one thread, with which the processes die, and in
/// which every signal is blocked.
///
/// A process belongs to a mould. One is started when a job finds none of its mould waiting, as long as the mould has
/// fewer than its share of `processes`: so a program that takes its time keeps one, and one that hurries gets them all.
class PovrayPool {
 public:
  /// @throws std::system_error: no signals, no scratch folder
  PovrayPool(const Povray& povray, const PoolSettings& settings);
  /// Kills the processes; what is unfinished is answered with kDisconnected.
  ~PovrayPool();
  PovrayPool(const PovrayPool&) = delete;
  PovrayPool& operator=(const PovrayPool&) = delete;

  void add(Order order);
  /// Sees to all that can be done, and waits for the next event or until `wake_fd` is readable.
  void turn(int wake_fd);
  /// Why processes cannot be held on this machine, as came out at work; then nothing more is done. Empty: all is well.
  [[nodiscard]] const std::string& obstacle() const { return obstacle_; }
  /// All that is unfinished, in the order of submission within a mould.
  std::vector<Order> give_back();

 private:
  using SteadyTime = HeldPovray::SteadyTime;
  using State = HeldPovray::State;
  struct Worker {
    std::unique_ptr<HeldPovray> povray;
    int watch = -1;  ///< inotify's number of its folder
    bool errors_open = true;
  };
  struct Group {
    std::shared_ptr<const Mould> mould;
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
  void take_pictures();
  void picture_closed(Group& group, std::size_t worker);
  void check_time();
  void ended(Group& group, std::size_t worker);
  void drop(Group& group, std::size_t worker);
  void lose(Group& group, Order order, Error error);
  void forget_empty_groups();

  const Povray& povray_;
  const PoolSettings settings_;
  const std::chrono::nanoseconds idle_;
  ScratchFolder scratch_;
  UniqueFd signals_;
  UniqueFd files_;
  std::vector<std::unique_ptr<Group>> groups_;
  int started_ = 0;
  std::string obstacle_;
};

}  // namespace twocone::sim_povray
