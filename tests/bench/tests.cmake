fv_test(bench full_ratio rt)
fv_test(bench peers rt)
