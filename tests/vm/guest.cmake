# What runs in the guest beside the program itself: built for arm64, too.
function(fv_guest name)
    add_executable(vm_${name} ${CMAKE_SOURCE_DIR}/tests/vm/${name}.c)
    target_link_libraries(vm_${name} PRIVATE ${ARGN})
    target_link_options(vm_${name} PRIVATE -static)
endfunction()
fv_guest(imu_gadget m)
fv_guest(camera_tool)
