// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdio>
#include <fstream>
#include <functional>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

namespace twocone::vm {

inline double now_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}
inline void sleep_s(double time_s) { std::this_thread::sleep_for(std::chrono::duration<double>(time_s)); }

/// Returns whether `is_true` returns true within that time.
inline bool comes_true(double time_s, const std::function<bool()>& is_true) {
  for (const double end_s = now_s() + time_s; now_s() < end_s; sleep_s(0.01)) {
    if (is_true()) return true;
  }
  return is_true();
}

/// Prints a row of the results of a script in this folder.
inline bool row(const std::string& what, const std::string& figure, const std::string& target, bool is_met) {
  std::printf("row | %s | %s | %s | %s\n", what.c_str(), figure.c_str(), target.c_str(), is_met ? "yes" : "no");
  std::fflush(stdout);
  return is_met;
}

/// An emulated_controller whose standard output goes to one file, and whose standard input follows another.
class EmulatedFiles {
 public:
  EmulatedFiles(std::string log, std::string commands) : log_(std::move(log)), commands_(std::move(commands)) {}

  /// A start or stop of its wheels, with the time of its own clock.
  struct Change {
    double time_s = 0;
    bool turns = false;
  };
  [[nodiscard]] std::vector<Change> changes() const {
    std::vector<Change> found;
    std::ifstream file(log_);
    for (std::string line; std::getline(file, line) && !file.eof();) {  // the last line may be incomplete
      std::istringstream words(line);
      Change change;
      std::string word;
      if (!(words >> change.time_s >> word)) continue;
      change.turns = word == "turn";
      found.push_back(change);
    }
    return found;
  }
  [[nodiscard]] bool turns() const {
    const auto all = changes();
    return !all.empty() && all.back().turns;
  }

  /// Sends a command; does not wait until it is carried out.
  void send(const std::string& command) const { std::ofstream(commands_, std::ios::app) << command << std::endl; }

 private:
  const std::string log_;
  const std::string commands_;
};

}  // namespace twocone::vm
