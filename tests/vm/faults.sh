# The guest's part of faults.c: every fault of the design's table, one after another, while the program renders to a display.
# modules: v4l2loopback dummy_hcd libcomposite usb_f_hid usbhid hid-generic vkms
# module v4l2loopback: devices=1 video_nr=9 exclusive_caps=0 max_buffers=4
# module vkms: enable_cursor=0
# memory: 1024
# shift: 0
. /guest.sh
cat >/faults.ini <<'END'
[scene]
name = cornell
[display]
headset = small
width = 32
height = 32
sink = kms
[budget]
hz = 60
pace = vsync
adapt = on
[threads]
workers = 1
fifo = 5
[eye]
source = v4l2
device = /dev/v4l/by-id/eye
width = 192
height = 192
confidence = 0.85
[imu]
source = usb
device = 28de:2000
layout = id -1, bytes 52, readings 1, first 0, acc 0, rate 12, counter 24, counter_bytes 4, number f32, acc_unit 1,
  rate_unit 1, counter_bits 32, tick_ns 1e6, hz 1000
END

# Until it is said, for five seconds at most.
said() {
    n=0
    until grep -q "$1" /said; do
        sleep 0.1
        n=$((n + 1))
        [ $n -lt 50 ] || return 0
    done
}
next() {
    kill -USR1 $1
    sleep $2
}
see() {
    rm -f /eye.txt
    /vm_camera_eye "$@" >/eye.txt &
    camera=$!
    until [ -s /eye.txt ]; do sleep 0.1; done
    point $1
}
report() { [ ! -f $1/report.json ] || grep '^"' $1/report.json; }

/vm_camera_tool /dev/video9 first ksoftirqd/0
make_gadget
plug
/vm_imu_gadget 1000 60 sound nan huge saturated stuck repeated back sound &
imu=$!
see /dev/video9 192 192 120 60 told 5,-6 5,-6,0 5,-6 5,-6,0.42 5,-6,-1 5,-6

echo "== faults"
/foveola run --config /faults.ini --out /out/faults 2>/said &
run=$!
begun $run /out/faults
sleep 1
# Lids close for a moment, half, and the headset is taken off.
next $camera 0.2
next $camera 0.3
next $camera 0.4
next $camera 1.4
next $camera 0.3
# The sensor: nan, huge, saturated, stuck, repeated, back, sound.
for seconds in 0.2 0.2 0.2 0.4 0.3 0.3 0.3; do next $imu $seconds; done
unplug
sleep 0.4
# Late: the whole program stands still; something else takes the processor.
kill -STOP $run
sleep 0.3
kill -CONT $run
plug
sleep 0.5
/vm_hog 9 29 1
# The display: another flips it, an event of it is lost, it is unplugged.
/vm_kms_tool flip $run 10
/vm_kms_tool steal $run
said "display lost (a flip was never over)"
sleep 1.2
echo off >/sys/class/drm/card0-Virtual-1/status
said "display lost (unplugged)"
# The camera, meanwhile: it is gone, and comes back by another name.
kill $camera
n=0
until rmmod v4l2loopback 2>/dev/null; do sleep 0.1; n=$((n + 1)); done
rm $eye
echo detect >/sys/class/drm/card0-Virtual-1/status
sleep 0.3
insmod /modules/v4l2loopback.ko devices=1 video_nr=3 exclusive_caps=0 max_buffers=4
see /dev/video3 192 192 120 60 told 5,-6
sleep 1.2
kill -TERM $run
wait $run
echo "exit $?"
kill $camera
grep '^foveola: ' /said
report /out/faults

# A disk that is full, and a player that ends.
echo "== recorded"
mkdir -p /out/recorded/tape
mount -t tmpfs -o size=32k none /out/recorded/tape
mkfifo /pipe
head -c 400000 /pipe >/dev/null &
/foveola run --config /faults.ini --set eye.source=sim --set display.sink=y4m --set display.y4m_path=/pipe --frames 120 \
    --out /out/recorded 2>/said
echo "exit $?"
grep '^foveola: ' /said
kill $imu
report /out/recorded

# Nothing is run.
printf '[budget]\nhz = 60\nadpat = on\n' >/bad.ini
printf 'v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n' >/bad.obj
refuse() {
    name=$1
    shift
    echo "== $name"
    /foveola run --out /out/$name "$@" 2>&1 | tail -n 3
    /foveola run --out /out/$name "$@" 2>/dev/null
    echo "exit $?"
    [ ! -e /out/$name ] || echo "left something"
}
refuse settings --config /bad.ini
refuse scene --config /faults.ini --set scene.file=/bad.obj --set eye.source=none --set imu.source=none --set display.sink=none
refuse argument --frames many
