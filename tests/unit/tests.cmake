fv_test(unit png display)
fv_test(unit y4m display)
fv_test(unit sensors sensors)
fv_test(unit tape sensors)
