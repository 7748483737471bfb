# The guest's part of imu_usb.c: a gadget that looks like an HTC Vive on a made-up host controller.
# modules: dummy_hcd libcomposite usb_f_hid usbhid hid-generic
. /guest.sh
driven() { [ -e /sys/bus/usb/drivers/usbhid/1-1:1.0 ] && echo yes || echo no; }

echo "== absent"
/vm_imu_probe 1

make_gadget
plug
sleep 1

echo "== forbidden"
chmod 600 /dev/bus/usb/001/*
su nobody -s /bin/sh -c "/vm_imu_probe 1"
echo "== other"
/vm_imu_probe 1 imu.device=LHR-2
echo "== interface"
/vm_imu_probe 1 imu.device=28de:2000 "imu.layout=interface 3"
echo "== unknown"
/vm_imu_probe 1 imu.device=1d6b:0002

echo "== steady"
/vm_imu_gadget 1000 13 &
sleep 1
/vm_imu_probe 10 imu.device=LHR-1
wait
echo "driver given back: $(driven)"

echo "== unplugged"
/vm_imu_gadget 1000 14 &
sleep 1
/vm_imu_probe 12 &
probe=$!
sleep 1
echo "driver detached: $(driven)"
for i in 1 2; do
    sleep 2
    unplug
    sleep 2
    plug
done
wait $probe
wait
