// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "apps/config/robot_file.h"
#include "apps/config/yaml/yaml_reader.h"

/// The keys of a robot file's `estimator:`. Private to this folder.
namespace twocone::config {

/// Reads `estimator:` of the outermost mapping and reports errors as the methods of Section do.
void read_estimator(Section& root, EstimatorKeys& keys);

/// Replaces `estimator:` in a robot file that was read without errors. Default values are left out, and so is an empty
/// section.
void set_estimator(YAML::Node& robot, const EstimatorKeys& keys);

}  // namespace twocone::config
