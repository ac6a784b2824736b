#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The cost of accuracy: sweeps of the lab and the hall, their frontiers, repeatability, choices, adaptive precision, sweeps that are
# killed or run by Slurm. Takes about an hour of two cores.
. "$(dirname "$0")/common.sh"

# TWOCONE_TRADEOFF_EPISODES=6 runs all rows with few episodes, and writes the page to a separate folder; such a page is no evidence.
episodes=()
if [ -n "${TWOCONE_TRADEOFF_EPISODES:-}" ]; then
  episodes=(--episodes "$TWOCONE_TRADEOFF_EPISODES" --validation-episodes "$TWOCONE_TRADEOFF_EPISODES")
  work+=_$TWOCONE_TRADEOFF_EPISODES
  pages=$work
  mkdir -p "$work"
fi
few=6 # number of episodes of the sweeps that are killed or run by Slurm
two_cores=()
if [ "$(nproc)" -gt 2 ]; then two_cores=(taskset -c 0,1); fi

# csv FILE PROGRAM: runs awk on the rows of a table; c["NAME"] is the number of a column
csv() { awk -F, "NR == 1 { for (i = 1; i <= NF; i++) c[\$i] = i; next } $2" "$1" 2>/dev/null || echo none; }
# The columns that define a setting, as one word.
setting='$c["width_px"] "x" $c["height_px"] "/" $c["antialias"] "/" $c["effects"] "/" $c["estimator"] "/" $c["enough_m"] "/" $c["landmarks"] "/" $c["bearings"] "/" $c["rate_hz"] "/" $c["frames"]'
at_least() { if [[ "$1" == none || -z "$1" ]]; then echo no; else holds "$1 >= $2"; fi; }
both() { if [ "$1$2" = yesyes ]; then echo yes; else echo no; fi; }

# sweep NAME ROBOT OPTION...: makes a sweep in $work/NAME, and stores its duration and its figures before a choice is marked in them.
# An interrupted sweep starts again, because its duration is a result.
sweep() {
  local name=$1 robot=$2
  shift 2
  if [ ! -f "$work/$name.status" ]; then rm -rf "${work:?}/$name"; fi
  timed_sweep() {
    local begin=$SECONDS
    "${two_cores[@]}" "$twocone" tradeoff --robot "$robot" --out "$work/$name" "${episodes[@]:0:2}" "$@" || return 1
    echo $((SECONDS - begin)) >"$work/$name.seconds"
    for image in robot_time simulation_time; do
      node tests/evidence/viewer/save_figure.mjs "$work/$name/index.html" "$image" "$work/${name}_$image.svg" || return 1
    done
  }
  step "$name" timed_sweep "$@"
}

# of_sweep NAME WHAT: writes the rows on the extent of a sweep
of_sweep() {
  local name=$1 what=$2 table=$work/$1/tradeoff.csv
  if [ "$(passed "$name")" = no ]; then
    row "$what" "$(tail -n 1 "$work/$name.log")" "a sweep" no
    return
  fi
  local settings axes frontier span_error span_time robot_frontier
  settings=$(csv "$table" 'END { print NR - 1 }')
  axes=$(csv "$table" '
    { size[$c["width_px"] "x" $c["height_px"]]; smooth[$c["antialias"]]; effects[$c["effects"]]; level[$c["estimator"]]; many[$c["landmarks"]]
      bearings[$c["bearings"]]; rate[$c["rate_hz"]]; frames[$c["frames"]] }
    END { print (length(size) > 1) + (length(smooth) > 1) + (length(effects) > 1) + (length(level) > 1) + (length(many) > 1) + (length(bearings) > 1) + (length(rate) > 1) + (length(frames) > 1) }')
  row "$what: settings" "$settings over $axes axes" "at least 60 over at least 4" "$(both "$(at_least "$settings" 60)" "$(at_least "$axes" 4)")"
  local of_frontier='
    $c["simulation_frontier"] == 1 { n++; e = $c["position_mean_m"] + 0; t = $c["simulation_s"] + 0
      if (n == 1 || e < e0) e0 = e; if (n == 1 || e > e1) e1 = e; if (n == 1 || t < t0) t0 = t; if (n == 1 || t > t1) t1 = t }'
  frontier=$(csv "$table" "$of_frontier END { print n + 0 }")
  robot_frontier=$(csv "$table" '$c["robot_frontier"] == 1 { n++ } END { print n + 0 }')
  row "$what: settings on the frontier of simulation time" "$frontier; of robot time $robot_frontier" "at least 6" "$(at_least "$frontier" 6)"
  span_error=$(csv "$table" "$of_frontier END { if (e0 > 0) printf \"%.1f\", e1 / e0; else print \"none\" }")
  span_time=$(csv "$table" "$of_frontier END { if (t0 > 0) printf \"%.1f\", t1 / t0; else print \"none\" }")
  row "$what: span of that frontier" "error $span_error times ($(csv "$table" "$of_frontier END { printf \"%.3f to %.1f mm\", 1e3 * e0, 1e3 * e1 }")), time $span_time times ($(csv "$table" "$of_frontier END { printf \"%.1f to %.0f ms\", 1e3 * t0, 1e3 * t1 }"))" "at least 30 times each" "$(both "$(at_least "$span_error" 30)" "$(at_least "$span_time" 30)")"
}

