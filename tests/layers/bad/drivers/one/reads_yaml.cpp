// SPDX-License-Identifier: Apache-2.0
#include "drivers/one/one.h"
#include "hal/camera.h"

#include <yaml-cpp/yaml.h>
