// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

namespace twocone::tradeoff {

/// The most memory that this process is resident with, from here on. The kernel keeps one such mark a process, so there
/// is one of these at a time.
class PeakMemory {
 public:
  PeakMemory();
  /// Nothing where the kernel does not tell, or does not let the mark be set back.
  [[nodiscard]] std::optional<double> bytes() const;

 private:
  bool is_fresh_ = false;
};

}  // namespace twocone::tradeoff
