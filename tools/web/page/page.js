// SPDX-License-Identifier: Apache-2.0
// The page of `waymark web`: asks for the state ten times a second while it is looked at, and draws it. Text from
// messages is only ever set as text.
import {$, axes, begin_drawing, canvas, colours, down, draw_landmark, draw_layer, element, ellipse, fixed, grid_lines, high, hooks, label, length, minus, pen, right, round_step,
  set_mode, size_canvas, swatch, take_colours, tint, view, wide} from './mapview.js';

const ASK_MS = 100, PICTURE_MS = 250, LEAST_VIEW_M = 8;
const NUMBERS = 1e6;  // a larger one is a filter's own, and no name for a person
const BLUE_DOTS = '#1fa2ff', YELLOW = '#ffd23d', HIT = '#35e0a8';

// What is shown.
const trail = {generation: 0, points: []};
let state = null, before = null, arrived_ms = 0, landmarks = {version: 0, list: []};
let places = {version: 0, particles: [], hypotheses: []};
const layers = {floor: null, edges: null};  // of the map: {width, height, cell_m, origin, picture}
const shown = {map: true, trail: true, landmarks: true, sightings: true, particles: true, hypotheses: true};
const drawn = {trail: 0, landmarks: 0, rays: 0, particles: 0, hypotheses: 0, map: 0, picture_dots: 0, map_dots: 0, pictures: 0};

function repaint() {
  take_colours();
  for (const layer of Object.values(layers)) if (layer) tint(layer);
}

// ── numbers for people ──────────────────────────────────────────────────────────────────────────────────────────────
function degrees(v) { return v === null || v === undefined ? '\u2013' : minus((v * 180 / Math.PI).toFixed(Math.abs(v) < 0.17 ? 2 : 1)) + '\u00b0'; }
function count(n) { return String(n).replace(/\B(?=(\d{3})+$)/g, '\u2009'); }
function duration(s) {
  if (s === null || s === undefined) return '\u2013';
  return s < 10 ? s.toFixed(1) + ' s' : s < 120 ? s.toFixed(0) + ' s' : s < 7200 ? (s / 60).toFixed(0) + ' min' : (s / 3600).toFixed(0) + ' h';
}

// ── the view of the map ─────────────────────────────────────────────────────────────────────────────────────────────
// The pose between the last two messages, so that it moves evenly; a jump is shown as one.
function pose_now() {
  const now = state && state.pose;
  if (!now || now.x_m === null) return null;
  const old = before && before.pose;
  if (!old || old.x_m === null || old.resets !== now.resets || old.jumps !== now.jumps || old.heading_rad === null) return now;
  const part = Math.min(1, (performance.now() - arrived_ms) / (ASK_MS * 1.2));
  let turn = now.heading_rad - old.heading_rad;
  turn -= 2 * Math.PI * Math.round(turn / (2 * Math.PI));
  return {...now, x_m: old.x_m + part * (now.x_m - old.x_m), y_m: old.y_m + part * (now.y_m - old.y_m), heading_rad: old.heading_rad + part * turn};
}

function bounds(pose) {
  let box = [Infinity, Infinity, -Infinity, -Infinity];
  const add = (x, y) => { box = [Math.min(box[0], x), Math.min(box[1], y), Math.max(box[2], x), Math.max(box[3], y)]; };
  for (const p of trail.points) add(p[0], p[1]);
  if (pose) {
    add(pose.x_m - LEAST_VIEW_M / 2, pose.y_m - LEAST_VIEW_M / 2);
    add(pose.x_m + LEAST_VIEW_M / 2, pose.y_m + LEAST_VIEW_M / 2);
  }
  if (!isFinite(box[0])) return null;
  const reach = Math.max(box[2] - box[0], box[3] - box[1], 20);  // landmarks far away don't make the drive small
  const drive = box.slice();
  for (const l of landmarks.list)
    if (l[1] !== null && l[1] > drive[0] - reach && l[1] < drive[2] + reach && l[2] > drive[1] - reach && l[2] < drive[3] + reach) add(l[1], l[2]);
  return box;
}

