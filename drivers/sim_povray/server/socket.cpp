// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/server/socket.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <thread>

#include <fmt/format.h>

#include "base/child_process.h"
#include "drivers/sim_povray/server/server.h"
#include "hal/clock.h"

namespace twocone::sim_povray {
namespace server {
namespace {

constexpr int kBacklog = 64;
constexpr std::chrono::milliseconds kConnectPause{10};

/// Returns the address of a path, which fits because world_socket() has checked it.
sockaddr_un address_of(const std::filesystem::path& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::string& text = path.native();
  assert(text.size() < sizeof(address.sun_path));
  std::memcpy(address.sun_path, text.data(), std::min(text.size(), sizeof(address.sun_path) - 1));
  return address;
}

base::UniqueFd make_socket() {
  return base::UniqueFd(::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
}

/// Waits until the socket is ready; returns false at the deadline.
bool wait_for(int socket, short events, SteadyTime deadline) {
  while (true) {
    const int wait_ms = base::milliseconds_until(deadline);
    pollfd entry{socket, events, 0};
    const int ready = ::poll(&entry, 1, wait_ms);
    if (ready > 0) return true;  // also when the peer has hung up: the next call reports it
    if (ready == 0 && wait_ms == 0) return false;
  }
}

Error disconnected(const std::string& why) { return {ErrorCode::kDisconnected, why}; }

/// The control part of a packet, aligned as the kernel requires.
union Control {
  cmsghdr header;
  std::array<char, CMSG_SPACE(sizeof(int))> bytes;
};

base::UniqueFd file_in(msghdr& packet) {
  for (cmsghdr* part = CMSG_FIRSTHDR(&packet); part != nullptr; part = CMSG_NXTHDR(&packet, part)) {
    if (part->cmsg_level != SOL_SOCKET || part->cmsg_type != SCM_RIGHTS || part->cmsg_len != CMSG_LEN(sizeof(int))) {
      continue;
    }
    int file = -1;
    std::memcpy(&file, CMSG_DATA(part), sizeof(file));
    return base::UniqueFd(file);
  }
  return {};
}

// A client that sweeps holds the lock for a moment.
constexpr int kAttempts = 20;
constexpr std::chrono::milliseconds kPause{10};

std::filesystem::path lock_of(std::filesystem::path socket) { return socket.replace_extension(".lock"); }

/// Returns the lock, if it is free and its file is still the one at `path`; else nothing, and errno.
base::UniqueFd try_lock(const std::filesystem::path& path, int flags) {
  base::UniqueFd file(::open(path.c_str(), O_RDWR | O_CLOEXEC | O_NOFOLLOW | flags, S_IRUSR | S_IWUSR));
  if (!file.valid()) return {};
  if (::flock(file.get(), LOCK_EX | LOCK_NB) != 0) return {};
  struct stat ours {};
  struct stat there {};
  const bool same = ::fstat(file.get(), &ours) == 0 && ::stat(path.c_str(), &there) == 0 &&
                    ours.st_dev == there.st_dev && ours.st_ino == there.st_ino;
  if (!same) {  // its last holder removed it after it was opened here, and before it was locked
    errno = EWOULDBLOCK;
    return {};
  }
  return file;
}

}  // namespace

Result<ServedName> ServedName::claim(const std::filesystem::path& socket) {
  const auto path = lock_of(socket);
  for (int i = 0; i < kAttempts; ++i) {
    if (i != 0) std::this_thread::sleep_for(kPause);
    base::UniqueFd lock = try_lock(path, O_CREAT);
    if (lock.valid()) {
      ::unlink(socket.c_str());
      return ServedName(socket, std::move(lock));
    }
    if (errno != EWOULDBLOCK) {
      return Error(ErrorCode::kUnavailable, "no lock {}: {}", path.string(), server::words(errno));
    }
  }
  return Error(ErrorCode::kRefused, "a world '{}' is served already (its lock is {})", socket.stem().string(),
               path.string());
}

ServedName::~ServedName() {
  if (!lock_.valid()) return;
  ::unlink(socket_.c_str());
  ::unlink(lock_of(socket_).c_str());
}

void sweep(const std::filesystem::path& socket, std::chrono::milliseconds patience) noexcept {
  try {
    const auto path = lock_of(socket);
    const auto deadline = std::chrono::steady_clock::now() + patience;
    while (true) {
      const base::UniqueFd lock = try_lock(path, 0);
      if (lock.valid()) {
        ::unlink(socket.c_str());
        ::unlink(path.c_str());
        return;
      }
      if (errno != EWOULDBLOCK || std::chrono::steady_clock::now() >= deadline) return;
      std::this_thread::sleep_for(kPause);
    }
  } catch (const std::exception&) {  // no memory: the files stay, and the next server removes them
  }
}

Result<base::UniqueFd> listen_at(const std::filesystem::path& path) {
  const auto failed = [&path] {
    return Error(ErrorCode::kUnavailable, "no socket {}: {}", path.string(), words(errno));
  };
  base::UniqueFd socket = make_socket();
  if (!socket.valid()) return failed();
  const sockaddr_un address = address_of(path);
  if (::bind(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) return failed();
  if (::chmod(path.c_str(), S_IRUSR | S_IWUSR) != 0 || ::listen(socket.get(), kBacklog) != 0) return failed();
  return socket;
}

Result<base::UniqueFd> connect_to(const std::filesystem::path& path, SteadyTime deadline) {
  base::UniqueFd socket = make_socket();
  if (!socket.valid()) return Error(ErrorCode::kUnavailable, "no socket: {}", words(errno));
  const sockaddr_un address = address_of(path);
  while (::connect(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
    if (errno == ENOENT || errno == ECONNREFUSED) {
      return Error(ErrorCode::kNotFound, "no program listens at {}", path.string());
    }
    // EAGAIN: too many others are connecting, and there is nothing that poll() could wait for.
    if (errno != EAGAIN && errno != EINTR) {
      return Error(ErrorCode::kUnavailable, "cannot connect to {}: {}", path.string(), words(errno));
    }
    if (std::chrono::steady_clock::now() >= deadline) {
      return Error(ErrorCode::kTimeout, "no program accepts the connection at {}", path.string());
    }
    std::this_thread::sleep_for(kConnectPause);
  }
  if (auto same_user = check_peer(peer_of(socket.get()), ::geteuid()); !same_user) return same_user.error();
  return socket;
}

std::optional<Peer> peer_of(int socket) {
  ucred credentials{};
  socklen_t size = sizeof(credentials);
  if (::getsockopt(socket, SOL_SOCKET, SO_PEERCRED, &credentials, &size) != 0) return std::nullopt;
  return Peer{credentials.uid, credentials.pid};
}

Status check_peer(const std::optional<Peer>& peer, uid_t user) {
  if (!peer) return Error{ErrorCode::kRefused, "the other program's user is not known"};
  if (peer->user == user) return {};
  return Error(ErrorCode::kRefused, "the other program (pid {}) is of user {}, this one of user {}", peer->process,
               peer->user, user);
}

Status send_message(int socket, const Message& message, SteadyTime deadline, int file) {
  std::vector<std::uint8_t> bytes = encode(message);
  assert(bytes.size() <= kMaxMessage);
  iovec content{bytes.data(), bytes.size()};
  msghdr packet{};
  packet.msg_iov = &content;
  packet.msg_iovlen = 1;
  Control control{};
  if (file >= 0) {
    packet.msg_control = control.bytes.data();
    packet.msg_controllen = control.bytes.size();
    cmsghdr* part = CMSG_FIRSTHDR(&packet);
    part->cmsg_level = SOL_SOCKET;
    part->cmsg_type = SCM_RIGHTS;
    part->cmsg_len = CMSG_LEN(sizeof(file));
    std::memcpy(CMSG_DATA(part), &file, sizeof(file));
  }
  while (::sendmsg(socket, &packet, MSG_NOSIGNAL) < 0) {
    if (errno == EINTR) continue;
    if (errno != EAGAIN) return disconnected(fmt::format("nothing can be sent: {}", words(errno)));
    if (!wait_for(socket, POLLOUT, deadline)) return Error{ErrorCode::kTimeout, "the other program does not listen"};
  }
  return {};
}

Result<Received> receive_message(int socket, SteadyTime deadline, Files files) {
  std::vector<std::uint8_t> bytes(kMaxMessage);
  while (true) {
    iovec content{bytes.data(), bytes.size()};
    msghdr packet{};
    packet.msg_iov = &content;
    packet.msg_iovlen = 1;
    // Without room for them, the kernel closes files that are sent along.
    Control control{};
    if (files == Files::kTake) {
      packet.msg_control = control.bytes.data();
      packet.msg_controllen = CMSG_LEN(sizeof(int));  // room for one, not for what alignment would add
    }
    const ssize_t size = ::recvmsg(socket, &packet, MSG_CMSG_CLOEXEC);
    if (size == 0) return disconnected("the other program has ended or closed the link");
    if (size > 0) {
      Received received;
      received.file = file_in(packet);
      if ((packet.msg_flags & MSG_TRUNC) == 0) received.message = decode({bytes.data(), std::size_t(size)});
      return received;
    }
    // ECONNRESET comes before the last message of the peer, which may hold its reason, and only once.
    if (errno == EINTR || errno == ECONNRESET) continue;
    if (errno != EAGAIN) return disconnected(fmt::format("nothing can be received: {}", words(errno)));
    if (!wait_for(socket, POLLIN, deadline)) return Error{ErrorCode::kTimeout, "the other program says nothing"};
  }
}

bool hung_up(int socket) {
  pollfd entry{socket, POLLRDHUP, 0};
  return ::poll(&entry, 1, 0) > 0 && (entry.revents & (POLLRDHUP | POLLHUP | POLLERR | POLLNVAL)) != 0;
}

}  // namespace server

namespace {

constexpr std::size_t kMaxName = 64;

Error refused(const std::filesystem::path& folder, const std::string& why) {
  return Error(ErrorCode::kRefused, "{} {}", folder.string(), why);
}

/// Makes the folder if it does not exist. Errors: kRefused: not a folder of this user's alone.
Status own_folder(const std::filesystem::path& folder) {
  if (::mkdir(folder.c_str(), S_IRWXU) != 0 && errno != EEXIST) {
    return refused(folder, fmt::format("cannot be made: {}", server::words(errno)));
  }
  struct stat status {};
  if (::lstat(folder.c_str(), &status) != 0) {
    return refused(folder, fmt::format("cannot be looked at: {}", server::words(errno)));
  }
  if (!S_ISDIR(status.st_mode)) return refused(folder, "is no folder");
  if (status.st_uid != ::geteuid()) {
    return refused(folder, fmt::format("belongs to user {}, not to {}", status.st_uid, ::geteuid()));
  }
  if ((status.st_mode & (S_IRWXG | S_IRWXO)) != 0) {
    return refused(folder,
                   fmt::format("is open to others (mode {:o}; chmod 700 {})", status.st_mode & 07777, folder.string()));
  }
  return {};
}

bool is_good(const std::string& name) {
  const auto good = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_';
  };
  return !name.empty() && name.size() <= kMaxName && std::all_of(name.begin(), name.end(), good);
}

}  // namespace

Result<std::filesystem::path> world_socket(const std::string& name) {
  if (!is_good(name)) {
    return Error(ErrorCode::kRefused, "'{}' is no name for a world: 1 to {} letters, digits, - and _", name, kMaxName);
  }
  std::filesystem::path runtime = fmt::format("/run/user/{}", ::geteuid());
  std::error_code ignored;
  if (const char* given = std::getenv("XDG_RUNTIME_DIR"); given != nullptr && *given != '\0') {
    runtime = given;
  } else if (!std::filesystem::is_directory(runtime, ignored)) {
    runtime = fmt::format("/tmp/twocone-{}", ::geteuid());
    if (auto own = own_folder(runtime); !own) return own.error();
  }
  const std::filesystem::path folder = runtime / "twocone";
  if (auto own = own_folder(folder); !own) return own.error();
  const std::filesystem::path socket = folder / (name + ".sock");
  if (socket.native().size() >= sizeof(sockaddr_un::sun_path)) {
    return refused(folder, fmt::format("is too long a path for the socket of '{}': {} bytes of {}", name,
                                       socket.native().size(), sizeof(sockaddr_un::sun_path) - 1));
  }
  return socket;
}

}  // namespace twocone::sim_povray
