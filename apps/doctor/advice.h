// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "apps/doctor/report.h"
#include "hal/result.h"

namespace twocone::doctor {

/// Return what a user can do about an error of a camera or of a drive. For a refusal the advice is general, since it
/// has many causes.
std::string camera_advice(ErrorCode code);
std::string drive_advice(ErrorCode code);

/// Returns a failed row for an error. The part's name at the beginning of the message is left out. The message of a
/// refusal states, after a semicolon, what to do about its own cause: then that is the row's advice instead of
/// `advice`.
Row failed_row(const std::string& part, const std::string& check, const Error& error, const std::string& advice);

/// The same for the drive, with drive_advice().
Row drive_failed(const std::string& check, const Error& error);

}  // namespace twocone::doctor
