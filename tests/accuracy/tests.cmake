fv_test(accuracy reproject platform)
fv_test(accuracy pyramid platform)
fv_test(accuracy broad sensors)
fv_test(accuracy imu_usb sensors)
