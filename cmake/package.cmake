# The Debian package: `cpack --config build/PRESET/CPackConfig.cmake`, or ./bootstrap package. One static program, its
# settings files, rules for udev, a unit for systemd that is not enabled, a manual page from the program's own tables.
set(page ${CMAKE_BINARY_DIR}/package)
set(FV_MAINTAINER "Foveola <foveola@localhost.localdomain>" CACHE STRING "Name and address of who makes the package")
file(MAKE_DIRECTORY ${page})
string(TIMESTAMP now "%a, %d %b %Y %H:%M:%S +0000" UTC)
file(WRITE ${page}/changelog "foveola (${PROJECT_VERSION}) unstable; urgency=medium\n\n  * Version ${PROJECT_VERSION}.\n\n -- ${FV_MAINTAINER}  ${now}\n")

# cpack packs what is built: ninja package_files, which builds the program, comes first.
set(CMAKE_SKIP_INSTALL_ALL_DEPENDENCY ON)

# In a target of its own: tests and runs do not want it. A cross-built program runs in the emulator.
add_custom_command(OUTPUT ${page}/foveola.1.gz ${page}/changelog.gz DEPENDS foveola
    COMMAND foveola help man > ${page}/foveola.1
    COMMAND gzip -9nkf ${page}/foveola.1 ${page}/changelog)
add_custom_target(package_files DEPENDS ${page}/foveola.1.gz ${page}/changelog.gz)

install(TARGETS foveola RUNTIME DESTINATION usr/bin)
foreach(kind boards headsets methods scenes)
    install(DIRECTORY config/${kind} DESTINATION usr/share/foveola/config)
endforeach()
install(FILES config/udev/70-foveola-imu.rules config/udev/71-foveola-service.rules DESTINATION lib/udev/rules.d)
install(FILES config/systemd/foveola.service DESTINATION lib/systemd/system)
install(FILES config/systemd/sysusers.conf DESTINATION usr/lib/sysusers.d RENAME foveola.conf)
install(FILES config/systemd/foveola.ini DESTINATION etc/foveola)
install(FILES ${page}/foveola.1.gz DESTINATION usr/share/man/man1)
install(FILES config/debian/copyright ${page}/changelog.gz DESTINATION usr/share/doc/foveola)
install(FILES config/debian/lintian-overrides DESTINATION usr/share/lintian/overrides RENAME foveola)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME foveola)
set(CPACK_PACKAGE_CONTACT "${FV_MAINTAINER}")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "renderer of a standalone VR headset")
set(CPACK_DEBIAN_PACKAGE_DESCRIPTION "Reads an eye camera and an inertial sensor, ray traces both eyes' pictures\nsharpest where the eye looks, and has each frame ready before the display\nneeds it. One static program, with settings of boards, headsets and scenes,\na manual page, rules for udev, and a service for systemd, which is not\nenabled by itself.")
set(CPACK_DEBIAN_PACKAGE_SECTION graphics)
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)
if(CMAKE_SYSTEM_PROCESSOR STREQUAL "aarch64")
    set(CPACK_DEBIAN_PACKAGE_ARCHITECTURE arm64)
else()
    set(CPACK_DEBIAN_PACKAGE_ARCHITECTURE amd64)
endif()
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_CONTROL_EXTRA ${CMAKE_SOURCE_DIR}/config/debian/postinst ${CMAKE_SOURCE_DIR}/config/debian/prerm
    ${CMAKE_SOURCE_DIR}/config/debian/postrm ${CMAKE_SOURCE_DIR}/config/debian/conffiles)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_STRIP_FILES ON)
set(CPACK_PACKAGING_INSTALL_PREFIX /)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_PACKAGE_DIRECTORY ${CMAKE_BINARY_DIR})
include(CPack)
