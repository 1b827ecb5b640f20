# prepare.sh - sourced by ./run and ./test: what is missing is installed, what changed is built.
#
# CLEAVE_NO_INSTALL=1 never installs: it prints the line to run and stops with 2.
# CLEAVE_PACKAGES=FILE names another list of packages (the scripts' own test uses it).
# CLEAVE_JOBS=N bounds the compilers that run at once.

export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 OPENBLAS_NUM_THREADS=1

# Packages of the list that dpkg does not hold. Nothing to say where dpkg is absent: CMake names what it misses.
cleave_missing() {
  command -v dpkg-query >/dev/null || return 0
  local wanted
  wanted=$(sed -e 's/[[:space:]]*#.*//' -e '/^$/d' "$1")
  [ -z "${PETSC_DIR:-}" ] || wanted=$(grep -vxE "petsc-dev|slepc-dev" <<<"$wanted")
  # shellcheck disable=SC2086 # one word per package
  comm -23 <(sort <<<"$wanted") \
    <(dpkg-query -W -f='${db:Status-Status} ${Package}\n' $wanted 2>/dev/null | sed -n 's/^installed //p' | sort) | tr '\n' ' '
}

# A stamp in build/ carries the list's checksum, so a machine that has everything pays one cksum.
cleave_packages() {
  local root=$1 list=${CLEAVE_PACKAGES:-$1/cmake/packages.txt} stamp missing as_root=""
  stamp="$root/build/packages-$(cksum <"$list" | tr ' ' -)"
  [ ! -e "$stamp" ] || return 0
  missing=$(cleave_missing "$list")
  if [ -n "$missing" ]; then
    [ "$(id -u)" = 0 ] || as_root="sudo "
    if [ -n "${CLEAVE_NO_INSTALL:-}" ] || { [ -n "$as_root" ] && ! sudo -n true 2>/dev/null; }; then
      echo "Packages are missing. Install them with:" >&2
      echo "  ${as_root}apt-get install -y --no-install-recommends ${missing% }" >&2
      exit 2
    fi
    echo "Installing: $missing" >&2
    # shellcheck disable=SC2086 # one word per package; as_root is "sudo " or nothing
    if ! { $as_root apt-get update -qq && DEBIAN_FRONTEND=noninteractive $as_root apt-get install -y -qq --no-install-recommends $missing; } >&2; then
      echo "The packages could not be installed. The line was:" >&2
      echo "  ${as_root}apt-get install -y --no-install-recommends ${missing% }" >&2
      exit 2
    fi
  fi
  mkdir -p "$root/build"
  rm -f "$root"/build/packages-*
  : >"$stamp"
}

# cleave_build ROOT PRESET [TARGET]: configure when there is no build tree, or it belongs to a tree that has moved; then ninja.
# Quiet unless it fails. Two calls at once take turns.
cleave_build() {
  local root=$1 preset=$2 target=${3:-all}
  local tree="$root/build/$preset" log="$root/build/$preset.log" launcher=() jobs=()
  (
    flock 9
    if [ -e "$tree/CMakeCache.txt" ] && ! grep -qx "CMAKE_HOME_DIRECTORY:INTERNAL=$root" "$tree/CMakeCache.txt"; then rm -rf "$tree"; fi
    if [ ! -e "$tree/build.ninja" ]; then
      ! command -v ccache >/dev/null || launcher=(-DCMAKE_C_COMPILER_LAUNCHER=ccache -DCMAKE_CXX_COMPILER_LAUNCHER=ccache)
      echo "Configuring ($preset)" >&2
      if ! (cd "$root" && cmake --preset "$preset" "${launcher[@]}") >"$log" 2>&1; then
        cat "$log" >&2
        rm -f "$tree/build.ninja"
        exit 1
      fi
    fi
    [ -e "$tree/.built-$target" ] || echo "Building ($preset); the first time takes a few minutes" >&2
    [ -z "${CLEAVE_JOBS:-}" ] || jobs=(-j "$CLEAVE_JOBS")
    if ! ninja -C "$tree" "${jobs[@]}" "$target" >"$log" 2>&1; then
      cat "$log" >&2
      exit 1
    fi
    : >"$tree/.built-$target"
  ) 9>"$root/build/.lock" || exit 1
}
