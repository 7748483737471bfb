# What the scripts in the guest share: runs of the program, and a gadget that looks like an HTC Vive's sensor.
eye=/dev/v4l/by-id/eye
mkdir -p /dev/v4l/by-id
cat >/settings.ini <<'END'
[scene]
name = cornell
[display]
headset = small
width = 64
height = 64
sink = none
[budget]
hz = 10
pace = vsync
[threads]
workers = 1
[eye]
device = /dev/v4l/by-id/eye
END

# start NAME FRAMES SETTING...: a run of so many frames, 10 a second; finish: what became of it.
start() {
    name=$1 frames=$2
    shift 2
    sets=
    for set in "$@"; do sets="$sets --set $set"; done
    echo "== $name"
    /foveola run --config /settings.ini --frames $frames --out /out/$name $sets 2>/said &
    run=$!
}
finish() {
    wait $run
    echo "exit $?"
    grep '^foveola: ' /said
    [ ! -f /out/$name/report.json ] || grep '^"\(frames\|frame_ms\|gaze\|imu\|sealed\)"' /out/$name/report.json
}

# begun PROCESS OUT: waits until a run has begun, or ended.
begun() {
    until [ -f $2/frames.csv.part ] || ! kill -0 $1 2>/dev/null; do sleep 0.1; done
}

# The camera that the settings name, as udev would name it.
point() { ln -sf $1 $eye; }

# The kernel's test camera (vivid): its second input, HDMI, takes any size and rate.
vivid() { /vm_camera_tool $vivid "$@"; }
connect() {
    vivid=/dev/$(ls /sys/bus/platform/devices/vivid.0/video4linux)
    point $vivid
    vivid input 1
    vivid set timestamp_source 1
    vivid timings "$@"
    vivid set test_pattern 5 # black, as a picture full of edges takes long to search
}

# showing: waits for the camera to stream anew, and lets it show its pictures in time.
showing() { vivid first vivid-000-vid; }

# The gadget, not yet plugged in; plug, unplug.
gadget=/sys/kernel/config/usb_gadget/vive
make_gadget() {
    mkdir $gadget
    cd $gadget
    echo 0x28de >idVendor
    echo 0x2000 >idProduct
    mkdir strings/0x409 configs/c.1 functions/hid.0
    echo LHR-1 >strings/0x409/serialnumber
    echo 52 >functions/hid.0/report_length
    echo 0 >functions/hid.0/protocol
    # 52 bytes of the vendor's own.
    printf '\006\000\377\011\001\241\001\025\000\046\377\000\165\010\225\064\011\001\201\002\300' \
        >functions/hid.0/report_desc
    ln -s functions/hid.0 configs/c.1/
    cd /
}
plug() { ls /sys/class/udc >$gadget/UDC; }
unplug() { echo "" >$gadget/UDC; }
