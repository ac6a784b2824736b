// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <thread>

#include "drivers/sim_povray/hall.h"
#include "drivers/sim_povray/render/child_process.h"

namespace twocone::sim_povray::link {

/// One connection, from its handshake to its end, in a thread of its own.
class Session {
 public:
  /// @param tell called from the session's thread @param stop looked at twenty times a second
  /// @param patience how long others wait for a client that asks for nothing, before it is sent away
  Session(UniqueFd socket, std::shared_ptr<Hall> hall, std::function<void(const std::string&)> tell,
          const std::atomic<bool>& stop, std::chrono::milliseconds patience);
  /// Waits for the session's end: when the client leaves or is sent away, or `stop` is set.
  ~Session() { thread_.join(); }

  [[nodiscard]] bool finished() const { return finished_; }

 private:
  void work(const std::atomic<bool>& stop, std::chrono::milliseconds patience);

  UniqueFd socket_;
  std::shared_ptr<Hall> hall_;
  std::function<void(const std::string&)> tell_;
  std::atomic<bool> finished_{false};
  std::thread thread_;
};

}  // namespace twocone::sim_povray::link
