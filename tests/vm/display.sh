# The guest's part of display.c: a display with a vertical blank (vkms), then two without (bochs, virtio-gpu).
# modules: vkms bochs virtio_pci virtio-gpu
# module vkms: enable_cursor=0
# memory: 1024
# shift: 0
# devices: -device bochs-display -device virtio-gpu-pci
small="scene.name=primitives display.headset=small display.width=24 display.height=20 scene.path_seconds=0 imu.source=none eye.source=none method.name=full threads.workers=1 output.tape=off"

# show NAME FRAMES SETTING...: a run with the display, in the background.
show() {
    name=$1 frames=$2
    shift 2
    sets=
    for set in $small display.sink=kms "$@"; do sets="$sets --set $set"; done
    echo "== $name"
    /foveola run --frames $frames --out /out/$name $sets 2>/said &
    run=$!
}
ended() {
    wait $run
    echo "exit $?"
    grep '^foveola: ' /said
    [ ! -f /out/$name/report.json ] || grep '^"\(frames\|missed\|skipped\|period_ms\|display\|sealed\)"' /out/$name/report.json
}
# The card of a driver becomes card0.
card() { for c in /sys/class/drm/card[0-9]; do case $(readlink $c/device/driver; readlink $c/device) in *$1*) basename $c ;; esac; done; }
vkms=$(card vkms) bochs=$(card bochs) virtio=$(card virtio)
echo "cards: vkms $vkms, bochs $bochs, virtio $virtio"
mv /dev/dri/$vkms /dev/dri/vkms
mv /dev/dri/$bochs /dev/dri/bochs
mv /dev/dri/$virtio /dev/dri/virtio
ln -s vkms /dev/dri/card0

sets=
for set in $small; do sets="$sets --set $set"; done
/foveola run --frames 2 --out /png $sets 2>/dev/null

echo "== before"
/vm_kms_tool state

show steady 600 budget.pace=vsync
sleep 4
mkdir /back
/vm_kms_tool state
/vm_kms_tool read /back 24 20
ended
cmp /back/left.png /png/left-00001.png && cmp /back/right.png /png/right-00001.png && echo "same pictures"
/vm_kms_tool state

show free 120 display.buffers=2
ended

show ended 100000 budget.pace=vsync
sleep 3
kill -TERM $run
ended
/vm_kms_tool state

show unplugged 480 budget.pace=vsync
sleep 2.5
plugged=/sys/class/drm/$vkms-Virtual-1/status
echo off >$plugged
sleep 2
/vm_kms_tool state
echo detect >$plugged
ended

echo "== held"
/vm_kms_tool hold 3 &
sleep 1
/foveola run --frames 1 --out /out/held --set display.sink=kms --set scene.name=cornell --set display.headset=small
echo "exit $?"
wait

show refused 1 display.connector=DP-9
ended
show nomode 1 display.mode=333x222
ended

for blankless in bochs virtio; do
    rm /dev/dri/card0
    ln -s $blankless /dev/dri/card0
    show $blankless 60 budget.pace=vsync budget.hz=20
    sleep 2
    /vm_kms_tool read /back 24 20
    ended
    cmp /back/left.png /png/left-00001.png && cmp /back/right.png /png/right-00001.png && echo "same pictures"
done
