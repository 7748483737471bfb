# Both Debian packages, by one compiler. What package.sh does with one needs root and a mirror: not part of ctest.
if(NOT FV_SANITIZE AND CMAKE_C_COMPILER_ID STREQUAL GNU)
    add_test(NAME deploy_packages COMMAND sh ${CMAKE_CURRENT_LIST_DIR}/packages.sh ${CMAKE_BINARY_DIR} ${cross_build})
    set_tests_properties(deploy_packages PROPERTIES LABELS deploy SKIP_RETURN_CODE 77 TIMEOUT 300)
endif()
