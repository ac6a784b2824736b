// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <memory>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "drivers/sim_povray/simulation.h"
#include "hal/camera.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/value.h"

namespace twocone::sim_povray {

using twocone::testing_support::TemporaryFolder;
using twocone::testing_support::value;

/// Time limit of a rendering. One image takes 0.7 s, in which POV-Ray mostly sleeps; on a loaded machine it takes many
/// times that.
inline constexpr std::chrono::seconds kRenderLimit{60};
/// Time limit of a child. Far more than the start of a shell takes, also on a loaded machine under a sanitizer.
inline constexpr std::chrono::seconds kChildLimit{30};
/// Time-out for a child that would not end.
inline constexpr std::chrono::milliseconds kChildTimeout{300};
inline constexpr CameraSettings kSmallSize{64, 48, 10};

inline std::filesystem::path scene_of_tests(const std::string& name) {
  return std::filesystem::path(TWOCONE_SOURCE_DIR) / "tests/sim_povray/scenes" / name;
}
inline std::filesystem::path lab_scene() { return std::filesystem::path(TWOCONE_SOURCE_DIR) / "scenes/lab.pov"; }

inline std::string read_file(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

/// Opens a camera, and starts it.
inline std::unique_ptr<Camera> streaming(Simulation& simulation, const ViewSettings& view,
                                         const CameraSettings& settings = kSmallSize) {
  auto camera = value(simulation.open_camera(view));
  (void)value(camera->configure(settings));
  value(camera->start());
  return camera;
}

/// State letter and parent of a process, from /proc; state 'X' if there is no such process.
struct ProcessState {
  char state = 'X';
  pid_t parent = 0;
};
inline ProcessState process_state(pid_t pid) {
  const std::string stat = read_file("/proc/" + std::to_string(pid) + "/stat");
  const auto name_end = stat.rfind(')');
  ProcessState result;
  if (name_end == std::string::npos) return result;
  std::istringstream(stat.substr(name_end + 1)) >> result.state >> result.parent;
  return result;
}
/// Returns whether a process runs. A zombie, which only its new parent could reap, counts as dead.
inline bool is_running(pid_t pid) {
  const char state = process_state(pid).state;
  return state != 'X' && state != 'Z';
}

inline std::vector<pid_t> children_of(pid_t parent) {
  std::vector<pid_t> result;
  for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
    const std::string name = entry.path().filename().string();
    if (name.find_first_not_of("0123456789") != std::string::npos) continue;
    const auto pid = pid_t(std::stol(name));
    if (process_state(pid).parent == parent) result.push_back(pid);
  }
  return result;
}

/// Waits until `condition` holds, for at most ten seconds. Every operation of these tests takes far less.
template <typename Condition>
bool eventually(Condition condition) {
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(10);
  while (!condition()) {
    if (std::chrono::steady_clock::now() > deadline) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return true;
}

}  // namespace twocone::sim_povray
