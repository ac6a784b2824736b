// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

namespace twocone::tradeoff {

/// The peak of this process's resident memory since construction. The kernel keeps one such mark for each process, so
/// only one object may exist at a time.
class PeakMemory {
 public:
  PeakMemory();
  /// Returns nothing where the kernel does not report the peak or does not allow its reset.
  [[nodiscard]] std::optional<double> bytes() const;

 private:
  bool is_fresh_ = false;
};

}  // namespace twocone::tradeoff
