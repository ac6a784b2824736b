// SPDX-License-Identifier: Apache-2.0
#include "apps/doctor/advice.h"

namespace twocone::doctor {

std::string camera_advice(ErrorCode code) {
  switch (code) {
    case ErrorCode::kNotFound:
      return "plug it in; twocone devices lists the available names";
    case ErrorCode::kUnavailable:
      return "install the missing software";
    case ErrorCode::kInvalidState:
    case ErrorCode::kCancelled:
    case ErrorCode::kRefused:
      return "see the message; request a mode that it has";
    case ErrorCode::kTimeout:
      return "it is connected but sends nothing: check cable, hub, power";
    case ErrorCode::kDisconnected:
      return "it was disconnected: check cable, hub, power";
    case ErrorCode::kBadData:
      return "its data are no image: check cable and hub";
  }
  return "";
}

std::string drive_advice(ErrorCode code) {
  switch (code) {
    case ErrorCode::kNotFound:
      return "plug it in; twocone devices lists the available ports";
    case ErrorCode::kUnavailable:
      return "install the missing software";
    case ErrorCode::kInvalidState:
    case ErrorCode::kCancelled:
    case ErrorCode::kRefused:
      return "see the message";
    case ErrorCode::kTimeout:
      return "check protocol, baud, the controller's power, the cable's RX and TX";
    case ErrorCode::kDisconnected:
      return "it was disconnected: check cable, hub, power";
    case ErrorCode::kBadData:
      return "check protocol and baud; keep the cable away from the motors' wires";
  }
  return "";
}

Row failed_row(const std::string& part, const std::string& check, const Error& error, const std::string& advice) {
  std::string message = error.message;
  for (const std::string& name : {"cameras." + part + ": ", part + ": "}) {
    if (message.starts_with(name)) message.erase(0, name.size());
  }
  if (const auto end = message.find("; "); error.code == ErrorCode::kRefused && end != std::string::npos) {
    return {part, check, message.substr(0, end), Verdict::kFailed, message.substr(end + 2)};
  }
  return {part, check, message, Verdict::kFailed, advice};
}

}  // namespace twocone::doctor
