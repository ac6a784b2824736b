// SPDX-License-Identifier: Apache-2.0
#include "vision/ranging.h"
#include "hal/camera.h"
