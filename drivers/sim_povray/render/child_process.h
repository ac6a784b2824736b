// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <optional>
#include <string>

#include "drivers/sim_povray/render/picture.h"
#include "drivers/sim_povray/render/started_child.h"

namespace twocone::sim_povray {

/// A descriptor to wait on that is not ready until raise() is called. Any thread.
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

struct ChildRequest {
  Program program;
  std::size_t max_output = 0;           ///< bytes of standard output after which the child is killed
  std::chrono::nanoseconds timeout{0};  ///< after which it is killed
  int stop_fd = -1;                     ///< it is killed when this gets readable; -1: none
  bool measured = false;                ///< ChildResult::use is wanted
};

struct ChildResult {
  enum class End {
    kEnded,       ///< not by us; `wait_status` says how
    kTimedOut,    ///< killed: it took too long
    kStopped,     ///< killed: stop_fd said so
    kTooMuch,     ///< killed: it wrote more than max_output
    kNotStarted,  ///< `errors` says at what step and why
  };
  End end = End::kNotStarted;
  int wait_status = 0;  ///< as waitpid() tells it
  std::string output;
  std::string errors;
  /// Of one that has ended. Its memory: when it wrote last. None: not asked for, or the system does not tell.
  std::optional<ProcessUse> use{};
};

/// Runs a program to its end. When this returns, the child and all that stayed in its process group are gone and
/// reaped.
ChildResult run_child(const ChildRequest& request);

}  // namespace twocone::sim_povray
