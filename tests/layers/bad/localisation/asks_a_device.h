// SPDX-License-Identifier: Apache-2.0
#include "hal/camera.h"
#include "vision/ranging.h"
