// SPDX-License-Identifier: Apache-2.0
// What the pages share: the view of a map on the canvas #map (metres to pixels, moved by mouse, fingers and keys), its
// axes and layers, and numbers for people.
export const $ = id => document.getElementById(id);
const TWO_SIGMA = Math.sqrt(5.991);  // an ellipse that holds 95 of 100

// ── numbers for people ──────────────────────────────────────────────────────────────────────────────────────────────
export const minus = text => text.replace('-', '\u2212');
export function fixed(v, n) { return v === null || v === undefined ? '\u2013' : minus(v.toFixed(n)); }
export function length(v) {
  if (v === null || v === undefined) return '\u2013';
  const a = Math.abs(v);
  return minus(a < 0.0095 ? (v * 1000).toFixed(1) + ' mm' : a < 0.995 ? (v * 100).toFixed(a < 0.0995 ? 1 : 0) + ' cm' : a < 99.5 ? v.toFixed(2) + ' m' : a < 9950 ? v.toFixed(0) + ' m' : (v / 1000).toFixed(1) + ' km');
}
export function round_step(least) {
  const power = Math.pow(10, Math.floor(Math.log10(least)));
  return [1, 2, 5, 10].find(k => k * power >= least * 0.999) * power;
}

// ── small pieces of the document ────────────────────────────────────────────────────────────────────────────────────
export function element(tag, text, name) {
  const out = document.createElement(tag);
  if (text !== undefined) out.textContent = text;
  if (name) out.className = name;
  return out;
}
export function swatch(name, path, tag = 'path') {
  const svg = document.createElementNS('http://www.w3.org/2000/svg', 'svg');
  svg.setAttribute('viewBox', '0 -7 24 14');
  svg.setAttribute('aria-hidden', 'true');
  const mark = document.createElementNS(svg.namespaceURI, tag);
  mark.setAttribute('class', name);
  if (tag === 'path') mark.setAttribute('d', path);
  else { mark.setAttribute('cx', '12'); mark.setAttribute('r', path); }
  svg.append(mark);
  return svg;
}

// ── the view ────────────────────────────────────────────────────────────────────────────────────────────────────────
export const canvas = $('map'), pen = canvas.getContext('2d');
export const view = {x: 0, y: 0, scale: 40, mode: 'fit'};  // px a metre; 'fit', 'follow' or 'free'
// `mode`: after each change of it; `takes`: whether a pointer is something else's than the view's; `key`: likewise of a key.
export const hooks = {mode: () => {}, takes: () => false, key: () => false};
export let wide = 0, high = 0;
export const colours = {};
export function take_colours() {
  const css = getComputedStyle(document.documentElement);
  for (const name of ['paper', 'card', 'ink', 'soft', 'rule', 'grid', 'blue', 'band', 'green', 'orange', 'amber', 'purple', 'pale', 'halo'])
    colours[name] = css.getPropertyValue('--' + name).trim();
  colours.font = '12px ' + getComputedStyle(document.body).fontFamily;
}
export function size_canvas(c) {
  const ratio = window.devicePixelRatio || 1, w = c.clientWidth, h = c.clientHeight;
  if (c.width !== Math.round(w * ratio) || c.height !== Math.round(h * ratio)) {
    c.width = Math.round(w * ratio);
    c.height = Math.round(h * ratio);
  }
  c.getContext('2d').setTransform(ratio, 0, 0, ratio, 0, 0);
  return [w, h];
}
export function begin_drawing() {
  [wide, high] = size_canvas(canvas);
  pen.clearRect(0, 0, wide, high);
}
export const right = x => wide / 2 + (x - view.x) * view.scale;
export const down = y => high / 2 - (y - view.y) * view.scale;
export const place_of = (px, py) => [view.x + (px - wide / 2) / view.scale, view.y - (py - high / 2) / view.scale];

export function set_mode(mode) {
  view.mode = mode;
  hooks.mode(mode);
}
export function zoom(factor, px = wide / 2, py = high / 2) {
  const scale = Math.min(4000, Math.max(0.02, view.scale * factor));
  if (view.mode === 'fit') set_mode('free');
  if (view.mode === 'free') {
    view.x += (px - wide / 2) * (1 / view.scale - 1 / scale);
    view.y -= (py - high / 2) * (1 / view.scale - 1 / scale);
  }
  view.scale = scale;
}

