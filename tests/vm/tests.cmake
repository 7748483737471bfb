# Against the kernel's own devices, in a virtual machine: skipped where it cannot run (vm.sh). What runs in it is static;
# by one compiler, for it takes a minute.
if(NOT FV_SANITIZE AND CMAKE_C_COMPILER_ID STREQUAL GNU)
    include(${CMAKE_CURRENT_LIST_DIR}/guest.cmake)
    # A test: what it judges is printed by the script of the same name in the guest, which has these programs.
    function(fv_vm_test name)
        fv_test(vm ${name} platform)
        set(programs "")
        foreach(program ${ARGN})
            string(APPEND programs " $<TARGET_FILE:${program}>")
        endforeach()
        target_compile_definitions(vm_${name} PRIVATE FV_VM_CACHE="${FOVEOLA_CACHE}" FV_VM_PROGRAMS="${programs}")
        add_dependencies(vm_${name} ${ARGN})
        set_tests_properties(vm_${name} PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 450)
    endfunction()
    fv_guest(imu_probe sensors)
    fv_guest(camera_eye sensors)
    fv_vm_test(imu_usb vm_imu_probe vm_imu_gadget)
    fv_vm_test(eye_camera foveola vm_camera_tool vm_camera_eye)
    fv_vm_test(devices foveola vm_imu_gadget vm_camera_tool vm_camera_eye)

    # The arm64 machine runs the cross-built programs; this one renders the same again.
    fv_test(vm arm64 rt)
    target_compile_definitions(vm_arm64 PRIVATE FV_VM_CACHE="${FOVEOLA_CACHE}"
        FV_VM_PROGRAMS="${cross_build}/foveola ${cross_build}/vm_imu_gadget ${cross_build}/vm_camera_tool")
    add_dependencies(vm_arm64 foveola)
    set_tests_properties(vm_arm64 PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 450)
endif()

# A display and lines of a GPIO chip.
if(COMMAND fv_vm_test)
    fv_guest(kms_tool display)
    fv_guest(gpio_tool)
    fv_vm_test(display foveola vm_kms_tool)
    fv_vm_test(lines foveola vm_gpio_tool)
    # A whole board, by its settings; every fault of the design's table.
    fv_guest(hog)
    fv_vm_test(board foveola vm_imu_gadget vm_camera_tool vm_camera_eye vm_gpio_tool vm_kms_tool)
    fv_vm_test(faults foveola vm_imu_gadget vm_camera_tool vm_camera_eye vm_kms_tool vm_hog)
endif()
