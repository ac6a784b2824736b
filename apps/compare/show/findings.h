// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "apps/compare/comparison.h"

/// The page's parts that say in tables what was found. Each gives the inner HTML of a section. Private to
/// apps/compare/show.
namespace twocone::compare {

/// Sources: those that differ first, what to change, then, folded, those that agree and those that cannot be told.
std::string causes_html(const Comparison& comparison);

/// Gaps before and after as bars and as a table.
std::string gaps_html(const Comparison& comparison);

/// Stage by stage with lights and limits.
std::string stages_html(const Comparison& comparison);

}  // namespace twocone::compare
