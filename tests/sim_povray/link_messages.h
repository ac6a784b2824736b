// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "drivers/sim_povray/server/protocol.h"

namespace twocone::sim_povray::server {

/// Returns at least one message of each kind. No field has its default, so that an omitted field is noticed.
inline std::vector<Message> sample_messages() {
  SessionSettings session{.name = "2",
                          .body = {"robot.2",
                                   {1.5, -2.25, 0.7},
                                   0.21,
                                   {0.31, 0.052, 0.013, 2.2, 1024, 0.11},
                                   std::chrono::nanoseconds(412),
                                   Physics{4.9, 0.77, 0.29},
                                   0xfedcba9876543210,
                                   Pose2{-0.4, 1.25, 2.6}},
                          .drive = {9.5, std::chrono::nanoseconds(399)},
                          .run_ahead_frames = 7};
  SessionSettings without_physics = session;
  without_physics.body.physics.reset();
  const CameraEffects effects{1.1,
                              20000,
                              12,
                              0.3,
                              0.8,
                              0.011,
                              0.013,
                              9,
                              {0.1, -0.2, 0.003, 0.004, 0.05},
                              333.0,
                              0.015,
                              0.025,
                              0.035,
                              {1.07, 0.96, 0.91},
                              0.045,
                              83};
  const SessionState state{41, std::chrono::nanoseconds(2733), {0.1, 0.2, -0.3}, 4.5, 5.5, "landmark red"};
  return {Hello{kMagic + 1, kVersion + 6, "twocone 9.9"},
          Failed{ErrorCode::kTimeout, "robot.2 has not asked"},
          Take{session},
          Take{without_physics},
          OpenView{{"upper", 3, effects}},
          ConfigureView{1, {321, 241, 14.5}},
          ReleaseView{3},
          Step{std::chrono::nanoseconds(1'234'567)},
          ImageOrder{77, 1, 5},
          Command{{1.25, -0.75}},
          Halt{},
          Leave{},
          Sessioned{state},
          Stepped{state},
          ViewOpened{2},
          ViewConfigured{8, 921600},
          Done{},
          ImageDone{78, PixelFormat::kGrey8},
          ImageFailed{79, ErrorCode::kRefused, "scene.pov:3: POV-Ray: ..."}};
}

}  // namespace twocone::sim_povray::server
