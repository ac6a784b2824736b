// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "apps/compare/comparison.h"

/// The parts of the page that show the results in tables. Each function returns the inner HTML of a section. Private to
/// apps/compare/show.
namespace twocone::compare {

/// Returns the sources: those that differ with advice, then, folded, those that agree and those that are not
/// determined.
std::string causes_html(const Comparison& comparison);

/// Returns the gaps before and after, as bars and as a table.
std::string gaps_html(const Comparison& comparison);

/// Returns the stages with lights and limits.
std::string stages_html(const Comparison& comparison);

}  // namespace twocone::compare
