// SPDX-License-Identifier: Apache-2.0
#include "base/confinement.h"

#include <fcntl.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <utility>

namespace twocone::base {
namespace {

// ---- Landlock: a copy of linux/landlock.h of Linux 6.12, because the header of an older system lacks part of it. The
// numbers of the system calls are the same on all processors.

constexpr long kCreateRuleset = 444;
constexpr long kAddRule = 445;
constexpr long kRestrictSelf = 446;
constexpr unsigned kVersionFlag = 1;
constexpr int kPathBeneath = 1;

struct RulesetAttributes {
  std::uint64_t files = 0;
  std::uint64_t net = 0;     ///< since version 4
  std::uint64_t scoped = 0;  ///< since version 6
};
struct __attribute__((packed)) PathBeneath {
  std::uint64_t allowed = 0;
  std::int32_t folder = -1;
};

constexpr std::uint64_t kExecute = 1U << 0U;
constexpr std::uint64_t kWriteFile = 1U << 1U;
constexpr std::uint64_t kReadFile = 1U << 2U;
constexpr std::uint64_t kReadFolder = 1U << 3U;
constexpr std::uint64_t kRemoveFile = 1U << 5U;
constexpr std::uint64_t kMakeFile = 1U << 8U;
constexpr std::uint64_t kTruncate = 1U << 14U;
constexpr std::uint64_t kDeviceControl = 1U << 15U;
constexpr std::uint64_t kAllNet = 3;
constexpr std::uint64_t kAllScopes = 3;

/// Returns all rights on files that a version supports. Version 1 has 13; later versions add moving between folders,
/// truncating and controlling devices.
constexpr std::uint64_t all_files(int version) {
  const unsigned count = version >= 5 ? 16 : version >= 3 ? 15 : version >= 2 ? 14 : 13;
  return (1U << count) - 1;
}
/// Rights that a rule may grant for a file (not a folder).
constexpr std::uint64_t kOfFiles = kExecute | kWriteFile | kReadFile | kTruncate | kDeviceControl;

void allow(int ruleset, const std::string& path, std::uint64_t rights, std::uint64_t handled) {
  const UniqueFd place(::open(path.c_str(), O_PATH | O_CLOEXEC));
  if (!place.valid()) {
    if (errno == ENOENT || errno == ENOTDIR || errno == EACCES) return;  // nothing to allow there
    throw_errno(path.c_str());
  }
  struct stat status {};
  if (::fstat(place.get(), &status) != 0) throw_errno(path.c_str());
  if (!S_ISDIR(status.st_mode)) rights &= kOfFiles;
  const PathBeneath rule{rights & handled, place.get()};
  if (::syscall(kAddRule, ruleset, kPathBeneath, &rule, 0U) != 0) throw_errno(path.c_str());
}

// ---- seccomp: no file is opened for writing, and no folder changed

#if defined(__x86_64__)
#define TWOCONE_AUDIT_ARCH AUDIT_ARCH_X86_64
#elif defined(__aarch64__)
#define TWOCONE_AUDIT_ARCH AUDIT_ARCH_AARCH64
#elif defined(__arm__) && defined(__ARM_EABI__)
#define TWOCONE_AUDIT_ARCH AUDIT_ARCH_ARM
#elif defined(__riscv) && __riscv_xlen == 64
#define TWOCONE_AUDIT_ARCH AUDIT_ARCH_RISCV64
#endif

#ifdef TWOCONE_AUDIT_ARCH

constexpr std::uint32_t kRefuse = SECCOMP_RET_ERRNO | EACCES;
/// With this error, glibc falls back to the older call.
constexpr std::uint32_t kUnknown = SECCOMP_RET_ERRNO | ENOSYS;
/// O_TMPFILE needs no entry: it is valid only together with one of the first two.
constexpr std::uint32_t kOpensForWriting = O_WRONLY | O_RDWR | O_CREAT | O_TRUNC | O_APPEND;

/// Calls that change a file or a folder by its name, or that could do so without this filter seeing it.
constexpr std::array kRefused = {
#ifdef SYS_unlink  // the processors that still have the older calls have all of these
    SYS_creat,
    SYS_unlink,
    SYS_rmdir,
    SYS_mkdir,
    SYS_rename,
    SYS_link,
    SYS_symlink,
    SYS_mknod,
    SYS_chmod,
    SYS_chown,
    SYS_lchown,
#endif
#ifdef SYS_renameat
    SYS_renameat,
#endif
    SYS_unlinkat,
    SYS_mkdirat,
    SYS_renameat2,
    SYS_linkat,
    SYS_symlinkat,
    SYS_mknodat,
    SYS_fchmodat,
    SYS_fchownat,
    SYS_truncate,
    SYS_utimensat,
    SYS_setxattr,
    SYS_lsetxattr,
    SYS_removexattr,
    SYS_lremovexattr,
    SYS_mount,
    SYS_socket,
    SYS_ptrace,
    SYS_io_uring_setup,
    SYS_open_by_handle_at,
    SYS_process_vm_writev,
};

constexpr sock_filter statement(std::uint16_t code, std::uint32_t k) { return {code, 0, 0, k}; }
constexpr sock_filter jump(std::uint16_t code, std::uint32_t k, std::uint8_t yes, std::uint8_t no) {
  return {code, yes, no, k};
}
constexpr std::uint32_t kNumber = offsetof(seccomp_data, nr);
constexpr std::uint32_t kArch = offsetof(seccomp_data, arch);
/// Returns the offset of an argument's low half: all of these processors are little-endian.
constexpr std::uint32_t argument(std::size_t index) {
  return std::uint32_t(offsetof(seccomp_data, args) + index * sizeof(std::uint64_t));
}

#ifdef SYS_open
constexpr std::size_t kOpens = 2;
#else
constexpr std::size_t kOpens = 1;
#endif
constexpr std::size_t kFilterLength = 5 + 4 * kOpens + 2 + 2 * kRefused.size() + 1;

constexpr std::array<sock_filter, kFilterLength> make_filter() {
  std::array<sock_filter, kFilterLength> filter{};
  std::size_t at = 0;
  const auto add = [&](const sock_filter& line) { filter[at++] = line; };
  constexpr std::uint16_t kLoad = BPF_LD | BPF_W | BPF_ABS;
  constexpr std::uint16_t kEqual = BPF_JMP | BPF_JEQ | BPF_K;
  constexpr std::uint16_t kAnySet = BPF_JMP | BPF_JSET | BPF_K;
  constexpr std::uint16_t kReturn = BPF_RET | BPF_K;
  constexpr std::uint32_t kOtherCalls = 0x40000000;  // x32 on x86_64: the same calls by other numbers
  add(statement(kLoad, kArch));
  add(jump(kEqual, TWOCONE_AUDIT_ARCH, 1, 0));
  add(statement(kReturn, SECCOMP_RET_KILL_PROCESS));
  add(statement(kLoad, kNumber));
  add(jump(kAnySet, kOtherCalls, std::uint8_t(0), 0));
  const auto open_call = [&](std::uint32_t call, std::size_t flags) {
    add(jump(kEqual, call, 0, 3));
    add(statement(kLoad, argument(flags)));
    add(jump(kAnySet, kOpensForWriting, 0, std::uint8_t(kFilterLength - 1 - at - 1)));
    add(statement(kReturn, kRefuse));
  };
  open_call(SYS_openat, 2);
#ifdef SYS_open
  open_call(SYS_open, 1);
#endif
  add(jump(kEqual, SYS_openat2, 0, 1));
  add(statement(kReturn, kUnknown));
  for (const auto call : kRefused) {
    add(jump(kEqual, std::uint32_t(call), 0, 1));
    add(statement(kReturn, kRefuse));
  }
  add(statement(kReturn, SECCOMP_RET_ALLOW));
  // A call number with that bit set jumps to the refusal at the end of the first open_call().
  filter[4].jt = std::uint8_t(5 + 3 - 4 - 1);
  return filter;
}

constexpr std::array<sock_filter, kFilterLength> kFilter = make_filter();

bool forbid_writing() {
  sock_fprog program{kFilter.size(), const_cast<sock_filter*>(kFilter.data())};
  return ::prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program) == 0;
}
constexpr bool kHasFilter = true;

#else

bool forbid_writing() { return false; }
constexpr bool kHasFilter = false;

#endif

}  // namespace

