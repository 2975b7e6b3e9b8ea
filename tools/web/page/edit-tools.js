// SPDX-License-Identifier: Apache-2.0
// What mouse and keys do on the plan, and how the plan is drawn.
import {$, axes, begin_drawing, canvas, colours, down, draw_landmark, draw_layer, grid_lines, high, hooks, label, length, pen, place_of, right, set_mode, view, wide} from './mapview.js';
import {act, act_on, applied, floor_now, model} from './edit-model.js';

const NEAR_PX = 12, CLICK_PX = 4, NUDGE_M = 0.01, NUDGES_MS = 1500;
export const tool = {name: 'move', points: [], selected: null, drag: null, pointer: null, area: -1};
export const drawn = {landmarks: 0, drives: 0, areas: 0, layers: 0};
export const shown = {plan: true, landmarks: true, drives: true, ways: true, areas: true};
// What the page does when a tool has its points or something else is selected.
export const calls = {asked: () => {}, selected: () => {}, say: () => {}};
export const TOOLS = [['move', 'v', 'Move', 'Drag a landmark; arrow keys move the selected one by 1 cm, with shift by 10 cm; Delete deletes it'], ['add', 'a', 'Add', 'Click where a landmark or a tag is'],
  ['measure', 'm', 'Measure', 'Click two points'], ['scale', 's', 'Scale', 'Click two points whose distance you know'], ['origin', 'o', 'Origin', 'Click a place whose latitude and longitude you know'],
  ['ignore', 'i', 'Ignore an area', 'Click the corners about furniture or the like; Enter closes it']];
export const is_desk = () => !matchMedia('(max-width: 820px)').matches;

export function choose(name) {
  Object.assign(tool, {name, points: [], drag: null, area: -1});
  canvas.classList.toggle('picks', name !== 'move');
  calls.asked(null);
}
export function select(id) {
  tool.selected = id;
  tool.area = -1;
  calls.selected();
}
const try_to = problem => { if (problem) calls.say(problem); };

// ── what is under the pointer ───────────────────────────────────────────────────────────────────────────────────────
function landmark_at(px, py) {
  let best = null, near = NEAR_PX;
  for (const l of floor_now().landmarks.values()) {
    const d = Math.hypot(right(l.x_m) - px, down(l.y_m) - py);
    if (d < near) { best = l; near = d; }
  }
  return best;
}
function is_inside(area, [x, y]) {
  let inside = false;
  area.forEach(([x1, y1], i) => {
    const [x0, y0] = area.at(i - 1);
    if (y0 > y !== y1 > y && x < x0 + (y - y0) * (x1 - x0) / (y1 - y0)) inside = !inside;
  });
  return inside;
}

