// SPDX-License-Identifier: Apache-2.0
// Rays by Embree 3 or 4, which ask for them in two ways.
#pragma once

#if WM_EMBREE == 4
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

namespace wm::render {

// Static: sources are compiled for several instruction sets, and none may take another's.
#if WM_EMBREE == 4
static inline void first_hit(RTCScene scene, RTCRayHit &ray) { rtcIntersect1(scene, &ray, nullptr); }

static inline bool is_blocked(RTCScene scene, RTCRay &ray) {
  rtcOccluded1(scene, &ray, nullptr);
  return ray.tfar < 0;
}

// Eight rays that begin and end near one another. `valid`: -1 for those that count.
static inline void first_hits(const int *valid, RTCScene scene, RTCRayHit8 &rays) {
  RTCIntersectArguments how;
  rtcInitIntersectArguments(&how);
  how.flags = RTC_RAY_QUERY_FLAG_COHERENT;
  rtcIntersect8(valid, scene, &rays, &how);
}
#else
static inline void first_hit(RTCScene scene, RTCRayHit &ray) {
  RTCIntersectContext how;
  rtcInitIntersectContext(&how);
  rtcIntersect1(scene, &how, &ray);
}

static inline bool is_blocked(RTCScene scene, RTCRay &ray) {
  RTCIntersectContext how;
  rtcInitIntersectContext(&how);
  rtcOccluded1(scene, &how, &ray);
  return ray.tfar < 0;
}

static inline void first_hits(const int *valid, RTCScene scene, RTCRayHit8 &rays) {
  RTCIntersectContext how;
  rtcInitIntersectContext(&how);
  how.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcIntersect8(valid, scene, &how, &rays);
}
#endif

}  // namespace wm::render
