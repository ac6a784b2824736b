// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "base/started_child.h"

namespace twocone::base {

/// A descriptor to wait on. It is ready from raise() to lower(). Every method may be called from any thread.
class StopSignal {
 public:
  /// @throws std::system_error
  StopSignal();
  void raise();
  void lower();
  [[nodiscard]] int fd() const { return fd_.get(); }

 private:
  UniqueFd fd_;
};

/// The resources that a process used.
struct ProcessUse {
  std::chrono::nanoseconds cpu{0};  ///< processor time of all its threads
  std::uint64_t peak_bytes = 0;     ///< peak memory; 0: not known
};

struct ChildRequest {
  Program program;
  std::size_t max_output = 0;           ///< bytes of standard output after which the child is killed
  std::chrono::nanoseconds timeout{0};  ///< time after which the child is killed
  int stop_fd = -1;                     ///< the child is killed when this becomes readable; -1: none
  bool measured = false;                ///< true: ChildResult::use is filled in
};

struct ChildResult {
  enum class End {
    kEnded,       ///< the child ended by itself; `wait_status` holds how
    kTimedOut,    ///< killed: it took too long
    kStopped,     ///< killed: stop_fd became readable
    kTooMuch,     ///< killed: it wrote more than max_output
    kNotStarted,  ///< `errors` holds the failed step and the reason
  };
  End end = End::kNotStarted;
  int wait_status = 0;  ///< as waitpid() reports it
  std::string output;
  std::string errors;
  /// Use of a child that has ended. The memory is as of its last output. None: not requested, or not reported by the
  /// system.
  std::optional<ProcessUse> use{};
};

/// Runs a program to its end. When this returns, the child is reaped and every process that stayed in its process group
/// is gone.
ChildResult run_child(const ChildRequest& request);

}  // namespace twocone::base
