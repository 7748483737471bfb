typedef int fv_nothing;
