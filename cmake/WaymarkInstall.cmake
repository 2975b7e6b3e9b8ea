# SPDX-License-Identifier: Apache-2.0
# What `cmake --install` puts where, in the components that become packages: runtime, gst, tools, calibrate, fleet, dev, ros2.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)
# Libraries of several architectures side by side, also under /usr/local.
if(CMAKE_LIBRARY_ARCHITECTURE)
  set(CMAKE_INSTALL_LIBDIR lib/${CMAKE_LIBRARY_ARCHITECTURE})
endif()
set(WM_PACKAGE_DIR ${CMAKE_SOURCE_DIR}/toolchain/package)

# ── the robot's ──────────────────────────────────────────────────────────────────────────────────────────────────────
install(TARGETS waymark waymark-play DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT runtime)
install(DIRECTORY config/etc/ DESTINATION etc/waymark COMPONENT runtime)
install(FILES config/waymark.service DESTINATION lib/systemd/system COMPONENT runtime)
install(FILES ${WM_PACKAGE_DIR}/60-waymark.rules DESTINATION lib/udev/rules.d COMPONENT runtime)
install(FILES ${WM_PACKAGE_DIR}/completion/waymark.bash DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions
  RENAME waymark COMPONENT runtime)
install(FILES ${WM_PACKAGE_DIR}/completion/_waymark DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/vendor-completions
  COMPONENT runtime)
