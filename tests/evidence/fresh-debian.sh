#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# ./demo.sh and ./test.sh on fresh Debian 12 and 13 with both compilers; then the packages that each Debian's g++ has built.
. "$(dirname "$0")/common.sh"
version=$(sed -n 's/^project(twocone VERSION \([0-9.]*\).*/\1/p' CMakeLists.txt)

for suite in bookworm trixie; do
  for compiler in g++ clang++; do
    name=fresh_${suite}_$compiler
    packages=""
    if [ "$compiler" = g++ ]; then packages=$work/deb_$suite; fi
    step "$name" tests/evidence/fresh_debian.sh "$suite" "$compiler" $packages
    took() { sed -n "s/^took $1: \(.*\)/\1 s/p" "$work/$name.log"; }
    demo=$(took 'first demo') demo_again=$(took 'second demo') tests=$(took 'first test') tests_again=$(took 'second test')
    full_name=$(sed -n 's/^compiler: //p' "$work/$name.log")
    what="fresh $suite, ${full_name:-$compiler}"
    row "$what: \`./demo.sh\`" "${demo:-not run}${demo:+ with set-up}${demo_again:+; again, 10 frames: $demo_again}" "ends; again quickly" \
      "$([ -n "$demo_again" ] && echo yes || echo no)"
    row "$what: \`./test.sh\`" "${tests:-not run}${tests_again:+; again $tests_again}${tests:+; $(grep -E 'tests passed' "$work/$name.log" | tail -n 1)}" "passes" \
      "$(passed "$name")"
    if [ "$compiler" = clang++ ]; then continue; fi
    # A fused multiplication or another library may round otherwise, so the figures of README are those of its own compiler.
    if [ "$suite" = bookworm ]; then
      sed -n '/^begin demo/,/^end demo/p' "$work/$name.log" >"$work/$name.demo"
      sed -n '/^```text/,/^```/p' README.md | grep -v '^```' | grep . >"$work/README.lines"
      printed=$(grep -cxFf "$work/$name.demo" "$work/README.lines" || true)
      row "$what: lines of README's table that \`./demo.sh\` prints" "$printed of $(wc -l <"$work/README.lines")" "all" "$(holds "$printed == $(wc -l <"$work/README.lines")")"
    fi
    step "deb_$suite" env SUITE="$suite" tests/evidence/release/on_debian.sh "$packages" "$version"
    row "the packages built on $suite, on a fresh $suite" "$(grep -c '^row .*yes$' "$work/deb_$suite.log") rows met, $(grep -c '^row .*no$' "$work/deb_$suite.log") not" "all" "$(passed "deb_$suite")"
  done
done
page "the two commands on a fresh Debian"
