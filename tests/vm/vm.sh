#!/bin/sh
# vm.sh CACHE SCRIPT PROGRAM...: boots Debian's kernel under QEMU's software emulation with nothing but busybox and the
# static programs, runs SCRIPT in it and prints what it prints. Lines of the script say what it needs: "# modules: ...",
# "# module NAME: ..." their parameters, "# files: ..." of the source, "# devices: ..." of QEMU's, "# memory: MB",
# "# shift: N" a guest's instruction takes 2^N ns, "# machine: aarch64" for another than x86_64. With the module 9p the
# folder FV_VM_SHARE is the guest's /host.
# Guest time follows instructions (-icount), so rates hold on a busy machine; it says nothing about speed.
# Exit: 0 when the script ran to its end, 77 where QEMU, busybox, the kernel or a module (./bootstrap vm) are not there;
# 1 then, too, with CI=true.
set -eu
cache=$1 script=$2
shift 2
PATH=$PATH:/usr/sbin:/sbin
lack() {
    echo "vm: $1"
    [ "${CI:-}" = true ] && exit 1
    exit 77
}
# option NAME DEFAULT: of the script's line "# NAME: ...".
option() {
    said=$(sed -n "s/^# $1: //p" "$script")
    echo "${said:-$2}"
}
machine=$(option machine x86_64)
case $machine in
x86_64)
    kernel=$cache/vm-kernel busybox=$(command -v busybox) || lack "no busybox here"
    strip=strip console=ttyS0 cpu="-M q35 -cpu max"
    ;;
aarch64)
    kernel=$cache/vm-kernel-aarch64 busybox=$cache/vm-kernel-aarch64/bin/busybox
    strip=aarch64-linux-gnu-strip console=ttyAMA0 cpu="-M virt -cpu cortex-a57"
    ;;
esac
for tool in qemu-system-$machine $strip cpio modprobe; do
    command -v $tool >/dev/null || lack "no $tool here"
done
[ -f "$kernel/done" ] || lack "no kernel in $kernel"
for program in "$@"; do [ -x "$program" ] || lack "no program $program"; done
version=$(ls "$kernel/lib/modules")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p "$work/root/bin" "$work/root/dev" "$work/root/proc" "$work/root/sys" "$work/root/tmp" "$work/root/etc" \
    "$work/root/modules"
cp "$busybox" "$work/root/bin/busybox"
for program in "$@"; do $strip -o "$work/root/$(basename "$program")" "$program"; done
cp "$script" "$work/root/script"
here=$(dirname "$0")
for file in $(option files ""); do cp "$here/../../$file" "$work/root/"; done
cp "$here/guest.sh" "$work/root/"
printf 'root:x:0:0::/:/bin/sh\nnobody:x:99:99::/:/bin/sh\n' >"$work/root/etc/passwd"
for module in $(option modules ""); do
    modprobe -d "$kernel" -S "$version" --show-depends "$module" >>"$work/needed" || lack "no module $module in $kernel"
done
awk '$1 == "insmod" && !seen[$2]++ { print $2 }' "$work/needed" >"$work/modules"
while read -r file; do
    cp "$file" "$work/root/modules/"
    basename "$file" >>"$work/root/modules/order"
done <"$work/modules"
cat >"$work/root/init" <<'END'
#!/bin/busybox sh
/bin/busybox --install -s /bin
mount -t proc proc /proc
mount -t sysfs sys /sys
mount -t devtmpfs dev /dev
echo 1 >/proc/sys/vm/overcommit_memory
while read -r module; do
    insmod /modules/$module $(sed -n "s/^# module ${module%.ko}: //p" /script) || echo "vm: insmod $module failed"
done </modules/order
[ ! -d /sys/kernel/config ] || mount -t configfs config /sys/kernel/config
[ ! -d /sys/module/9p ] || { mkdir /host && mount -t 9p -o trans=virtio,version=9p2000.L host /host; }
sh /script && echo "vm: done"
poweroff -f
END
chmod +x "$work/root/init"
(cd "$work/root" && find . | cpio -o -H newc --quiet) >"$work/initrd" # packed it would take longer
share=
case " $(option modules "") " in *" 9p "*) share="-virtfs local,path=$FV_VM_SHARE,mount_tag=host,security_model=none" ;; esac
# shellcheck disable=SC2046,SC2086
timeout 400 qemu-system-$machine $cpu -accel tcg,thread=single -smp 1 \
    -icount shift="$(option shift 1)",sleep=off -m "$(option memory 512)" -nodefaults -no-user-config -display none -serial stdio -no-reboot \
    -kernel "$kernel"/boot/vmlinuz-* -initrd "$work/initrd" $share \
    $(option devices "") -append "console=$console quiet panic=-1 mitigations=off" </dev/null | stdbuf -oL tr -d '\r' | tee "$work/output"
grep -q '^vm: done' "$work/output"