# ------------------------------------------------------------------------ the lab ----
sweep lab robots/lab_sim.yaml
seconds=$(cat "$work/lab.seconds" 2>/dev/null || echo 9999)
row "default sweep of the lab" "$seconds s on two cores" "less than 600 s" "$(both "$(passed lab)" "$(holds "$seconds < 600")")"
of_sweep lab lab
if [ "$(passed lab)" = yes ] && [ "$pages" = docs/evidence ]; then
  for image in robot_time simulation_time; do
    cp "$work/lab_$image.svg" "docs/images/tradeoff-${image//_/-}.svg"
  done
fi

# Another seed, hence other poses, must give the same means up to chance, within the intervals that each sweep states.
sweep lab_again robots/lab_sim.yaml --seed 2
compared=$(awk -F, '
  FNR == 1 { for (i = 1; i <= NF; i++) c[$i] = i; next }
  $c["position_mean_m"] == "" || $c["position_mean_low_m"] == "" || $c["position_mean_high_m"] == "" { left[FNR]; next }
  { key = '"$setting"'; mean = $c["position_mean_m"]; half = ($c["position_mean_high_m"] - $c["position_mean_low_m"]) / 2 }
  FILENAME == ARGV[1] { first[key] = mean; width[key] = half; next }
  key in first { n++; d = mean - first[key]; if (d < 0) d = -d; if (d < sqrt(half ^ 2 + width[key] ^ 2)) in_it++ }
  END { printf "%.1f %d %d", n ? 100 * in_it / n : 0, n, length(left) }' "$work/lab/errors.csv" "$work/lab_again/errors.csv" 2>/dev/null || echo "0 0 0")
read -r share settings left <<<"$compared"
row "lab with another seed: settings whose means differ by less than the root of both half intervals' squares" "$share % of $settings ($left without an interval left out)" "at least 90 %" "$(both "$(at_least "$settings" 50)" "$(at_least "$share" 90)")"

# -------------------------------------------------------------------- choosing ----
eligible='$c["effects"] == "scene" && $c["position_mean_m"] != "" && $c["answered"] >= 0.9 * $c["frames_observed"]'
# choose NAME OPTION VALUE: makes a choice and writes its row. The settings of the sweep that are cheaper (for a time budget: more
# accurate) and within the requirement are counted here from the CSV; each must have been tried.
choose() {
  local name=$1 option=$2 requirement=$3 json=$work/$1.json
  chosen() {
    "$twocone" tradeoff --robot robots/lab_sim.yaml --out "$work/lab" "${episodes[@]}" "$option" "$requirement" --write-robot "$work/$name.yaml" || return 1
    cp "$work/lab/choice.json" "$json"
    # The written robot file must run.
    "$twocone" run --robot "$work/$name.yaml" --frames 3 --out "$work/${name}_run" || return 1
  }
  if [ ! -f "$work/$name.status" ]; then rm -rf "$work/${name}_run"; fi
  step "$name" chosen
  if [ "$(passed "$name")" = no ]; then
    row "lab, $option $requirement" "$(tail -n 1 "$work/$name.log")" "a choice" no
    return
  fi
  local number tried better figure last
  number=$(jq .choice "$json")
  tried=$(jq '.validations[:-1] | map(select(.holds | not)) | length' "$json")
  last=$(jq -r '.validations[-1] | [.setting, .holds, (1e3 * .mean_m.value), (1e3 * .upper_limit_m), (1e3 * .robot_time_s.value), (1e3 * .robot_time_s.high), .is] | @tsv' "$json")
  local setting_number holds mean upper time upper_time is
  IFS=$'\t' read -r setting_number holds mean upper time upper_time is <<<"$last"
  if [ "$option" = --target-mm ]; then
    better=$(awk -F, -v chosen=$((number + 2)) -v requirement="$requirement" 'NR == 1 { for (i = 1; i <= NF; i++) c[$i] = i; next }
      NR == FNR { if (FNR == chosen) limit = $c["robot_p95_s"]; next }
      FNR > 1 && '"$eligible"' && 1e3 * $c["position_mean_m"] < requirement && $c["robot_p95_s"] + 0 < limit + 0 { n++ } END { print n + 0 }' "$work/lab/tradeoff.csv" "$work/lab/tradeoff.csv")
    figure=$(printf 'mean %.2f mm, upper limit %.2f mm' "$mean" "$upper")
    holds=$(if [ "$holds" = true ]; then holds "$upper < $requirement"; else echo no; fi)
  else
    better=$(awk -F, -v chosen=$((number + 2)) -v requirement="$requirement" 'NR == 1 { for (i = 1; i <= NF; i++) c[$i] = i; next }
      NR == FNR { if (FNR == chosen) limit = $c["position_mean_m"]; next }
      FNR > 1 && '"$eligible"' && 1e3 * $c["robot_p95_s"] < requirement && $c["position_mean_m"] + 0 < limit + 0 { n++ } END { print n + 0 }' "$work/lab/tradeoff.csv" "$work/lab/tradeoff.csv")
    figure=$(printf '%.2f ms (95 %% quantile), upper limit %.2f ms, mean %.2f mm' "$time" "$upper_time" "$mean")
    holds=$(if [ "$holds" = true ]; then holds "$upper_time < $requirement"; else echo no; fi)
  fi
  row "lab, $option $requirement: $is" "$figure on fresh poses, $(jq .settings_swept "$json") settings allowed for; swept settings that would be better and within the requirement: $better, tried and not held: $tried" "holds; each better one tried, none holds" "$(both "$holds" "$(if [ "$setting_number" = "$number" ]; then holds "$better == $tried"; else echo no; fi)")"
}
choose target_5 --target-mm 5
choose target_2 --target-mm 2
choose budget_20 --budget-ms 20
# Every setting of the lab takes less than 20 ms; this time budget excludes some.
choose budget_1 --budget-ms 1

# ---------------------------------------------------------- adaptive precision ----
# Compares settings with the same images, landmarks and frames: the mean of the adaptive one must not exceed the interval of the uniform
# one.
adaptive=$(awk -F, '
  NR == 1 { for (i = 1; i <= NF; i++) c[$i] = i; next }
  $c["position_mean_m"] == "" { next }
  { key = $c["width_px"] "x" $c["height_px"] ", antialias " $c["antialias"] ", " $c["effects"] ", " $c["landmarks"] " landmarks, " ($c["bearings"] ? "bearings" : "ranges") ", " $c["rate_hz"] " Hz, " $c["frames"] " frames" }
  $c["estimator"] == "fine" { mean[key] = $c["position_mean_m"]; high[key] = $c["position_mean_high_m"]; vision[key] = $c["vision_median_s"]; slow[key] = $c["vision_p95_s"] }
  $c["estimator"] == "adaptive" { n++; of[n] = key; enough[n] = $c["enough_m"]; a_mean[n] = $c["position_mean_m"]; a_vision[n] = $c["vision_median_s"]; a_slow[n] = $c["vision_p95_s"] }
  END {
    for (i = 1; i <= n; i++) if (of[i] in mean && a_vision[i] > 0)
      printf "%.2f %s %.3f %.3f %.2f %.2f %s, enough %g mm; 95 %% quantile of vision %.2f and %.2f ms\n", vision[of[i]] / a_vision[i], (a_mean[i] <= high[of[i]] ? "equal" : "worse"), 1e3 * a_mean[i], 1e3 * mean[of[i]], 1e3 * a_vision[i], 1e3 * vision[of[i]], of[i], 1e3 * enough[i], 1e3 * a_slow[i], 1e3 * slow[of[i]]
  }' "$work/lab/tradeoff.csv" 2>/dev/null || true)
# The median over all sizes and smoothings of the scene's own world, each with its best tolerance, so that no lucky pair is selected.
same_images() { # same_images FRAMES WHAT
  local kinds middle pairs sets times a_mean u_mean a_vision u_vision where
  kinds=$(grep " scene, .* $1 frames," <<<"$adaptive" || true)
  middle=$(grep ' equal ' <<<"$kinds" | sort -rn | awk '{ where = $0; sub(/, enough.*/, "", where); sub(/^[^ ]* [^ ]* [^ ]* [^ ]* [^ ]* [^ ]* /, "", where); if (!(where in seen)) { seen[where]; print } }' || true)
  pairs=$(grep -c . <<<"$middle" || true)
  sets=$(sed 's/, enough.*//' <<<"$kinds" | cut -d' ' -f7- | sort -u | grep -c . || true)
  read -r times _ a_mean u_mean a_vision u_vision where <<<"$(head -n "$((pairs / 2 + 1))" <<<"$middle" | tail -n 1 | grep . || echo none none none none none none none)"
  row "adaptive against uniform (fine) precision on the same images, $2, mean error within the uniform one's interval: vision time" "$times times less, the median of $pairs kinds of images ($where: $a_vision against $u_vision ms, mean $a_mean against $u_mean mm); equal in $pairs of $sets kinds; all pairs below" "at least 2 times less, or the data that show why not" "$(if [ "$times" = none ]; then echo no; else holds "$times >= 2"; fi)"
}
same_images 1 "single frames"
same_images 4 "4 frames fused (swept to 0.1 mm alone)"

# For any images: each adaptive setting of single frames on the frontier of adaptive settings is compared with the cheapest uniform one
# (found, coarse or fine) of the whole sweep whose mean is not larger. Intervals are not used.
frontier=$(awk -F, '
  NR == 1 { for (i = 1; i <= NF; i++) c[$i] = i; next }
  '"$eligible"' && $c["frames"] == 1 {
    n++; mean[n] = 1e3 * $c["position_mean_m"]; vision[n] = 1e3 * $c["vision_median_s"]; how[n] = $c["estimator"]
    what[n] = $c["width_px"] "x" $c["height_px"] ", antialias " $c["antialias"] ", " $c["landmarks"] " landmarks, " ($c["bearings"] ? "bearings, " : "ranges, ") $c["estimator"] ($c["enough_m"] > 0 ? " to " 1e3 * $c["enough_m"] " mm" : "") }
  END {
    for (i = 1; i <= n; i++) {
      if (how[i] != "adaptive") continue
      best = 0
      for (k = 1; k <= n && best >= 0; k++) {
        if (how[k] == "adaptive" && k != i && mean[k] <= mean[i] && vision[k] <= vision[i]) best = -1
        else if (how[k] ~ /^(found|coarse|fine)$/ && mean[k] <= mean[i] && (!best || vision[k] < vision[best])) best = k
      }
      if (best > 0) printf "%.2f %.3f %.3f %.2f %.2f %s | %s\n", vision[best] / vision[i], mean[i], mean[best], vision[i], vision[best], what[i], what[best]
    }
  }' "$work/lab/tradeoff.csv" 2>/dev/null | sort -k2 -n || true)
middle=$(cut -d' ' -f1 <<<"$frontier" | sort -n | awk '{ all[NR] = $1 } END { print all[int((NR + 1) / 2)] }')
read -r all twice least most <<<"$(awk '$1 >= 2 { n++; if (n == 1) least = $2; most = $2 } END { print NR, n + 0, least, most }' <<<"$frontier")"
row "adaptive settings of single frames on their frontier, against the cheapest uniform one of the sweep with no larger error: vision time" "$middle times less, the median of $all; at least 2 times less for $twice of them, with mean errors from $least to $most mm; all below" "at least 2 times less, or the data that show why not" "$(at_least "$middle" 2)"

# ------------------------------------------------------------- kills and Slurm ----
step killed tests/evidence/tradeoff_killed.sh "$twocone" "$work/killed_sweep" robots/lab_sim.yaml "$few"
row "a sweep killed three times (kill -9) and resumed, $few episodes" "$(grep '^byte-equal' "$work/killed.log" || tail -n 1 "$work/killed.log")" "errors.csv byte-equal to that of an uninterrupted sweep" "$(passed killed)"
step slurm tests/evidence/tradeoff_slurm.sh "$twocone" "$work/slurm_sweep" robots/lab_sim.yaml "$few" "$work/killed_sweep/whole"
row "the same sweep by Slurm, a job array on one node, $few episodes" "$(grep '^byte-equal' "$work/slurm.log" || tail -n 1 "$work/slurm.log")" "errors.csv byte-equal to that of an uninterrupted sweep" "$(passed slurm)"

# ----------------------------------------------------------------------- the hall ----
# Its images are half as large again, and with this number of episodes it takes about as long as the lab.
hall=(--episodes 12)
if ((${#episodes[@]})); then hall=(); fi
sweep hall robots/hall_sim.yaml "${hall[@]}"
of_sweep hall "hall (8 landmarks, large mirrors, 800x600)${hall[*]:+, 12 episodes}"

text_of() { cat "$work/$1/tradeoff.txt" 2>/dev/null || tail -n 3 "$work/$1.log"; }
block "The lab" "$(text_of lab)"
block "Choices" "$(grep -hE '^(requirement|trial|choice|robot) ' "$work"/{target_5,target_2,budget_20,budget_1}.log 2>/dev/null || true)"
block "Adaptive against uniform: times less vision time; mean error equal or worse; adaptive and uniform mean, mm; vision, ms" "${adaptive:-none}"
block "Adaptive settings on their frontier against the cheapest uniform one with no larger error: times less vision time; mean, mm; vision, ms" "${frontier:-none}"
block "A sweep that was killed" "$(grep -E '^(undisturbed|killed|--merge|byte)' "$work/killed.log" || true)"
block "Slurm" "$(tail -n 5 "$work/slurm.log")"
block "The hall" "$(text_of hall)"
page "the cost of accuracy in time"
