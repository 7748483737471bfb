#!/bin/sh
# package.sh DEB [FOLDER]: installs the package into a bare Debian 12 (made by debootstrap in FOLDER, or already there), runs
# the program and its check, kills a supervised run and waits for it to be back, upgrades, removes and purges; what is left
# behind fails. FV_BACK_MS: within how long it has to be back, on a busy machine (2000). Needs root, debootstrap, dpkg-dev's tools, and a Debian mirror; not part of ctest.
set -eu
deb=$(realpath "$1")
here=$(dirname "$(realpath "$0")")
root=${2:-$(mktemp -d)}
say() { printf '== %s\n' "$*"; }
fail() { printf 'FAILED: %s\n' "$*"; exit 1; }
inside() { chroot "$root" "$@"; }

[ -x "$root/usr/bin/dpkg" ] || debootstrap --variant=minbase bookworm "$root" >/dev/null
rm -rf "$root/tmp/work"
mkdir -p "$root/tmp/work"
find "$root/etc" "$root/usr" "$root/lib" "$root/var/lib" -name '*foveola*' | grep . && fail "something is there before"

say install
cp "$deb" "$root/tmp/work/foveola.deb"
inside dpkg -i /tmp/work/foveola.deb >/dev/null
inside foveola version
[ -s "$root/etc/foveola/foveola.ini" ] || fail "no settings"

say "run, and check"
small="--set display.headset=small --set scene.name=cornell"
# shellcheck disable=SC2086
inside foveola run --config /etc/foveola/foveola.ini $small --frames 20 --out /tmp/work/out 2>"$root/tmp/work/log" || fail "run"
grep -q '20 frames of cornell' "$root/tmp/work/log" || fail "no 20 frames"
# shellcheck disable=SC2086
inside foveola check --config /etc/foveola/foveola.ini $small --set budget.hz=5 --seconds 0.5 >"$root/tmp/work/checked" || {
    cat "$root/tmp/work/checked"
    fail "check"
}
for board in "$root"/usr/share/foveola/config/boards/*.ini; do
    case $board in */rk3588.ini) continue ;; esac # its cores are not here
    inside foveola plan --config "${board#"$root"}" $small >/dev/null || fail "$board"
done

say "killed, it is back"
# As the unit does: always, 100 ms later; of a run that is killed, frames.csv.part is left.
supervised() {
    for _ in 1 2 3 4; do
        # Not by inside: the shell that a function runs in would be killed in its place.
        chroot "$root" foveola run --config /etc/foveola/foveola.ini --set display.headset=small --out /tmp/work/kept &
        echo $! >"$root/tmp/work/pid"
        wait $! || true
        sleep 0.1
    done
}
supervised 2>/dev/null &
supervisor=$!
mark=$root/tmp/work/kept/frames.csv.part
await() {
    for _ in $(seq 500); do
        [ -e "$mark" ] && return 0
        sleep 0.01
    done
    kill -9 "$(cat "$root/tmp/work/pid")" "$supervisor" 2>/dev/null || true
    fail "no frames in five seconds"
}
await
soon=0
for _ in 1 2 3; do
    sleep 0.5
    rm -f "$mark"
    from=$(date +%s%N)
    kill -9 "$(cat "$root/tmp/work/pid")"
    await
    ms=$((($(date +%s%N) - from) / 1000000))
    say "frames again after $ms ms (the atrium)"
    [ "$ms" -ge "${FV_BACK_MS:-2000}" ] || soon=$((soon + 1))
done
kill -9 "$(cat "$root/tmp/work/pid")"
wait
[ "$soon" -ge 2 ] || fail "that is more than ${FV_BACK_MS:-2000} ms"

say upgrade
# systemd stands in as a list of what it is told; the service is enabled.
mkdir -p "$root/run/systemd/system" "$root/etc/systemd/system/multi-user.target.wants"
printf '#!/bin/sh\necho "$@" >>/tmp/work/told\n' >"$root/usr/local/bin/systemctl"
chmod 755 "$root/usr/local/bin/systemctl"
ln -sf /lib/systemd/system/foveola.service "$root/etc/systemd/system/multi-user.target.wants/foveola.service"
told() { grep -q -- "$1" "$root/tmp/work/told" || fail "$2: systemctl was not told: $1"; }
echo '; kept' >>"$root/etc/foveola/foveola.ini"
rm -rf "$root/tmp/work/newer"
dpkg-deb -R "$deb" "$root/tmp/work/newer"
sed -i 's/^Version: .*/&.1/' "$root/tmp/work/newer/DEBIAN/control"
dpkg-deb --root-owner-group -b "$root/tmp/work/newer" "$root/tmp/work/newer.deb" >/dev/null
inside dpkg -i /tmp/work/newer.deb >/dev/null
grep -q '^; kept' "$root/etc/foveola/foveola.ini" || fail "settings were not kept"
inside foveola version >/dev/null
told daemon-reload upgrade
told 'try-restart foveola.service' upgrade
rm "$root/tmp/work/told"

say remove
inside dpkg -r foveola >/dev/null
told 'stop foveola.service' remove
told daemon-reload remove
[ ! -e "$root/usr/bin/foveola" ] || fail "the program is left"
[ -e "$root/etc/foveola/foveola.ini" ] || fail "settings are gone before the purge"

say purge
mkdir -p "$root/var/lib/foveola/session"
inside dpkg -P foveola >/dev/null
rm -rf "$root/run/systemd" "$root/usr/local/bin/systemctl"
find "$root/etc" "$root/usr" "$root/lib" "$root/var/lib" -name '*foveola*' | grep . && fail "something is left"

say "the unit"
# A group that is not there keeps it from starting: Debian has it, or the package makes it.
for group in $(sed -n 's/^SupplementaryGroups=//p' "$here/../../config/systemd/foveola.service"); do
    grep -q "^g $group " "$here/../../config/systemd/sysusers.conf" || grep -q "^$group:" "$root/usr/share/base-passwd/group.master" ||
        fail "nobody makes the group $group"
done
if command -v systemd-sysusers >/dev/null; then
    systemd-sysusers --dry-run "$here/../../config/systemd/sysusers.conf" >/dev/null || fail "sysusers.d"
fi
if command -v systemd-analyze >/dev/null; then
    unit=$(mktemp -d)
    # The program is not installed here: any other stands for it.
    sed 's|/usr/bin/foveola|/bin/true|; /^Documentation/d' "$here/../../config/systemd/foveola.service" >"$unit/foveola.service"
    systemd-analyze verify "$unit/foveola.service" || fail "systemd-analyze verify"
    rm -rf "$unit"
fi
rm -rf "$root/tmp/work"
say passed
