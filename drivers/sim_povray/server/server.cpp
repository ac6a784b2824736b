// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/server/server.h"

#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstddef>
#include <list>
#include <mutex>
#include <system_error>
#include <thread>
#include <utility>

#include <fmt/format.h>

#include "base/log.h"
#include "base/unique_fd.h"
#include "drivers/sim_povray/server/client_connection.h"
#include "drivers/sim_povray/server/served_name.h"
#include "drivers/sim_povray/server/socket.h"
#include "drivers/sim_povray/simulation_host.h"

namespace twocone::sim_povray {
namespace {

constexpr std::size_t kMaxConnections = 64;
/// How often `stop` is checked.
constexpr std::chrono::milliseconds kAcceptSlice{50};

/// A connection to one client, in a thread of its own.
struct Connection {
  std::atomic<bool> finished{false};
  std::jthread thread{};
};

/// Sends a refusal without waiting: a client that does not read it immediately misses it.
void send_away(int socket, const std::string& why) {
  (void)send_message(socket, server::Failed{ErrorCode::kUnavailable, why}, std::chrono::steady_clock::now());
}

}  // namespace

Status serve(const std::shared_ptr<SimulationHost>& host, const std::string& name,
             const std::function<void(const std::string&)>& report, const std::atomic<bool>& stop,
             std::chrono::milliseconds patience) {
  const auto path = world_socket(name);
  if (!path) return path.error();
  const auto claim = server::ServedName::claim(*path);
  if (!claim) return claim.error();
  auto listening = server::listen_at(*path);
  if (!listening) return listening.error();

  std::mutex report_mutex;
  const auto report_in_turn = [&](const std::string& line) {
    base::Logger("server").info(line);
    const std::lock_guard lock(report_mutex);
    report(line);
  };
  report_in_turn(fmt::format("serving '{}' at {}", name, path->string()));
  std::list<Connection> connections;
  while (!stop) {
    pollfd entry{listening->get(), POLLIN, 0};
    const int ready = ::poll(&entry, 1, static_cast<int>(kAcceptSlice.count()));
    connections.remove_if([](const Connection& connection) { return connection.finished.load(); });
    if (ready <= 0) continue;
    base::UniqueFd socket(::accept4(listening->get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
    if (!socket.valid()) {
      // Usually no descriptor is left. The caller stays in the queue, so without a pause this would spin.
      if (errno == EINTR || errno == ECONNABORTED) continue;
      base::Logger("server").warning("a program cannot be accepted; tried again");
      std::this_thread::sleep_for(kAcceptSlice);
      continue;
    }
    if (connections.size() >= kMaxConnections) {
      send_away(socket.get(),
                fmt::format("'{}' serves {} programs already, and no more at one time", name, kMaxConnections));
      continue;
    }
    Connection& connection = connections.emplace_back();
    try {
      connection.thread = std::jthread([&, socket = std::move(socket)]() mutable {
        server::converse(socket.get(), *host, report_in_turn, stop, patience);
        socket.reset();
        connection.finished = true;
      });
    } catch (const std::system_error& error) {  // no thread is available
      connections.pop_back();
      report_in_turn(fmt::format("a program was sent away: {}", error.what()));
    }
  }
  // No new client finds the socket from now on; `connections` are joined before the claim goes.
  ::unlink(path->c_str());
  listening->reset();
  return {};
}

Status serve_world(const PlaceSettings& place, const std::string& name,
                   const std::function<void(const std::string&)>& report, const std::atomic<bool>& stop) {
  auto host = SimulationHost::open(place);
  if (!host) return host.error();
  report((*host)->rendering());
  return serve(*host, name, report, stop);
}

}  // namespace twocone::sim_povray
