// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

/// The log: what the program handles without the user, such as a retry, a restart or a fallback.
///
/// It is global: a logger passed to each driver would be a parameter of every constructor. Nothing that the program
/// computes depends on it, and a failure of the log itself is ignored. It must not be used in a signal handler, or
/// between fork and exec.
///
/// Messages are kept in memory, the last 1000 of them, until a file takes them. An equal message of the same logger is
/// written at most once per second, with the number of those that were left out. A message that may come often must
/// therefore not contain a number that changes.
namespace twocone::base {

/// Least important first; a level includes all that follow. Nothing is logged at `trace` yet.
inline constexpr std::array kLogLevels{"trace", "debug", "info", "warning", "error", "off"};

/// Writes messages under the name of a driver or another part of the program. May be used from any thread.
class Logger {
 public:
  /// @param name appears in each line, for example "v4l2"; the text must outlive the logger
  constexpr explicit Logger(const char* name) : name_(name) {}

  /// Logs a single step.
  void debug(std::string_view message) const noexcept;
  /// Logs a change of state that is in order.
  void info(std::string_view message) const noexcept;
  /// Logs a failure that the program handles.
  void warning(std::string_view message) const noexcept;
  /// Logs a failure that ends what was to be done.
  void error(std::string_view message) const noexcept;

 private:
  const char* name_;
};

/// Shows the log on standard error, once. @param level the lowest level that is logged, one of kLogLevels; without this
/// call, `warning`
void show_log(std::string_view level);

/// Appends the kept messages and all later ones to a file, each at once. If it cannot be opened, they are still kept.
void open_log(const std::filesystem::path& file) noexcept;

/// Ends what open_log() began. Returns and forgets the kept messages that were written neither to a file nor to
/// standard error.
std::vector<std::string> close_log();

}  // namespace twocone::base
