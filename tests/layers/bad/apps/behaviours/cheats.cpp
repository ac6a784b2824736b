// SPDX-License-Identifier: Apache-2.0
#include "hal/clock.h"
#include "hal/robot.h"
