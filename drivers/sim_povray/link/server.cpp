// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/link/server.h"

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

#include "drivers/sim_povray/link/served_name.h"
#include "drivers/sim_povray/link/session.h"
#include "drivers/sim_povray/link/socket.h"

namespace twocone::sim_povray {
namespace {

constexpr std::size_t kMaxConnections = 64;
/// How often `stop` is looked at.
constexpr std::chrono::milliseconds kSlice{50};

/// Nobody waits for this: who does not read it at once misses it.
void send_away(int socket, const std::string& why) {
  const Status told =
      send_message(socket, link::Failed{ErrorCode::kUnavailable, why}, std::chrono::steady_clock::now());
  static_cast<void>(told);
}

}  // namespace

Status serve(const std::shared_ptr<Hall>& hall, const std::string& name,
             const std::function<void(const std::string&)>& tell, const std::atomic<bool>& stop,
             std::chrono::milliseconds patience) {
  const auto path = world_socket(name);
  if (!path) return path.error();
  const auto claim = link::ServedName::claim(*path);
  if (!claim) return claim.error();
  auto listening = link::listen_at(*path);
  if (!listening) return listening.error();

  std::mutex tell_mutex;
  const auto tell_in_turn = [&](const std::string& line) {
    const std::lock_guard lock(tell_mutex);
    tell(line);
  };
  tell_in_turn(fmt::format("serving '{}' at {}", name, path->string()));
  std::list<link::Session> sessions;
  while (!stop) {
    pollfd entry{listening->get(), POLLIN, 0};
    const int ready = ::poll(&entry, 1, static_cast<int>(kSlice.count()));
    sessions.remove_if([](const link::Session& session) { return session.finished(); });
    if (ready <= 0) continue;
    UniqueFd socket(::accept4(listening->get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
    if (!socket.valid()) {
      // Mostly: no descriptor left. The caller stays in the queue, so without a pause this would spin.
      if (errno != EINTR && errno != ECONNABORTED) std::this_thread::sleep_for(kSlice);
      continue;
    }
    if (sessions.size() >= kMaxConnections) {
      send_away(socket.get(),
                fmt::format("'{}' serves {} programs already, and no more at one time", name, kMaxConnections));
      continue;
    }
    try {
      sessions.emplace_back(std::move(socket), hall, tell_in_turn, stop, patience);
    } catch (const std::system_error& error) {  // no thread to be had
      tell_in_turn(fmt::format("a program was sent away: {}", error.what()));
    }
  }
  // Nobody new finds it from now on; `sessions` is joined before the claim goes.
  ::unlink(path->c_str());
  listening->reset();
  return {};
}

}  // namespace twocone::sim_povray
