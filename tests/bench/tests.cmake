fv_test(bench full_ratio rt)
