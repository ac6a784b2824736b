// SPDX-License-Identifier: Apache-2.0
#include "hal/pose.h"
#include "hal/robot.h"
