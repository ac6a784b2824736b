// SPDX-License-Identifier: Apache-2.0
#include "drivers/backends.h"
#include "drivers/sim_povray/world/world.h"
#include "robot_file.h"
#include ROBOT_FILE
#include <opencv2/imgcodecs.hpp>
