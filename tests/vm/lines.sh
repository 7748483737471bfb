# The guest's part of lines.c: a made-up GPIO chip (gpio-sim) of eight lines.
# modules: gpio-sim
# memory: 1024
# shift: 0
small="scene.name=cornell display.headset=small display.width=24 display.height=20 display.sink=y4m display.y4m_path=/dev/null imu.source=none eye.source=none method.name=full threads.workers=1 output.tape=off budget.pace=vsync budget.hz=21"
sim=/sys/kernel/config/gpio-sim/board
mkdir $sim $sim/bank0
echo 8 >$sim/bank0/num_lines
echo board >$sim/bank0/label
n=0
for name in TE STROBE LATE BEAT KEY; do
    mkdir $sim/bank0/line$n
    echo $name >$sim/bank0/line$n/name
    n=$((n + 1))
done
echo 1 >$sim/live
chip=$(echo /sys/devices/platform/gpio-sim.*/gpiochip*)

run() {
    name=$1 frames=$2
    shift 2
    sets=
    for set in $small "$@"; do sets="$sets --set $set"; done
    echo "== $name"
    /foveola run --frames $frames --out /out/$name $sets 2>/said
    echo "exit $?"
    grep '^foveola: ' /said
    [ ! -f /out/$name/report.json ] || grep '^"\(frames\|missed\|skipped\|gpio\|sealed\)"' /out/$name/report.json
}

# The display's line at 20 Hz; the settings say 21.
/vm_gpio_tool pulse $chip/sim_gpio0/pull 20 20 &
pulses=$!
(
    sleep 4
    for i in 1 2; do
        echo pull-up >$chip/sim_gpio4/pull
        sleep 0.1
        echo pull-down >$chip/sim_gpio4/pull
        sleep 0.5
    done
) &
/vm_gpio_tool watch $chip/sim_gpio1/value 16 >/strobe &
/vm_gpio_tool watch $chip/sim_gpio3/value 16 >/beat &
watches=$!
run lines 200 gpio.chip=board gpio.vsync=TE gpio.strobe=STROBE gpio.missed=LATE gpio.heartbeat=BEAT gpio.button=KEY
wait $watches
cat /strobe
echo "heartbeat $(cat /beat)"
wait
run nochip 1 gpio.chip=other gpio.vsync=TE
run noline 1 gpio.chip=board gpio.vsync=NONE