// Mouse, pen and fingers alike: one moves, two zoom.
const fingers = new Map();
canvas.addEventListener('pointerdown', e => {
  if (hooks.takes(e)) return;
  canvas.setPointerCapture(e.pointerId);
  fingers.set(e.pointerId, [e.offsetX, e.offsetY]);
});
for (const name of ['pointerup', 'pointercancel']) canvas.addEventListener(name, e => fingers.delete(e.pointerId));
canvas.addEventListener('pointermove', e => {
  const old = fingers.get(e.pointerId);
  if (!old) return;
  const others = [...fingers].filter(([id]) => id !== e.pointerId).map(([, at]) => at);
  if (others.length === 0) {
    if (Math.hypot(e.offsetX - old[0], e.offsetY - old[1]) < 1) return;
    set_mode('free');
    view.x -= (e.offsetX - old[0]) / view.scale;
    view.y += (e.offsetY - old[1]) / view.scale;
  } else {
    const [ox, oy] = others[0];
    const was = Math.hypot(old[0] - ox, old[1] - oy), is = Math.hypot(e.offsetX - ox, e.offsetY - oy);
    if (was > 8 && is > 8) zoom(is / was, (e.offsetX + ox) / 2, (e.offsetY + oy) / 2);
  }
  fingers.set(e.pointerId, [e.offsetX, e.offsetY]);
});
canvas.addEventListener('wheel', e => { e.preventDefault(); zoom(Math.exp(-e.deltaY * (e.deltaMode ? 0.05 : 0.0015)), e.offsetX, e.offsetY); }, {passive: false});
canvas.addEventListener('dblclick', e => { if (!hooks.takes(e)) zoom(2, e.offsetX, e.offsetY); });
canvas.addEventListener('keydown', e => {
  if (e.ctrlKey || e.metaKey || e.altKey) return;
  const step = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1]}[e.key];
  if (hooks.key(e, step)) { /* is something else's */ }
  else if (step) { set_mode('free'); view.x += step[0] * 60 / view.scale; view.y += step[1] * 60 / view.scale; }
  else if (e.key === '+' || e.key === '=') zoom(1.4);
  else if (e.key === '-') zoom(1 / 1.4);
  else if (e.key === 'f') set_mode('fit');
  else return;
  e.preventDefault();
});
$('closer').onclick = () => zoom(1.5);
$('farther').onclick = () => zoom(1 / 1.5);

