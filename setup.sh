#!/usr/bin/env bash
# Installs what razy needs, builds it, and runs the demo or the tests.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"

usage() {
  cat <<'END'
usage: ./setup.sh COMMAND
  demo         build, sweep inputs/torsional_gear_pair.nml on all cores, draw its bifurcation diagram in build/demo/
  thesis       build, compute every figure and table of the source (inputs/thesis/report.toml), write build/thesis/report.html
  test         build, run the tests with all run-time checks (debug), then optimised (release), then the numerical ones with
               another BLAS and LAPACK; the slow ones: preset slow
  build        build the programs into build/bin/, and the tests
  docs         the site in build/docs/: pages, inputs, what is validated, the library; docs --gallery draws every input first
  environment  only install what is missing; environment tests: also the Python packages for the tests, which build and
               test install otherwise
  help         this text
Missing Debian or Ubuntu packages are installed by apt-get, as root or by sudo without a password.
Python packages go into .venv/ of this folder only.
END
}

fail() {
  printf 'setup.sh: %s\n' "$@" >&2
  exit 1
}

# Of each command its own, as two may run side by side.
log=build/setup-${1-help}.log

# quietly MESSAGE COMMAND...: what the command prints is shown only if it fails, and a line of it every minute.
quietly() {
  local beat
  echo "$1"
  shift
  mkdir -p build
  # Once a minute the last line of what it says, until the descriptor is closed.
  exec {beat}> >(
    minutes=0
    while read -r -t 60 _ || (($? > 128)); do
      echo "  $((++minutes)) min: $(grep "[^[:space:]]" "$log" | tail -n 1 | cut -c 1-100)"
    done
  )
  if "$@" >"$log" 2>&1 </dev/null {beat}>&-; then
    exec {beat}>&-
  else
    exec {beat}>&-
    tail -n 100 "$log" >&2
    fail "failed: $*" "all it said is in $log"
  fi
}

has() { command -v "$1" >/dev/null 2>&1; }

has_lapack() {
  local folder answer=0
  folder=$(mktemp -d)
  printf 'external dsygvd, dgemm\ncall dsygvd\ncall dgemm\nend\n' >"$folder/link.f90"
  gfortran -o "$folder/link" "$folder/link.f90" -llapack -lblas >/dev/null 2>&1 || answer=1
  rm -r "$folder"
  return "$answer"
}

has_arpack() {
  local folder answer=0
  folder=$(mktemp -d)
  printf 'external dsaupd\ncall dsaupd\nend\n' >"$folder/link.f90"
  gfortran -o "$folder/link" "$folder/link.f90" -larpack >/dev/null 2>&1 || answer=1
  rm -r "$folder"
  return "$answer"
}

# The first Python that is new enough and can make an environment; also one that pyenv provides.
find_python() {
  local python
  for python in python3 /usr/bin/python3 python3.14 python3.13 python3.12 python3.11; do
    if "$python" -c 'import sys, ensurepip, venv; sys.exit(sys.version_info < (3, 11))' >/dev/null 2>&1; then
      echo "$python"
      return
    fi
  done
  return 1
}

missing_packages() {
  has gfortran || echo gfortran
  has gcc || echo gcc
  has cmake || echo cmake
  has make || has ninja || echo ninja-build
  has git || echo git
  has mpifort || echo libopenmpi-dev
  has mpirun || echo openmpi-bin
  has h5fc || echo libhdf5-dev
  has gfortran && has_lapack || echo liblapack-dev libblas-dev
  has gfortran && has_arpack || echo libarpack2-dev
  [[ -x .venv/bin/python ]] || find_python >/dev/null || echo python3-venv
}

