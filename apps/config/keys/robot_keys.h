// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include "apps/config/robot_file.h"
#include "apps/config/yaml/yaml_reader.h"

/// The keys of a robot file, section by section. Private to this folder. The functions report errors as the methods of
/// Section do, and those that change a file require one that was read without errors.
namespace twocone::config {

// ---- rig

/// Reads `rig:` of the outermost mapping. It stores the paths of `camera_info` and does not read these files.
/// @param file the folder of this file is the base of relative paths
void read_rig(Section& root, const std::filesystem::path& file, Rig& rig);

/// Reads `sigma:` of `drive:`.
void read_wheel_sigma(Section& drive_section, Drive& drive);

/// Returns `sigma:` of `rig:` or `drive:` as it is written; 0 if all of them are.
YAML::Node sigma_of(const RigSigma& sigma);
YAML::Node sigma_of(const WheelSigma& sigma);

/// Makes the path of each `camera_info` and of `calibration` absolute. @param file named when the robot was read
void make_rig_paths_absolute(YAML::Node& robot, const std::filesystem::path& file);

/// Reads the lens data of `view.camera_info`, a camera calibration, into `view`: a ROS camera_info YAML file, as
/// `camera_calibration` and the OpenCV tools write it. A file without coefficients, or with zeros, is of a lens without
/// distortion.
///
/// The model is plumb_bob (4 or 5 coefficients) or rational_polynomial (4, 5 or 8). Rectification, projection, binning
/// and region of interest are accepted and not used, because the mirror model replaces them. A skewed pixel grid is
/// rejected.
/// @param camera the camera to which the file must belong. @param name of that camera, for messages: "cameras.lower of
/// robots/lab.yaml"
/// @throws FileError with one line for each bad key, as read_robot
void read_camera_info(const drivers::CameraPart& camera, const std::string& name, RigView& view);

// ---- effects: those of the simulated body, `effects.camera` for all cameras, `cameras.NAME.effects` for one

/// Reads the keys of `effects:` except `camera`. Returns the section `camera`, with the effects that all cameras share,
/// or null.
Section* read_effects(Section& root, Effects& effects);

/// Overwrites `effects` with the keys that are present. Returns whether all of them were valid.
bool read_camera_effects(Section& section, sim_povray::CameraEffects& effects);

/// Complains about valid values that contradict each other in one camera. The complaint goes to the section that has
/// the key; the camera's own section comes before the common one. Either may be null. @param rate_hz of the camera, if
/// known
void check_camera_effects(const sim_povray::CameraEffects& effects, Section* own, Section* common,
                          std::optional<double> rate_hz);

/// Complains about keys that have no effect, because none of the sections has the key on which they depend.
void check_unneeded_keys(std::span<Section* const> sections);

/// Writes the keys of `effects:`, except `camera`, that differ from `read`. Default values are left out, and so is an
/// empty section.
void set_effects(YAML::Node& robot, const Effects& changed, const Effects& read);

/// Writes the keys of `cameras.NAME.effects` that differ from `read`. Values of `effects.camera` are not repeated,
/// except for keys on which others depend. @param file named in messages
/// @throws FileError if the effects of a real camera differ
void set_camera_effects(YAML::Node& robot, const std::string& name, const drivers::CameraPart& changed,
                        const drivers::CameraPart& read, const std::filesystem::path& file);

// ---- drive and cameras: the keys of real devices, which must be absent for all other drivers

/// Reads device, format and controls of a camera. The driver must be set.
void read_camera_device(Section& section, drivers::CameraPart& camera);
/// Reads protocol, port and the other keys of a drive. The driver must be set.
void read_serial_drive(Section& section, Drive& drive);

// ---- estimator

/// Reads `estimator:` of the outermost mapping.
void read_estimator(Section& root, EstimatorKeys& keys);

/// Replaces `estimator:`. Default values are left out, and so is an empty section.
void set_estimator(YAML::Node& robot, const EstimatorKeys& keys);

// ---- the start of a written file

/// Returns lines as comments. A line break inside one of them does not end the comment.
std::string comments(const std::vector<std::string>& lines);

// ---- numbers as YAML

/// Returns the shortest text that reads back as the same number.
inline std::string text_of(double number) { return fmt::format("{}", number); }
/// Returns a list in flow style: `[1, 2.5]`.
inline YAML::Node list_of(std::span<const double> numbers) {
  YAML::Node list(YAML::NodeType::Sequence);
  list.SetStyle(YAML::EmitterStyle::Flow);
  for (const double number : numbers) list.push_back(text_of(number));
  return list;
}

}  // namespace twocone::config
