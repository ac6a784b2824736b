// SPDX-License-Identifier: Apache-2.0
#include "apps/report/kit/html.h"

namespace twocone::report {

// Neither text holds < or &, so that the page stays well-formed XML.
std::string_view style() {
  return R"css(
:root {
  color-scheme: light dark;
  --page: #f4f5f6; --card: #ffffff; --ink: #1d2329; --soft: #5a646e; --line: #dfe3e6; --accent: #0b5cad;
  --good: #0a7a55; --bad: #b3400a;
}
@media (prefers-color-scheme: dark) {
  :root {
    --page: #14181b; --card: #1d2327; --ink: #e7eaec; --soft: #9ea8b0; --line: #343c42; --accent: #7db8f0;
    --good: #52c79b; --bad: #f08a52;
  }
}
* { box-sizing: border-box; }
html { -webkit-text-size-adjust: 100%; }
body { margin: 0; background: var(--page); color: var(--ink);
  font: 16px/1.55 system-ui, -apple-system, "Segoe UI", "Noto Sans", "DejaVu Sans", sans-serif; }
main { max-width: 1120px; margin: 0 auto; padding: 2rem 1.25rem 4rem; }
h1 { font-size: 1.05rem; font-weight: 600; color: var(--soft); margin: 0; overflow-wrap: anywhere; }
h2 { font-size: 1.3rem; margin: 0 0 .75rem; }
p { margin: .5rem 0; max-width: 76ch; }
a { color: var(--accent); }
.headline {
  font-size: clamp(1.4rem, 3.2vw, 2rem); line-height: 1.25; font-weight: 650; margin: .35rem 0 .5rem;
  max-width: 34em;
}
.soft { color: var(--soft); }
nav { display: flex; flex-wrap: wrap; gap: .25rem 1.1rem; margin: 1rem 0 1.25rem; font-size: .95rem; }
section { margin: 2.5rem 0 0; }
.warning { border-left: 4px solid var(--bad); background: var(--card); padding: .6rem 1rem; border-radius: 6px; }
.tiles { display: grid; grid-template-columns: repeat(auto-fit, minmax(165px, 1fr)); gap: .75rem; }
.tile { background: var(--card); border: 1px solid var(--line); border-radius: 8px; padding: .8rem 1rem; }
.tile b {
  display: block; white-space: nowrap; font-size: 1.5rem; line-height: 1.2; font-weight: 650;
  font-variant-numeric: tabular-nums;
}
.tile span { display: block; font-size: .88rem; color: var(--soft); }
.rules {
  display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 320px), 1fr)); gap: .25rem 2rem;
  margin: 0 0 1rem;
}
.rules p { font-size: .95rem; }
.met { color: var(--good); font-weight: 600; }
.unmet { color: var(--bad); font-weight: 600; }
.scroll {
  overflow-x: auto; background: var(--card); border: 1px solid var(--line); border-radius: 8px; margin: .75rem 0;
  padding: .25rem .75rem .5rem;
}
table { border-collapse: collapse; width: 100%; font-variant-numeric: tabular-nums; font-size: .95rem; }
caption { text-align: left; font-weight: 600; padding: .6rem .35rem .35rem; }
th, td { padding: .34rem .55rem; text-align: right; white-space: nowrap; border-top: 1px solid var(--line); }
thead th { color: var(--soft); font-weight: 500; border-top: 0; }
th:first-child { text-align: left; font-weight: 600; }
thead th[colspan] { text-align: center; border-bottom: 1px solid var(--line); }
tbody th { white-space: normal; overflow-wrap: anywhere; min-width: 6rem; }
.words th, .words td { text-align: left; }
.words td { white-space: normal; }
.swatch {
  display: inline-block; width: .8em; height: .8em; border-radius: 50%; border: 1px solid var(--soft);
  margin-right: .5em;
}
.share {
  display: flex; height: 1.05rem; min-width: 220px; border-radius: 4px; overflow: hidden; background: var(--line);
}
.share i { display: block; height: 100%; }
.legend {
  display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 340px), 1fr)); gap: .1rem 1.5rem;
  font-size: .9rem; color: var(--soft); margin: .5rem 0;
}
.legend b { color: var(--ink); font-weight: 600; }
.legend .swatch { border-radius: 3px; border: 0; margin-right: .4em; }
.figures { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 480px), 1fr)); gap: 1rem; }
figure { margin: 0; background: var(--card); border: 1px solid var(--line); border-radius: 8px; overflow: hidden; }
figure.wide { grid-column: 1 / -1; }
figure svg { display: block; width: 100%; height: auto; max-height: 780px; background: #ffffff; }
figure svg text { font-family: system-ui, -apple-system, "Segoe UI", "Noto Sans", "DejaVu Sans", sans-serif; }
figcaption { padding: .7rem 1rem .9rem; font-size: .93rem; color: var(--soft); overflow-wrap: anywhere; }
figcaption strong { color: var(--ink); }
#views_unwrapped svg { max-height: none; }
.slider { display: flex; align-items: center; gap: 1rem; padding: .7rem 1rem 0; }
.slider input { flex: 1; }
.slider output { min-width: 13em; font-variant-numeric: tabular-nums; }
.frame[hidden] { display: none; }
pre {
  background: var(--card); border: 1px solid var(--line); border-radius: 8px; padding: .75rem 1rem;
  overflow-x: auto; font-size: .9rem; white-space: pre-wrap; overflow-wrap: anywhere;
}
h3 { font-size: 1.05rem; margin: 1.25rem 0 .25rem; }
dl { display: grid; grid-template-columns: max-content 1fr; gap: .2rem 1.25rem; margin: .75rem 0; }
dt { color: var(--soft); }
dd { margin: 0; overflow-wrap: anywhere; }
@media (max-width: 560px) {
  main { padding: 1.25rem .8rem 3rem; }
  th, td { padding: .3rem .4rem; font-size: .88rem; }
  #views_unwrapped svg { max-height: none; }
.slider { flex-wrap: wrap; }
}
@media print {
  :root { color-scheme: light; --page: #ffffff; --card: #ffffff; --ink: #000000; --soft: #444444; --line: #bbbbbb; }
  body { font-size: 10.5pt; }
  main { max-width: none; padding: 0; }
  nav, #browse { display: none; }
  .scroll { overflow: visible; padding: .1rem .3rem .3rem; }
  table { font-size: 8.5pt; }
  th, td { padding: .18rem .28rem; white-space: normal; }
  .figures { grid-template-columns: 1fr 1fr; gap: .5rem; }
  .tiles { grid-template-columns: repeat(3, 1fr); }
  figure svg { max-height: 115mm; }
  figcaption { font-size: 8.5pt; padding: .4rem .6rem; }
  section { margin-top: 1.2rem; }
  figure, tr, .tile { break-inside: avoid; }
  h2 { break-after: avoid; }
  .share i, .swatch { print-color-adjust: exact; -webkit-print-color-adjust: exact; }
}
)css";
}

std::string_view script() {
  return R"js(
(function () {
  var input = document.getElementById("frame-choice");
  if (!input) { return; }
  var frames = Array.prototype.slice.call(document.querySelectorAll(".frame"));
  function show() {
    frames.forEach(function (frame, i) { frame.hidden = i !== Number(input.value); });
    document.getElementById("frame-name").textContent = frames[Number(input.value)].getAttribute("data-name");
  }
  input.disabled = false;
  input.addEventListener("input", show);
  show();
}());
)js";
}

}  // namespace twocone::report
