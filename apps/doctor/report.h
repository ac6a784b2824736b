// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace twocone::doctor {

enum class Verdict {
  kOk,
  kWarning,  ///< the robot runs, but not as well as it could, or not always
  kFailed,   ///< the robot does not run so, or not safely
  kNotRun,   ///< nobody knows: `advice` says what the check waits for
};
/// As in the table: ok, warning, failed, not run.
std::string_view to_string(Verdict verdict);

struct Row {
  std::string part;      ///< as in the robot file, without `cameras.`: lower, drive; or files, robot, pair
  std::string check;     ///< what was looked at
  std::string measured;  ///< with units
  Verdict verdict = Verdict::kOk;
  std::string advice{};  ///< what to do; empty: nothing
};

/// What was found, in the order in which it was looked for.
class Report {
 public:
  void add(Row row) { rows_.push_back(std::move(row)); }
  [[nodiscard]] const std::vector<Row>& rows() const { return rows_; }
  [[nodiscard]] std::size_t count(Verdict verdict) const;
  [[nodiscard]] bool has_failed() const { return count(Verdict::kFailed) > 0; }

 private:
  std::vector<Row> rows_;
};

/// Aligned columns no wider than `width` characters (what cannot be broken apart): long cells go on in the next line.
std::string table(const Report& report, std::size_t width = 120);

/// "all 21 checks ok"; "18 ok, 3 warnings, 1 failed, 1 not run".
std::string summary(const Report& report);

}  // namespace twocone::doctor
