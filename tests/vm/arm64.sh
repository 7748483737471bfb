# The guest's part of arm64.c: the arm64 program, with the kernel's test camera and an inertial sensor on USB. What it
# recorded is left on the host.
# machine: aarch64
# modules: vivid dummy_hcd libcomposite usb_f_hid usbhid hid-generic virtio_pci 9pnet_virtio 9p
# module vivid: n_devs=1 node_types=0x1 num_inputs=2 input_types=0xc
# memory: 1024
# shift: 0
. /guest.sh

echo "== program"
/foveola version
/vm_camera_tool /dev/video0 first ksoftirqd/0
make_gadget
plug
/vm_imu_gadget 1000 10 &
connect 640 480 75
start devices 12 eye.source=v4l2 eye.width=640 eye.height=480 eye.hz=75 imu.source=usb threads.fifo=5 \
    display.sink=png output.every=1
showing
finish
grep '^"host"' /out/devices/report.json
cp -r /out/devices /host/
