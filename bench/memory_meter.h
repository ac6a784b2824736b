// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

namespace twocone::bench {

/// Measures the peak memory of this program and all processes that it has started, in MiB, sampled every 50 ms. It is
/// the sum of their proportional set sizes (/proc/PID/smaps_rollup), in which a shared page is divided among its users.
class MemoryMeter {
 public:
  MemoryMeter() : thread_([this] { watch(); }) {}
  ~MemoryMeter() { stop(); }
  MemoryMeter(const MemoryMeter&) = delete;
  MemoryMeter& operator=(const MemoryMeter&) = delete;

  double stop() {
    stopping_ = true;
    if (thread_.joinable()) thread_.join();
    return double(peak_kib_) / 1024;
  }

 private:
  static long proportional_kib(const std::string& pid) {
    std::ifstream file("/proc/" + pid + "/smaps_rollup");
    for (std::string word; file >> word;) {
      long kib = 0;
      if (word == "Pss:" && file >> kib) return kib;
    }
    return 0;  // the process has ended
  }
  static long all_kib() {
    std::map<std::string, std::string> parents;
    for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
      const std::string pid = entry.path().filename().string();
      if (pid.find_first_not_of("0123456789") != std::string::npos) continue;
      std::ifstream file(entry.path() / "stat");
      std::string line;
      std::getline(file, line);
      const auto name_end = line.rfind(')');
      if (name_end == std::string::npos) continue;
      std::string state, parent;
      std::istringstream(line.substr(name_end + 1)) >> state >> parent;
      parents[pid] = parent;
    }
    const std::string self = std::to_string(::getpid());
    long sum = 0;
    for (const auto& [pid, parent] : parents) {
      std::string ancestor = pid;
      while (ancestor != self && parents.contains(ancestor)) ancestor = parents.at(ancestor);
      if (ancestor == self) sum += proportional_kib(pid);
    }
    return sum;
  }
  void watch() {
    while (!stopping_) {
      peak_kib_ = std::max(peak_kib_, all_kib());
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
  }

  std::atomic<bool> stopping_{false};
  long peak_kib_ = 0;
  std::thread thread_;
};

}  // namespace twocone::bench
