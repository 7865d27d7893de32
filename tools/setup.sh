#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Everything a fresh clone needs, under build/: the system's tools are checked (and installed where that is allowed), the pinned
# packages of requirements.lock go into build/venv. Runs by itself before any other target; done once, it costs nothing.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
ROOT=$PWD
VENV=$ROOT/build/venv
STAMP=$VENV/stamp
LOG=$ROOT/build/setup.log

say() { printf 'setup: %s\n' "$*"; }
stop() { printf 'setup: %s\n' "$*" >&2; exit 1; }

state() { { echo "$ROOT"; python3 -V; cat requirements.lock pyproject.toml sw/host/pyproject.toml; } 2>&1 | cksum; }

if [ -f "$STAMP" ] && [ "$(cat "$STAMP")" = "$(state)" ] && [ -x "$VENV/bin/python" ]; then
    touch "$STAMP"
    exit 0
fi

# ---- the system's tools: what is missing, and the Debian package that brings it

python_is_new() { python3 -c 'import sys; sys.exit(sys.version_info < (3, 11))' > /dev/null 2>&1; }

has_libpython() {           # cocotb loads Python into the simulator from this library
    python3 - <<'PYTHON'
import ctypes.util, os, sys, sysconfig
get = sysconfig.get_config_var
name = "python{}.{}".format(*sys.version_info[:2])
inside = [os.path.join(get(d) or "", get(n) or "") for d in ("LIBDIR", "LIBPL") for n in ("INSTSONAME", "LDLIBRARY")]
sys.exit(not (any(p.endswith((".so", ".dylib", ".1.0")) and os.path.isfile(p) for p in inside) or ctypes.util.find_library(name)))
PYTHON
}

missing() {                 # lines of `package: what it is for`
    command -v make > /dev/null || echo "make: make runs every step"
    command -v g++ > /dev/null || echo "g++: the C++ compiler builds the simulations"
    command -v iverilog > /dev/null || echo "iverilog: Icarus Verilog runs the unit tests"
    perl -MPod::Usage -e 1 2> /dev/null || echo "perl: Perl with Pod::Usage starts Verilator"
    if ! command -v python3 > /dev/null; then
        echo "python3: Python 3.11 or newer runs everything"
        echo "python3-venv: Python's venv holds the packages"
        return
    fi
    python_is_new || return 0
    local version
    version=$(python3 -c 'import sys; print("{}.{}".format(*sys.version_info[:2]))')
    python3 -c 'import venv, ensurepip' 2> /dev/null || echo "python$version-venv: Python's venv holds the packages"
    has_libpython || echo "libpython$version: cocotb loads Python's shared library into the simulator"
}

mkdir -p build
list=$(missing)
if [ -n "$list" ]; then
    as_root=()
    [ "$(id -u)" = 0 ] || as_root=(sudo -n)
    if command -v apt-get > /dev/null && { [ "$(id -u)" = 0 ] || sudo -n true 2> /dev/null; }; then
        packages=$(cut -d: -f1 <<< "$list" | tr '\n' ' ')
        say "installing $packages(log: build/setup.log)"
        # shellcheck disable=SC2086
        { "${as_root[@]}" apt-get -q update && "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -qy install --no-install-recommends $packages; } \
            < /dev/null > "$LOG" 2>&1 || say "apt-get could not install them; its last word: $(tail -n 1 "$LOG")" >&2
        list=$(missing)
    fi
    if [ -n "$list" ]; then
        while IFS=: read -r package reason; do
            printf 'setup: missing:%s. Install the package %s and run this again.\n' "$reason" "$package" >&2
        done <<< "$list"
        exit 1
    fi
fi
python_is_new || stop "Python 3.11 or newer is needed, $(command -v python3) is $(python3 -V 2>&1). Put a newer python3 first on PATH."

# ---- the packages

if ! "$VENV/bin/python" -c "import sys; sys.exit(sys.prefix != '$VENV' or sys.version_info[:2] != ($(python3 -c 'import sys; print("%d, %d" % sys.version_info[:2])')))" 2> /dev/null \
   || ! head -n 1 "$VENV/bin/pip" 2> /dev/null | grep -qF "$VENV/"; then
    say "making build/venv with $(python3 -V)"
    python3 -m venv --clear "$VENV" > "$LOG" 2>&1 || stop "python3 -m venv failed; its last word: $(tail -n 1 "$LOG")"
fi
pip() { "$VENV/bin/python" -m pip --disable-pip-version-check --no-input -q "$@" < /dev/null > "$LOG" 2>&1; }
last_word() { grep -E '^ERROR' "$LOG" | tail -n 1 | cut -c1-300 || true; }

say "fetching $(grep -c == requirements.lock) pinned Python packages into build/venv: about 1.6 GB on the disk, some minutes the first time"
pip install --no-deps -r requirements.lock \
    || stop "the Python packages could not be fetched: is there a way to a Python package index? pip's last word: $(last_word) (log: build/setup.log)"
pip install --no-deps --no-build-isolation -e ./sw/host -e . \
    || stop "the project's own packages could not be installed; pip's last word: $(last_word) (log: build/setup.log)"
pip check || stop "requirements.lock does not fit together: $(head -n 1 "$LOG")"
state > "$STAMP"
say "done"
