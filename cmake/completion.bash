# SPDX-License-Identifier: Apache-2.0
# Completion of twocone for bash. The program's own help names subcommands, options and words, so that nothing is listed here.

_twocone() {
  local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD - 1]} program=${COMP_WORDS[0]} help words
  COMPREPLY=()
  if ((COMP_CWORD == 1)) || [[ ${COMP_WORDS[1]} == help && $COMP_CWORD == 2 ]]; then
    words=$("$program" --help 2>/dev/null | sed -n '/^Subcommands:/,$ s/^  \([a-z][-a-z]*\) .*/\1/p')
    ((COMP_CWORD > 1)) || words+=" --help --version"
    mapfile -t COMPREPLY < <(compgen -W "$words" -- "$word")
    return
  fi
  help=$("$program" "${COMP_WORDS[1]}" --help 2>/dev/null) || return
  if [[ $word == -* ]]; then
    words=$(grep -o -- '^  [-a-z,]*--[a-z][-a-z0-9]*' <<<"$help" | grep -o -- '--[a-z][-a-z0-9]*')
    mapfile -t COMPREPLY < <(compgen -W "$words" -- "$word")
    return
  fi
  # An option of few words lists them in braces: --renderer TEXT:{auto,native,povray}.
  words=
  if [[ $before =~ ^--[a-z][-a-z0-9]*$ ]]; then words=$(sed -n "s/^  [-a-z,]*$before .*{\([^}]*\)}.*/\1/p" <<<"$help" | tr ',' ' '); fi
  if [[ -n $words ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$words" -- "$word")
  else
    compopt -o filenames
    mapfile -t COMPREPLY < <(compgen -f -- "$word")
  fi
}
complete -F _twocone twocone
