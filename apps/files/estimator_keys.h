// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "apps/files/robot_file.h"
#include "apps/files/yaml_reader.h"

/// The keys of a robot file's `estimator:`. Private to this folder.
namespace twocone::files {

/// Reads `estimator:` of the file's outermost mapping, as Section's calls do.
void read_estimator(Section& root, EstimatorKeys& keys);

/// Gives a robot file that has been read without complaint another `estimator:`; what is as by default is left out, and
/// the section too where nothing is left of it.
void set_estimator(YAML::Node& robot, const EstimatorKeys& keys);

}  // namespace twocone::files
