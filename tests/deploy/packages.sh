#!/bin/sh
# packages.sh BUILD CROSS-BUILD: packs what is built for amd64 and for arm64, and looks at both packages: of which machine
# they and their program are, that they hold the same files with the same rights, and that each program runs, arm64's in
# the emulator. Where lintian is installed it has nothing to say. Exit: 77 where CROSS-BUILD (./bootstrap aarch64) is not
# there; 1 then, too, with CI=true.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
fail() { printf 'FAILED: %s\n' "$*"; exit 1; }
[ -x "$2/foveola" ] || {
    echo "no program in $2"
    [ "${CI:-}" = true ] && exit 1
    exit 77
}

# look ARCHITECTURE BUILD ELF-MACHINE EMULATOR...
look() {
    architecture=$1 build=$2 machine=$3
    shift 3
    cmake --build "$build" --target package_files >"$work/log" || { cat "$work/log"; fail "$build: package_files"; }
    (cd "$build" && cpack -B "$work/$architecture") >"$work/log" 2>&1 || { cat "$work/log"; fail "$build: cpack"; }
    deb=$(echo "$work/$architecture"/foveola_*_"$architecture".deb)
    [ "$(dpkg-deb -f "$deb" Architecture)" = "$architecture" ] || fail "$deb is not of $architecture"
    dpkg-deb -c "$deb" | awk '{ print $1, $2, $6 }' >"$work/$architecture.files"
    dpkg-deb -x "$deb" "$work/$architecture/root"
    program=$work/$architecture/root/usr/bin/foveola
    [ "$(od -An -tu2 -j18 -N2 "$program" | tr -d ' ')" = "$machine" ] || fail "$program is of another machine"
    "$@" "$program" version || fail "$program does not run"
    ! command -v lintian >/dev/null || [ -z "$(lintian "$deb" 2>/dev/null)" ] || { lintian "$deb"; fail "lintian"; }
    echo "$architecture: $(stat -c %s "$deb") bytes, $(grep -c . "$work/$architecture.files") files and folders"
}
look amd64 "$1" 62
look arm64 "$2" 183 qemu-aarch64-static
diff "$work/amd64.files" "$work/arm64.files" || fail "they hold different files"
