// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "drivers/sim_povray/simulation.h"
#include "tests/support/value.h"
#include "vision/ranging.h"

/// Measures how times grow with the number of robots, frames, pixels and landmarks.
namespace twocone::bench {

struct Options {
  int repeats = 5;
  int processes = sim_povray::RenderSettings{}.processes;  ///< for robots
  std::filesystem::path scratch;                           ///< an empty folder
};

/// One measured quantity.
struct Column {
  std::string name;                          ///< with its unit
  int digits = 2;                            ///< after the decimal point
  std::vector<std::vector<double>> repeats;  ///< for each size, its repeats
  bool grows = true;                         ///< it gets an exponent
};

struct Growth {
  std::string title;
  std::string what;                 ///< the method of measurement, a sentence or two
  std::string size_name;            ///< "robots"
  std::vector<double> sizes;        ///< to which the exponents belong
  std::vector<std::string> labels;  ///< of the sizes, as printed
  std::vector<Column> columns;
};

/// Returns the table as markdown: each cell is the median with the lowest and the highest of its repeats. Then follow
/// the exponents of the medians with their intervals, and those between the last two sizes, where fixed costs matter
/// least.
std::string markdown(const Growth& growth);

Growth grow_robots(const Options& options);
/// Measures as grow_robots(), but with a process for each view, so no view has to give up its process to another.
Growth grow_robots_with_a_process_a_view(Options options);
/// Measures the effect of other robots in the room on a robot's fixes.
Growth grow_error_by_robots(const Options& options);
Growth grow_frames(const Options& options);
Growth grow_pixels(const Options& options);
Growth grow_objects(const Options& options);
Growth grow_vision_landmarks(const Options& options);
Growth grow_localisation_landmarks(const Options& options);

/// Runs this number of frames in this process alone and prints one line of figures for grow_frames() on standard
/// output.
void run_alone(int frames, const std::filesystem::path& scratch);

// ---- for the parts

/// Returns the scene text that moves an object, made about the origin, to that pose. The scene must have the W() of
/// lab.pov or room.inc.
std::string standing_at(const Pose2& pose);
/// Returns the scene text of a robot at that pose, made from the parts in scenes/parts/robot.inc.
/// @param first_line its `//*PMName`, or nothing
std::string robot_at(const Pose2& pose, const std::string& first_line = "");

/// Opens the cameras `lower` and `upper` and starts them.
std::vector<std::unique_ptr<Camera>> start_pair(sim_povray::Simulation& simulation, const CameraSettings& settings,
                                                int antialias = 1);

/// Returns the number of landmarks with a range.
int ranged(const std::vector<vision::RangeMeasurement>& measurements);

double wall_s();        ///< returns the time of the steady clock
double thread_cpu_s();  ///< returns the processor time of the calling thread
double median(std::vector<double> values);

using testing_support::value;

}  // namespace twocone::bench
