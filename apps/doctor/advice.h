// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "apps/doctor/report.h"
#include "hal/result.h"

namespace twocone::doctor {

/// What a person can do about an error of a camera, or of a drive.
std::string camera_advice(ErrorCode code);
std::string drive_advice(ErrorCode code);

/// A failed row that tells of an error: the part's name, which messages begin with, is not told twice.
Row failed_row(const std::string& part, const std::string& check, const Error& error, const std::string& advice);

}  // namespace twocone::doctor
