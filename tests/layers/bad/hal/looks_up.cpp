// SPDX-License-Identifier: Apache-2.0
#include <chrono>

#include "hal/camera.h"
#include "vision/mirror_view.h"