function move_view(pose) {
  if (view.mode === 'free') return;
  let x = pose ? pose.x_m : view.x, y = pose ? pose.y_m : view.y, scale = view.scale;
  if (view.mode === 'fit') {
    const box = bounds(pose);
    if (!box) return;
    const margin = wide < 600 ? 44 : 64;
    scale = Math.min(200, (wide - 2 * margin) / Math.max(box[2] - box[0], 1), (high - 2 * margin) / Math.max(box[3] - box[1], 1));
    x = (box[0] + box[2]) / 2;
    y = (box[1] + box[3]) / 2;
  }
  const far = Math.hypot(x - view.x, y - view.y) * view.scale > 2 * Math.max(wide, high) || !view.placed;
  const soft = far ? 1 : 0.18;
  view.placed = true;
  view.x += soft * (x - view.x);
  view.y += soft * (y - view.y);
  view.scale *= Math.pow(Math.max(scale, 0.01) / view.scale, soft);
}

hooks.mode = mode => {
  $('fit').setAttribute('aria-pressed', String(mode === 'fit'));
  $('follow').setAttribute('aria-pressed', String(mode === 'follow'));
};
hooks.key = e => {
  if (e.key !== ' ') return false;
  set_mode(view.mode === 'follow' ? 'free' : 'follow');
  return true;
};
function follow() {
  if (view.mode === 'fit') view.scale = Math.max(view.scale, Math.min(wide, high) / 16);
  set_mode(view.mode === 'follow' ? 'free' : 'follow');
}
$('fit').onclick = () => set_mode('fit');
$('follow').onclick = follow;

