// SPDX-License-Identifier: Apache-2.0
#include "apps/tradeoff/show/page.h"

namespace twocone::tradeoff {

// Neither text holds < or &, so that the page stays well-formed XML.
std::string_view page_style() {
  return R"css(
.spot { outline: none; cursor: pointer; }
.spot:focus, .spot.shown { stroke: #111111; stroke-width: 1.6; }
#tip {
  position: fixed; z-index: 2; max-width: min(35rem, 92vw); padding: .55rem .75rem; border-radius: 6px;
  background: #1d2329; color: #f4f5f6; font-size: .85rem; line-height: 1.45; white-space: pre-line;
  pointer-events: none; box-shadow: 0 3px 14px rgba(0, 0, 0, .3);
}
#tip[hidden] { display: none; }
#tip::first-line { font-weight: 650; }
.choice { border-left: 4px solid var(--accent); background: var(--card); padding: .6rem 1rem; border-radius: 6px; }
#all { font-size: .86rem; }
#all th, #all td { padding: .28rem .5rem; }
#all thead th { text-align: right; vertical-align: bottom; }
#all thead th:first-child { text-align: left; }
#all tbody th { white-space: nowrap; font-weight: 500; }
#all small { color: var(--soft); }
#all button {
  font: inherit; color: inherit; background: none; border: 0; padding: 0; cursor: pointer; text-align: inherit;
}
#all button:hover { color: var(--accent); text-decoration: underline; }
#all th[aria-sort="ascending"] button::after { content: " \25B4"; }
#all th[aria-sort="descending"] button::after { content: " \25BE"; }
#all tr.frontier th, #all tr.frontier td { background: rgba(0, 114, 178, .09); }
#all tr.frontier th { font-weight: 650; }
#all tr.shown th, #all tr.shown td { background: rgba(230, 159, 0, .3); }
#all .on { color: var(--accent); margin-left: .15em; }
@media (min-width: 1200px) {
  #settings .scroll { width: min(94vw, 1760px); margin-left: 50%; transform: translateX(-50%); }
}
@media print {
  #all { font-size: 6pt; }
  #all th, #all td { padding: .1rem .15rem; }
}
)css";
}

std::string_view page_script() {
  return R"js(
(function () {
  var tip = document.getElementById("tip");
  var spots = Array.prototype.slice.call(document.querySelectorAll(".spot"));
  function mark(setting, on) {
    document.querySelectorAll("[data-setting='" + setting + "']").forEach(function (one) {
      one.classList.toggle("shown", on);
    });
  }
  function show(spot) {
    mark(spot.getAttribute("data-setting"), true);
    tip.textContent = spot.getAttribute("aria-label");
    tip.hidden = false;
    var at = spot.getBoundingClientRect();
    var box = tip.getBoundingClientRect();
    var left = at.right + 10;
    if (left + box.width > window.innerWidth - 8) { left = at.left - box.width - 10; }
    var top = Math.min(at.top, window.innerHeight - box.height - 8);
    tip.style.left = Math.max(left, 8) + "px";
    tip.style.top = Math.max(top, 8) + "px";
  }
  function hide(spot) {
    mark(spot.getAttribute("data-setting"), false);
    tip.hidden = true;
  }
  // Marks lie close together, so the nearest one is selected and not the topmost.
  function nearest(group, event) {
    var best = null;
    var least = 14;
    Array.prototype.forEach.call(group.children, function (spot) {
      var box = spot.getBoundingClientRect();
      var away = Math.hypot(box.left + box.width / 2 - event.clientX, box.top + box.height / 2 - event.clientY);
      if (least > away) { least = away; best = spot; }
    });
    return best;
  }
  document.querySelectorAll(".spots").forEach(function (group) {
    var shown = null;
    function turn_to(spot) {
      if (spot === shown) { return; }
      if (shown) { hide(shown); }
      shown = spot;
      if (shown) { show(shown); }
    }
    var svg = group.ownerSVGElement;
    svg.addEventListener("pointermove", function (event) { turn_to(nearest(group, event)); });
    svg.addEventListener("pointerleave", function () { turn_to(null); });
  });
  function cost(spot) { return Number(spot.getAttribute("cx")); }
  spots.forEach(function (spot) {
    var title = spot.querySelector("title");
    spot.setAttribute("aria-label", title.textContent);
    spot.removeChild(title);
    spot.addEventListener("focus", function () { show(spot); });
    spot.addEventListener("blur", function () { hide(spot); });
    spot.addEventListener("keydown", function (event) {
      var step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
      if (event.key === "Escape") { hide(spot); }
      if (!step) { return; }
      event.preventDefault();
      var row = Array.prototype.slice.call(spot.parentNode.children).sort(function (a, b) { return cost(a) - cost(b); });
      var next = row[row.indexOf(spot) + step];
      if (next) { next.focus(); }
    });
  });

  var table = document.getElementById("all");
  var body = table.querySelector("tbody");
  var heads = Array.prototype.slice.call(table.querySelectorAll("thead th"));
  function key(row, column) {
    var data = row.children[column].querySelector("data");
    return data ? Number(data.getAttribute("value")) : Infinity;
  }
  heads.forEach(function (head, column) {
    head.addEventListener("click", function () {
      var up = head.getAttribute("aria-sort") !== "ascending";
      heads.forEach(function (other) { other.removeAttribute("aria-sort"); });
      head.setAttribute("aria-sort", up ? "ascending" : "descending");
      Array.prototype.slice.call(body.children).sort(function (a, b) {
        var x = key(a, column);
        var y = key(b, column);
        if (x === y) { return 0; }
        if (x === Infinity || y === Infinity) { return x === Infinity ? 1 : -1; }
        return up ? x - y : y - x;
      }).forEach(function (row) { body.appendChild(row); });
    });
  });
}());
)js";
}

}  // namespace twocone::tradeoff