install_packages() {
  local packages as_root=()
  mapfile -t packages < <(missing_packages | tr ' ' '\n')
  [[ ${#packages[@]} -gt 0 ]] || return 0
  if [[ $EUID -ne 0 ]]; then
    as_root=(sudo -n)
    if ! has sudo || ! sudo -n true 2>/dev/null; then as_root=(); fi
  fi
  if ! has apt-get || [[ $EUID -ne 0 && ${#as_root[@]} -eq 0 ]]; then
    cat >&2 <<END
setup.sh: these are missing, and only root on Debian or Ubuntu can have them installed here (Debian's names):
  ${packages[*]}
Install them, for example by
  sudo apt-get update && sudo apt-get install ${packages[*]}
or load modules that provide them (gfortran 12, CMake 3.25, Ninja or make, MPI, HDF5 with Fortran, LAPACK, ARPACK,
Python 3.11 or newer),
then start again.
END
    exit 2
  fi
  quietly "updating the list of packages" "${as_root[@]}" apt-get update
  quietly "installing ${packages[*]}" \
    "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends "${packages[@]}"
  mapfile -t packages < <(missing_packages | tr ' ' '\n')
  [[ ${#packages[@]} -eq 0 ]] || fail "still missing after the installation: ${packages[*]}"
}

# install_python ARGUMENTS OF PIP…: translated on all cores, and not the packages' own tests, which is most of what pip would do alone.
install_python() {
  .venv/bin/python -m pip install --disable-pip-version-check --no-compile "$@" || return
  # Templates in the folders of packages are no Python.
  .venv/bin/python -m compileall -q -j 0 -x /tests/ .venv/lib || true
}

# make_environment [tests]: what the commands need, and what the tests need besides.
make_environment() {
  local python stamp=.venv/requirements.sha256 wanted packages=(-e "./post[check,shapes,view]")
  wanted=$(cat post/pyproject.toml tests/requirements.txt | sha256sum)
  if [[ ${1-} == tests ]]; then
    packages=(-e "./post[test]" -r tests/requirements.txt)
    wanted+=" tests"
  fi
  if [[ -f $stamp && $(<"$stamp") == "$wanted"* ]] && .venv/bin/razy-plot --help >/dev/null 2>&1; then return; fi
  if ! .venv/bin/python -m pip --version >/dev/null 2>&1; then
    python=$(find_python) || fail "no Python 3.11 or newer that can make an environment"
    quietly "making a Python environment in .venv" "$python" -m venv --clear .venv
  fi
  # The name of the package up to 0.2, whose programs have the same names.
  .venv/bin/python -m pip uninstall --disable-pip-version-check --yes --quiet razy-post >/dev/null 2>&1 || true
  quietly "installing Python packages into .venv" install_python "${packages[@]}"
  echo "$wanted" >"$stamp"
}

# build PRESET TARGET
build() {
  quietly "configuring $1" cmake --preset "$1"
  quietly "building $1" cmake --build --preset "$1" --parallel "$cores" --target "$2"
}

# prepare [tests]
prepare() {
  cores=$(nproc)
  install_packages
  make_environment "$@"
  if has ninja; then export CMAKE_GENERATOR=${CMAKE_GENERATOR:-Ninja}; fi
  # Open MPI refuses root, and more ranks than cores, unless told otherwise.
  if [[ $EUID -eq 0 ]]; then export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1; fi
  # The second is the name of it from Open MPI 5 on.
  export OMPI_MCA_rmaps_base_oversubscribe=1 PRTE_MCA_rmaps_default_mapping_policy=:oversubscribe
}

# build_release TARGET
build_release() {
  build release "$1"
  local program
  for program in check csv doctor export import-ross merge plot report view; do ln -sfn "../../.venv/bin/razy-$program" "build/bin/razy-$program"; done
}

demo() {
  local scene=torsional_gear_pair folder=build/demo start ranks
  prepare
  build_release programs
  mkdir -p "$folder"
  ranks=$((cores < 2 ? 2 : cores))
  echo "mpirun -n $ranks razy-sweep inputs/$scene.nml"
  start=$(date +%s%N)
  mpirun -n "$ranks" build/bin/razy-sweep "inputs/$scene.nml" --output "$folder/$scene.h5" --force </dev/null
  build/bin/razy-plot "$folder/$scene.h5" --save "$folder/$scene.png" --force
  echo "results: $PWD/$folder/$scene.h5"
  echo "picture: $PWD/$folder/$scene.png"
  LC_ALL=C awk -v start="$start" -v end="$(date +%s%N)" \
    'BEGIN { printf "time of sweep and picture: %.1f s\n", (end - start) / 1e9 }'
}

thesis() {
  prepare
  build_release programs
  build/bin/razy-report inputs/thesis --output build/thesis --programs build/bin --jobs "$cores" "$@"
}

# Folders of another BLAS and LAPACK than the programs use: OpenBLAS, or the reference where they use OpenBLAS already.
# The system keeps its own: if OpenBLAS is not installed, Debian's package is unpacked in build/.
other_blas() {
  local system used
  system=/usr/lib/$(gcc -print-multiarch)
  used=$(readlink -f "$(ldd build/bin/razy-run | awk '$1 ~ /libblas|libopenblas/ { print $3; exit }')")
  if [[ $used == *openblas* ]]; then
    echo "$system/blas:$system/lapack"
  elif [[ -e $system/openblas-pthread/liblapack.so.3 ]]; then
    echo "$system/openblas-pthread"
  else
    echo "$PWD/build/openblas$system/openblas-pthread"
  fi
}

unpack_openblas() (
  mkdir -p build/openblas && cd build/openblas || return 1
  apt-get download libopenblas0-pthread || { apt-get update && apt-get download libopenblas0-pthread; } || return 1
  dpkg-deb --extract libopenblas0-pthread_*.deb .
)

test_with_other_blas() {
  local folders first
  folders=$(other_blas)
  first=${folders%%:*}
  if [[ $first == "$PWD"/* && ! -e $first ]]; then
    if ! has apt-get; then
      echo "no OpenBLAS in /usr/lib: the numerical tests ran with one BLAS only"
      return
    fi
    quietly "unpacking OpenBLAS in build/openblas" unpack_openblas
  fi
  [[ -e $first/libblas.so.3 ]] || fail "no libblas.so.3 in $first"
  echo "numerical tests with BLAS and LAPACK of $folders"
  LD_LIBRARY_PATH=$folders${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH} OPENBLAS_NUM_THREADS=1 \
    ctest --preset release --parallel "$cores" --label-regex '^(unit|verification)$' --exclude-regex '^(support|house|io|post|drivers)'
}

run_tests() {
  prepare tests
  build debug all
  build_release all
  # Programs under mpirun mostly wait for its start and end.
  ctest --preset debug --parallel $((2 * cores + 1))
  ctest --preset release --parallel $((2 * cores + 1))
  test_with_other_blas
}

make_docs() {
  make_environment
  quietly "installing FORD and MkDocs into .venv" install_python -r docs/requirements.txt
  quietly "writing build/docs" env COLUMNS=200 PATH="$PWD/.venv/bin:$PATH" .venv/bin/python docs/site/build.py build "$@"
  echo "pages: $PWD/build/docs/index.html"
}

case ${1-help} in
  demo) demo ;;
  thesis)
    shift
    thesis "$@"
    ;;
  test) run_tests ;;
  docs)
    shift
    make_docs "$@"
    ;;
  build)
    prepare tests
    build_release all
    ;;
  environment)
    shift
    prepare "$@"
    ;;
  help | -h | --help) usage ;;
  *)
    usage >&2
    exit 2
    ;;
esac