int landlock_version() {
  static const int version = [] {
    const long found = ::syscall(kCreateRuleset, nullptr, std::size_t{0}, kVersionFlag);
    return found > 0 ? int(found) : 0;
  }();
  return version;
}

Confinement::Confinement(std::vector<std::string> readable, bool landlock)
    : readable_(std::move(readable)),
      kind_(landlock && landlock_version() > 0 ? Kind::kLandlock
            : kHasFilter                       ? Kind::kNoWriting
                                               : Kind::kNone) {}

UniqueFd Confinement::ruleset(const std::string& writable) const {
  if (kind_ != Kind::kLandlock) return {};
  const int version = landlock_version();
  // An older version refuses a structure with the members of a later one.
  const RulesetAttributes attributes{all_files(version), kAllNet, kAllScopes};
  const std::size_t size = version >= 6   ? sizeof attributes
                           : version >= 4 ? offsetof(RulesetAttributes, scoped)
                                          : offsetof(RulesetAttributes, net);
  UniqueFd ruleset(int(::syscall(kCreateRuleset, &attributes, size, 0U)));
  if (!ruleset.valid()) throw_errno("landlock_create_ruleset");
  for (const std::string& path : readable_) {
    allow(ruleset.get(), path, kExecute | kReadFile | kReadFolder, attributes.files);
  }
  if (!writable.empty()) {
    allow(ruleset.get(), writable, kReadFile | kReadFolder | kWriteFile | kMakeFile | kRemoveFile | kTruncate,
          attributes.files);
  }
  return ruleset;
}

bool Confinement::enter(Kind kind, int ruleset) {
  if (kind == Kind::kNone) return true;
  if (::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) return false;
  if (kind == Kind::kNoWriting) return forbid_writing();
  return ::syscall(kRestrictSelf, ruleset, 0U) == 0;
}

}  // namespace twocone::base
