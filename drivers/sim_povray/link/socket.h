// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "drivers/sim_povray/link/protocol.h"
#include "drivers/sim_povray/render/child_process.h"
#include "hal/result.h"

/// Packets over Unix-domain sockets. Nothing here waits longer than its deadline, and a peer that is gone is an answer,
/// never a signal.
namespace twocone::sim_povray::link {

using SteadyTime = std::chrono::steady_clock::time_point;

/// Listens on `path`, which must be free; only this user may connect. Errors: kUnavailable.
Result<UniqueFd> listen_at(const std::filesystem::path& path);

/// Errors: kNotFound (nobody listens there), kTimeout (nobody takes the call), kUnavailable, and those of check_peer.
Result<UniqueFd> connect_to(const std::filesystem::path& path, SteadyTime deadline);

/// Who is at the other end, as the kernel tells; nothing if it does not.
struct Peer {
  uid_t user = 0;
  pid_t process = 0;
};
std::optional<Peer> peer_of(int socket);

/// A link joins programs of one user; root is a user like others. Errors: kRefused.
Status check_peer(const std::optional<Peer>& peer, uid_t user);

/// Errors: kTimeout (the peer does not read), kDisconnected. @param file rides along if it is not negative
Status send_message(int socket, const Message& message, SteadyTime deadline, int file = -1);

struct Received {
  std::optional<Message> message;  ///< nothing: a packet came, but it is no message
  UniqueFd file;                   ///< what rode along, if it was asked for
};
enum class Files { kDrop, kTake };
/// Errors: kTimeout, kDisconnected.
Result<Received> receive_message(int socket, SteadyTime deadline, Files files = Files::kDrop);

/// The peer has closed its end or is dead, whatever of its messages is still unread.
bool hung_up(int socket);

}  // namespace twocone::sim_povray::link
