#!/usr/bin/env bash
# ./run and ./test, tried in a scratch copy of the scripts alone: the package check, the one line to run, the options handed on.
# usage: scripts.sh SOURCE_TREE
set -euo pipefail
tree=$1
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
mkdir -p "$scratch/clone/cmake" "$scratch/elsewhere"
cp "$tree/run" "$tree/test" "$scratch/clone/"
cp "$tree"/cmake/prepare.sh "$tree"/cmake/packages.txt "$scratch/clone/cmake/"
cd "$scratch/elsewhere"

fail() { echo "FAILED: $*" >&2; exit 1; }
# expect CODE TEXT COMMAND...: the exit code, and a text its output holds
expect() {
  local code=$1 text=$2 got=0
  shift 2
  "$@" >"$scratch/out" 2>&1 || got=$?
  [ "$got" = "$code" ] || { cat "$scratch/out"; fail "$* gave $got, expected $code"; }
  grep -qF -- "$text" "$scratch/out" || { cat "$scratch/out"; fail "$* does not say '$text'"; }
}

expect 2 "usage: ./run SCENE" ../clone/run
expect 0 "usage: ./run SCENE" ../clone/run --help
expect 0 "./test all" ../clone/test --help

# A package nobody has: the one line, exit 2, nothing made.
printf '# a list\ncmake\n\ncleave-no-such-package # reason\ncleave-nor-this\n' >"$scratch/list"
for script in run test; do
  expect 2 "apt-get install -y --no-install-recommends cleave-no-such-package cleave-nor-this" \
    env CLEAVE_PACKAGES="$scratch/list" CLEAVE_NO_INSTALL=1 "../clone/$script" scene.yaml
  [ "$(grep -c 'apt-get install' "$scratch/out")" = 1 ] || fail "$script prints more than one install line"
  ! grep -q 'install.* cmake' "$scratch/out" || fail "$script asks for a package that is there"
done
[ ! -e "$scratch/clone/build" ] || fail "a build tree was made although packages are missing"

# Nothing missing: on to the build. Here cmake and ninja are impostors, and cleave and ctest print what they are handed.
mkdir -p "$scratch/bin"
printf '#!/bin/sh\necho "cmake $*"\nmkdir -p build/release && touch build/release/build.ninja && echo "CMAKE_HOME_DIRECTORY:INTERNAL=$PWD" >build/release/CMakeCache.txt\n' >"$scratch/bin/cmake"
printf '#!/bin/sh\necho "ninja $*"\n[ -z "${BREAK:-}" ] || { echo "it broke"; exit 1; }\nmkdir -p "$2/app"\nprintf "#!/bin/sh\\necho cleave in \\$PWD: \\$*\\n" >"$2/app/cleave"\nchmod +x "$2/app/cleave"\n' >"$scratch/bin/ninja"
printf '#!/bin/sh\necho "ctest $*"\n' >"$scratch/bin/ctest"
chmod +x "$scratch"/bin/*
printf 'cmake\n' >"$scratch/list"
export PATH="$scratch/bin:$PATH" CLEAVE_PACKAGES="$scratch/list" CLEAVE_NO_INSTALL=1

expect 0 "cleave in $scratch/elsewhere: run my scene.yaml --set a=b -- -log_view" ../clone/run "my scene.yaml" --set a=b -- -log_view
ls "$scratch"/clone/build/packages-* >/dev/null || fail "no stamp of the package check"
expect 0 "cleave in" ../clone/run scene.yaml
! grep -q Configuring "$scratch/out" || fail "configured again without need"
expect 1 "it broke" env BREAK=1 ../clone/run scene.yaml
expect 0 "-LE long -R scene" ../clone/test -R scene
expect 0 "ctest" ../clone/test all
! grep -q -- "-LE long" "$scratch/out" || fail "./test all leaves the long runs out"
ln -s "$scratch/clone/run" "$scratch/elsewhere/linked"
expect 0 "cleave in" ./linked scene.yaml

# A tree that moved is configured anew; a list that changed is checked anew.
mv "$scratch/clone" "$scratch/moved"
expect 0 "Configuring" ../moved/run scene.yaml
printf 'cleave-no-such-package\n' >"$scratch/list"
expect 2 "apt-get install" ../moved/run scene.yaml
echo "scripts: all as promised"
