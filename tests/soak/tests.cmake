add_test(NAME soak_drift COMMAND numeric_drift 1000000000)
set_tests_properties(soak_drift PROPERTIES LABELS soak TIMEOUT 3600)
add_test(NAME soak_frames COMMAND numeric_frames 10000000)
set_tests_properties(soak_frames PROPERTIES LABELS soak TIMEOUT 36000)
add_test(NAME soak_plants COMMAND numeric_plants 1000000)
set_tests_properties(soak_plants PROPERTIES LABELS soak TIMEOUT 3600)
add_test(NAME soak_paced COMMAND numeric_paced 1000000)
set_tests_properties(soak_paced PROPERTIES LABELS soak TIMEOUT 7200)

# The real program, in a made-up world that takes the place of the clock and of devices.
file(GLOB soak_sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_LIST_DIR}/*.c)
add_executable(soak ${soak_sources})
target_link_libraries(soak PRIVATE cli ${LIB_cmocka})
add_dependencies(soak foveola) # replays what was recorded
target_compile_definitions(soak PRIVATE FV_PROGRAM="$<TARGET_FILE:foveola>")
target_link_options(soak PRIVATE -Wl,--wrap=fv_thread_start,--wrap=nanosleep,--wrap=pause,--wrap=write
    -Wl,--wrap=fv_setup_latch,--wrap=fv_display_present)
# Two hours where they take minutes; where a sanitizer looks on, what leaks or overflows does so within minutes.
set(soak_hours 2)
if(FV_SANITIZE OR NOT CMAKE_C_COMPILER_ID STREQUAL "GNU")
    set(soak_hours 0.1)
endif()
add_test(NAME soak_faults COMMAND soak ${soak_hours} 1)
set_tests_properties(soak_faults PROPERTIES LABELS unit TIMEOUT 1800 RUN_SERIAL ON)
add_test(NAME soak_faults_long COMMAND soak 20 1)
set_tests_properties(soak_faults_long PROPERTIES LABELS soak TIMEOUT 14400)
fv_test(unit soak_fails platform)
target_compile_definitions(unit_soak_fails PRIVATE FV_SOAK="$<TARGET_FILE:soak>")
