// SPDX-License-Identifier: Apache-2.0
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "apps/tradeoff/output.h"
#include "apps/tradeoff/wording.h"
#include "tests/support/page_data.h"
#include "tests/tradeoff/a_sweep.h"

namespace twocone::tradeoff {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing_support::page_data;

TEST(TradeoffJson, HoldsEverySettingWithTheColumnsOfTheCsv) {
  const Sweep sweep = a_sweep();
  const json all = json::parse(tradeoff_json(sweep));
  ASSERT_EQ(all["settings"].size(), sweep.settings.size());
  const std::string csv = tradeoff_csv(sweep), heads = ",is," + csv.substr(0, csv.find('\n')) + ",";
  for (std::size_t i = 0; i < sweep.settings.size(); ++i) {
    const SettingResult& result = sweep.settings[i];
    const json& setting = all["settings"][i];
    EXPECT_EQ(setting["is"], describe(result.setting));
    EXPECT_EQ(setting["robot_frontier"], result.on_robot_frontier ? 1 : 0);
    EXPECT_EQ(setting["simulation_s"].get<double>(), result.simulation_time_s().value);
    if (result.position_m) {
      EXPECT_EQ(setting["position_mean_high_m"].get<double>(), result.position_m->mean.high);
    }
    for (const auto& [key, value] : setting.items()) EXPECT_THAT(heads, HasSubstr("," + key + ","));
  }
  EXPECT_TRUE(all["settings"].back()["position_mean_m"].is_null()) << "the one that never answers";
  EXPECT_EQ(all["as_is"], *sweep.as_is);
  EXPECT_EQ(all["baseline"], *baseline_of(sweep));
  EXPECT_EQ(all["rules"], rule_sentences());
  EXPECT_EQ(all["growth"], growth_sentences(sweep));
  EXPECT_EQ(all["conclusions"]["size"], conclusions(sweep)[Axis::kSize]);
  EXPECT_EQ(all["paper"]["mean_error_m"], kPaperMeanError_m);
}

TEST(TradeoffJson, WritesAnIntervalWithoutALimitAsNull) {
  Sweep sweep = a_sweep();
  sweep.settings[0].position_m->mean.high = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(json::parse(tradeoff_json(sweep))["settings"][0]["position_mean_high_m"].is_null());
}

TEST(TradeoffPage, HoldsTheJsonTheChoiceAndTheTable) {
  const Sweep sweep = a_sweep();
  const Choice choice{sweep.as_is, {}, "640x480 is confirmed: 0.36 < 0.5 mm"};
  const std::string text = page(sweep, &choice);
  json data = page_data(text);
  EXPECT_EQ(data["page"], "tradeoff");
  EXPECT_EQ(data["choice"]["setting"], *sweep.as_is);
  EXPECT_EQ(data["choice"]["why"], choice.why);
  EXPECT_THAT(text, HasSubstr("the paper's own, 2006: 30 mm, about 2 s a stereo frame"));
  for (const char* key : {"page", "choice"}) data.erase(key);
  EXPECT_EQ(data, json::parse(tradeoff_json(sweep)));
  EXPECT_FALSE(page_data(page(sweep, nullptr)).contains("choice"));
}

TEST(TradeoffPage, NamesCannotEndTheScript) {
  Sweep sweep = a_sweep();
  sweep.robot = "robots/</script><script>alert(1)</script>.yaml";
  sweep.landmarks[0] = "<!-- <script>";
  const std::string text = page(sweep, nullptr);
  EXPECT_EQ(text.find("alert(1)</script"), std::string::npos);
  EXPECT_EQ(page_data(text)["robot"], sweep.robot);
  EXPECT_EQ(page_data(text)["landmarks"][0], sweep.landmarks[0]);
}

TEST(TradeoffPage, IsWrittenForASweepWithoutSettings) {
  EXPECT_EQ(page_data(page({}, nullptr))["settings"], json::array());
}

}  // namespace
}  // namespace twocone::tradeoff
