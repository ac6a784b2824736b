// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <thread>

#include "base/unique_fd.h"
#include "drivers/sim_povray/simulation_host.h"

namespace twocone::sim_povray::server {

/// One connection, from its handshake to its end, in a thread of its own.
class ClientConnection {
 public:
  /// @param report called from the session's thread @param stop checked twenty times a second
  /// @param patience how long others wait for a client that requests nothing, before it is sent away
  ClientConnection(base::UniqueFd socket, std::shared_ptr<SimulationHost> host,
                   std::function<void(const std::string&)> report, const std::atomic<bool>& stop,
                   std::chrono::milliseconds patience);
  /// Waits for the session's end: when the client leaves or is sent away, or `stop` is set.
  ~ClientConnection() { thread_.join(); }

  [[nodiscard]] bool finished() const { return finished_; }

 private:
  void work(const std::atomic<bool>& stop, std::chrono::milliseconds patience);

  base::UniqueFd socket_;
  std::shared_ptr<SimulationHost> host_;
  std::function<void(const std::string&)> report_;
  std::atomic<bool> finished_{false};
  std::thread thread_;
};

}  // namespace twocone::sim_povray::server
