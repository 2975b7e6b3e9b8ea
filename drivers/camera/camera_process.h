// SPDX-License-Identifier: Apache-2.0
// Cameras in a process of their own, one each: a library that ends its process where a camera is unplugged (libcamera
// does) ends no more than that. The context of `open` is its program, a path or the name of one in
// ../lib/waymark beside this one's folder, which has one argument. Calls and their results go through a socket,
// pictures through shared memory.
#ifndef WM_CAMERA_PROCESS_H
#define WM_CAMERA_PROCESS_H

#include "camera_io.h"

#define CAMERA_PROCESS "camera-process"  // the argument
#define CAMERA_BY_LIBCAMERA "waymark-camera"
#define CAMERA_BY_GSTREAMER "waymark-gst"

// In the camera's process: serves `io` until the other side closes its end.
void camera_process_serve(const camera_io *io);

// Whether a program is beside this one.
int camera_process_is_there(const char *program);

// A process that ends, or doesn't answer, is a camera that is gone (-ENODEV).
extern const camera_io kCameraProcess;

#endif
