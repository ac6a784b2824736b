// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "hal/result.h"

namespace twocone::doctor {

enum class Verdict {
  kOk,
  kWarning,  ///< the robot works, but not always or not as well as it could
  kFailed,   ///< the robot does not work in this state, or not safely
  kNotRun,   ///< the result is unknown: `advice` states what the check needs
};
using enum Verdict;
/// Returns the verdict as printed in the table: ok, warning, failed, not run.
std::string_view to_string(Verdict verdict);

struct Row {
  std::string part;      ///< as in the robot file, without `cameras.`: lower, drive; or files, robot, pair
  std::string check;     ///< the property that was checked
  std::string measured;  ///< with units
  Verdict verdict = kOk;
  std::string advice{};  ///< what to do; empty: nothing is necessary

  void judge(Verdict new_verdict, std::string new_advice) {
    verdict = new_verdict;
    advice = std::move(new_advice);
  }
};

/// Return what a user can do about an error of a camera or of a drive. For kRefused the advice is general, because this
/// error has many causes.
std::string camera_advice(ErrorCode code);
std::string drive_advice(ErrorCode code);

/// Returns a failed row for an error. The part's name at the beginning of the message is left out. If the message of
/// kRefused has a semicolon, the text after it states what to do, and replaces `advice` in the row.
Row failed_row(const std::string& part, const std::string& check, const Error& error, const std::string& advice);

/// Like failed_row, for the drive and with drive_advice().
Row drive_failed(const std::string& check, const Error& error);

/// The results, in the order of the checks.
class Report {
 public:
  void add(Row row) { rows_.push_back(std::move(row)); }
  /// Sets the row's part and adds the row. For checks that several parts share.
  void add(const std::string& part, Row row) {
    row.part = part;
    add(std::move(row));
  }
  [[nodiscard]] const std::vector<Row>& rows() const { return rows_; }
  [[nodiscard]] std::size_t count(Verdict verdict) const;
  [[nodiscard]] bool has_failed() const { return count(kFailed) > 0; }

 private:
  std::vector<Row> rows_;
};

/// Returns aligned columns of at most `width` characters (except words that cannot be broken). Long cells continue in
/// the next line.
std::string table(const Report& report, std::size_t width = 120);

/// Returns "all 21 checks ok" or "18 ok, 3 warnings, 1 failed, 1 not run".
std::string summary(const Report& report);

}  // namespace twocone::doctor