// ── pointer and keys ────────────────────────────────────────────────────────────────────────────────────────────────
const millimetre = v => Math.round(v * 1000) / 1000;
// A place by a click is no better known than a pixel.
const place_sigma = old => Math.max(old || 0, Math.round(1e4 / view.scale) / 1e4);
let pressed = null;
hooks.takes = e => {
  if (!model.site) return false;
  if (e.type === 'dblclick') return tool.name !== 'move' || landmark_at(e.offsetX, e.offsetY) !== null;
  pressed = e.button === 0 ? [e.offsetX, e.offsetY] : null;
  const hit = e.button === 0 && tool.name === 'move' && shown.landmarks ? landmark_at(e.offsetX, e.offsetY) : null;
  if (!hit) return false;
  select(hit.id);
  if (!is_desk()) return false;
  canvas.setPointerCapture(e.pointerId);
  tool.drag = {id: hit.id, from: [e.offsetX, e.offsetY], off: [hit.x_m - place_of(e.offsetX, e.offsetY)[0], hit.y_m - place_of(e.offsetX, e.offsetY)[1]], to: null};
  return true;
};
canvas.addEventListener('pointermove', e => {
  tool.pointer = place_of(e.offsetX, e.offsetY);
  const d = tool.drag;
  if (d && (d.to || Math.hypot(e.offsetX - d.from[0], e.offsetY - d.from[1]) > CLICK_PX)) d.to = tool.pointer.map((v, k) => millimetre(v + d.off[k]));
  if (model.site && is_desk() && e.buttons === 0) canvas.classList.toggle('over', tool.name === 'move' && landmark_at(e.offsetX, e.offsetY) !== null);
});
canvas.addEventListener('pointercancel', () => { tool.drag = null; });
canvas.addEventListener('pointerup', e => {
  const d = tool.drag;
  tool.drag = null;
  if (d && d.to) {
    const old = floor_now().landmarks.get(d.id);
    if (old) try_to(act({do: 'set', floor: model.floor, id: d.id, x_m: d.to[0], y_m: d.to[1], sigma_m: place_sigma(old.sigma_m)}));
  } else if (!d && pressed && Math.hypot(e.offsetX - pressed[0], e.offsetY - pressed[1]) <= CLICK_PX) click(place_of(e.offsetX, e.offsetY));
  pressed = null;
});
function click(at) {
  const place = at.map(millimetre);
  if (tool.name === 'move') {
    tool.area = shown.areas ? floor_now().areas.findIndex(area => is_inside(area, place)) : -1;
    if (tool.area < 0) return select(null);
    return calls.say('Delete deletes this area');
  }
  if (!is_desk() && tool.name !== 'measure') return;
  if (tool.name === 'add') {
    if (!floor_now().has_landmarks) return calls.say('floor ' + model.floor + ' has no file of landmarks in site.yaml');
    const taken = applied().flatMap(f => [...f.landmarks.keys()]), id = taken.reduce((a, b) => Math.max(a, b), 0) + 1;
    try_to(act({do: 'add', floor: model.floor, id, x_m: place[0], y_m: place[1], z_m: 0, sigma_m: place_sigma(0)}));
    return select(id);
  }
  if ((tool.name === 'measure' || tool.name === 'scale') && tool.points.length === 2) tool.points = [];
  if (tool.name === 'origin') tool.points = [];
  const first = tool.points[0];
  if (tool.name === 'ignore' && tool.points.length > 2 && Math.hypot(right(first[0]) - right(place[0]), down(first[1]) - down(place[1])) < NEAR_PX) return close_area();
  tool.points.push(place);
  if (tool.points.length === {measure: 2, scale: 2, origin: 1}[tool.name]) calls.asked(tool.name);
}
function close_area() {
  if (tool.points.length > 2) try_to(act({do: 'ignore', floor: model.floor, areas: [...floor_now().areas, tool.points]}));
  tool.points = [];
}
let nudged_ms = -Infinity;
hooks.key = (e, step) => {
  if (!model.site || !is_desk()) return false;
  const old = tool.selected !== null && floor_now().landmarks.get(tool.selected), by = TOOLS.find(t => t[1] === e.key);
  if (by) choose(by[0]);
  else if (e.key === 'Escape') { tool.points.length || tool.name === 'move' ? (tool.points = [], calls.asked(null), select(null)) : choose('move'); }
  else if (e.key === 'Enter' && tool.name === 'ignore') close_area();
  else if (e.key === 'Delete' && tool.area >= 0) {
    try_to(act({do: 'ignore', floor: model.floor, areas: floor_now().areas.filter((_, i) => i !== tool.area)}));
    tool.area = -1;
  } else if (e.key === 'Delete' && old) { try_to(act({do: 'delete', floor: model.floor, id: old.id})); select(null); }
  else if (step && old) {
    const by_m = NUDGE_M * (e.shiftKey ? 10 : 1);
    try_to(act_on({do: 'set', floor: model.floor, id: old.id, x_m: millimetre(old.x_m + step[0] * by_m), y_m: millimetre(old.y_m + step[1] * by_m)}, performance.now() - nudged_ms < NUDGES_MS));
    nudged_ms = performance.now();
  } else return false;
  return true;
};

