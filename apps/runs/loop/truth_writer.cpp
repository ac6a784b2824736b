// SPDX-License-Identifier: Apache-2.0
#include "apps/runs/loop/truth_writer.h"

#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "apps/config/to_layers.h"
#include "apps/runlog/tables/tables.h"

namespace twocone::runs {

Result<TruthWriter> TruthWriter::open(const config::Robot& robot, const config::Map& map,
                                      const drivers::RobotSettings& settings) {
  if (!settings.world || !settings.world->attach.empty()) {
    return Error{
        ErrorCode::kRefused,
        fmt::format("{}: --truth needs a simulated world inside this program: only that knows where everything "
                    "is",
                    robot.file.string())};
  }
  auto object = sim_povray::claimed_object(settings.world->place, settings.world->session.name);
  if (!object) return object.error();
  TruthWriter writer;
  writer.robot_ = &robot;
  writer.place_ = settings.world->place;
  writer.object_ = *object;
  writer.ending_ = object->substr(std::string_view("robot").size());
  writer.landmarks_ = map.landmarks;
  return writer;
}

Status TruthWriter::write(const std::filesystem::path& run, const runlog::FrameRecord& record,
                          const StereoFrame& frame) const {
  const runlog::PoseRow& now = *record.truth;
  const sim_povray::MovedBlock robot{object_, config::to_start_pose(*robot_), {now.x_m, now.y_m, now.heading_rad}};
  const auto others = sim_povray::moved_blocks(place_, frame.lower.header().captured.since_zero);
  for (const auto& [view, camera] : {std::pair{"lower", &robot_->lower}, {"upper", &robot_->upper}}) {
    const auto pixels = sim_povray::reflected_truth(
        place_, robot, {view + ending_, camera->width_px, camera->height_px}, landmarks_, others);
    if (!pixels) return pixels.error();
    runlog::write_truth(runlog::truth_file(run, view, record.frame.frame), *pixels, landmarks_);
  }
  return {};
}

}  // namespace twocone::runs