// ── drawing the map ─────────────────────────────────────────────────────────────────────────────────────────────────
function draw_trail(pose) {
  const points = trail.points;
  const kinds = [[colours.pale, [2, 5]], [colours.blue, []], [colours.amber, [7, 4]], [colours.orange, [3, 4]]];
  pen.lineJoin = pen.lineCap = 'round';
  pen.lineWidth = 2.4;
  drawn.trail = points.length;
  let last = -1;
  for (let i = 0; i < points.length; i++) {
    const [x, y, , kind, jump] = points[i];
    if (kind !== last || jump) {
      if (last >= 0) pen.stroke();
      pen.beginPath();
      pen.strokeStyle = (kinds[kind] || kinds[0])[0];
      pen.setLineDash((kinds[kind] || kinds[0])[1]);
      if (i > 0 && !jump) pen.moveTo(right(points[i - 1][0]), down(points[i - 1][1]));
      last = kind;
    }
    pen.lineTo(right(x), down(y));
  }
  if (last >= 0 && pose) pen.lineTo(right(pose.x_m), down(pose.y_m));
  if (last >= 0) pen.stroke();
  pen.setLineDash([]);
  pen.lineCap = 'butt';
  if (points.length > 1) {
    pen.beginPath();
    pen.arc(right(points[0][0]), down(points[0][1]), 5, 0, 7);
    pen.fillStyle = colours.card;
    pen.strokeStyle = colours.ink;
    pen.lineWidth = 2;
    pen.fill();
    pen.stroke();
  }
}
function draw_landmarks() {
  let names = 0;
  drawn.landmarks = 0;
  const fits = landmarks.list.length < 60 || view.scale > 25;
  for (const [id, x, y, , xx, xy, yy, own] of landmarks.list) {
    if (x === null || y === null) continue;
    const u = right(x), v = down(y);
    if (u < -50 || v < -50 || u > wide + 50 || v > high + 50) continue;
    drawn.landmarks++;
    draw_landmark(id, x, y, xx, xy, yy, own, id >= 0 && id < NUMBERS && fits && names++ < 200);
  }
}
function draw_rays() {
  drawn.rays = 0;
  pen.lineWidth = 1.4;
  for (const [x0, y0, x1, y1, verdict] of (state && state.rays) || []) {
    if (x0 === null || x1 === null) continue;
    drawn.rays++;
    pen.strokeStyle = verdict === 'refused' ? colours.orange : colours.green;
    pen.globalAlpha = verdict === 'seen' ? 0.45 : 0.8;
    pen.setLineDash([6, 4]);
    pen.beginPath();
    pen.moveTo(right(x0), down(y0));
    pen.lineTo(right(x1), down(y1));
    pen.stroke();
    pen.setLineDash([]);
    pen.beginPath();
    pen.arc(right(x1), down(y1), 3, 0, 7);
    pen.fillStyle = pen.strokeStyle;
    pen.fill();
  }
  pen.globalAlpha = 1;
}
function draw_particles() {
  const list = places.particles;
  drawn.particles = list.length;
  if (list.length === 0) return;
  pen.strokeStyle = colours.purple;
  pen.globalAlpha = 0.55;
  pen.lineWidth = 1.3;
  pen.beginPath();
  for (const [x, y, heading] of list) {
    if (x === null || y === null) continue;
    const u = right(x), v = down(y);
    pen.moveTo(u - 1, v);
    pen.arc(u, v, 1.3, Math.PI, 3 * Math.PI);
    pen.moveTo(u, v);
    pen.lineTo(u + 8 * Math.cos(heading), v - 8 * Math.sin(heading));
  }
  pen.stroke();
  pen.globalAlpha = 1;
}
function arrow(u, v, heading, size) {
  pen.save();
  pen.translate(u, v);
  pen.rotate(-heading);
  pen.beginPath();
  pen.moveTo(1.5 * size, 0); pen.lineTo(-size, 0.95 * size); pen.lineTo(-0.5 * size, 0); pen.lineTo(-size, -0.95 * size);
  pen.closePath();
  pen.restore();
}
function draw_hypotheses() {
  drawn.hypotheses = places.hypotheses.length;
  for (const [x, y, heading, weight, xx, xy, yy] of places.hypotheses) {
    if (x === null || y === null) continue;
    pen.strokeStyle = colours.purple;
    pen.lineWidth = 1.6;
    pen.setLineDash([5, 3]);
    if (xx !== null) { ellipse(x, y, xx, xy, yy, 4); pen.stroke(); }
    pen.setLineDash([]);
    arrow(right(x), down(y), heading || 0, 7);
    pen.fillStyle = colours.card;
    pen.fill();
    pen.stroke();
    if (weight !== null) label((weight * 100).toFixed(0) + ' %', right(x) + 12, down(y) + 12, 'left', colours.purple);
  }
}
function draw_robot(pose) {
  if (!pose) return;
  const u = right(pose.x_m), v = down(pose.y_m), heading = pose.heading_rad || 0, c = pose.covariance;
  const tone = state.state === 'lost' || state.state === 'silent' ? colours.orange : state.state === 'tracking' ? colours.blue : colours.amber;
  if (pose.sigma_heading_rad !== null) {  // the sector of two sigma of the heading
    const half = Math.min(2 * pose.sigma_heading_rad, Math.PI), reach = 58;
    const shade = pen.createRadialGradient(u, v, 8, u, v, reach);
    shade.addColorStop(0, tone);
    shade.addColorStop(1, 'transparent');
    pen.globalAlpha = 0.4;
    pen.fillStyle = shade;
    pen.beginPath();
    pen.moveTo(u, v);
    pen.arc(u, v, reach, -heading - Math.max(half, 0.02), -heading + Math.max(half, 0.02));
    pen.closePath();
    pen.fill();
    pen.globalAlpha = 1;
  }
  arrow(u, v, heading, 11);
  pen.fillStyle = tone;
  pen.strokeStyle = colours.card;
  pen.lineWidth = 2.5;
  pen.lineJoin = 'round';
  pen.stroke();
  pen.fill();
  if (c[0] === null) return;
  ellipse(pose.x_m, pose.y_m, c[0], c[1], c[2], 0);  // over the arrow: it may be smaller
  pen.fillStyle = colours.band;
  pen.fill();
  pen.strokeStyle = colours.card;
  pen.lineWidth = 3;
  pen.stroke();
  pen.strokeStyle = tone;
  pen.lineWidth = 1.5;
  pen.stroke();
}
function draw_depth() {
  const strip = $('depth');
  const has = state && state.pose && state.pose.dof === 6 && trail.points.length > 1;
  if (strip.hidden === Boolean(has)) strip.hidden = !has;
  if (!has) return;
  const [w, h] = size_canvas(strip), c = strip.getContext('2d'), left = 52, foot = 20;
  c.clearRect(0, 0, w, h);
  const way = [0];
  for (let i = 1; i < trail.points.length; i++)
    way.push(way[i - 1] + Math.hypot(trail.points[i][0] - trail.points[i - 1][0], trail.points[i][1] - trail.points[i - 1][1]));
  let low = Infinity, top = -Infinity;
  for (const p of trail.points) { low = Math.min(low, p[2]); top = Math.max(top, p[2]); }
  const middle = (low + top) / 2, half = Math.max((top - low) / 2, 0.25) * 1.15;
  const X = s => left + (w - left - 12) * s / Math.max(way[way.length - 1], 0.1), Y = z => 8 + (h - foot - 8) * (middle + half - z) / (2 * half);
  c.font = colours.font;
  c.fillStyle = colours.soft;
  c.strokeStyle = colours.grid;
  c.lineWidth = 1;
  const step = round_step(half * 2 / 3);
  c.textAlign = 'right';
  c.textBaseline = 'middle';
  for (let i = Math.ceil((middle - half) / step); i * step <= middle + half; i++) {
    c.beginPath(); c.moveTo(left, Y(i * step)); c.lineTo(w - 12, Y(i * step)); c.stroke();
    c.fillText(minus((i * step).toFixed(step < 1 ? 1 : 0)) + ' m', left - 6, Y(i * step));
  }
  c.textAlign = 'left';
  c.fillText('height over ' + length(way[way.length - 1]) + ' of way', left, h - 9);
  c.strokeStyle = colours.blue;
  c.lineWidth = 2;
  c.beginPath();
  trail.points.forEach((p, i) => i ? c.lineTo(X(way[i]), Y(p[2])) : c.moveTo(X(0), Y(p[2])));
  c.stroke();
  c.fillStyle = colours.orange;
  c.beginPath();
  c.arc(X(way[way.length - 1]), Y(state.pose.z_m === null ? middle : state.pose.z_m), 4, 0, 7);
  c.fill();
}
function draw() {
  requestAnimationFrame(draw);
  if (document.hidden) return;
  begin_drawing();
  const pose = pose_now();
  move_view(pose);
  drawn.map = 0;
  if (shown.map && layers.floor) {  // beyond the floor
    pen.fillStyle = colours.grid;
    pen.fillRect(0, 0, wide, high);
    drawn.map += draw_layer(layers.floor);
  }
  const grid = grid_lines(shown.map && layers.floor);
  if (shown.map) drawn.map += draw_layer(layers.edges);
  if (shown.particles) draw_particles();
  if (shown.trail) draw_trail(pose);
  if (shown.landmarks) draw_landmarks();
  if (shown.sightings) draw_rays();
  if (shown.hypotheses) draw_hypotheses();
  draw_robot(pose);
  axes(grid);
  draw_depth();
}

