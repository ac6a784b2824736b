#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Refuses words that only this project ever used for what the field has a name for: in code, comments, messages, file
# names and documents. docs/glossary.md has the words to use.
#   words.sh SOURCE_DIR
set -euo pipefail
cd "$1"

# A word for each line, as an extended regular expression; then what is allowed although it holds such a word.
refused='[Pp]icture|[Pp]illar|[Mm]ould|[Dd]arkroom|\b[Vv]enue|\b[Rr]esident\b|\b[Ss]eat(s|ed)?\b|Seat[A-Z]|\bHall\b|OpenHall|[Ss]tand[-_]in\b|\b[Gg]uest\b|\b[Ff]oreign\b|\b[Oo]utage|\b[Ss]tance|\b[Dd]ice\b|\b[Ee]ffort|\b[Ww]ish(es|ed)?\b|\b[Ll]egs?\b|\bis told\b|\b[Tt]ells\b|\bcalls? for\b|[Mm]ethod `?full|--method full|methods/full|FullRanging|DESIGN\.md'
allowed="full-scale|--legs|legs:|Room_Pillar|panel legs|resident (size|memory)|Hall's|\\{\"Hall\""

files() {
  git ls-files -- '*.h' '*.cpp' '*.py' '*.md' '*.sh' '*.txt' '*.cmake' '*.yaml' '*.in' |
    grep -v '^docs/evidence/\|^tests/formats/\|^tests/evidence/behaviour\|^tests/layers/words.sh\|^tests/layers/bad/\|^apps/config/yaml/names\|^docs/file-formats.md\|^CHANGELOG.md'
}
found=$(files | xargs grep -nE -- "$refused" | grep -vE -- "$allowed" || true)
names=$(git ls-files | grep -v '^tests/formats/\|^docs/evidence/' | grep -E "$refused" || true)
if [ -n "$found$names" ]; then
  printf '%s\n' "$found" "$names" | cut -c1-160
  echo "words.sh: $(printf '%s\n' "$found" "$names" | grep -c .) lines use words that the field has better ones for (docs/glossary.md)"
  exit 1
fi
echo "no refused word in $(files | wc -l) files"
