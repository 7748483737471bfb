# The guest's part of imu_usb.c: a gadget that looks like an HTC Vive on a made-up host controller.
# modules: dummy_hcd libcomposite usb_f_hid usbhid hid-generic
gadget=/sys/kernel/config/usb_gadget/vive
driven() { [ -e /sys/bus/usb/drivers/usbhid/1-1:1.0 ] && echo yes || echo no; }

echo "== absent"
/vm_imu_probe 1

mkdir $gadget
cd $gadget
echo 0x28de >idVendor
echo 0x2000 >idProduct
mkdir strings/0x409 configs/c.1 functions/hid.0
echo LHR-1 >strings/0x409/serialnumber
echo 52 >functions/hid.0/report_length
echo 0 >functions/hid.0/protocol
# 52 bytes of the vendor's own.
printf '\006\000\377\011\001\241\001\025\000\046\377\000\165\010\225\064\011\001\201\002\300' >functions/hid.0/report_desc
ln -s functions/hid.0 configs/c.1/
controller=$(ls /sys/class/udc)
echo $controller >UDC
cd /
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
/vm_imu_gadget 1000 33 &
sleep 1
/vm_imu_probe 30 imu.device=LHR-1
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
    echo "" >$gadget/UDC
    sleep 2
    echo $controller >$gadget/UDC
done
wait $probe
wait