file(GLOB examples CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/config/*.yaml)
install(FILES ${examples} DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/waymark/examples COMPONENT runtime)
install(DIRECTORY config/datasets config/faults DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/waymark/examples COMPONENT runtime)
# The pages: messages and configurations name many of them.
file(GLOB pages CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/docs/*.md)
install(FILES ${pages} DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/waymark COMPONENT runtime)

# Manual pages are compressed as Debian wants them: without a time, so that the same sources give the same bytes.
function(wm_install_compressed file name where component)
  set(made ${CMAKE_BINARY_DIR}/compressed/${where}/${name}.gz)
  add_custom_command(OUTPUT ${made} COMMAND ${CMAKE_COMMAND} -E make_directory ${CMAKE_BINARY_DIR}/compressed/${where}
    COMMAND gzip -9nc ${file} > ${made} DEPENDS ${file} VERBATIM)
  set_property(GLOBAL APPEND PROPERTY WM_COMPRESSED ${made})
  install(FILES ${made} DESTINATION ${CMAKE_INSTALL_DATADIR}/${where} COMPONENT ${component})
endfunction()
wm_install_compressed(${WM_PACKAGE_DIR}/man/waymark.1 waymark.1 man/man1 runtime)
wm_install_compressed(${WM_PACKAGE_DIR}/man/waymark-play.1 waymark-play.1 man/man1 runtime)
if(TARGET waymark-camera)
  install(TARGETS waymark-camera DESTINATION lib/waymark COMPONENT runtime)
endif()
# A package of its own: GStreamer brings many libraries.
if(TARGET waymark-gst)
  install(TARGETS waymark-gst DESTINATION lib/waymark COMPONENT gst)
endif()
if(TARGET waymark-web) # a robot's page comes from the robot
  install(TARGETS waymark-web DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT runtime)
  install(FILES config/waymark-web.service DESTINATION lib/systemd/system COMPONENT runtime)
  wm_install_compressed(${WM_PACKAGE_DIR}/man/waymark-web.1 waymark-web.1 man/man1 runtime)
endif()

# ── the desk's ───────────────────────────────────────────────────────────────────────────────────────────────────────
foreach(tool detect diff eval import init map reference report)
  if(TARGET waymark-${tool}) # not everything is there for every architecture
    install(TARGETS waymark-${tool} DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT tools)
    wm_install_compressed(${WM_PACKAGE_DIR}/man/waymark-${tool}.1 waymark-${tool}.1 man/man1 tools)
  endif()
endforeach()
# A package of its own: OpenCV and Ceres bring many libraries.
install(TARGETS waymark-calibrate DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT calibrate)
wm_install_compressed(${WM_PACKAGE_DIR}/man/waymark-calibrate.1 waymark-calibrate.1 man/man1 calibrate)
# The simulator's renderer brings Embree.
if(TARGET waymark-simulate)
  install(TARGETS waymark-simulate DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT sim)
  wm_install_compressed(${WM_PACKAGE_DIR}/man/waymark-simulate.1 waymark-simulate.1 man/man1 sim)
  install(DIRECTORY config/worlds DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/waymark-sim/examples COMPONENT sim)
endif()
# Scripts: what they need is Python and the programs above.
foreach(command batch bench compare mine)
  install(PROGRAMS ${CMAKE_BINARY_DIR}/fleet/waymark-${command} DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT fleet)
  wm_install_compressed(${WM_PACKAGE_DIR}/man/waymark-${command}.1 waymark-${command}.1 man/man1 fleet)
endforeach()
install(DIRECTORY tools/fleet/waymark_fleet DESTINATION ${CMAKE_INSTALL_DATADIR}/waymark-fleet COMPONENT fleet FILES_MATCHING PATTERN "*.py")
# waymark hil: its scripts, those that run on a target, and what makes guests' images.
install(PROGRAMS ${CMAKE_BINARY_DIR}/hil/waymark-hil DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT fleet)
wm_install_compressed(${WM_PACKAGE_DIR}/man/waymark-hil.1 waymark-hil.1 man/man1 fleet)
install(DIRECTORY tools/hil/waymark_hil tools/hil/target tools/hil/guest DESTINATION ${CMAKE_INSTALL_DATADIR}/waymark-hil COMPONENT fleet
  FILES_MATCHING PATTERN "*.py" PATTERN "*.sh" PATTERN "*.c")
install(FILES toolchain/foreign.sh toolchain/foreign-apt.sh DESTINATION ${CMAKE_INSTALL_DATADIR}/waymark-hil/guest COMPONENT fleet)
install(DIRECTORY ${CMAKE_BINARY_DIR}/hil/lcm DESTINATION ${CMAKE_INSTALL_DATADIR}/waymark-hil COMPONENT fleet FILES_MATCHING PATTERN "*.py")
install(FILES tools/fleet/Snakefile DESTINATION ${CMAKE_INSTALL_DATADIR}/waymark-fleet COMPONENT fleet)
install(DIRECTORY tools/fleet/slurm DESTINATION ${CMAKE_INSTALL_DATADIR}/waymark-fleet COMPONENT fleet)

# ── the bridge to ROS 2, where it is built ───────────────────────────────────────────────────────────────────────────
if(TARGET waymark-ros2)
  install(TARGETS waymark-ros2 DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT ros2)
  install(FILES config/waymark-ros2.service DESTINATION lib/systemd/system COMPONENT ros2)
  wm_install_compressed(${WM_PACKAGE_DIR}/man/waymark-ros2.1 waymark-ros2.1 man/man1 ros2)
endif()

# ── for who writes programs ──────────────────────────────────────────────────────────────────────────────────────────
# libwaymark.so: the runtime. libwaymark-messages: LCM messages, in C. libwaymark-estimator: the filters and our detectors.
add_library(wm_public STATIC $<TARGET_OBJECTS:wm_msgs> $<TARGET_OBJECTS:wm_lcm_messages> $<TARGET_OBJECTS:wm_lcm_types>)
add_library(wm_public_estimator STATIC $<TARGET_OBJECTS:wm_estimator>)
set_target_properties(wm_public PROPERTIES OUTPUT_NAME waymark-messages LINKER_LANGUAGE C)
set_target_properties(wm_public_estimator PROPERTIES OUTPUT_NAME waymark-estimator LINKER_LANGUAGE CXX)
install(TARGETS wm_public wm_public_estimator DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT dev)
install(DIRECTORY msgs/include/waymark estimator/include/waymark firmware/library/include/waymark DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT dev
  PATTERN internal EXCLUDE) # for the other rooms and the desk
if(TARGET wm_shared)
  install(TARGETS wm_shared LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT library NAMELINK_COMPONENT dev)
endif()
install(DIRECTORY ${CMAKE_BINARY_DIR}/msgs/lcm/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/waymark/lcm COMPONENT dev
  FILES_MATCHING PATTERN "*.h")
install(DIRECTORY msgs/lcm DESTINATION ${CMAKE_INSTALL_DATADIR}/waymark COMPONENT dev)
install(DIRECTORY tests/package/downstream/ DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/libwaymark-dev/examples COMPONENT dev)
configure_package_config_file(cmake/waymarkConfig.cmake.in ${CMAKE_BINARY_DIR}/waymarkConfig.cmake
  INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/waymark PATH_VARS CMAKE_INSTALL_INCLUDEDIR CMAKE_INSTALL_LIBDIR)
write_basic_package_version_file(${CMAKE_BINARY_DIR}/waymarkConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_BINARY_DIR}/waymarkConfig.cmake ${CMAKE_BINARY_DIR}/waymarkConfigVersion.cmake
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/waymark COMPONENT dev)
foreach(name waymark waymark-estimator waymark-session)
  configure_file(cmake/${name}.pc.in ${CMAKE_BINARY_DIR}/${name}.pc @ONLY)
  install(FILES ${CMAKE_BINARY_DIR}/${name}.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT dev)
endforeach()

# ── what each package says of itself ─────────────────────────────────────────────────────────────────────────────────
set(packages runtime:waymark tools:waymark-tools calibrate:waymark-calibrate fleet:waymark-fleet dev:libwaymark-dev)
if(TARGET waymark-simulate)
  list(APPEND packages sim:waymark-sim)
endif()
if(TARGET wm_shared)
  list(APPEND packages library:libwaymark0)
endif()
if(TARGET waymark-gst)
  list(APPEND packages gst:waymark-gst)
endif()
if(TARGET waymark-ros2)
  list(APPEND packages ros2:waymark-ros2)
endif()
foreach(pair ${packages})
  string(REPLACE ":" ";" pair ${pair})
  list(GET pair 0 component)
  list(GET pair 1 package)
  wm_install_compressed(${CMAKE_SOURCE_DIR}/CHANGELOG.md changelog doc/${package} ${component})
  wm_install_compressed(${WM_PACKAGE_DIR}/changelog changelog.Debian doc/${package} ${component})
  install(FILES ${WM_PACKAGE_DIR}/copyright DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${package} COMPONENT ${component})
endforeach()
get_property(compressed GLOBAL PROPERTY WM_COMPRESSED)
add_custom_target(wm_compressed ALL DEPENDS ${compressed})
