# SPDX-License-Identifier: Apache-2.0
# Debian 12 and 13, with both compilers, each from nothing.
for suite in bookworm trixie; do
  for compiler in g++ clang++; do
    name=fresh_${suite}_$compiler
    packages=""
    if [ "$compiler" = g++ ]; then packages=$work/deb_$suite; fi
    step "$name" tests/evidence/fresh_debian.sh "$suite" "$compiler" $packages
    took() { sed -n "s/^took $1: //p" "$work/$name.log"; }
    again=$(took 'second test')
    what="fresh $suite, $(sed -n 's/^compiler: //p' "$work/$name.log")"
    row "$what: \`./demo.sh\`" "$(took 'first demo') s with all set-up; again, 10 frames: $(took 'second demo') s" "ends; again quickly" "$([ -n "$(took 'second demo')" ] && echo yes || echo no)"
    row "$what: \`./test.sh\`" "$(took 'first test') s; ${again:+again $again s; }$(grep -E 'tests passed' "$work/$name.log" | tail -n 1)" "passes" "$(passed "$name")"
    if [ "$compiler" = clang++ ]; then continue; fi
    step "deb_$suite" tests/evidence/deb.sh "$suite" "$packages"
    row "the package built on $suite, on a fresh $suite" "$(grep -c '^row .*yes$' "$work/deb_$suite.log") rows met, $(grep -c '^row .*no$' "$work/deb_$suite.log") not" "all" "$(passed "deb_$suite")"
  done
done
lines+="| F | fresh Debian 13: \`./demo.sh\` | a compile error: a false warning of g++ 14 is an error in every preset | warnings are errors only where TWOCONE_WARNINGS_AS_ERRORS is set, as \`.ci/run\` does | the rows of trixie above | $(passed fresh_trixie_g++) |"$'\n'
