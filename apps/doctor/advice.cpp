// SPDX-License-Identifier: Apache-2.0
#include "apps/doctor/advice.h"

namespace twocone::doctor {

std::string camera_advice(ErrorCode code) {
  switch (code) {
    case ErrorCode::kNotFound:
      return "plug it in; twocone devices lists the names that there are";
    case ErrorCode::kUnavailable:
      return "install what is missing";
    case ErrorCode::kInvalidState:
    case ErrorCode::kRefused:
      return "see what it says; ask for what it has";
    case ErrorCode::kTimeout:
      return "it is there but sends nothing: cable, hub, power";
    case ErrorCode::kDisconnected:
      return "it went away: cable, hub, power";
    case ErrorCode::kBadData:
      return "what comes is no picture: cable, hub";
  }
  return "";
}

std::string drive_advice(ErrorCode code) {
  switch (code) {
    case ErrorCode::kNotFound:
      return "plug it in; twocone devices lists the ports that there are";
    case ErrorCode::kUnavailable:
      return "install what is missing";
    case ErrorCode::kInvalidState:
    case ErrorCode::kRefused:
      return "see what it says";
    case ErrorCode::kTimeout:
      return "protocol, baud, the controller's power, the cable's RX and TX";
    case ErrorCode::kDisconnected:
      return "it went away: cable, hub, power";
    case ErrorCode::kBadData:
      return "protocol and baud; the cable beside the motors' wires";
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
