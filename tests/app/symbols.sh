#!/usr/bin/env bash
# Every public symbol of a library begins with a name of its module.  usage: symbols.sh LIBRARY PREFIX...
set -euo pipefail
library=$1
shift
pattern="^($(IFS='|'; echo "$*"))"
strangers=$(nm --defined-only --extern-only "$library" 2>/dev/null | awk 'NF == 3 && $2 !~ /[uwvV]/ {print $3}' | grep -vE "$pattern" | grep -vE '^(__asan|__odr_asan|_ZN?K?St|_ZN[0-9]+voro|_ZN4voro|_ZTI|_ZTS|_ZTV)' | sort -u || true)
if [ -n "$strangers" ]; then
  echo "public symbols of $(basename "$library") that begin with none of: $*" >&2
  echo "$strangers" >&2
  exit 1
fi
echo "$(basename "$library"): $(nm --defined-only --extern-only "$library" 2>/dev/null | awk 'NF == 3' | wc -l) symbols, all named after their module"
