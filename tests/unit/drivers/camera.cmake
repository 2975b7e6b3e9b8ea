# SPDX-License-Identifier: Apache-2.0
# Cameras, on a system that does what the test says.
wm_test(camera_pixels SOURCES camera_pixels.c USES wm_camera_device wm_clock)
wm_test(camera_device SOURCES camera_device.c fake_camera.c USES wm_camera_device wm_clock ${TURBOJPEG_LIBRARY})
foreach(test camera_pixels camera_device)
  target_include_directories(${test} PRIVATE ${CMAKE_SOURCE_DIR}/drivers/camera)
endforeach()
