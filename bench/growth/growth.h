// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "drivers/sim_povray/sim_povray.h"
#include "hal/result.h"
#include "vision/ranging.h"

/// How times grow with what there is more of.
namespace twocone::bench {

struct Options {
  int repeats = 5;
  int processes = sim_povray::RenderSettings{}.processes;  ///< for robots
  std::filesystem::path scratch;                           ///< an empty folder
};

/// One thing that was measured.
struct Column {
  std::string name;                          ///< with its unit
  int digits = 2;                            ///< behind the point
  std::vector<std::vector<double>> repeats;  ///< for each size, its repeats
  bool grows = true;                         ///< it gets an exponent
};

struct Growth {
  std::string title;
  std::string what;                 ///< how it was measured, a sentence or two
  std::string size_name;            ///< "robots"
  std::vector<double> sizes;        ///< that the exponents belong to
  std::vector<std::string> labels;  ///< of the sizes, as printed
  std::vector<Column> columns;
};

/// A table as markdown: each cell the median with the lowest and the highest of its repeats; then the exponents
/// of the medians with their intervals, and those between the last two sizes, where what is paid once weighs least.
std::string markdown(const Growth& growth);

Growth grow_robots(const Options& options);
/// The same where no view has to give its process up to another.
Growth grow_robots_with_a_process_a_view(Options options);
/// What other robots in the room do to a robot's fixes.
Growth grow_error_by_robots(const Options& options);
Growth grow_frames(const Options& options);
Growth grow_pixels(const Options& options);
Growth grow_vision_landmarks(const Options& options);
Growth grow_localisation_landmarks(const Options& options);

/// A run of so many frames in this process, alone; one line of figures for grow_frames() on standard output.
void run_alone(int frames, const std::filesystem::path& scratch);

// ---- for the parts

/// What puts an object of a scene, made about the origin, there; the scene has lab.pov's or room.inc's W().
std::string standing_at(const Pose2& pose);
/// A robot there, of the parts of scenes/parts/robot.inc. @param first_line its `//*PMName`, or nothing
std::string robot_at(const Pose2& pose, const std::string& first_line = "");

/// The cameras `lower` and `upper`, streaming.
std::vector<std::unique_ptr<Camera>> start_pair(sim_povray::Simulation& simulation, const CameraSettings& settings,
                                                int antialias = 1);

/// How many landmarks have a range.
int ranged(const std::vector<vision::RangeMeasurement>& measurements);

double wall_s();        ///< of the steady clock
double thread_cpu_s();  ///< of the calling thread
double median(std::vector<double> values);

template <typename T>
T value(Result<T> result) {
  if (!result) throw std::runtime_error(result.error().message);
  return std::move(*result);
}

}  // namespace twocone::bench
