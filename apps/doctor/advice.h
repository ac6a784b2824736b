// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "apps/doctor/report.h"
#include "hal/result.h"

namespace twocone::doctor {

/// What a person can do about an error of a camera, or of a drive; of a refusal only in general, since it has many
/// causes.
std::string camera_advice(ErrorCode code);
std::string drive_advice(ErrorCode code);

/// A failed row that tells of an error: the part's name, which messages begin with, is not told twice. A refusal's
/// message says behind a semicolon what to do about its own cause: that is the row's advice then, and not `advice`.
Row failed_row(const std::string& part, const std::string& check, const Error& error, const std::string& advice);

}  // namespace twocone::doctor
