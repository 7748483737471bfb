# The guest's part of eye_camera.c: the kernel's test camera (vivid) and a camera that shows a simulated eye
# (v4l2loopback), while the program renders.
# modules: vivid v4l2loopback
# module vivid: n_devs=1 node_types=0x1 num_inputs=2 input_types=0xc
# module v4l2loopback: devices=1 video_nr=9 exclusive_caps=0 max_buffers=4
# memory: 1024
# shift: 0
. /guest.sh

start absent 1 eye.source=v4l2
finish
point /dev/null
start other 1 eye.source=v4l2
finish
connect 640 480 75
for format in GREY Y10 Y16 YUYV NV12; do
    start $format 4 eye.source=v4l2 eye.format=$format eye.width=640 eye.height=480 eye.hz=75
    showing
    finish
done

# The camera scales its picture down.
connect 400 240 120
small="eye.source=v4l2 eye.width=200 eye.height=120"
start fast 20 $small eye.hz=120
showing
finish

connect 640 480 75
start faults 70 $small eye.hz=75
showing
/foveola run --config /settings.ini --set eye.source=v4l2 --frames 1 --out /out/busy 2>/busy
echo "busy exit $?"
cat /busy
vivid set percentage_of_dropped_buffers 30
sleep 0.5
vivid set percentage_of_dropped_buffers 0
for i in 1 2 3; do
    vivid set inject_v4l2_buf_flag_error 1
    sleep 0.1
done
vivid set inject_vidioc_qbuf_error 1
sleep 0.1
vivid set inject_fatal_streaming_error 1
showing
sleep 0.2
vivid set inject_vidioc_streamon_error 1
vivid set inject_fatal_streaming_error 1
showing
sleep 0.2
vivid set inject_vidioc_reqbufs_error 1
vivid set disconnect 1
showing
sleep 0.2
# Unplugged; it comes back by another name, as somebody holds the old one.
exec 7<$vivid
rm $eye
echo vivid.0 >/sys/bus/platform/drivers/vivid/unbind
sleep 1
echo "gone from $vivid"
echo vivid.0 >/sys/bus/platform/drivers/vivid/bind
connect 640 480 75
showing
echo "back as $vivid"
finish
exec 7<&-

# The device threads of a board that serves them first, as one processor does everything here.
point /dev/video9
/vm_camera_eye /dev/video9 320 240 120 6 0,0 12,0 -12,0 0,8 5,-8 >/eye.txt &
until [ -s /eye.txt ]; do sleep 0.1; done
start loop 50 eye.source=v4l2 threads.fifo=5 eye.width=320 eye.height=240 eye.hz=120
finish
cat /eye.txt
echo "gazes:"
cut -d, -f1-4,8 /out/loop/tape/gaze.csv
wait
