// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/server/served_name.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <exception>
#include <string>
#include <thread>

#include <fmt/format.h>

#include "drivers/sim_povray/server/server.h"
#include "drivers/sim_povray/server/socket.h"

namespace twocone::sim_povray {
namespace server {
namespace {

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
      return Error{ErrorCode::kUnavailable, fmt::format("no lock {}: {}", path.string(), server::words(errno))};
    }
  }
  return Error{ErrorCode::kRefused,
               fmt::format("a world '{}' is served already (its lock is {})", socket.stem().string(), path.string())};
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

}  // namespace server

namespace {

constexpr std::size_t kMaxName = 64;

Error refused(const std::filesystem::path& folder, const std::string& why) {
  return {ErrorCode::kRefused, fmt::format("{} {}", folder.string(), why)};
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
    return Error{ErrorCode::kRefused,
                 fmt::format("'{}' is no name for a world: 1 to {} letters, digits, - and _", name, kMaxName)};
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
