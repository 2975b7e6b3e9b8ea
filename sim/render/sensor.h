// SPDX-License-Identifier: Apache-2.0
// From light to grey values: gain, vignetting, noise, the response curve, eight bits.
#pragma once

#include "images/pictures.h"
#include "render/render.h"

namespace wm::render {

struct SensorModel {
  // Signal 1 is white. Variance of the noise, in signal: shot · signal + read²; both are amplified where the gain is
  // (in the sensor's units the light is signal / gain): shot · gain · signal + (read · gain)².
  double shot = 1.0 / 20000;
  double read = 0.0008;
  double vignetting = 0.3;       // share of the light that is missing in the picture's corners: 1 - v · (r / corner)²
  double response_power = 0.55;  // grey = signal^power, bent below 1 by a shoulder
  double shoulder = 0.8;         // the grey value (of 1) from where on it bends towards white; 1: cut off hard
};

// Grey value in [0, 1] of a signal: x^power up to the shoulder, then 1 - (1-s)·exp(-(y-s)/(1-s)), smooth where they
// meet.
double response(const SensorModel &model, double signal);

struct Exposure {
  double gain = 1;         // signal = radiance · gain
  double noise_scale = 1;  // multiplies the noise's deviation; 0: none
};

class Sensor {
 public:
  // `centre` in pixels is where vignetting is zero.
  Sensor(const SensorModel &model, uint64_t seed, int width, int height, const Vec2 &centre_px);
  // Develops a frame. Noise depends on (seed, frame, pixel) alone.
  void develop(const Image &image, const Exposure &exposure, uint64_t frame, images::Picture8 &out) const;
  double vignetting_at(double u_px, double v_px) const;

 private:
  SensorModel model_;
  uint64_t seed_;
  Vec2 centre_px_;
  double corner2_;
  std::vector<float> curve_;    // grey (0..255) by signal, spaced by the bits of a float
  std::vector<float> normal_;   // quantiles of the normal distribution
  std::vector<float> falloff_;  // a pixel
};

// Auto-exposure as cheap cameras have it: the gain follows the mean radiance with a delay of its own, and wanders.
class AutoExposure {
 public:
  // `target`: mean signal that it wants; `share`: how much of the error goes a frame; drift: standard deviation of the
  // wandering, a frame, of the gain's logarithm.
  AutoExposure(double target, double share, double drift, uint64_t seed, double min_gain = 0.05, double max_gain = 50);
  // The gain for this frame; learns from its picture for the next one. The first frame fits at once.
  double next(const Image &image, uint64_t frame);

 private:
  double target_, share_, drift_, min_gain_, max_gain_;
  uint64_t seed_;
  double log_gain_ = 0, wander_ = 0;
  bool begun_ = false;
};

}  // namespace wm::render
