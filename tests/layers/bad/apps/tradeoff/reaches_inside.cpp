// SPDX-License-Identifier: Apache-2.0
#include "apps/report/kit/plain_text.h"
#include "apps/report/report.h"
