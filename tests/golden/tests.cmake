fv_test(golden pictures rt)
fv_test(golden quality rt)
fv_test(golden moving rt)
fv_test(golden trails rt)
