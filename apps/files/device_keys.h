// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "apps/files/robot_file.h"
#include "apps/files/yaml_reader.h"

/// The keys of real devices; for other drivers they must be absent.
namespace twocone::files {

/// device, format and controls of a camera whose driver is known.
void read_camera_device(Section& section, CameraEntry& camera);
/// protocol, port and so on, of a drive whose driver is known.
void read_serial_drive(Section& section, Drive& drive);

}  // namespace twocone::files
