# What is installed, and the .deb that deploy/package makes of it (CPack). Paths as in the package: the
# prefix is /usr. saccade-decode and saccade-eval lie beside the programs that start them.
set(debian ${CMAKE_SOURCE_DIR}/deploy/debian)
install(TARGETS saccade saccade-server saccade-eval saccade-decode saccade-client RUNTIME DESTINATION bin)
install(DIRECTORY ${CMAKE_SOURCE_DIR}/web/dist/ DESTINATION share/saccade/web OPTIONAL)
install(FILES ${CMAKE_SOURCE_DIR}/README.md ${debian}/copyright DESTINATION share/doc/saccade)
install(FILES ${CMAKE_SOURCE_DIR}/docs/configuration.md ${CMAKE_SOURCE_DIR}/docs/security.md
              ${CMAKE_SOURCE_DIR}/docs/install.md ${CMAKE_SOURCE_DIR}/docs/phone.md ${CMAKE_SOURCE_DIR}/docs/scene.md
              ${CMAKE_SOURCE_DIR}/docs/desktop.md
        DESTINATION share/doc/saccade)
install(DIRECTORY ${CMAKE_SOURCE_DIR}/examples DESTINATION share/doc/saccade
        PATTERN CMakeLists.txt EXCLUDE PATTERN node_modules EXCLUDE PATTERN dist EXCLUDE PATTERN gen EXCLUDE)
# Models to place.
install(DIRECTORY ${CMAKE_SOURCE_DIR}/deploy/models/ DESTINATION share/saccade/models FILES_MATCHING PATTERN "*.glb")
# Opens saccade:// links; the cache of such handlers is the system's to renew (a dpkg trigger).
install(FILES ${debian}/saccade-client.desktop DESTINATION share/applications)
install(FILES ${debian}/saccade.svg DESTINATION share/icons/hicolor/scalable/apps)
install(FILES ${debian}/saccade.service DESTINATION lib/systemd/system)
# deploy/package writes there what is made of the programs and of Git: manual pages, changelogs.
install(DIRECTORY ${CMAKE_BINARY_DIR}/package/share/ DESTINATION share OPTIONAL)
install(FILES ${debian}/saccade.toml DESTINATION /etc/saccade)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME saccade)
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGE_CONTACT "$ENV{SACCADE_MAINTAINER}")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "far experts mark what a worn camera sees, and the marks stay there")
set(CPACK_DEBIAN_PACKAGE_DESCRIPTION
"Follows a camera in real time from its pictures alone, builds a small 3D map,
and serves a page on which experts see the live video and leave marks that
stay where they were put.
.
This package holds the server (saccade-server, a service of systemd), the
command line (saccade), the evaluation (saccade-eval), the sandboxed decoder
of videos (saccade-decode), the page, and the expert's desktop client
(saccade-client).")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_SECTION video)
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)
set(CPACK_DEBIAN_COMPRESSION_TYPE xz)
# Libraries are found by dpkg-shlibdeps. Fonts are opened by name; deb-systemd-* enable the service.
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_DEPENDS "adduser, init-system-helpers (>= 1.52), fonts-dejavu-core")
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "fonts-wqy-microhei, fonts-noto-color-emoji, libgl1, libasound2-plugins, poppler-utils")
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_EXTRA
  ${debian}/conffiles ${debian}/postinst ${debian}/prerm ${debian}/postrm)
if(CMAKE_CROSSCOMPILING)  # CPack asks dpkg for the machine that it runs on
  set(CPACK_DEBIAN_PACKAGE_ARCHITECTURE ${SACCADE_DEBIAN_ARCHITECTURE})
endif()
include(CPack)