// ── what stands beside the map ──────────────────────────────────────────────────────────────────────────────────────
const LAYERS = [
  ['map', 'map', () => layers.floor || layers.edges, () => swatch('mark-edges', 'M0 0H24')],
  ['trail', 'path', () => trail.points.length > 0, () => swatch('mark-trail', 'M0 0H24')],
  ['landmarks', 'landmarks', () => landmarks.list.length > 0,
    () => landmarks.list.every(l => l[7]) ? swatch('mark-own', 'M12-5l5 5l-5 5l-5-5Z') : swatch('mark-fill', 'M12-6l6 6l-6 6l-6-6Z')],
  ['sightings', 'sightings', () => drawn.rays > 0 || (state && state.rays.length > 0), () => swatch('mark-ray', 'M0 0H24')],
  ['particles', 'particles', () => places.particles.length > 0, () => swatch('mark-cloud', 'M3 0h0M12-3h0M20 2h0')],
  ['hypotheses', 'other places', () => places.hypotheses.length > 0, () => swatch('mark-else', '8', 'circle')]];
function show_layers() {
  const list = $('layers');
  for (const [key, words, is_there, make] of LAYERS) {
    if (!is_there() || list.querySelector('[data-layer=' + key + ']')) continue;
    const item = element('li'), button = element('button');
    button.type = 'button';
    button.dataset.layer = key;
    button.append(make(), words);
    button.setAttribute('aria-pressed', 'true');
    button.onclick = () => { shown[key] = !shown[key]; button.setAttribute('aria-pressed', String(shown[key])); };
    item.append(button);
    list.append(item);
  }
}
function show_state() {
  const banner = $('state');
  banner.className = 'state ' + state.state.split(' ')[0];
  banner.lastElementChild.textContent = state.state;
  const silent = state.state === 'silent' ? 'no message for more than two seconds' : state.state === 'waiting' ? 'for messages of a run' : '';
  const bad = state.health ? state.health.sources.filter(s => s.is_bad).length : 0;
  const good = state.state === 'tracking' && state.health && bad === 0 ? 'all ' + state.health.sources.length + ' sources are heard' : '';
  $('why').textContent = state.why || silent || good;
  $('name').textContent = state.name || '';
  document.title = state.state + ' \u00b7 waymark';
}
function show_tiles() {
  const p = state.pose, h = state.health, tiles = $('tiles');
  const rows = [];
  if (p) {
    const sigma = p.sigma_m[0] === null ? null : Math.sqrt((p.sigma_m[0] ** 2 + p.sigma_m[1] ** 2) / 2);
    rows.push([fixed(p.x_m, 2) + ' m', 'x'], [fixed(p.y_m, 2) + ' m', 'y'], [degrees(p.heading_rad), 'heading']);
    if (p.dof === 6) rows.push([fixed(p.z_m, 2) + ' m', 'z'], [degrees(p.roll_rad), 'roll'], [degrees(p.pitch_rad), 'pitch']);
    rows.push(['\u00b1\u2009' + length(sigma), 'position, one sigma'], ['\u00b1\u2009' + degrees(p.sigma_heading_rad), 'heading, one sigma'],
      [fixed(p.speed_mps, 2) + ' m/s', 'speed, ' + degrees(p.turn_radps) + '/s']);
    rows.push([duration(p.fused_s_ago), 'since the last fused'], [p.rate_hz === null ? '\u2013' : fixed(p.rate_hz, 0) + ' Hz', 'poses']);
  }
  if (h) rows.push([h.left_m === null ? 'any' : length(h.left_m), 'dead reckoning left']);
  while (tiles.children.length > rows.length) tiles.lastChild.remove();
  rows.forEach(([value, words], i) => {
    if (!tiles.children[i]) { const tile = element('div'); tile.append(element('b'), element('span')); tiles.append(tile); }
    tiles.children[i].firstChild.textContent = value;
    tiles.children[i].lastChild.textContent = words;
  });
  tiles.hidden = rows.length === 0;
}
function row(cells, tag) {
  const out = element('tr');
  for (const [text, name] of cells) out.append(element(tag || 'td', text, name));
  return out;
}
let health_shown = '';
function show_health() {
  const h = state.health;
  $('health').hidden = !h;
  if (!h) return;
  const text = JSON.stringify([h.sources, h.findings, h.counters, h.calibration]);
  if (text === health_shown) return;
  health_shown = text;
  const rows = [row([['source'], ['ago'], ['fused'], ['rejected'], ['late'], ['lost']], 'th')];
  for (const s of h.sources) {
    const line = row([['', 'name' + (s.is_bad ? ' bad' : '')], [duration(s.silent_s), s.is_bad ? 'bad' : ''], [count(s.fused)], [count(s.rejected)],
      [count(s.late), s.late > 0 ? 'bad' : ''], [count(s.lost), s.lost > 0 ? 'bad' : '']]);
    line.firstChild.append(element('i'), s.name);
    rows.push(line);
    const words = [s.is_bad ? s.device : '', s.is_bad ? s.remedy : '', s.looks].filter(Boolean).join('; ');
    if (words) { const more = row([[words, 'words']]); more.firstChild.colSpan = 6; rows.push(more); }
  }
  $('table').replaceChildren(...rows);
  const more = h.counters.map(c => row([[c.name.replaceAll('_', ' ')], [count(c.count)], ['']]));
  for (const c of h.calibration) more.push(row([[c.name, 'name'], [fixed(c.value, 5)], [c.sigma === null ? '' : '\u00b1 ' + c.sigma.toPrecision(2)]]));
  $('more').replaceChildren(...more);
  $('more').closest('details').hidden = more.length === 0;
  $('findings').replaceChildren(...h.findings.map(f => {
    const line = element('li', '', f.severity);
    line.append(element('b', f.about), ' ' + f.text);
    if (f.fix) line.append(element('p', f.fix));
    line.append(element('code', f.id));
    return line;
  }));
  $('findings-card').hidden = h.findings.length === 0;
}
function show_foot() {
  const h = state.health;
  $('foot').textContent = [h && h.lost_probability !== null ? 'Lost with probability ' + h.lost_probability.toPrecision(2) : '',
    state.consistency !== 'unknown' ? state.consistency : '', state.nis !== null ? 'squared innovations ' + state.nis.toFixed(2) + ' of their variance' : '', h ? count(h.deadlines_missed) + ' deadlines missed' : '',
    h && h.outputs_lost ? count(h.outputs_lost) + ' records lost' : '', state.pose && state.pose.jumps ? state.pose.jumps + ' jumps, the last ' + length(state.pose.last_jump_m) : '',
    state.not_understood ? state.not_understood + ' messages of another version' : ''].filter(Boolean).join(' \u00b7 ');
}

