# cmake --install: the program, the modules' libraries and headers, and a package that find_package(pliant) finds.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

get_property(modules GLOBAL PROPERTY PLIANT_MODULES)
add_library(pliant_library INTERFACE)
add_library(pliant::pliant ALIAS pliant_library)
list(TRANSFORM modules PREPEND pliant_ OUTPUT_VARIABLE module_targets)
target_link_libraries(pliant_library INTERFACE ${module_targets})
set_target_properties(pliant_library PROPERTIES EXPORT_NAME pliant)

set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/pliant)
if(TARGET pliant)
  install(TARGETS pliant RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT program)
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/examples/oracle-bounce-a ${PROJECT_SOURCE_DIR}/examples/situations ${PROJECT_SOURCE_DIR}/examples/synthetic-ring
    DESTINATION ${CMAKE_INSTALL_DATADIR}/pliant/examples COMPONENT program PATTERN "*.py" EXCLUDE PATTERN "__pycache__" EXCLUDE)
  install(FILES ${PROJECT_SOURCE_DIR}/LICENSE ${PROJECT_SOURCE_DIR}/README.md ${PROJECT_SOURCE_DIR}/CHANGELOG.md DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT program)
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/docs/ DESTINATION ${CMAKE_INSTALL_DOCDIR}/docs COMPONENT program FILES_MATCHING PATTERN "*.md")
  include(pliant_package)
endif()
install(TARGETS pliant_library ${module_targets} EXPORT pliantTargets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(DIRECTORY ${PROJECT_SOURCE_DIR}/src/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/pliant FILES_MATCHING PATTERN "*.hpp")
install(EXPORT pliantTargets NAMESPACE pliant:: DESTINATION ${package_folder})
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE ${PROJECT_SOURCE_DIR}/docs/licences.md DESTINATION ${CMAKE_INSTALL_DOCDIR})

configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/pliantConfig.cmake.in ${PROJECT_BINARY_DIR}/pliantConfig.cmake
  INSTALL_DESTINATION ${package_folder})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/pliantConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/pliantConfig.cmake ${PROJECT_BINARY_DIR}/pliantConfigVersion.cmake
  ${PROJECT_SOURCE_DIR}/cmake/FindLZ4.cmake ${PROJECT_SOURCE_DIR}/cmake/FindOpenCV.cmake ${PROJECT_SOURCE_DIR}/cmake/FindSuiteSparse.cmake DESTINATION ${package_folder})
