// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "apps/report/kit/figure.h"
#include "apps/runlog/run_data.h"
#include "apps/runlog/summary/summary.h"

namespace twocone::report {

/// The run that the figures of a report show, and what they are drawn with.
struct Drawing : DrawingTools {
  const runlog::RunData& run;
  const runlog::Summary& summary;
};

}  // namespace twocone::report
