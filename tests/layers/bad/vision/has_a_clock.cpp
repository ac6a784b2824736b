// SPDX-License-Identifier: Apache-2.0
#include <opencv2/core.hpp>
#include <chrono>
