// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/render/povray/pose_lease.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <fstream>
#include <system_error>
#include <thread>

#include <fmt/format.h>

#include "base/unique_fd.h"

namespace twocone::sim_povray {
namespace {

/// Below this, a loaded machine might break a lease although all is well.
constexpr int kLeastBreakTime_s = 4;

}  // namespace

PoseLease::PoseLease(const std::string& text) {
  const base::UniqueFd first = base::memory_file("pose.inc", "");
  // A write lease requires that the file is open once only; creating a memory file counts as another opening, a real
  // opening does not.
  fd_ = base::UniqueFd(::open(fmt::format("/proc/self/fd/{}", first.get()).c_str(), O_RDWR | O_CLOEXEC));
  if (!fd_.valid()) base::throw_errno("opening a memory file again");
  write(text);
}

bool PoseLease::take() {
  // Set before F_SETLEASE, which would notify the whole process: any thread of it could get the signal.
  // Set each time: giving a lease back forgets the owner.
  f_owner_ex owner{F_OWNER_TID, ::gettid()};
  if (::fcntl(fd_.get(), F_SETOWN_EX, &owner) != 0) base::throw_errno("F_SETOWN_EX");
  if (::fcntl(fd_.get(), F_SETLEASE, F_WRLCK) == 0) return true;
  if (errno != EAGAIN) base::throw_errno("F_SETLEASE");
  return false;
}

bool PoseLease::wanted() const { return ::fcntl(fd_.get(), F_GETLEASE) != F_WRLCK; }

void PoseLease::write(const std::string& text) {
  std::size_t done = 0;
  while (done < text.size()) {
    const auto written = ::pwrite(fd_.get(), text.data() + done, text.size() - done, off_t(done));
    if (written < 0 && errno != EINTR) base::throw_errno("writing a memory file");
    if (written > 0) done += std::size_t(written);
  }
  if (::ftruncate(fd_.get(), off_t(text.size())) != 0) base::throw_errno("writing a memory file");
}

void PoseLease::give(const std::string& text) {
  write(text);
  if (::fcntl(fd_.get(), F_SETLEASE, F_UNLCK) != 0 && errno != EAGAIN) base::throw_errno("F_SETLEASE");
}

int lease_break_time_s() {
  std::ifstream file("/proc/sys/fs/lease-break-time");
  int seconds = 0;
  return file >> seconds ? seconds : 0;
}

std::string lease_obstacle() {
  try {
    const int seconds = lease_break_time_s();
    if (seconds < kLeastBreakTime_s) {
      return fmt::format("/proc/sys/fs/lease-break-time is {} s, must be >= {} s", seconds, kLeastBreakTime_s);
    }
    PoseLease lease("");
    // A child that another thread forks at this moment has the file open too, until it execs.
    for (int attempt = 0; attempt < 100; ++attempt) {
      if (lease.take()) return "";
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return "F_SETLEASE: a file of our own counts as open elsewhere";
  } catch (const std::system_error& e) {
    return e.what();
  }
}

}  // namespace twocone::sim_povray
