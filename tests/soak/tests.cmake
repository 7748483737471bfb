add_test(NAME soak_drift COMMAND numeric_drift 1000000000)
set_tests_properties(soak_drift PROPERTIES LABELS soak TIMEOUT 3600)
add_test(NAME soak_frames COMMAND numeric_frames 10000000)
set_tests_properties(soak_frames PROPERTIES LABELS soak TIMEOUT 36000)
