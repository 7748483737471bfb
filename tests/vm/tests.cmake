# Against the kernel's own devices, in a virtual machine: skipped where it cannot run (vm.sh). What runs in it is static;
# by one compiler, for it takes a minute.
if(NOT FV_SANITIZE AND CMAKE_C_COMPILER_ID STREQUAL GNU)
    # What runs in the guest beside the program itself.
    function(fv_guest name)
        add_executable(vm_${name} vm/${name}.c)
        target_link_libraries(vm_${name} PRIVATE ${ARGN})
        target_link_options(vm_${name} PRIVATE -static)
    endfunction()
    # A test: what it judges is printed by the script of the same name in the guest, which has these programs.
    function(fv_vm_test name)
        fv_test(vm ${name} platform)
        set(programs "")
        foreach(program ${ARGN})
            string(APPEND programs " $<TARGET_FILE:${program}>")
        endforeach()
        target_compile_definitions(vm_${name} PRIVATE FV_VM_CACHE="${FOVEOLA_CACHE}" FV_VM_PROGRAMS="${programs}")
        add_dependencies(vm_${name} ${ARGN})
        set_tests_properties(vm_${name} PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 300)
    endfunction()
    fv_guest(imu_probe sensors)
    fv_guest(imu_gadget m)
    fv_vm_test(imu_usb vm_imu_probe vm_imu_gadget)
endif()

# A display and lines of a GPIO chip.
if(COMMAND fv_vm_test)
    fv_guest(kms_tool display)
    fv_guest(gpio_tool)
    fv_vm_test(display foveola vm_kms_tool)
    fv_vm_test(lines foveola vm_gpio_tool)
endif()
