// SPDX-License-Identifier: Apache-2.0
#include "hal/result.h"

namespace twocone {

std::string_view to_string(ErrorCode code) {
  switch (code) {
    case ErrorCode::kNotFound:
      return "NotFound";
    case ErrorCode::kUnavailable:
      return "Unavailable";
    case ErrorCode::kInvalidState:
      return "InvalidState";
    case ErrorCode::kTimeout:
      return "Timeout";
    case ErrorCode::kDisconnected:
      return "Disconnected";
    case ErrorCode::kBadData:
      return "BadData";
    case ErrorCode::kCancelled:
      return "Cancelled";
    case ErrorCode::kRefused:
      return "Refused";
  }
  assert(false);
  return "";
}

}  // namespace twocone
