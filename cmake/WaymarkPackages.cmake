# SPDX-License-Identifier: Apache-2.0
# Debian packages by CPack: waymark (the robot's), waymark-gst, waymark-tools (the desk's), waymark-calibrate, waymark-sim, waymark-fleet, libwaymark0, libwaymark-dev, waymark-ros2. docs/boards.md.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME waymark)
set(CPACK_PACKAGE_VENDOR Waymark)
set(CPACK_PACKAGE_CONTACT "Waymark maintainers <maintainers@waymark.example>" CACHE STRING "Maintainer of the packages")
# CPack 3.25 puts one summary before each package's own description, unless it is this one.
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${PROJECT_NAME} built using CMake")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_COMPONENTS_ALL runtime tools calibrate fleet dev)
if(TARGET waymark-ros2)
  list(APPEND CPACK_COMPONENTS_ALL ros2)
endif()
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ
  WORLD_EXECUTE)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
# Each system has packages of its own. A newer one's are newer, so that an upgrade of the system takes them; Debian 12's have the plain number.
cmake_host_system_information(RESULT system QUERY DISTRIB_INFO)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
if(NOT "${system_ID}${system_VERSION_ID}" STREQUAL debian12)
  string(APPEND CPACK_DEBIAN_PACKAGE_RELEASE +${system_ID}${system_VERSION_ID})
endif()
set(version ${PROJECT_VERSION}-${CPACK_DEBIAN_PACKAGE_RELEASE})
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_COMPRESSION_TYPE xz)
set(CPACK_THREADS 1) # the bytes of xz depend on how many there are