// ── drawing ─────────────────────────────────────────────────────────────────────────────────────────────────────────
export function label(text, x, y, align, colour) {
  pen.font = colours.font;
  pen.textAlign = align;
  pen.textBaseline = 'middle';
  pen.lineJoin = 'round';
  pen.lineWidth = 4;
  pen.strokeStyle = colours.halo;
  pen.strokeText(text, x, y);
  pen.fillStyle = colour || colours.soft;
  pen.fillText(text, x, y);
}
export function grid_lines(is_on_floor) {
  const step = round_step(80 / view.scale);
  pen.strokeStyle = is_on_floor ? colours.rule : colours.grid;
  pen.globalAlpha = is_on_floor ? 0.6 : 1;
  pen.lineWidth = 1;
  pen.beginPath();
  const from_x = Math.ceil((view.x - wide / 2 / view.scale) / step), to_x = (view.x + wide / 2 / view.scale) / step;
  const from_y = Math.ceil((view.y - high / 2 / view.scale) / step), to_y = (view.y + high / 2 / view.scale) / step;
  for (let i = from_x; i <= to_x; i++) { const x = Math.round(right(i * step)) + 0.5; pen.moveTo(x, 0); pen.lineTo(x, high); }
  for (let i = from_y; i <= to_y; i++) { const y = Math.round(down(i * step)) + 0.5; pen.moveTo(0, y); pen.lineTo(wide, y); }
  pen.stroke();
  pen.globalAlpha = 1;
  return {step, from_x, to_x, from_y, to_y};
}
export function axes(grid) {
  const decimals = Math.max(0, -Math.floor(Math.log10(grid.step) + 1e-9));
  const foot = wide < 600 ? 52 : 14;
  for (let i = grid.from_x; i <= grid.to_x; i++) {
    const x = right(i * grid.step);
    if (x > 150 && x < wide - 90) label(fixed(i * grid.step, decimals), x, high - foot, 'center');
  }
  for (let i = grid.from_y; i <= grid.to_y; i++) {
    const y = down(i * grid.step);
    if (y > 60 && y < high - foot - 44) label(fixed(i * grid.step, decimals), wide - 8, y, 'right');
  }
  label('x in m \u2192', wide - 8, high - foot, 'right');
  // Scale bar.
  const bar = round_step(60 / view.scale), px = bar * view.scale, x = 16, y = high - foot - 2;
  pen.strokeStyle = colours.ink;
  pen.lineWidth = 2;
  pen.beginPath();
  pen.moveTo(x, y - 6); pen.lineTo(x, y); pen.lineTo(x + px, y); pen.lineTo(x + px, y - 6);
  pen.stroke();
  label(bar < 1 ? (bar * 100).toFixed(0) + ' cm' : bar < 1000 ? bar + ' m' : bar / 1000 + ' km', x + px / 2, y - 12, 'center', colours.ink);
}
// A layer {name, image, width, height, cell_m, origin} in the page's colours.
export function tint(layer) {
  const made = document.createElement('canvas');
  made.width = layer.width;
  made.height = layer.height;
  const c = made.getContext('2d');
  c.drawImage(layer.image, 0, 0);
  c.globalCompositeOperation = 'source-in';
  c.fillStyle = layer.name === 'floor' ? colours.card : colours.orange;
  c.fillRect(0, 0, made.width, made.height);
  layer.picture = made;
}
// True where there was something to draw.
export function draw_layer(layer) {
  if (!layer || !layer.picture) return false;
  const [x, y, yaw] = layer.origin;
  pen.save();
  pen.translate(right(x), down(y));
  pen.rotate(-yaw);
  const s = layer.cell_m * view.scale;
  pen.translate(0, -layer.height * s);
  pen.scale(s, s);
  pen.imageSmoothingEnabled = s < 1;
  pen.drawImage(layer.picture, 0, 0);
  pen.restore();
  return true;
}
export function ellipse(x, y, xx, xy, yy, least_px) {
  if (!(xx >= 0) || !(yy >= 0)) return;
  const h = (xx - yy) / 2, r = Math.hypot(h, xy), m = (xx + yy) / 2, k = TWO_SIGMA * view.scale;
  pen.beginPath();
  pen.ellipse(right(x), down(y), Math.max(k * Math.sqrt(Math.max(m + r, 0)), least_px), Math.max(k * Math.sqrt(Math.max(m - r, 0)), least_px),
    -0.5 * Math.atan2(2 * xy, xx - yy), 0, 2 * Math.PI);
}
// A landmark: its ellipse, its diamond, its number. `is_own`: mapped by the run itself, or not yet saved.
export function draw_landmark(id, x, y, xx, xy, yy, is_own, is_named) {
  const u = right(x), v = down(y), colour = is_own ? colours.purple : colours.green;
  if (xx > 0 && Math.sqrt(Math.max(xx, yy)) * view.scale > 1.5) {
    ellipse(x, y, xx, xy, yy, 0);
    pen.globalAlpha = 0.16;
    pen.fillStyle = colour;
    pen.fill();
    pen.globalAlpha = 0.8;
    pen.strokeStyle = colour;
    pen.lineWidth = 1;
    pen.stroke();
    pen.globalAlpha = 1;
  }
  pen.beginPath();
  const s = is_own ? 4.5 : 5.5;
  pen.moveTo(u, v - s); pen.lineTo(u + s, v); pen.lineTo(u, v + s); pen.lineTo(u - s, v); pen.closePath();
  pen.fillStyle = is_own ? colours.card : colour;
  pen.fill();
  pen.strokeStyle = is_own ? colour : colours.card;
  pen.lineWidth = is_own ? 2 : 1.5;
  pen.stroke();
  if (is_named) label(String(id), u + 9, v - 8, 'left', colour);
}
