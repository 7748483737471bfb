fv_test(accuracy reproject platform)