# Libraries that programs need are found in staged.cmake; here are the other packages.
set(CPACK_DEBIAN_RUNTIME_PACKAGE_NAME waymark)
set(CPACK_DEBIAN_RUNTIME_PACKAGE_SECTION misc)
set(CPACK_DEBIAN_RUNTIME_PACKAGE_DEPENDS "iproute2, procps") # of the service: `ip route`, `kill`
set(CPACK_DEBIAN_RUNTIME_PACKAGE_SUGGESTS "waymark-tools, can-utils, v4l-utils, liblcm-bin")
set(CPACK_DEBIAN_RUNTIME_DESCRIPTION "localization of a robot on its own computer
Estimates the pose of a robot from cameras, CAN and other sensors on its
computer, and publishes it over LCM from a real-time thread. The service
is installed, not started: its configuration in /etc/waymark has to be the
robot's first.")
set(conffiles "")
file(GLOB etc RELATIVE ${CMAKE_SOURCE_DIR}/config/etc CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/config/etc/*)
foreach(name ${etc})
  string(APPEND conffiles "/etc/waymark/${name}\n")
endforeach()
file(WRITE ${CMAKE_BINARY_DIR}/debian/conffiles "${conffiles}")
set(CPACK_DEBIAN_RUNTIME_PACKAGE_CONTROL_EXTRA ${CMAKE_BINARY_DIR}/debian/conffiles ${WM_PACKAGE_DIR}/postinst
  ${WM_PACKAGE_DIR}/prerm ${WM_PACKAGE_DIR}/postrm)

if(TARGET waymark-gst)
  list(APPEND CPACK_COMPONENTS_ALL gst)
  set(CPACK_DEBIAN_GST_PACKAGE_NAME waymark-gst)
  set(CPACK_DEBIAN_GST_PACKAGE_SECTION misc)
  set(CPACK_DEBIAN_GST_PACKAGE_DEPENDS "waymark (= ${version})")
  set(CPACK_DEBIAN_GST_PACKAGE_RECOMMENDS "gstreamer1.0-plugins-base, gstreamer1.0-plugins-good")
  set(CPACK_DEBIAN_GST_DESCRIPTION "cameras of a robot by GStreamer
Gives waymark the pictures of any GStreamer pipeline, as those of NVIDIA's
Argus on Jetsons: devices.cameras with the key gst.")
endif()

set(CPACK_DEBIAN_TOOLS_PACKAGE_NAME waymark-tools)
set(CPACK_DEBIAN_TOOLS_PACKAGE_SECTION misc)
set(CPACK_DEBIAN_TOOLS_PACKAGE_DEPENDS "waymark (= ${version})")
set(CPACK_DEBIAN_TOOLS_DESCRIPTION "desk tools for the localization of a robot
Judges runs against truth, draws reports, makes maps, writes the
configuration of a new robot: waymark eval, report, diff, map, init.")
set(CPACK_DEBIAN_TOOLS_PACKAGE_RECOMMENDS waymark-calibrate)

if(TARGET waymark-simulate)
  list(APPEND CPACK_COMPONENTS_ALL sim)
  string(APPEND CPACK_DEBIAN_TOOLS_PACKAGE_RECOMMENDS ", waymark-sim")
  set(CPACK_DEBIAN_SIM_PACKAGE_NAME waymark-sim)
  set(CPACK_DEBIAN_SIM_PACKAGE_SECTION misc)
  set(CPACK_DEBIAN_SIM_PACKAGE_DEPENDS "waymark (= ${version})")
  set(CPACK_DEBIAN_SIM_DESCRIPTION "simulated drives of a robot, with known truth
Makes recordings of drives through corridors, offices, streets and over the
sea floor: CAN, pictures, sightings and labels, with the errors and faults of
sensors. The same seed gives the same bytes: waymark simulate.")
endif()

set(CPACK_DEBIAN_CALIBRATE_PACKAGE_NAME waymark-calibrate)
set(CPACK_DEBIAN_CALIBRATE_PACKAGE_SECTION misc)
set(CPACK_DEBIAN_CALIBRATE_PACKAGE_DEPENDS "waymark (= ${version})")
set(CPACK_DEBIAN_CALIBRATE_DESCRIPTION "calibration of a robot's cameras
Finds the model of a camera, of a pair, and their mountings on the robot, from
pictures of boards or from drives; reads calibrations of OpenCV, Kalibr, ROS
and OCamCalib: waymark calibrate.")

set(CPACK_DEBIAN_FLEET_PACKAGE_NAME waymark-fleet)
set(CPACK_DEBIAN_FLEET_PACKAGE_ARCHITECTURE all)
set(CPACK_DEBIAN_FLEET_PACKAGE_SECTION misc)
set(CPACK_DEBIAN_FLEET_PACKAGE_DEPENDS "waymark-tools (= ${version}), python3 (>= 3.10), python3-yaml")
set(CPACK_DEBIAN_FLEET_PACKAGE_SUGGESTS "snakemake, qemu-system-x86, qemu-system-arm, mmdebstrap, cpio, e2fsprogs, gcc-12, make, openssh-client")
set(CPACK_DEBIAN_FLEET_DESCRIPTION "many drives of robots at once
Replays and judges all recordings of a fleet on every core or on a cluster,
compares what a change did to them, lists what black boxes hold, measures
boards, and plays recordings into boards and guests: waymark batch, bench,
compare, mine, hil.")

set(CPACK_DEBIAN_DEV_PACKAGE_NAME libwaymark-dev)
set(CPACK_DEBIAN_DEV_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEV_PACKAGE_DEPENDS "liblcm-dev (>= 1.3.1)")
set(CPACK_DEBIAN_DEV_DESCRIPTION "poses of a robot for other programs
Headers and libraries: libwaymark localizes in a program of its own,
libwaymark-messages reads and writes the messages that waymark sends over
LCM, libwaymark-estimator has its filters and detectors. For
find_package(waymark) and pkg-config.")

if(TARGET wm_shared)
  list(APPEND CPACK_COMPONENTS_ALL library)
  string(APPEND CPACK_DEBIAN_DEV_PACKAGE_DEPENDS ", libwaymark0 (= ${version})")
  set(CPACK_DEBIAN_LIBRARY_PACKAGE_NAME libwaymark0)
  set(CPACK_DEBIAN_LIBRARY_PACKAGE_SECTION libs)
  set(CPACK_DEBIAN_LIBRARY_DESCRIPTION "localization of a robot in a program of its own
The runtime of waymark as a shared library with a stable C interface: a
program pushes odometry, CAN frames, observations and pictures, and takes
poses. The same poses, to the bit, as of the program waymark.")
  file(WRITE ${CMAKE_BINARY_DIR}/debian/triggers "activate-noawait ldconfig\n")
  file(WRITE ${CMAKE_BINARY_DIR}/debian/shlibs "libwaymark 0 libwaymark0 (>= ${PROJECT_VERSION})\n")
  set(CPACK_DEBIAN_LIBRARY_PACKAGE_CONTROL_EXTRA ${CMAKE_BINARY_DIR}/debian/triggers ${CMAKE_BINARY_DIR}/debian/shlibs)
endif()

set(CPACK_DEBIAN_ROS2_PACKAGE_NAME waymark-ros2)
set(CPACK_DEBIAN_ROS2_PACKAGE_SECTION misc)
set(CPACK_DEBIAN_ROS2_DESCRIPTION "poses of a robot for ROS 2
A bridge between the messages of a waymark run and ROS 2, by Cyclone DDS: /tf,
/waymark/pose, /waymark/odom and /diagnostics; /initialpose, /odom, /imu/data
and /fix for the run. It needs no ROS. The service is installed, not started.")
set(CPACK_DEBIAN_ROS2_PACKAGE_CONTROL_EXTRA ${WM_PACKAGE_DIR}/ros2/postinst ${WM_PACKAGE_DIR}/ros2/prerm
  ${WM_PACKAGE_DIR}/ros2/postrm)

# What a package is for, by its description: packages of several boards have one name and version.
if(CMAKE_TOOLCHAIN_FILE)
  file(STRINGS ${CMAKE_TOOLCHAIN_FILE} about REGEX "^# [A-Z].*[.:]" LIMIT_COUNT 2) # behind the licence
  list(GET about -1 about)
  string(REGEX REPLACE "^# |\\.$" "" about "${about}")
elseif("${CMAKE_C_FLAGS}" MATCHES "-march=native")
  set(about "computers with the processor of the one that built it")
else()
  set(about "any computer of its architecture")
endif()
foreach(component ${CPACK_COMPONENTS_ALL})
  string(TOUPPER ${component} component)
  if(NOT "${CPACK_DEBIAN_${component}_PACKAGE_ARCHITECTURE}" STREQUAL all)
    string(APPEND CPACK_DEBIAN_${component}_DESCRIPTION "\nBuilt for: ${about}.")
  endif()
endforeach()

# The same sources give the same bytes, whenever, wherever and by whomever they are packed.
set(CPACK_PROJECT_CONFIG_FILE ${CMAKE_SOURCE_DIR}/cmake/source_date.cmake)
set(CPACK_PRE_BUILD_SCRIPTS ${CMAKE_SOURCE_DIR}/cmake/staged.cmake)
set(CPACK_POST_BUILD_SCRIPTS ${CMAKE_SOURCE_DIR}/cmake/packed.cmake)
include(CPack)
