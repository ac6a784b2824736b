// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "apps/as_built/as_built.h"

/// Private to this folder.
namespace twocone::as_built {

/// Returns the scene's text about the robot, its two cameras and the landmarks, for the end of a scene. It depends on
/// no declaration and no #default of that scene.
std::string scene_text(const AsBuilt& drawn);

}  // namespace twocone::as_built
