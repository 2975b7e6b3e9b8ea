# SPDX-License-Identifier: Apache-2.0
# Cameras, on a system that does what the test says.
wm_test(camera_pixels SOURCES camera_pixels.c USES wm_camera_device wm_clock)
wm_test(camera_device SOURCES camera_device.c fake_camera.c USES wm_camera_device wm_clock ${TURBOJPEG_LIBRARY})
wm_test(camera_process SOURCES camera_process.c USES wm_camera_device)
wm_test(camera_v4l2 SOURCES v4l2.c USES wm_camera_device)
target_link_options(camera_v4l2 PRIVATE -Wl,--wrap=open,--wrap=close,--wrap=poll,--wrap=mmap,--wrap=munmap,--wrap=ioctl)
foreach(test camera_pixels camera_device camera_process camera_v4l2)
  target_include_directories(${test} PRIVATE ${CMAKE_SOURCE_DIR}/drivers/camera)
endforeach()
