# What a browser makes of the pages does not depend on the compiler: one preset is enough.
if(CMAKE_C_COMPILER_ID STREQUAL "GNU" AND NOT FV_SANITIZE)
    fv_test(page reports cli)
endif()
