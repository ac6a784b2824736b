// SPDX-License-Identifier: Apache-2.0
#include "apps/compare/show/page_style.h"

namespace twocone::compare {

// Neither text holds < or &, so that the page stays well-formed XML.
std::string_view page_style() {
  return R"css(
.headline.long { font-size: clamp(1.15rem, 2.4vw, 1.45rem); max-width: 46em; }
.light { white-space: nowrap; font-weight: 600; }
.light.green { color: var(--good); }
.light.amber { color: var(--amber); }
.light.red { color: var(--red); }
:root { --amber: #8a5a00; --red: #b3160a; }
@media (prefers-color-scheme: dark) { :root { --amber: #e8b24a; --red: #ff7b6b; } }
.sources th, .sources td { vertical-align: top; }
.sources td:nth-child(2), .sources th:nth-child(2), .sources td:nth-child(n+7), .sources th:nth-child(n+7) {
  text-align: left;
}
.sources { font-size: .92rem; }
.sources th, .sources td { padding: .34rem .42rem; }
.stages small { color: var(--soft); margin-right: .6em; }
.stages td, .stages th { vertical-align: top; }
.stages td:last-child, .stages thead th:last-child { text-align: left; white-space: normal; min-width: 9rem; }
.stages td:nth-child(2), .stages th:nth-child(2), .stages td:nth-child(7), .stages th:nth-child(7) {
  text-align: left;
}
.stages .stage th { padding-top: 1rem; color: var(--accent); }
details { margin: .75rem 0; }
summary { cursor: pointer; font-weight: 600; }
.sliders { background: var(--card); border: 1px solid var(--line); border-radius: 8px; padding: 0 0 .7rem;
  position: sticky; top: 0; z-index: 1; }
.sliders label, .sliders span { white-space: nowrap; color: var(--soft); }
.sliders label { min-width: 8.5em; }
.pairs { display: grid; grid-template-columns: 1fr 1fr; gap: .75rem; margin: .75rem 0; }
.pairs figure { margin: 0; }
.pairs figcaption { padding: .4rem .8rem .5rem; }
.over { opacity: var(--real, .5); }
.frame > figure { margin-bottom: .75rem; }
.strips { display: grid; grid-template-columns: 6.5rem 1fr; gap: 2px 0; align-items: center; }
.strips .strip-name { font-size: .88rem; color: var(--soft); padding-left: .8rem; }
.bearings { position: relative; height: 1.3rem; margin-left: 6.5rem; font-size: .8rem; color: var(--soft); }
.bearings span { position: absolute; left: 50%; transform: translateX(-50%); }
.bearings span:first-child { left: 0; transform: none; }
.bearings span:nth-child(2) { left: 25%; }
.bearings span:nth-child(4) { left: 75%; }
.bearings span:last-child { left: auto; right: 0; transform: none; }
.ramp { display: inline-block; width: 10rem; height: .8em; border: 1px solid var(--line); margin: 0 .4em;
  vertical-align: -.05em; }
@media (max-width: 560px) { .bearings span:nth-child(even) { display: none; } }
@media print {
  .sliders { display: none; }
  .ramp { print-color-adjust: exact; -webkit-print-color-adjust: exact; }
}
)css";
}

std::string_view page_script() {
  return R"js(
(function () {
  var blend = document.getElementById("blend");
  if (!blend) { return; }
  function show() { document.documentElement.style.setProperty("--real", Number(blend.value) / 100); }
  blend.disabled = false;
  blend.addEventListener("input", show);
  show();
}());
)js";
}

}  // namespace twocone::compare
