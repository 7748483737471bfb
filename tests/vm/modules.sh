#!/bin/sh
# modules.sh VERSION RELEASE PREFIX: modules that Debian's kernel lacks, built from Debian's sources of the same VERSION
# (of the package, 6.1.192-2) and added to the kernel unpacked in PREFIX (its release, 6.1.0-56-amd64). Nothing is
# installed. A package that cannot be had is said, and only what is made of it is left out.
# Exit: 0 when all are there, 1 when some are, 2 when none could be built.
set -eu
version=$1 release=$2 prefix=$3
series=$(echo "$release" | cut -d. -f1,2)
headers=linux-headers-${release%-*}
work=$prefix/work
mkdir -p "$work/packages" "$work/root" "$work/build"

# Module (a folder's has a slash at its end) | package | what of it: files of the package, or of the tarball in it.
modules="v4l2loopback v4l2loopback-dkms v4l2loopback.c v4l2loopback_formats.h
irq_sim linux-source-$series=$version kernel/irq/irq_sim.c
gpio-sim linux-source-$series=$version drivers/gpio/gpio-sim.c drivers/gpio/gpiolib.h
vkms/ linux-source-$series=$version drivers/gpu/drm/vkms"

say() { echo "modules: $*" >&2; }

# fetch PACKAGE[=VERSION]: into its own folder, once; prints the file.
fetch() {
    folder=$work/packages/$1
    [ -d "$folder" ] || {
        mkdir "$folder"
        (cd "$folder" && apt-get -o APT::Sandbox::User="$(id -un)" download -qq "$1" >&2) || true
    }
    find "$folder" -name '*.deb' | grep . || { say "Debian's package $1 cannot be had"; return 1; }
}

# What the kernel's build needs: its headers and tools, with the one absolute path in them turned to this folder.
for package in "$headers-${release##*-}=$version" "$headers-common=$version" "linux-kbuild-$series=$version"; do
    deb=$(fetch "$package") || exit 2
    dpkg-deb -x "$deb" "$work/root"
done
sed -i "s,/usr/src,$work/root/usr/src," "$work/root/usr/src/linux-headers-$release/Makefile"

# take DEB FILES...: these files out of the package, or out of the kernel's tarball in it, into the build's folder.
take() {
    deb=$1
    shift
    mkdir -p "$work/taken"
    tarball=$(dpkg-deb --fsys-tarfile "$deb" | tar -t | grep '/linux-source-.*\.tar\.xz$') || {
        dpkg-deb -x "$deb" "$work/taken"
        for file in "$@"; do cp "$work"/taken/usr/src/*/"$file" "$work/build/"; done
        return
    }
    [ -f "$work/taken/tarball" ] || { # minutes of reading, so for all modules at once
        # shellcheck disable=SC2046
        dpkg-deb --fsys-tarfile "$deb" | tar -xO "$tarball" | tar -xJ -C "$work/taken" --strip-components=1 \
            $(echo "$modules" | sed -n 's,^[^ ]* linux-source-[^ ]* ,,p' | tr ' ' '\n' |
                sed "s,^,linux-source-$series/,")
        touch "$work/taken/tarball"
    }
    for file in "$@"; do cp -r "$work/taken/$file" "$work/build/"; done
}

code=0
echo "$modules" >"$work/modules"
while read -r module package files; do
    # shellcheck disable=SC2086
    if deb=$(fetch "$package") && take "$deb" $files; then
        case $module in
        */) echo "obj-m += $module" ;;
        *) echo "obj-m += $module.o" ;;
        esac >>"$work/build/Kbuild"
    else
        say "left out: $module"
        code=1
    fi
done <"$work/modules"
[ -f "$work/build/Kbuild" ] || exit 2

# irq_sim is no module in the kernel's own tree: what it needs to be one, and the one function that modules may not call.
[ ! -f "$work/build/irq_sim.c" ] ||
    sed -i -e 's/handle_simple_irq(irq_to_desc(irqnum))/generic_handle_irq(irqnum)/' \
        -e '0,/^#include/s//#include <linux\/module.h>\n#include <linux\/irqdomain.h>\n#include/' \
        -e '$aMODULE_LICENSE("GPL");' "$work/build/irq_sim.c"
make -C "$work/root/usr/src/linux-headers-$release" M="$work/build" CONFIG_DEBUG_INFO_BTF_MODULES= \
    CONFIG_DRM_VKMS=m modules >&2 || exit 2

added=$prefix/lib/modules/$release/updates
mkdir -p "$added"
find "$work/build" -name '*.ko' -exec strip --strip-debug {} \; -exec cp {} "$added/" \;
PATH=$PATH:/usr/sbin:/sbin depmod -b "$prefix" "$release"
rm -rf "$work"
exit $code
