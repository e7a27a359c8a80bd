# `cpack -G DEB` in the build folder: a Debian package of the program, its documentation and an example recording.
# scripts/build_deb.sh builds it for every processor of the kind.
set(CPACK_PACKAGE_NAME pliant)
set(CPACK_PACKAGE_VENDOR "the developers of pliant")
set(CPACK_PACKAGE_CONTACT "the developers of pliant <pliant@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${PROJECT_DESCRIPTION}")
set(CPACK_DEBIAN_PACKAGE_DESCRIPTION "Give it a scan of a soft object at rest and a depth video, point clouds or markers of it in motion or under load,
 and get back its stiffness, damping and Poisson's ratio with uncertainties, and a model that simulates it.
 An example recording is in /usr/share/pliant/examples.")
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SUGGESTS "ffmpeg, paraview")
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_ALL program)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME pliant)
set(CPACK_STRIP_FILES ON)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
include(CPack)
