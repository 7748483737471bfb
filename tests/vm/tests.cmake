# Against the kernel's own devices, in a virtual machine: skipped where it cannot run (vm.sh). What runs in it is static;
# by one compiler, for it takes a minute.
if(NOT FV_SANITIZE AND CMAKE_C_COMPILER_ID STREQUAL GNU)
    add_executable(vm_imu_probe vm/imu_probe.c)
    target_link_libraries(vm_imu_probe PRIVATE sensors)
    target_link_options(vm_imu_probe PRIVATE -static)
    add_executable(vm_imu_gadget vm/imu_gadget.c)
    target_link_libraries(vm_imu_gadget PRIVATE m)
    target_link_options(vm_imu_gadget PRIVATE -static)
    fv_test(vm imu_usb platform)
    target_compile_definitions(vm_imu_usb PRIVATE FV_VM_CACHE="${FOVEOLA_CACHE}"
        FV_VM_PROBE="$<TARGET_FILE:vm_imu_probe>" FV_VM_GADGET="$<TARGET_FILE:vm_imu_gadget>")
    add_dependencies(vm_imu_usb vm_imu_probe vm_imu_gadget)
    set_tests_properties(vm_imu_usb PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 300)
endif()
