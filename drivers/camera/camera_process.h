// SPDX-License-Identifier: Apache-2.0
// Cameras in a process of their own, one each: a library that ends its process where a camera is unplugged (libcamera
// does) ends no more than that. Its program is ../lib/waymark/waymark-camera beside this one's folder, or the context
// of `open`, and has one argument. Calls and their results go through a socket, pictures through shared memory.
#ifndef WM_CAMERA_PROCESS_H
#define WM_CAMERA_PROCESS_H

#include "camera_io.h"

#define CAMERA_PROCESS "camera-process"  // the argument

// In the camera's process: serves `io` until the other side closes its end.
void camera_process_serve(const camera_io *io);

// A process that ends, or doesn't answer, is a camera that is gone (-ENODEV).
extern const camera_io kCameraProcess;

#endif
