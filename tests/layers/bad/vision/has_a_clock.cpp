// SPDX-License-Identifier: Apache-2.0
#include <chrono>
#include <opencv2/core.hpp>
