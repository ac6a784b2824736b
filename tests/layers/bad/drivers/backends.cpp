// SPDX-License-Identifier: Apache-2.0
#include "drivers/one/one.h"
#include "drivers/two/two.h"
#include "apps/config/robot_file.h"
