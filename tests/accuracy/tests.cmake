fv_test(accuracy reproject platform)
fv_test(accuracy pyramid platform)
fv_test(accuracy pupil sensors rt)
fv_test(accuracy events sensors)
