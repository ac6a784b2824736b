// SPDX-License-Identifier: Apache-2.0
#include "apps/doctor/advice.h"

#include <algorithm>
#include <array>

namespace twocone::doctor {
namespace {

struct Advice {
  ErrorCode code;
  const char* camera;
  const char* drive;
};

constexpr const char* kDisconnected = "it was disconnected: check cable, hub, power";
constexpr const char* kInstall = "install the missing software";
constexpr const char* kOtherMode = "see the message; request a mode that it has";
constexpr const char* kSeeMessage = "see the message";

constexpr std::array kAdvice{
    Advice{ErrorCode::kNotFound, "plug it in; twocone devices lists the available names",
           "plug it in; twocone devices lists the available ports"},
    Advice{ErrorCode::kUnavailable, kInstall, kInstall},
    Advice{ErrorCode::kInvalidState, kOtherMode, kSeeMessage},
    Advice{ErrorCode::kTimeout, "it is connected but sends nothing: check cable, hub, power",
           "check protocol, baud, the controller's power, the cable's RX and TX"},
    Advice{ErrorCode::kDisconnected, kDisconnected, kDisconnected},
    Advice{ErrorCode::kBadData, "its data are no image: check cable and hub",
           "check protocol and baud; keep the cable away from the motors' wires"},
    Advice{ErrorCode::kCancelled, kOtherMode, kSeeMessage},
    Advice{ErrorCode::kRefused, kOtherMode, kSeeMessage},
};

const Advice& advice_for(ErrorCode code) {
  return *std::find_if(kAdvice.begin(), kAdvice.end(), [code](const Advice& a) { return a.code == code; });
}

}  // namespace

std::string camera_advice(ErrorCode code) { return advice_for(code).camera; }
std::string drive_advice(ErrorCode code) { return advice_for(code).drive; }

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

Row drive_failed(const std::string& check, const Error& error) {
  return failed_row("drive", check, error, drive_advice(error.code));
}

}  // namespace twocone::doctor
