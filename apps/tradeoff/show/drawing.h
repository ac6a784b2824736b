// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "apps/report/kit/figure.h"
#include "apps/tradeoff/choice.h"
#include "apps/tradeoff/show/plane.h"

namespace twocone::tradeoff {

/// Returns the image as a plot for gnuplot. @param choice marked; may be null
report::Plot drawing_of(const Sweep& sweep, const Plane& plane, const Choice* choice);

}  // namespace twocone::tradeoff