// ── drawing ─────────────────────────────────────────────────────────────────────────────────────────────────────────
function path(points, is_closed) {
  pen.beginPath();
  points.forEach(([x, y], i) => (i ? pen.lineTo(right(x), down(y)) : pen.moveTo(right(x), down(y))));
  if (is_closed) pen.closePath();
}
function stroke(colour, width, dash = []) {
  pen.strokeStyle = colour;
  pen.lineWidth = width;
  pen.setLineDash(dash);
  pen.stroke();
  pen.setLineDash([]);
}
function draw_drives() {
  const drives = model.site.drives.filter(d => d.is_shown !== false && (d.floor === null || d.floor === model.floor));
  drawn.drives = drives.length;
  for (const drive of drives) { path(drive.points, false); stroke(colours.blue, 1.6); }
}
function draw_areas(areas) {
  drawn.areas = areas.length;
  areas.forEach((area, i) => {
    path(area, true);
    pen.fillStyle = colours.amber;
    pen.globalAlpha = 0.16;
    pen.fill();
    pen.globalAlpha = 1;
    stroke(colours.amber, i === tool.area ? 3.5 : 1.8, [6, 4]);
  });
}
function draw_ways() {
  for (const way of model.site.connections)
    for (const end of way.ends.filter(e => e.floor === model.floor)) {
      const u = right(end.x_m), v = down(end.y_m);
      pen.beginPath();
      pen.arc(u, v, Math.max(way.radius_m * view.scale, 4), 0, 7);
      stroke(colours.purple, 1.5, [5, 3]);
      label(way.name.toLowerCase().includes(way.kind) ? way.name : way.kind + ' ' + way.name, u, v, 'center', colours.purple);
    }
}
function draw_landmarks(all) {
  let names = 0;
  drawn.landmarks = 0;
  for (const old of all.values()) {
    const moved = tool.drag && tool.drag.id === old.id && tool.drag.to, l = moved ? {...old, x_m: moved[0], y_m: moved[1]} : old;
    const u = right(l.x_m), v = down(l.y_m), [xx, xy, yy] = l.cov || [l.sigma_m ** 2, 0, l.sigma_m ** 2];
    if (u < -50 || v < -50 || u > wide + 50 || v > high + 50) continue;
    drawn.landmarks++;
    if (l.yaw_rad !== null) {  // a tag looks there
      pen.beginPath();
      pen.moveTo(u, v);
      pen.lineTo(u + 17 * Math.cos(l.yaw_rad), v - 17 * Math.sin(l.yaw_rad));
      stroke(l.is_edited ? colours.purple : colours.green, 2.2);
    }
    if (tool.selected === l.id) { pen.beginPath(); pen.arc(u, v, 12, 0, 7); stroke(colours.blue, 2.5); }
    draw_landmark(l.id, l.x_m, l.y_m, xx, xy, yy, Boolean(l.is_edited || moved), (all.size < 60 || view.scale > 25) && names++ < 200);
  }
}
function draw_points() {
  const points = tool.points, is_open = tool.pointer && points.length && (tool.name === 'ignore' || points.length < 2);
  if (!points.length) return;
  path(is_open ? [...points, tool.pointer] : points, false);
  stroke(colours.orange, 2, [5, 3]);
  for (const [x, y] of points) { pen.beginPath(); pen.arc(right(x), down(y), 4, 0, 7); pen.fillStyle = colours.orange; pen.fill(); }
  const [a, b] = [points[0], points[1] || tool.pointer];
  if (tool.name !== 'ignore' && tool.name !== 'origin' && b) label(length(Math.hypot(a[0] - b[0], a[1] - b[1])), right((a[0] + b[0]) / 2), down((a[1] + b[1]) / 2) - 12, 'center', colours.ink);
}
function fit(floor, layers) {
  const box = [Infinity, Infinity, -Infinity, -Infinity];
  const add = ([x, y]) => { box[0] = Math.min(box[0], x); box[1] = Math.min(box[1], y); box[2] = Math.max(box[2], x); box[3] = Math.max(box[3], y); };
  for (const l of layers) {
    const w = l.width * l.cell_m, h = l.height * l.cell_m, [x, y, yaw] = l.origin, c = Math.cos(yaw), s = Math.sin(yaw);
    for (const [u, v] of [[0, 0], [w, 0], [0, h], [w, h]]) add([x + c * u - s * v, y + s * u + c * v]);
  }
  for (const l of floor.landmarks.values()) add([l.x_m, l.y_m]);
  if (!isFinite(box[0])) box.splice(0, 4, -5, -5, 5, 5);
  view.scale = Math.min(400, (wide - 60) / Math.max(box[2] - box[0], 1), (high - 130) / Math.max(box[3] - box[1], 1));
  view.x = (box[0] + box[2]) / 2;
  view.y = (box[1] + box[3]) / 2;
}
// `layers`: those of the floor, {floor, edges}, tinted.
export function draw(layers) {
  begin_drawing();
  const floor = floor_now(), plan = floor.plan;
  const placed = Object.values(layers).filter(l => l && l.picture).map(l => ({...l, cell_m: l.cell_m * plan.factor, origin: plan.origin}));
  if (view.mode === 'fit') fit(floor, placed);
  const is_on_floor = shown.plan && placed.some(l => l.name === 'floor');
  if (is_on_floor) { pen.fillStyle = colours.grid; pen.fillRect(0, 0, wide, high); }
  drawn.layers = 0;
  if (is_on_floor) drawn.layers += draw_layer(placed.find(l => l.name === 'floor'));
  const grid = grid_lines(is_on_floor);
  if (shown.plan) drawn.layers += draw_layer(placed.find(l => l.name === 'edges'));
  if (shown.areas) draw_areas(floor.areas);
  if (shown.drives) draw_drives();
  if (shown.ways) draw_ways();
  if (shown.landmarks) draw_landmarks(floor.landmarks);
  draw_points();
  axes(grid);
}
$('fit').onclick = () => set_mode('fit');
hooks.mode = mode => $('fit').setAttribute('aria-pressed', String(mode === 'fit'));
