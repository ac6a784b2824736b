// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "apps/config/robot_file.h"
#include "apps/config/yaml/yaml_reader.h"

/// The keys of real devices. They must be absent for all other drivers.
namespace twocone::config {

/// Reads device, format and controls of a camera. The driver must be set.
void read_camera_device(Section& section, CameraEntry& camera);
/// Reads protocol, port and the other keys of a drive. The driver must be set.
void read_serial_drive(Section& section, Drive& drive);

}  // namespace twocone::config
