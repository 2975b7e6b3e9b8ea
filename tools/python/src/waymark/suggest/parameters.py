# SPDX-License-Identifier: Apache-2.0
"""The parameters of a configuration that a suggestion may change: noises and priors. Gates, capacities and choices of a method are no
properties of a robot and stay."""

import math
from dataclasses import dataclass

from ..replaying import parameters

# Sizes to begin with where a noise is 0, or chosen by the program; 0: the size that it has.
NOISES = {
    "motion": {"noise.speed_mps": 0.02, "noise.speed_rel": 0.03, "noise.yaw_rate_radps": 0.01, "noise.yaw_rate_rel": 0.05, "noise.side_rel": 0.01,
               "noise.sideways_mps": 0.02, "noise.sideways_rel": 0.06, "noise.ticks_per_sqrt_m": 0.005, "noise.steering_rad": 0.005,
               "constant_velocity.speed_walk": 0.5, "constant_velocity.turn_walk": 0.5, "states.yaw_rate_bias_walk_radps": 0.0001},
    "sightings": {"noise.bearing_factor": 1, "noise.range_factor": 1, "noise.range_rel": 0.01, "correlated.lateral_m": 0.02, "correlated.range_rel": 0.01,
                  "correlated.tau_s": 2},
    "positions": {"noise.factor": 0.5, "correlated.tau_s": 20},
    "markers": {"sigma_m": 0.002, "sigma_rel": 0.005, "bearing_sigma_rad": 0.001, "heading_sigma_rad": 0.02},
    # No noise.pixel_px: tracks of a street drift alike, and the likelihood shows the noise of one picture alone.
    "stereo_ekf": {"noise.v_mps": 0.03, "noise.w_radps": 0.01, "constant_velocity.v_walk": 2, "constant_velocity.w_walk": 0.5},
    "edge_mcl": {"points.pixel_px": 0.5, "points.sigma_m": 0.012, "points.common_px": 0.6},
}
# Start sigmas of states; 0: the state is off.
STATES = {
    "motion": ("speed_scale_sigma", "yaw_rate_scale_sigma", "yaw_rate_bias_sigma_radps", "left_scale_sigma", "right_scale_sigma", "track_scale_sigma",
               "steering_offset_sigma_rad", "side_scale_sigma", "rotation_center_sigma_m"),
    "sightings": ("sensor_yaw_sigma_rad", "sensor_time_offset_sigma_s", "range_bias_sigma_m", "range_scale_sigma"),
    "positions": ("time_offset_sigma_s",),
    "stereo_ekf": ("rate_bias_sigma_radps", "velocity_scale_sigma", "rate_scale_sigma", "twist_axes_sigma_rad", "velocity_direction_sigma_rad",
                   "increment_scale_sigma", "increment_direction_sigma_rad", "time_offset_sigma_s"),
    "edge_mcl": ("pitch_sigma_rad", "yaw_sigma_rad", "time_offset_sigma_s"),
}
# Below 0 these are multiples of a stated sigma: their size is searched.
MULTIPLES = ("sightings.correlated.bearing_rad", "sightings.correlated.range_m", "positions.correlated.sigma_m", "sightings.states.range_bias_sigma_m")


@dataclass(frozen=True)
class Parameter:
    """A number of the configuration."""

    key: str  # "motion.noise.speed_mps"
    now: float
    initial: float
    least: float
    most: float
    begin: float = 0.0
    is_state: bool = False
    is_multiple: bool = False

    def trials(self, at: float, factor: float) -> list[float]:
        """Values to be tried from this one: larger and smaller by a factor, off, on."""
        is_signed = self.is_state or self.is_multiple
        size = abs(self._number(at)) if is_signed else self._number(at)
        if size > 0:
            found = [math.copysign(size * f, at) for f in (factor, 1 / factor)] + [0.0] * self.is_state
        elif self.is_state and self.initial:
            found = [self.initial]
        else:
            found = [self.begin / factor, self.begin, self.begin * factor] if self.begin > 0 else []
        return [value for value in map(self._within, found) if value != at]

    def between(self, to: float, share: float) -> float:
        """The value at this share of the way to another one, by logarithms; a state is off as long as that is nearer."""
        begin = self.now if self.now > 0 else abs(self.now) if self.is_state or self.is_multiple else self.begin
        if to == self.now or begin == 0 or to == 0:
            return to if share > 0.5 else self.now
        return self._within(math.copysign(math.exp((1 - share) * math.log(begin) + share * math.log(abs(to))), to))

    def _within(self, value: float) -> float:
        """Of three digits: more have no meaning, and a person has to read them."""
        return min(self.most, max(self.least, float(f"{self._number(value):.3g}")))

    def _number(self, value: float) -> float:
        if not math.isfinite(value):
            raise ValueError(f"{self.key}: {value} is no value to be tried")
        return value


def of_configuration(text: str, only: tuple[str, ...] = ()) -> list[Parameter]:
    """Those that the estimator of a configuration's text reads, and that begin with one of `only`."""
    begins = {f"{section}.{key}": begin for section, rows in NOISES.items() for key, begin in rows.items()}
    states = {f"{section}.states.{key}" for section, keys in STATES.items() for key in keys}
    order = [*begins, *sorted(states), *MULTIPLES]
    found = {key: Parameter(key, p["value"], p["initial"], p["min"], p["max"], begins.get(key, 0.0), key in states, key in MULTIPLES)
             for key, p in parameters(text).items() if key in order}
    return [found[key] for key in dict.fromkeys(order) if key in found and (not only or key.startswith(only))]
