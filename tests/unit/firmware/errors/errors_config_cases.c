// SPDX-License-Identifier: Apache-2.0
#include <stddef.h>

#include "errors_case.h"

#define CONFIG ERROR_CONFIG
#define REC ERROR_RECORDING
#define ROW ERROR_ROW
#define FILE_ "config/robot.yaml"

const error_case kErrorCases[] = {
    // Configuration.
    {CONFIG, "Parameter misspelt", FILE_, "sightings: {gaet: {hard: 20}}\n",
     "config/robot.yaml:3: sightings.gaet: unknown key; did you mean 'sightings.gate'?"},
    {CONFIG, "Estimator's section misspelt", FILE_, "landmark_efk: {gate: {hard: 20}}\n",
     "config/robot.yaml:3: landmark_efk: unknown key; did you mean 'landmark_ekf'?"},
    {CONFIG, "Parameter in the wrong place", FILE_, "horizon_ms: 500\n",
     "config/robot.yaml:3: horizon_ms: unknown key; did you mean 'merge.horizon_ms'?"},
    {CONFIG, "Unknown key", FILE_, "colour: red\n",
     "config/robot.yaml:3: colour: unknown key; known here: format, estimator, sources, calibration, landmarks, dbc, "
     "can_signals, devices, map, site, initial_pose, vision, start, black_box, publish, commands, merge, integrity, "
     "realtime, motion, sightings, positions, markers, localizer, landmark_ekf, edge_mcl, pf_edges, slam, stereo_ekf"},
    {CONFIG, "CAN interface without its name", FILE_, "devices: {can: [{dbc: car.dbc, can_signals: s.yaml}]}\n",
     "config/robot.yaml:3: devices.can[0]: interface: is missing; `ip link` lists them"},
    {CONFIG, "CAN interface without its DBC", FILE_, "devices: {can: [{interface: can0}]}\n",
     "config/robot.yaml:3: devices.can[0]: dbc: is missing; name one here or at the top of the configuration"},
    {CONFIG, "Text where a number is needed", FILE_, "sightings: {gate: {hard: abc}}\n",
     "config/robot.yaml:3: sightings.gate.hard: 'abc' is not a number; a number from 1 to 1000000 is needed"},
    {CONFIG, "Number in quotes", FILE_, "publish: {rate_hz: '50'}\n",
     "config/robot.yaml:3: publish.rate_hz: the text '50' is not a number; a number from 0.1 to 1000 is needed"},
    {CONFIG, "Number out of range", FILE_, "publish: {rate_hz: 5000}\n",
     "config/robot.yaml:3: publish.rate_hz: '5000' is out of range; a number from 0.1 to 1000 is needed"},
    {CONFIG, "Fraction where a whole number is needed", FILE_, "realtime: {cpu: 1.5}\n",
     "config/robot.yaml:3: realtime.cpu: '1.5' is not a whole number; a whole number from -1 to 1023 is needed"},
    {CONFIG, "Neither true nor false", FILE_, "publish: {lcm: maybe}\n",
     "config/robot.yaml:3: publish.lcm: 'maybe' is neither true nor false"},
    {CONFIG, "Choice misspelt", FILE_, "motion: {model: twits}\n",
     "config/robot.yaml:3: motion.model: 'twits' is unknown; did you mean 'twist'? (one of: auto, ticks, "
     "speed_yaw_rate, ackermann, twist, increments, constant_velocity)"},
    {CONFIG, "Channels that LCM takes for an expression", FILE_, "publish: {channel_prefix: 'R[1'}\n",
     "config/robot.yaml:3: publish.channel_prefix: 'R[1': letters, digits, '_', '-' and '/' are possible"},
    {CONFIG, "Key without a value", FILE_, "publish:\n  rate_hz:\n",
     "config/robot.yaml:4: publish.rate_hz: has no value; a number from 0.1 to 1000 is needed"},
    {CONFIG, "Value where a section is needed", FILE_, "merge: 300\n",
     "config/robot.yaml:3: merge: a map of parameters (KEY: VALUE) is needed"},
    {CONFIG, "Unknown estimator", FILE_, "format: waymark-config/1\nestimator: landmark_ukf\n",
     "config/robot.yaml:2: estimator: 'landmark_ukf' is unknown; did you mean 'landmark_ekf'? (one of: odometry, "
     "landmark_ekf, edge_mcl, pf_edges, slam, stereo_ekf)"},
    {CONFIG, "No estimator", FILE_, "format: waymark-config/1\n",
     "config/robot.yaml:1: estimator: is missing; one of these is needed: odometry, landmark_ekf, edge_mcl, pf_edges, "
     "slam, stereo_ekf"},
    {CONFIG, "Another format", FILE_, "format: waymark-config/9\n",
     "config/robot.yaml:1: format: 'waymark-config/9' is not a format that this program reads; it reads "
     "waymark-config/1"},
    {CONFIG, "Lateness above the horizon", FILE_, "sources: [{name: sightings, lateness_max_ms: 500}]\n",
     "config/robot.yaml:3: sources[0].lateness_max_ms: 500 is above merge.horizon_ms (300); at most 300 is possible, "
     "or set merge.horizon_ms to 500"},
    {CONFIG, "Horizon below the default lateness", FILE_, "merge: {horizon_ms: 100}\n",
     "config/robot.yaml:3: merge.horizon_ms: merge.lateness_max_ms (150) is above merge.horizon_ms (100); set "
     "lateness_max_ms to at most 100, or horizon_ms to 150"},
    {CONFIG, "Overflow at a radius that is obeyed", FILE_,
     "motion:\n  commands:\n    radius_overflow_m: 1.5\n    radius_max_m: 2\n",
     "config/robot.yaml:5: motion.commands.radius_overflow_m: is below motion.commands.radius_max_m, which the drive "
     "still obeys: nothing overflows there; set it to at least that, or to 0 if no radius overflows"},
    {CONFIG, "Stream over LCM without its name", FILE_, "devices: {lcm: [{channel: ODOM}]}\n",
     "config/robot.yaml:3: devices.lcm[0]: stream: is missing, e.g. {stream: motion}"},
    {CONFIG, "Stream that LCM does not carry", FILE_, "devices: {lcm: [{stream: imuu}]}\n",
     "config/robot.yaml:3: devices.lcm[0].stream: 'imuu' is unknown; did you mean 'imu'? (one of: motion, motion6, "
     "ticks, ...)"},
    {CONFIG, "Stream over LCM twice", FILE_, "devices:\n  lcm:\n    - {stream: imu}\n    - {stream: imu}\n",
     "config/robot.yaml:6: devices.lcm[1]: the stream 'imu' appears twice (first in line 5)"},
    {CONFIG, "Stream of gpsd and of LCM", FILE_, "devices:\n  lcm: [{stream: gnss}]\n  gpsd: [{latency_ms: 80}]\n",
     "config/robot.yaml:5: devices.gpsd[0]: the stream 'gnss' appears twice (first in line 4)"},
    {CONFIG, "Report that gpsd does not give", FILE_, "devices: {gpsd: [{take: positions}]}\n",
     "config/robot.yaml:3: devices.gpsd[0].take: 'positions' is unknown; did you mean 'position'? (one of: position, "
     "course, antennas)"},
    {CONFIG, "IMU without its name", FILE_, "devices: {iio: {rate_hz: 200}}\n",
     "config/robot.yaml:3: devices.iio: device: is missing: a name as `cat /sys/bus/iio/devices/*/name` prints them, "
     "e.g. bmi160"},
    {CONFIG, "Velocity log without its address", FILE_, "devices: {dvl: {port: 16171}}\n",
     "config/robot.yaml:3: devices.dvl: host: is missing: the log's address, e.g. 192.168.194.95"},
    {CONFIG, "Stream of a velocity log and of LCM", FILE_,
     "devices:\n  lcm: [{stream: motion6}]\n  dvl: {host: 192.168.194.95}\n",
     "config/robot.yaml:5: devices.dvl: the stream 'motion6' appears twice (first in line 4)"},
    {CONFIG, "Unknown source", FILE_, "sources: [{name: gpss}]\n",
     "config/robot.yaml:3: sources[0].name: 'gpss' is unknown; did you mean 'gnss'? (one of: can, motion, motion6, "
     "...)"},
    {CONFIG, "Source twice", FILE_, "sources:\n  - name: gnss\n  - name: gnss\n",
     "config/robot.yaml:5: sources[1].name: 'gnss' appears twice (first in line 4)"},
    {CONFIG, "Until before from", FILE_, "sources: [{name: gnss, from_s: 30, until_s: 25}]\n",
     "config/robot.yaml:3: sources[0].until_s: 25 is not after from_s (30): nothing would be taken"},
    {CONFIG, "File that is not there", FILE_, "landmarks: hall.csv\n",
     "config/robot.yaml:3: landmarks: 'hall.csv' cannot be read (looked for config/hall.csv)"},
    {CONFIG, "Building that is not there", FILE_, "site: office/ground\n",
     "config/robot.yaml:3: site: config/office/ground: is no site: there is no site.yaml in it, no landmarks.csv and "
     "no map.yaml (docs/building.md)"},
    {CONFIG, "Start pose with an unknown key", FILE_, "initial_pose: {x_m: 1, y_m: 2, yaw_rad: 0}\n",
     "config/robot.yaml:3: initial_pose.yaw_rad: unknown key; known are: t_ns, x_m, y_m, z_m, heading_rad, "
     "heading_deg, qx, qy, qz, qw, sigma_xy_m, sigma_heading_rad, sigma_heading_deg"},
    {CONFIG, "Heading given twice", FILE_, "initial_pose: {heading_rad: 0, heading_deg: 0}\n",
     "config/robot.yaml:3: initial_pose.heading_deg: heading_rad is given, too; give one of them"},
    {CONFIG, "Key twice", FILE_, "merge: {horizon_ms: 300}\nmerge: {horizon_ms: 400}\n",
     "config/robot.yaml:4: merge: the key appears twice (first in line 3)"},
    {CONFIG, "Tab as indentation", FILE_, "merge:\n\thorizon_ms: 300\n",
     "config/robot.yaml:4: not valid YAML: found character that cannot start any token, while scanning for the next "
     "token"},
    {CONFIG, "Time of detection where nothing is detected", FILE_, "sources: [{name: gnss, ready_after_ms: 40}]\n",
     "config/robot.yaml:3: sources[0].ready_after_ms: only a detector's observations take time"},
    {CONFIG, "Bracket not closed", FILE_, "sources: [{name: gnss}\nmerge: {horizon_ms: 300}\n",
     "config/robot.yaml:4: not valid YAML: did not find expected ',' or ']', while parsing a flow sequence that begins "
     "in line 3"},
    {CONFIG, "Alias without an anchor", FILE_, "merge: *defaults\n",
     "config/robot.yaml:3: an alias whose anchor (&NAME) doesn't stand before it"},

    // recording.yaml and what it names.
    {REC, "Not a recording", "recording.yaml", NULL,
     "rec: there is no recording.yaml in it: is it a recording's folder?"},
    {REC, "Recording without a format", "recording.yaml", "name: drive\n",
     "rec/recording.yaml:1: format: is missing; 'format: waymark-recording/1' is needed"},
    {REC, "Recording of a later format", "recording.yaml", "format: waymark-recording/2\n",
     "rec/recording.yaml:1: format: 'waymark-recording/2' is not a format that this program reads; it reads "
     "waymark-recording/1"},
    {REC, "Stream that is not there", "recording.yaml",
     "format: waymark-recording/1\nstreams: [motion.csv, gnss.csv]\n",
     "rec/recording.yaml:2: streams[1]: 'gnss.csv' is not in the folder; put it there or take it off the list"},
    {REC, "Start pose that is not a number", "recording.yaml",
     "format: waymark-recording/1\nvehicle:\n  initial_pose: {x_m: 1, y_m: two}\n",
     "rec/recording.yaml:3: vehicle.initial_pose.y_m: 'two' is not a number; a number from -100000000 to 100000000 is "
     "needed"},
    {REC, "Stamp with a fraction", "recording.yaml",
     "format: waymark-recording/1\nvehicle:\n  initial_pose: {t_ns: 1.5e9}\n",
     "rec/recording.yaml:3: vehicle.initial_pose.t_ns: '1.5e9' is not a whole number; a whole number from "
     "-4000000000000000000 to 4000000000000000000 is needed"},
    {REC, "Half a quaternion", "recording.yaml",
     "format: waymark-recording/1\nvehicle:\n  initial_pose: {x_m: 1, qz: 0.7, qw: 0.7}\n",
     "rec/recording.yaml:3: vehicle.initial_pose: a part of qx, qy, qz, qw is missing: all four are needed, or none"},
    {REC, "Quaternion of the wrong length", "recording.yaml",
     "format: waymark-recording/1\nvehicle:\n  initial_pose: {qx: 0, qy: 0, qz: 1, qw: 1}\n",
     "rec/recording.yaml:3: vehicle.initial_pose: the quaternion's length is 1.414; 1 is needed"},
    {REC, "CAN without a DBC", "vehicle.dbc", NULL,
     "rec/vehicle.dbc: is not there, but needed to read can.log; name one in the configuration or put it into the "
     "folder"},
    {REC, "CAN without a binding", "can-signals.yaml", NULL,
     "rec/can-signals.yaml: is not there, but needed to read can.log; name one in the configuration or put it into the "
     "folder"},

    // calibration.yaml.
    {REC, "Calibration key misspelt", "calibration.yaml", "wheels: {trak_m: 0.6}\n",
     "rec/calibration.yaml:1: wheels.trak_m: unknown key; did you mean 'track_m'?"},
    {REC, "Sensor's key misspelt", "calibration.yaml", "sensors:\n  laser: {bearing_sgma_rad: 0.02}\n",
     "rec/calibration.yaml:2: sensors.laser.bearing_sgma_rad: unknown key; did you mean 'bearing_sigma_rad'?"},
    {REC, "Track of zero", "calibration.yaml", "wheels: {track_m: 0}\n",
     "rec/calibration.yaml:1: wheels.track_m: '0' is out of range; a number above 0 and up to 100 is needed"},
    {REC, "Negative sigma", "calibration.yaml", "sensors:\n  laser: {range_sigma_m: -0.1}\n",
     "rec/calibration.yaml:2: sensors.laser.range_sigma_m: '-0.1' is out of range; a number above 0 and up to 1000 is "
     "needed"},
    {REC, "Mounting of two numbers", "calibration.yaml", "sensors:\n  laser: {mounting: {xyz_m: [0.2, 0]}}\n",
     "rec/calibration.yaml:2: sensors.laser.mounting.xyz_m: has 2 values; a list of 3 numbers is needed"},
    {REC, "Degrees and radians", "calibration.yaml",
     "sensors:\n  laser: {mounting: {rpy_deg: [0, 0, 5], rpy_rad: [0, 0, 0.1]}}\n",
     "rec/calibration.yaml:2: sensors.laser.mounting.rpy_rad: rpy_deg is given, too; give one of them"},
    {REC, "Range that is neither", "calibration.yaml", "sensors:\n  laser: {range_is: dept}\n",
     "rec/calibration.yaml:2: sensors.laser.range_is: 'dept' is unknown; did you mean 'depth'? (one of: distance, "
     "depth)"},
    {REC, "Unknown camera model", "calibration.yaml", "cameras:\n  front: {model: fisheye}\n",
     "rec/calibration.yaml:2: cameras.front.model: 'fisheye' is unknown; one of these is needed: equidistant, "
     "pinhole-radtan, omni, double-sphere, ocam"},
    {REC, "Intrinsics of another model", "calibration.yaml",
     "cameras:\n  front: {model: omni, size: [640, 480], intrinsics: [400, 400, 320, 240]}\n",
     "rec/calibration.yaml:2: cameras.front.intrinsics: has 4 values; this model needs [xi, fx, fy, cx, cy]"},
    {REC, "Centre outside of the picture", "calibration.yaml",
     "cameras:\n  front: {model: equidistant, size: [640, 480], intrinsics: [400, 400, 3200, 240]}\n",
     "rec/calibration.yaml:2: cameras.front.intrinsics[2]: '3200' is out of range; a number from -640 to 1280 is "
     "needed"},
    {REC, "Stereo with a camera that is not there", "calibration.yaml", "stereo: {left: cam_l, right: cam_r}\n",
     "rec/calibration.yaml:1: stereo.left: there is no camera 'cam_l' under cameras"},
    {REC, "Steering table that does not rise", "calibration.yaml",
     "wheels:\n  steering_table: {actuator_mm: [8, 50, 40], road_wheel_rad: [-0.7, 0, 0.7]}\n",
     "rec/calibration.yaml:2: wheels.steering_table.actuator_mm: must rise from value to value (40 follows 50)"},
    {REC, "Steering table of unequal lists", "calibration.yaml",
     "wheels:\n  steering_table: {actuator_mm: [8, 50, 98], road_wheel_rad: [-0.7, 0.7]}\n",
     "rec/calibration.yaml:2: wheels.steering_table: actuator_mm has 3 values, the angles are 2; one each is needed"},

    // landmarks.csv and the headers of streams.
    {REC, "Landmark twice", "landmarks.csv", "id,x_m,y_m,z_m,sigma_m\n7,1,2,0,0.01\n7,3,4,0,0.01\n",
     "rec/landmarks.csv:3: id: 7 appears twice (first in line 2); each landmark needs its own"},
    {REC, "Landmark that is not finite", "landmarks.csv", "id,x_m,y_m,z_m,sigma_m\n7,1,nan,0,0.01\n",
     "rec/landmarks.csv:2: y_m: 'nan' is not a finite number"},
    {REC, "Landmark with a negative sigma", "landmarks.csv", "id,x_m,y_m,z_m,sigma_m\n7,1,2,0,-0.01\n",
     "rec/landmarks.csv:2: sigma_m: '-0.01' is outside of what can be (0 to 1000000)"},
    {REC, "Column misspelt", "motion.csv", "t_ns,v_mps,w_rads\n0,0,0\n",
     "rec/motion.csv:1: the column 'w_radps' is missing (the header has 'w_rads': is it meant?); needed in the header, "
     "in any order: t_ns,v_mps,w_radps"},
    {REC, "Column missing", "gnss.csv", "t_ns,x_m,y_m\n0,0,0\n",
     "rec/gnss.csv:1: the column 'sigma_xy_m' is missing; needed in the header, in any order: t_ns,x_m,y_m,sigma_xy_m"},
    {REC, "Semicolons", "motion.csv", "t_ns;v_mps;w_radps\n0;0;0\n",
     "rec/motion.csv:1: the column 't_ns' is missing (commas part the fields); needed in the header, in any order: "
     "t_ns,v_mps,w_radps"},
    {REC, "Column twice", "motion.csv", "t_ns,v_mps,v_mps,w_radps\n0,0,0,0\n",
     "rec/motion.csv:1: the column 'v_mps' appears twice"},
    {REC, "Empty stream", "motion.csv", "", "rec/motion.csv:1: no header line; needed: t_ns,v_mps,w_radps"},

    // can-signals.yaml, as far as it is YAML; what doesn't fit the DBC is among the CAN cases.
    {REC, "Unknown quantity", "can-signals.yaml", "- {quantity: vehicle_sped, message: SPEED, signal: SPEED}\n",
     "rec/can-signals.yaml:1: [0].quantity: 'vehicle_sped' is unknown; did you mean 'vehicle_speed'? (one of: "
     "wheel_ticks_left, wheel_ticks_right, wheel_speed_front_left, wheel_speed_front_right, wheel_speed_rear_left, "
     "wheel_speed_rear_right, vehicle_speed, yaw_rate, steering_wheel, road_wheel, steering_actuator, gear, roll_rate, "
     "pitch_rate, acceleration_x, acceleration_y, acceleration_z, gnss_latitude, gnss_longitude, gnss_altitude, "
     "gnss_sigma_xy, gnss_sigma_z, gnss_valid, gnss_altitude_valid)"},
    {REC, "Binding without a signal", "can-signals.yaml", "- {quantity: vehicle_speed, message: SPEED}\n",
     "rec/can-signals.yaml:1: [0]: signal: is missing"},
    {REC, "Binding's key misspelt", "can-signals.yaml",
     "- {quantity: vehicle_speed, message: SPEED, signal: SPEED, scael: -1}\n",
     "rec/can-signals.yaml:1: [0].scael: unknown key; did you mean 'scale'?"},
    {REC, "Quantity bound twice", "can-signals.yaml",
     "- {quantity: vehicle_speed, message: SPEED, signal: SPEED}\n- {quantity: vehicle_speed, message: SPEED, signal: "
     "SPEED}\n",
     "rec/can-signals.yaml:2: [1]: vehicle_speed is bound twice (first in line 1)"},
    {REC, "Scale of zero", "can-signals.yaml", "- {quantity: vehicle_speed, message: SPEED, signal: SPEED, scale: 0}\n",
     "rec/can-signals.yaml:1: [0].scale: 0 would make everything 0; leave it out for 1"},
    {REC, "Values for what is not a gear", "can-signals.yaml",
     "- {quantity: vehicle_speed, message: SPEED, signal: SPEED, values: {forward: [1]}}\n",
     "rec/can-signals.yaml:1: [0].values: only the quantity gear has values"},

    // Rows: the recording is read on; the row is counted, and the first one is shown.
    {ROW, "Row with too few fields", "motion.csv", "t_ns,v_mps,w_radps\n0,0.5\n",
     "rec/motion.csv:2: 2 fields where the header has 3; the row is skipped"},
    {ROW, "Stamp that is not whole", "motion.csv", "t_ns,v_mps,w_radps\n0.5,0,0\n",
     "rec/motion.csv:2: t_ns: '0.5' is not a whole number; the row is skipped"},
    {ROW, "Stamp that leaps", "motion.csv", "t_ns,v_mps,w_radps\n0,1,0\n900000000000000,1,0\n100000000,1,0\n",
     "rec/motion.csv:3: t_ns: lies 900000 s after the next row's; the row is skipped"},
    {ROW, "Value that is not a number", "motion.csv", "t_ns,v_mps,w_radps\n0,fast,0\n",
     "rec/motion.csv:2: v_mps: 'fast' is not a number; the row is skipped"},
    {ROW, "Value that is not finite", "motion.csv", "t_ns,v_mps,w_radps\n0,inf,0\n",
     "rec/motion.csv:2: v_mps: 'inf' is not a finite number; the row is skipped"},
    {ROW, "Value that cannot be", "motion.csv", "t_ns,v_mps,w_radps\n0,1e6,0\n",
     "rec/motion.csv:2: v_mps: '1e6' is outside of what can be (-1000 to 1000); the row is skipped"},
    {ROW, "Empty field that is needed", "gnss.csv", "t_ns,x_m,y_m,z_m,sigma_xy_m,sigma_z_m\n0,1,2,3,,\n",
     "rec/gnss.csv:2: sigma_xy_m: is empty, but needed; the row is skipped"},
    {ROW, "Sighting of nothing", "sightings.csv", "t_ns,sensor,id,bearing_rad,range_m\n0,laser,7,,\n",
     "rec/sightings.csv:2: bearing_rad and range_m are both empty; the row is skipped"},
    {ROW, "Sighting in degrees", "sightings.csv", "t_ns,sensor,id,bearing_rad,range_m\n0,laser,7,45,2.5\n",
     "rec/sightings.csv:2: bearing_rad: '45' is outside of what can be (-6.2832 to 6.2832); the row is skipped"},
    {ROW, "Half a pixel", "stereo.csv", "t_ns,id,ul_px,vl_px,ur_px,vr_px\n0,1,320,,300,240\n",
     "rec/stereo.csv:2: one of u and v is empty; the row is skipped"},
    {0},
};
