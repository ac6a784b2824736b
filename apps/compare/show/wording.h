// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "apps/compare/comparison.h"

/// What the page says in words and numbers. Plain text unless said otherwise. Private to apps/compare/show.
namespace twocone::compare {

/// Four digits that count; an en dash for nothing and for what is not finite.
std::string plain_number(std::optional<double> value);

/// `value` to the last digit of `sigma` that counts.
std::string to_precision_of(double sigma, double value);

/// "+2.00 ± 0.10"; without a finite sigma > 0 the value alone. @param value with its sign
std::string with_sigma(double value, double sigma);

/// "62 %", "−3 %", "< 1 %".
std::string percent(double share);

/// "0.004", "1e-09", "< 1e-99".
std::string chance(double p_value);

/// A component's name without what its source's name says already, nor its unit: "rim radius".
std::string short_name(const Source& source, const Component& component);

/// Those that differ, the one that explains most of any gap first.
std::vector<const Source*> sources_by_share(const Comparison& comparison);
std::vector<const Source*> sources_of(const Comparison& comparison, SourceVerdict verdict);

/// "Differs: ..." or "No difference found.", each with its most certain component.
std::string headline(const Comparison& comparison);
/// How many were tested and not found, and how many cannot be told; empty where there are none.
std::string headline_rest(const Comparison& comparison);

/// HTML: shape, colour and word.
std::string light_html(Light light);

}  // namespace twocone::compare
