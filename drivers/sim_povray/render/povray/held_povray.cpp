// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/render/povray/held_povray.h"

#include <sys/stat.h>

#include <algorithm>
#include <cassert>
#include <cerrno>
#include <system_error>
#include <utility>

#include <fmt/format.h>

namespace twocone::sim_povray {
namespace {

/// Last frame of the animation: more than a process lives to render. Its digits are those in the files' names.
constexpr int kLastFrame = 999'999;
constexpr const char* kStale = "twocone: stale pose";

base::Program program_for(const Povray& povray, const ViewTemplate& view_template, int scene_fd, int pose_fd,
                          const std::filesystem::path& folder) {
  if (::mkdir(folder.c_str(), 0700) != 0) throw std::system_error(errno, std::generic_category(), folder.string());
  base::Program program = povray.program(view_template);
  // The clock stands still, so that `clock` has the value that it has in a single image.
  for (const char* option : {"+KFI1", "+KI0", "+KF0"}) program.arguments.emplace_back(option);
  program.arguments.push_back(fmt::format("+KFF{}", kLastFrame));
  program.arguments.push_back(fmt::format("+O{}/f", folder.string()));
  program.inputs = {scene_fd, pose_fd};
  program.output = false;
  program.writable = folder.string();
  return program;
}

PoseLease lease_without_pose(const HeldScene& scene) { return PoseLease(scene.pose_text(-1, "")); }

}  // namespace

HeldScene::HeldScene(const ViewTemplate& view_template) : serial_name_("Twocone_Serial") {
  while (view_template.scene.find(serial_name_) != std::string::npos) serial_name_ += '_';
  // Inserted into the line that exists, so that POV-Ray's line numbers stay those of the scene.
  // Sealed: several processes read it, and a scene could open it for writing.
  fd_ = base::sealed_file(
      "scene.pov",
      with_pose(view_template, fmt::format("#include \"/proc/self/fd/{}\" #if ({} != frame_number) #error \"{}\" #end",
                                           base::kChildInput + 1, serial_name_, kStale)));
}

std::string HeldScene::pose_text(int frame, const std::string& pose) const {
  return fmt::format("#declare {} = {}; {}\n", serial_name_, frame, pose);
}

bool HeldScene::is_stale(const std::string& errors) { return errors.find(kStale) != std::string::npos; }

HeldPovray::HeldPovray(const Povray& povray, const ViewTemplate& view_template, const HeldScene& scene,
                       const std::filesystem::path& folder)
    : scene_(scene),
      folder_(folder),
      lease_(lease_without_pose(scene)),
      leased_(lease_.take()),
      child_(program_for(povray, view_template, scene.fd(), lease_.fd(), folder)) {}

void HeldPovray::enter(State state) {
  state_ = state;
  since_ = std::chrono::steady_clock::now();
}

void HeldPovray::look() {
  if (state_ == State::kDrawing) return;
  if (!leased_) {
    // If POV-Ray opens the file before that, it finds an old pose and stops, and the pool starts another process.
    leased_ = lease_.take();
  } else if (state_ == State::kComing && lease_.wanted()) {
    enter(State::kWaiting);
  }
}

void HeldPovray::draw(Order order) {
  assert(state_ == State::kWaiting);
  const std::string text = scene_.pose_text(frame_, order.job.pose);
  order_ = std::move(order);
  enter(State::kDrawing);
  leased_ = false;
  lease_.give(text);
}

std::filesystem::path HeldPovray::image() const {
  return folder_ / fmt::format("f{:0{}}.ppm", frame_, fmt::formatted_size("{}", kLastFrame));
}

Order HeldPovray::finish() {
  assert(state_ == State::kDrawing);
  ++frame_;
  if (const auto cpu = child_.cpu()) {
    order_->use = {*cpu - cpu_until_last_, order_->job.used ? base::peak_memory_bytes(child_.pid()) : 0};
    cpu_until_last_ = *cpu;
  }
  errors_.clear();  // warnings about the finished frame
  enter(State::kComing);
  look();
  return *std::exchange(order_, std::nullopt);
}

bool HeldPovray::drain_errors() {
  const bool open = base::drain(child_.errors_fd(), errors_);
  base::keep_newest(errors_);
  return open;
}

}  // namespace twocone::sim_povray
