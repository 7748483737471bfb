#!/bin/sh
# vm.sh CACHE SCRIPT PROGRAM...: boots Debian's kernel under QEMU's software emulation with nothing but busybox and the
# static programs, runs SCRIPT in it and prints what it prints. The script's line "# modules: ..." says what it needs.
# Guest time follows instructions (-icount), so rates hold on a busy machine; it says nothing about speed.
# Exit: 0 when the script ran to its end, 77 where QEMU, busybox or the kernel (./bootstrap vm) are not there.
set -eu
kernel=$1/vm-kernel script=$2
shift 2
for tool in qemu-system-x86_64 busybox cpio modprobe; do
    PATH=$PATH:/usr/sbin:/sbin command -v $tool >/dev/null || { echo "vm: no $tool here"; exit 77; }
done
PATH=$PATH:/usr/sbin:/sbin
[ -f "$kernel/done" ] || { echo "vm: no kernel in $kernel"; exit 77; }
version=$(ls "$kernel/lib/modules")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p "$work/root/bin" "$work/root/dev" "$work/root/proc" "$work/root/sys" "$work/root/tmp" "$work/root/etc" \
    "$work/root/modules"
cp "$(command -v busybox)" "$work/root/bin/busybox"
cp "$@" "$work/root/"
cp "$script" "$work/root/script"
printf 'root:x:0:0::/:/bin/sh\nnobody:x:99:99::/:/bin/sh\n' >"$work/root/etc/passwd"
for module in $(sed -n 's/^# modules: //p' "$script"); do
    modprobe -d "$kernel" -S "$version" --show-depends "$module"
done | awk '$1 == "insmod" && !seen[$2]++ { print $2 }' >"$work/modules"
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
while read -r module; do insmod /modules/$module || echo "vm: insmod $module failed"; done </modules/order
mount -t configfs config /sys/kernel/config
sh /script && echo "vm: done"
poweroff -f
END
chmod +x "$work/root/init"
(cd "$work/root" && find . | cpio -o -H newc --quiet) | gzip -1 >"$work/initrd"
timeout 250 qemu-system-x86_64 -M q35 -accel tcg,thread=single -cpu max -smp 1 -icount shift=1,sleep=off -m 512 \
    -nodefaults -no-user-config -display none -serial stdio -no-reboot \
    -kernel "$kernel"/boot/vmlinuz-* -initrd "$work/initrd" \
    -append "console=ttyS0 quiet panic=-1 mitigations=off" </dev/null | tr -d '\r' | tee "$work/output"
grep -q '^vm: done' "$work/output"
