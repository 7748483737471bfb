# The guest's part of devices.c: an eye camera at 120 Hz and an inertial sensor at 1 kHz while the program renders.
# modules: v4l2loopback dummy_hcd libcomposite usb_f_hid usbhid hid-generic
# module v4l2loopback: devices=1 video_nr=9 exclusive_caps=0 max_buffers=4
# memory: 1024
# shift: 0
. /guest.sh

# As a board would run it: the threads of the devices get the processor first, those of the kernel before them.
/vm_camera_tool /dev/video9 first ksoftirqd/0
both="eye.source=v4l2 eye.width=192 eye.height=192 imu.source=usb threads.fifo=5"

# see NUMBER SECONDS: the camera shows an eye, for so long at most.
see() {
    rm -f /eye.txt
    /vm_camera_eye /dev/video$1 192 192 120 $2 5,-3 >/eye.txt &
    camera=$!
    until [ -s /eye.txt ]; do sleep 0.1; done
    point /dev/video$1
}

make_gadget
plug
/vm_imu_gadget 1000 33 &
see 9 32
start steady 300 $both
finish
wait

/vm_imu_gadget 1000 13 &
see 9 20
start unplugged 120 $both
sleep 2
unplug
kill $camera
# The driver goes as soon as the program does not hold the device.
n=0
until rmmod v4l2loopback 2>/dev/null; do sleep 0.1; n=$((n + 1)); done
rm $eye
echo "camera gone: $(ls /dev/video* 2>/dev/null)"
sleep 1
plug
insmod /modules/v4l2loopback.ko devices=1 video_nr=3 exclusive_caps=0 max_buffers=4
see 3 20
sleep 2
unplug
sleep 1.5
plug
finish
cat /eye.txt
kill $camera
wait
