fv_test(unit png display)
fv_test(unit y4m display)
