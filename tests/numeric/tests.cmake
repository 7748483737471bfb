fv_test(numeric offsets rt)
fv_test(numeric shading rt)
fv_test(numeric metrics rt)