// ── the state ───────────────────────────────────────────────────────────────────────────────────────────────────────
function take(next) {
  before = state;
  state = next;
  arrived_ms = performance.now();
  const t = next.trail;
  if (t.generation !== trail.generation) trail.points = [];
  trail.generation = t.generation;
  trail.points.length = Math.min(trail.points.length, t.from);
  for (const p of t.points) trail.points.push(p);
  if (next.landmarks) landmarks = next.landmarks;
  if (next.places) places = next.places;
}
async function ask() {
  const wait = new Promise(done => setTimeout(done, ASK_MS));
  if (!document.hidden) {
    try {
      const answer = await fetch('state.json?generation=' + trail.generation + '&points=' + trail.points.length + '&landmarks=' + landmarks.version + '&places=' + places.version);
      take(await answer.json());
    } catch (e) {
      if (state) state = {...state, state: 'silent', why: 'waymark web has ended, or can\u2019t be reached'};
    }
    if (state) { show_state(); show_tiles(); show_health(); show_foot(); show_layers(); }
  }
  await wait;
  ask();
}
async function load_map() {
  try {
    const known = await (await fetch('map.json')).json();
    for (const name of ['floor', 'edges']) {
      if (!known[name]) continue;
      const image = new Image();
      image.src = name + '.png';
      await image.decode();
      const layer = {name, image, ...known[name]};
      tint(layer);
      layers[name] = layer;
    }
  } catch (e) { /* the page works without */ }
}

