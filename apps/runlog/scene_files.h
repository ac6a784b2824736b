// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "apps/config/map_file.h"
#include "apps/runlog/run_data.h"

namespace twocone::runlog {

/// Returns the files of a map's scene, by name: the scene, and each file that the scene or one of its .inc or .pov
/// files names in quotes and that lies beside the scene or in the map's `scene_paths:`. POV-Ray's own libraries are
/// left out. The digest is 64-bit FNV-1a. It detects accidental changes and does not protect against forgery.
/// Requires a map that names a scene. A file that cannot be read is left out, because rendering reports it.
std::vector<SourceFile> scene_files(const config::Map& map);

}  // namespace twocone::runlog
