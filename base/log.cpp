// SPDX-License-Identifier: Apache-2.0
#include "base/log.h"

#include <atomic>
#include <chrono>
#include <map>
#include <memory>
#include <utility>

#include <fmt/format.h>
#include <spdlog/sinks/basic_file_sink.h>
#include <spdlog/sinks/dist_sink.h>
#include <spdlog/sinks/ringbuffer_sink.h>
#include <spdlog/sinks/stdout_sinks.h>

namespace twocone::base {
namespace {

using spdlog::level::level_enum;
using Sinks = spdlog::sinks::dist_sink_mt;
using Memory = spdlog::sinks::ringbuffer_sink_mt;

/// The form of a line: "2026-11-23T06:37:57.123+00:00 warning v4l2: ..."
constexpr const char* kPattern = "%Y-%m-%dT%H:%M:%S.%e%z %l %n: %v";
constexpr std::size_t kMostKept = 1000;
constexpr std::chrono::seconds kBetweenEqual{1};
/// After this many different messages, all of them are forgotten, and with them the numbers of those left out.
constexpr std::size_t kMostCompared = 256;

/// Passes equal messages on at most once per kBetweenEqual.
class LimitedSink final : public Sinks {
  void sink_it_(const spdlog::details::log_msg& message) override {
    std::string text(message.payload.data(), message.payload.size());
    if (passed_.size() >= kMostCompared) passed_.clear();
    const auto now = std::chrono::steady_clock::now();
    const auto [at, is_new] = passed_.try_emplace(fmt::format("{}: {}", message.logger_name, text), now, 0U);
    auto& [last, left_out] = at->second;
    if (!is_new && now - last < kBetweenEqual) {
      ++left_out;
      return;
    }
    if (left_out > 0) text += fmt::format(" ({} times more since the last such line)", std::exchange(left_out, 0U));
    last = now;
    Sinks::sink_it_({message.logger_name, message.level, text});
  }

  std::map<std::string, std::pair<std::chrono::steady_clock::time_point, unsigned>> passed_;
};

template <typename Sink, typename... Arguments>
std::shared_ptr<Sink> make_sink(const Arguments&... arguments) {
  auto sink = std::make_shared<Sink>(arguments...);
  sink->set_pattern(kPattern);
  return sink;
}

struct Log {
  Log() { sink.add_sink(memory); }

  LimitedSink sink;
  std::atomic<level_enum> level = level_enum::warn;
  std::shared_ptr<Memory> memory = make_sink<Memory>(kMostKept);
  spdlog::sink_ptr terminal, file;  ///< none until show_log(), open_log()
};

/// The log is never destroyed, because other objects may still use it while the program ends.
Log& the_log() {
  static Log& log = *new Log;
  return log;
}

void write(const char* name, level_enum level, std::string_view message) noexcept {
  try {
    if (level < the_log().level) return;
    the_log().sink.log({name, level, {message.data(), message.size()}});
    the_log().sink.flush();
  } catch (const std::exception&) {  // a full disk, for example
    return;
  }
}

}  // namespace

void Logger::debug(std::string_view message) const noexcept { write(name_, level_enum::debug, message); }
void Logger::info(std::string_view message) const noexcept { write(name_, level_enum::info, message); }
void Logger::warning(std::string_view message) const noexcept { write(name_, level_enum::warn, message); }
void Logger::error(std::string_view message) const noexcept { write(name_, level_enum::err, message); }

void show_log(std::string_view level) {
  the_log().level = spdlog::level::from_str(std::string(level));
  the_log().terminal = make_sink<spdlog::sinks::stderr_sink_mt>();
  the_log().sink.add_sink(the_log().terminal);
}

void open_log(const std::filesystem::path& file) noexcept {
  Log& log = the_log();
  try {
    const auto opened = make_sink<spdlog::sinks::basic_file_sink_mt>(file.string());
    log.sink.remove_sink(log.memory);
    log.sink.add_sink(log.file = opened);
    for (const auto& message : log.memory->last_raw()) opened->log(message);
    opened->flush();
  } catch (const std::exception&) {  // no such folder, or a full disk
    return;
  }
}

std::vector<std::string> close_log() {
  Log& log = the_log();
  auto unseen = log.file || log.terminal ? std::vector<std::string>() : log.memory->last_formatted();
  for (std::string& line : unseen) line.pop_back();  // the end of the line
  log.sink.remove_sink(std::exchange(log.file, nullptr));
  log.sink.remove_sink(log.memory);
  log.sink.add_sink(log.memory = make_sink<Memory>(kMostKept));
  return unseen;
}

}  // namespace twocone::base
