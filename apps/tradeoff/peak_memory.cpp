// SPDX-License-Identifier: Apache-2.0
#include "apps/tradeoff/peak_memory.h"

#include <fstream>
#include <string>

namespace twocone::tradeoff {

PeakMemory::PeakMemory() {
  std::ofstream mark("/proc/self/clear_refs");
  mark << "5" << std::flush;  // proc(5): sets the peak to the present resident size
  is_fresh_ = bool(mark);
}

std::optional<double> PeakMemory::bytes() const {
  if (!is_fresh_) return std::nullopt;
  std::ifstream status("/proc/self/status");
  for (std::string key; status >> key;) {
    if (key == "VmHWM:") {
      double kibibytes = 0;
      if (status >> kibibytes) return kibibytes * 1024;
      break;
    }
    status.ignore(4096, '\n');
  }
  return std::nullopt;
}

}  // namespace twocone::tradeoff
