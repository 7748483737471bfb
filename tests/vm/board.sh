# The guest's part of board.c: camera, sensor, lines and display of a board at once, by its settings files.
# modules: v4l2loopback dummy_hcd libcomposite usb_f_hid usbhid hid-generic gpio-sim vkms
# module v4l2loopback: devices=1 video_nr=9 exclusive_caps=0 max_buffers=4
# module vkms: enable_cursor=0
# files: config/boards/generic-arm64.ini tests/vm/board.ini
# memory: 1024
# shift: 0
. /guest.sh
config="--config /generic-arm64.ini --config /board.ini"

/vm_camera_tool /dev/video9 first ksoftirqd/0
make_gadget
plug
/vm_camera_eye /dev/video9 192 192 120 60 5,-3 >/eye.txt &
devices=$!
until [ -s /eye.txt ]; do sleep 0.1; done
point /dev/video9
sim=/sys/kernel/config/gpio-sim/board
mkdir $sim $sim/bank0
echo 8 >$sim/bank0/num_lines
echo board >$sim/bank0/label
n=0
for name in STROBE LATE BEAT KEY; do
    mkdir $sim/bank0/line$n
    echo $name >$sim/bank0/line$n/name
    n=$((n + 1))
done
echo 1 >$sim/live
chip=$(echo /sys/devices/platform/gpio-sim.*/gpiochip*)

echo "== check"
/foveola check $config --seconds 1 2>/said
echo "exit $?"
cat /said

echo "== board"
for line in 0 1 2; do
    /vm_gpio_tool watch $chip/sim_gpio$line/value 40 >/line$line &
    watches="$watches $!"
done
/foveola run $config --frames 600 --out /out/board 2>/said &
run=$!
begun $run /out/board
sleep 0.5
/vm_imu_gadget 1000 60 & # the sensor is silent until then: one core does not serve it while memory is locked
devices="$devices $!"
sleep 5
echo pull-up >$chip/sim_gpio3/pull
sleep 0.1
echo pull-down >$chip/sim_gpio3/pull
wait $run
echo "exit $?"
kill $watches
wait $watches
kill $devices
grep '^foveola: ' /said
grep '^"' /out/board/report.json
grep '"kind":"thread"' /out/board/report.json
echo "strobe $(cat /line0)"
echo "missed $(cat /line1)"
echo "heartbeat $(cat /line2)"
tail -c 8 /out/board/report.html

# Simulated eyes look at targets that the display shows.
echo "== calibrate"
mkdir /back
/foveola calibrate $config --points 5 --set eye.source=sim-camera --set eye.width=160 --set eye.height=120 --set eye.hz=60 --set budget.hz=20 \
    --out /out/calibrated 2>/said &
run=$!
sleep 3
/vm_kms_tool read /back 32 32
wait $run
echo "exit $?"
grep '^foveola: ' /said
ls /out/calibrated
/vm_kms_tool state
