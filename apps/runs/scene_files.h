// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "apps/files/map_file.h"
#include "apps/runs/run_data.h"

namespace twocone::runs {

/// What a map's scene is made of: the scene, and each file that it, or an .inc or .pov among them, names in quotes and
/// that lies beside the scene or in the map's `scene_paths:`. POV-Ray's own libraries are left out. By name; the digest
/// is FNV-1a of 64 bits, which finds what changed by chance, and is no proof against forgery.
/// Requires a map that names a scene. A file that cannot be read is left out: rendering tells of it.
std::vector<SourceFile> scene_files(const files::Map& map);

}  // namespace twocone::runs
