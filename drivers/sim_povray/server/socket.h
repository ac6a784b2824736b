// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <system_error>

#include "base/unique_fd.h"
#include "drivers/sim_povray/server/protocol.h"
#include "hal/result.h"

/// The socket of a world (Unix-domain): the right to serve it, and packets over it. No call waits longer than its
/// deadline, and a peer that is gone is reported as an error, never by a signal.
namespace twocone::sim_povray::server {

using SteadyTime = std::chrono::steady_clock::time_point;
inline SteadyTime in(std::chrono::nanoseconds time) { return std::chrono::steady_clock::now() + time; }

/// Returns the reason that errno gave, in words.
inline std::string words(int error_number) { return std::generic_category().message(error_number); }

/// The right to serve at a socket's path: a lock on `NAME.lock` beside it, which the kernel releases when the program
/// ends in any way. The holder of the lock may therefore remove a dead server's socket. Both files are removed with the
/// claim.
class ServedName {
 public:
  /// Claims the right. Errors: kRefused (it is already served), kUnavailable (no file can be made there).
  static Result<ServedName> claim(const std::filesystem::path& socket);

  ServedName(ServedName&&) noexcept = default;
  ServedName& operator=(ServedName&&) = delete;
  ~ServedName();

 private:
  ServedName(std::filesystem::path socket, base::UniqueFd lock) : socket_(std::move(socket)), lock_(std::move(lock)) {}

  std::filesystem::path socket_;
  base::UniqueFd lock_;
};

/// Removes the files that a killed server left there; does nothing if a server is alive.
/// @param patience how long to try while the lock is held: the kernel closes the connections of a killed program some
/// time before it releases its locks
void sweep(const std::filesystem::path& socket, std::chrono::milliseconds patience) noexcept;

/// Listens on `path`, which must be free; only this user may connect. Errors: kUnavailable.
Result<base::UniqueFd> listen_at(const std::filesystem::path& path);

/// Connects to the program that listens there. Errors: kNotFound (none does), kTimeout (it does not accept the
/// connection), kUnavailable, and those of check_peer.
Result<base::UniqueFd> connect_to(const std::filesystem::path& path, SteadyTime deadline);

/// The process at the other end, as the kernel reports it; nothing if it does not.
struct Peer {
  uid_t user = 0;
  pid_t process = 0;
};
std::optional<Peer> peer_of(int socket);

/// Checks that the peer is of `user`: a link joins programs of one user, and root is a user like others. Errors:
/// kRefused.
Status check_peer(const std::optional<Peer>& peer, uid_t user);

/// Sends a message. Errors: kTimeout (the peer does not read), kDisconnected. @param file sent along if not negative
Status send_message(int socket, const Message& message, SteadyTime deadline, int file = -1);

struct Received {
  std::optional<Message> message;  ///< nothing: a packet came, but it is not a message
  base::UniqueFd file;             ///< the file that was sent along, if it was requested
};
enum class Files { kDrop, kTake };
/// Receives a packet. Errors: kTimeout, kDisconnected.
Result<Received> receive_message(int socket, SteadyTime deadline, Files files = Files::kDrop);

/// Returns whether the peer has closed its end or is dead, even if some of its messages are still unread.
bool hung_up(int socket);

}  // namespace twocone::sim_povray::server
