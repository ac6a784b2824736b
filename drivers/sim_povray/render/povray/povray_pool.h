// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/child_process.h"
#include "base/scratch_folder.h"
#include "drivers/sim_povray/render/povray/povray.h"
#include "drivers/sim_povray/render/renderer.h"

/// POV-Ray processes that are held between images, each at the pose that it waits for, and the pool of them.
namespace twocone::sim_povray {

/// A file in memory that a child cannot open until it has been written. It holds POV-Ray until its pose is there.
///
/// It uses the kernel's leases (fcntl(2), F_SETLEASE). The holder of a write lease is notified (SIGIO) when a process
/// opens the file, and that open() blocks in the kernel until the lease is given back, at most
/// /proc/sys/fs/lease-break-time seconds; then it is broken by force. A dead holder's lease is gone.
class PoseLease {
 public:
  /// Starts without a lease: the file can be opened. @throws std::system_error if this machine has no memory file
  explicit PoseLease(const std::string& text);

  /// Returns the descriptor that the child must be given, to open it as /proc/self/fd/N.
  [[nodiscard]] int fd() const { return fd_.get(); }
  /// Returns whether a process waits to open the file (or was let in by force).
  [[nodiscard]] bool wanted() const;
  /// Writes `text` and gives the lease back. @throws std::system_error
  void give(const std::string& text);
  /// Takes the lease; returns false while a process still has the file open. The kernel sends the signal to the calling
  /// *thread*, which must block it: unhandled, it kills the program. @throws std::system_error if no lease is available
  [[nodiscard]] bool take();

 private:
  void write(const std::string& text);
  base::UniqueFd fd_;
};

/// Returns why this machine gives no leases that last long enough; empty if it does.
std::string lease_obstacle();
/// Returns how long this machine honours a lease. 0: unknown.
int lease_break_time_s();

/// A job with its callback.
struct Order {
  RenderJob job;
  Renderer::Done done;
  std::uint64_t number = 0;  ///< counts submissions
  int failures = 0;          ///< number of processes that were lost with it
  int stale = 0;             ///< number of processes that continued before its pose was written
  /// Use of resources by its process, set once the image is rendered. None: the system does not report it. Memory is
  /// measured only if the job requires it.
  std::optional<base::ProcessUse> use{};
};

/// A view template as held processes read it: in place of the pose it includes the file behind the lease, and it
/// rejects a pose of another frame.
class HeldScene {
 public:
  /// @throws std::system_error
  explicit HeldScene(const ViewTemplate& view_template);
  [[nodiscard]] int fd() const { return fd_.get(); }
  [[nodiscard]] std::string pose_text(int frame, const std::string& pose) const;
  /// Returns whether POV-Ray stopped because of an old pose: its lease was broken by force.
  static bool is_stale(const std::string& errors);

 private:
  std::string serial_name_;
  base::UniqueFd fd_;
};

/// A POV-Ray process that renders the frames of an endless animation, and waits for the pose of each; for one thread.
class HeldPovray {
 public:
  using SteadyTime = std::chrono::steady_clock::time_point;
  enum class State {
    kComing,   ///< starting, or between two frames; POV-Ray sleeps 0.2 s there
    kWaiting,  ///< for a pose
    kDrawing,  ///< `order_` holds the job
  };

  /// Starts the process; its images go into `folder`, which is created. @throws std::system_error
  HeldPovray(const Povray& povray, const ViewTemplate& view_template, const HeldScene& scene,
             const std::filesystem::path& folder);

  [[nodiscard]] State state() const { return state_; }
  [[nodiscard]] const base::StartedChild& child() const { return child_; }
  [[nodiscard]] SteadyTime since() const { return since_; }  ///< time at which its state began
  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }
  [[nodiscard]] const std::string& errors() const { return errors_; }

  /// Checks the lease: kComing becomes kWaiting if POV-Ray waits for the pose.
  void look();
  /// Returns whether the lease could not be taken yet, so that look() must be called again soon.
  [[nodiscard]] bool is_open() const { return !leased_; }
  /// Hands over the pose of `order`: kWaiting becomes kDrawing. @throws std::system_error
  void draw(Order order);
  /// Returns the file of its present frame.
  [[nodiscard]] std::filesystem::path image() const;
  /// Ends a frame whose image is written: kDrawing becomes kComing. Returns the order.
  Order finish();
  /// Takes back the order that the process will not finish.
  std::optional<Order> take_order() { return std::exchange(order_, std::nullopt); }
  /// Reads its error output. Returns false when that has ended.
  bool drain_errors();
  /// Kills and reaps it. Returns the status of waitpid().
  int end() { return child_.end(); }

 private:
  void enter(State state);

  const HeldScene& scene_;
  std::filesystem::path folder_;
  PoseLease lease_;
  bool leased_ = false;
  base::StartedChild child_;
  State state_ = State::kComing;
  SteadyTime since_ = std::chrono::steady_clock::now();
  int frame_ = 1;
  std::chrono::nanoseconds cpu_until_last_{0};
  std::optional<Order> order_;
  std::string errors_;
};

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
/// A process belongs to a view template. A process is started when no process of a job's view template is waiting, as
/// long as the view template has fewer than its share of `processes`. A slow program therefore keeps one process, and a
/// fast one gets all of them.
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
  /// Returns why processes cannot be held on this machine, as found during the work; the pool then does nothing more.
  /// Empty: they can be held.
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