// ── the live picture ────────────────────────────────────────────────────────────────────────────────────────────────
let picture = null, picture_source = 0, is_in_view = true;
const glass = $('picture');
new IntersectionObserver(seen => { is_in_view = seen[0].isIntersecting; }).observe($('sight'));
const dots = (c, list, colour, size) => {
  c.fillStyle = colour;
  for (const [x, y] of list) { c.beginPath(); c.arc(x, y, size, 0, 7); c.fill(); }
};
function rings(c, list, colour, unit) {
  c.strokeStyle = colour;
  c.lineWidth = 1.8 * unit;
  c.font = 12 * unit + 'px sans-serif';
  for (const [x, y, id] of list) {
    c.beginPath();
    c.arc(x, y, 8 * unit, 0, 7);
    c.stroke();
    if (id >= 0 && id < NUMBERS && list.length < 60) { c.fillStyle = '#000a'; c.fillText(id, x + 11.7 * unit, y + 4.7 * unit); c.fillStyle = '#ffe98a'; c.fillText(id, x + 11 * unit, y + 4 * unit); }
  }
}
async function show_picture(p) {
  const image = new Image();
  image.src = 'data:image/jpeg;base64,' + p.jpeg;
  await image.decode();
  glass.width = Math.max(p.width, 640);
  glass.height = glass.width * p.height / p.width;
  const c = glass.getContext('2d'), unit = p.width / 480;
  c.drawImage(image, 0, 0, glass.width, glass.height);
  c.scale(glass.width / p.width, glass.width / p.width);
  c.translate(0.5, 0.5);  // whole numbers are the centres of pixels
  dots(c, p.dots, YELLOW, 2.3 * unit);
  dots(c, p.map_dots, BLUE_DOTS, 0.95 * unit);
  c.strokeStyle = YELLOW;
  c.lineWidth = 2 * unit;
  for (const line of p.lines) { c.beginPath(); line.forEach(([x, y], i) => i ? c.lineTo(x, y) : c.moveTo(x, y)); c.stroke(); }
  rings(c, p.map_marks, YELLOW, unit);
  dots(c, p.marks, HIT, 3.4 * unit);
  drawn.picture_dots = p.dots.length + p.lines.length + p.marks.length;
  drawn.map_dots = p.map_dots.length + p.map_marks.length;
  drawn.pictures++;
  const key = [];
  if (p.dots.length) key.push([swatch('mark-seen', 'M4 0h0M12 0h0M20 0h0'), 'edges found in the picture']);
  if (p.lines.length) key.push([swatch('mark-seen', 'M0 0H24'), 'upright lines found']);
  if (p.marks.length) key.push([swatch('mark-hit', '4', 'circle'), 'found by the detector']);
  if (p.map_dots.length) key.push([swatch('mark-mapped', 'M2 0h0M7 0h0M12 0h0M17 0h0M22 0h0'), 'the map\u2019s edges, by pose and mounting']);
  if (p.map_marks.length) key.push([swatch('mark-hope', '5.5', 'circle'), 'where landmarks should be, with their numbers']);
  $('picture-key').replaceChildren(...key.map(([mark, words]) => { const li = element('li'); li.append(mark, words); return li; }));
  $('picture-note').textContent = [p.name, p.width + ' \u00d7 ' + p.height, p.is_calibrated ? '' : 'no calibration for this camera is known here: nothing is drawn in',
    p.is_calibrated && !p.has_pose ? 'no pose at its stamp' : '', p.missed ? p.missed + ' pictures were passed over' : ''].filter(Boolean).join(' \u00b7 ');
}
function show_sources(p) {
  if (p.sources < 2 || $('sources').children.length === p.sources) return;
  $('sources').replaceChildren(...Array.from({length: p.sources}, (_, i) => {
    const button = element('button', String(i + 1));
    button.type = 'button';
    button.setAttribute('aria-pressed', String(i === picture_source));
    button.onclick = () => {
      picture_source = i;
      picture = null;
      [...$('sources').children].forEach((b, k) => b.setAttribute('aria-pressed', String(k === i)));
    };
    return button;
  }));
}
async function look() {
  const wait = new Promise(done => setTimeout(done, PICTURE_MS));
  const card = $('sight');
  try {
    if (!document.hidden && (is_in_view || card.hidden)) {
      const answer = await fetch('picture.json?source=' + picture_source + '&number=' + (picture ? picture.number : -1));
      if (answer.status === 200) {
        const next = await answer.json();
        card.hidden = !next.jpeg && !drawn.pictures && !/^\//.test(next.why || '');
        glass.hidden = !next.jpeg && !drawn.pictures;
        if (next.jpeg) { picture = next; show_sources(next); await show_picture(next); }
        else if (next.why) $('picture-note').textContent = next.why;
      }
    }
  } catch (e) { /* the state line shows a server that does not answer */ }
  await wait;
  setTimeout(look, card.hidden ? 2000 : 0);
}

repaint();
matchMedia('(prefers-color-scheme: dark)').addEventListener('change', repaint);
set_mode('fit');
load_map();
ask();
look();
requestAnimationFrame(draw);
window.waymark = {drawn, view, state: () => state, set_mode};
