// SPDX-License-Identifier: Apache-2.0
// Compares thousands of generated cases of every numerical function with 50 digits: the error is at most a small number
// times the effect of one rounding by the problem's own condition.
#include <iostream>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/numerics/judge.h"
#include "tests/support/cases.h"

namespace twocone::exact {
namespace {

constexpr int kUsual = 500;  // of 2000

class Generated : public testing::TestWithParam<std::pair<std::string, Measure>> {};

TEST_P(Generated, AgreesWithFiftyDigits) {
  for (const Record& r : GetParam().second(testing_support::cases(kUsual))) {
    std::cout << fmt::format("{:55} {:5} cases, worst error / (condition eps) {:8.3g} of at most {:3} ({})\n",
                             r.function, r.cases, r.worst, r.bound, r.cases_of);
    EXPECT_LE(r.worst, r.bound) << r.function << ": error " << r.worst_error << ", condition " << r.worst_growth << ", "
                                << r.worst_case;
    EXPECT_GE(r.cases, testing_support::cases(kUsual) / 50) << r.function << ": too few cases had an answer";
  }
}

INSTANTIATE_TEST_SUITE_P(, Generated, testing::ValuesIn(measures()),
                         [](const auto& group) { return group.param.first; });

}  // namespace
}  // namespace twocone::exact
