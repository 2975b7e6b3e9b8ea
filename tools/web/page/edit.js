// SPDX-License-Identifier: Apache-2.0
// The editor's page: `waymark-web --edit SITE`. What the server has, the cards beside the plan, saving. Text from files is only ever
// set as text.
import {$, element, fixed, length, swatch, set_mode, take_colours, tint, down, right, view} from './mapview.js';
import {act, applied, floor_now, model, on_change, redo, take_site, undo, words} from './edit-model.js';
import {TOOLS, calls, choose, draw, drawn, is_desk, select, shown, tool} from './edit-tools.js';

const ASK_MS = 4000, ROWS_MAX = 500;
const degree = Math.PI / 180;
// The token stands behind the address's #, which no server and no log sees.
const given = new URLSearchParams(location.hash.slice(1)).get('token');
if (given) { sessionStorage.setItem('waymark-token', given); history.replaceState(null, '', location.pathname); }
const head = {'X-Waymark-Token': sessionStorage.getItem('waymark-token') || ''};

let layers = {}, layers_of = '', is_saving = false, online = true;
function repaint() {
  take_colours();
  Object.values(layers).forEach(tint);
}
async function show_plan() {
  const index = model.site.floors.findIndex(f => f.name === model.floor), wanted = model.site.base + '/' + index;
  if (wanted === layers_of) return;
  layers_of = wanted;
  const next = {};
  for (const [name, about] of Object.entries(model.site.floors[index].plan ? model.site.floors[index].plan.layers : {})) {
    const answer = await fetch('plan.png?floor=' + index + '&layer=' + name, {headers: head});
    if (answer.ok) { next[name] = {name, image: await createImageBitmap(await answer.blob()), ...about}; tint(next[name]); }
  }
  if (layers_of === wanted) layers = next;
}

// ── asking and saving ───────────────────────────────────────────────────────────────────────────────────────────────
function say(text, is_bad = true) {
  $('said').textContent = text;
  $('said').classList.toggle('bad', is_bad);
}
async function read_site() {
  const answer = await fetch('site.json', {headers: head});
  if (answer.status === 403) throw new Error('The token is missing or wrong: open the address that waymark-web printed.');
  if (!answer.ok) throw new Error((await answer.json()).errors.map(e => e.text).join('\n'));
  return answer.json();
}
async function take_newest(why) {
  const notes = take_site(await read_site());
  say([why, ...notes].filter(Boolean).join('\n'), Boolean(why) || notes.length > 0);
}
async function save(event) {
  event.preventDefault();
  if (is_saving || !model.steps.length) return;
  is_saving = true;
  changed();
  const author = $('author').value.trim(), note = $('note').value.trim(), base = model.site.base, before = model.site.current;
  localStorage.setItem('waymark-author', author);
  say('saving ...', false);
  const done = async name => {
    model.steps = [];
    $('note').value = '';
    await take_newest('');
    say('Version ' + name + ' is saved; robots take it at their next start or reload.', false);
  };
  try {
    const answer = await fetch('version', {method: 'POST', headers: {...head, 'Content-Type': 'application/json'}, body: JSON.stringify({base, author, note, edits: model.steps.flat()})});
    const said = await answer.json();
    if (answer.ok) await done(said.version);
    else if (answer.status === 409) await take_newest(said.errors[0].text + '\nYour changes are kept, on top of it. Look at them, and save again.');
    else say(said.errors.map(e => e.text).join('\n'));
  } catch (problem) {  // no answer: it is there, or not
    try {
      const now = await read_site(), newest = now.versions.find(v => v.name === now.current);
      if (now.base !== base && newest && newest.base === before && newest.author === author && newest.note === note) await done(newest.name);
      else await take_newest('No answer came, and nothing was saved. Save again.');
    } catch (again) { say('The server does not answer; your changes are still here. ' + again.message); }
  }
  is_saving = false;
  changed();
}
async function watch() {
  try {
    const answer = await fetch('newest.json', {headers: head});
    const newest = await answer.json();
    online = true;
    if (answer.ok && !is_saving && newest.base !== model.site.base) await take_newest(model.steps.length ? 'Another version came meanwhile. Your changes are kept, on top of it.' : '');
  } catch (problem) { online = false; }
  show_state();
  setTimeout(watch, ASK_MS);
}

// ── the cards ───────────────────────────────────────────────────────────────────────────────────────────────────────
function button(words, press, name) {
  const out = element('button', words, name);
  out.type = 'button';
  out.onclick = press;
  return out;
}
function field(words, value, change, more = {}) {
  const out = element('label', words + ' '), input = Object.assign(document.createElement('input'), {value, ...more});
  if (change) input.onchange = () => change(input);
  out.append(input);
  return out;
}
function row(cells, tag = 'td') {
  const out = element('tr');
  for (const text of cells) out.append(element(tag, text));
  return out;
}
const round = (v, n) => (v === null || v === undefined ? '' : String(+v.toFixed(n)));

function show_state() {
  const many = model.steps.length, state = $('state');
  state.className = 'state ' + (!online ? 'silent' : many ? 'degraded' : 'tracking');
  state.lastElementChild.textContent = !online ? 'no answer' : is_saving ? 'saving' : many ? many + (many === 1 ? ' change' : ' changes') + ', not saved' : 'as saved';
  const about = TOOLS.find(t => t[0] === tool.name);
  $('why').textContent = !online ? 'waymark-web has ended, or can\u2019t be reached; your changes are still here' : is_desk() ? about[3] : '';
  $('name').textContent = model.site.name;
  document.title = (many ? '\u2022 ' : '') + model.site.name + ' \u00b7 waymark';
}
function show_tools() {
  $('editing').replaceChildren(...TOOLS.map(([name, key, words, about]) => {
    const out = button('', () => { choose(name); $('map').focus(); show_tools(); show_state(); });
    const at = words.toLowerCase().indexOf(key);
    out.append(words.slice(0, at), element('u', words.slice(at, at + 1)), words.slice(at + 1));
    out.title = about + ' (' + key + ')';
    out.setAttribute('aria-pressed', String(tool.name === name));
    return out;
  }), button('Undo', undo), button('Redo', redo));
  const [undoing, redoing] = [...$('editing').children].slice(-2);
  undoing.disabled = !model.steps.length;
  redoing.disabled = !model.undone.length;
  undoing.title = 'Ctrl+Z';
  redoing.title = 'Ctrl+Shift+Z';
}
function show_floors() {
  $('floors').replaceChildren(...model.site.floors.map(f => {
    const out = button(f.name, () => { model.floor = f.name; select(null); choose(tool.name); set_mode('fit'); changed(); });
    out.setAttribute('aria-pressed', String(f.name === model.floor));
    return out;
  }));
  $('floors').hidden = model.site.floors.length < 2;
}
function show_selected() {
  const card = $('selected'), l = tool.selected === null ? null : floor_now().landmarks.get(tool.selected);
  card.hidden = !l;
  if (!l) { delete card.dataset.id; return; }
  const title = element('h2', l.yaw_rad === null ? 'Landmark ' + l.id : 'Tag ' + l.id);
  const put = name => input => {
    const value = input.value.trim() === '' ? null : Number(input.value.replace(',', '.')) * (name === 'yaw_rad' ? degree : 1);
    if (Number.isNaN(value) || (value === null && name.length === 3 && name !== 'z_m')) { input.setCustomValidity('a number is needed'); input.reportValidity(); return; }
    say(act({do: 'set', floor: model.floor, id: tool.selected, [name]: value}));
  };
  const rename = input => {
    const to = Number(input.value), said = Number.isInteger(to) && to >= 0 ? act({do: 'rename', floor: model.floor, id: l.id, to}) : 'an id is a whole number';
    say(said);
    if (!said) select(to);
    else input.value = l.id;
  };
  const fields = [['id', 'id', l.id, rename], ['x_m', 'x, m', round(l.x_m, 4)], ['y_m', 'y, m', round(l.y_m, 4)], ['z_m', 'z, m', round(l.z_m, 4)], ['sigma_m', 'sigma, m', round(l.sigma_m, 5)],
    ['yaw_rad', 'heading, \u00b0', round(l.yaw_rad === null ? null : l.yaw_rad / degree, 2)]];
  if (card.dataset.id === String(l.id)) {  // the same one: who goes from field to field stays there
    for (const [name, , value] of fields) card.elements[name].value = value;
    return card.firstChild.replaceWith(title);
  }
  card.dataset.id = l.id;
  card.replaceChildren(title, ...fields.map(([name, about, value, change]) => field(about, value, change || put(name), {name})),
    button('Delete', () => { act({do: 'delete', floor: model.floor, id: l.id}); select(null); }, 'desk'));
  if (!is_desk()) card.querySelectorAll('input').forEach(input => { input.readOnly = true; });
}
function show_list() {
  const all = [...floor_now().landmarks.values()].sort((a, b) => a.id - b.id);
  $('count').textContent = String(all.length);
  $('list').replaceChildren(row(['id', 'x', 'y', 'z', 'sigma'], 'th'), ...all.slice(0, ROWS_MAX).map(l => {
    const out = row([l.id + (l.yaw_rad === null ? '' : ' \u2197'), fixed(l.x_m, 2), fixed(l.y_m, 2), fixed(l.z_m, 2), length(l.sigma_m)]);
    out.tabIndex = 0;
    out.setAttribute('aria-selected', String(l.id === tool.selected));
    out.onclick = () => { select(l.id); Object.assign(view, {x: l.x_m, y: l.y_m}); set_mode('free'); };
    out.onkeydown = e => { if (e.key === 'Enter') out.onclick(); };
    return out;
  }));
  if (all.length > ROWS_MAX) $('list').append(row(['and ' + (all.length - ROWS_MAX) + ' more', '', '', '', '']));
}
function show_rest() {
  const s = model.site;
  $('changes').replaceChildren(...model.steps.map(step => element('li', step.length > 1 ? words(step[0]) + ' and ' + (step.length - 1) + ' more' : words(step[0]))));
  $('changes').scrollTop = $('changes').scrollHeight;
  $('save').disabled = is_saving || !model.steps.length;
  $('versions').replaceChildren(...(s.versions.length ? [] : [row(['none yet: robots take the files'])]), ...s.versions.slice().reverse().map(v =>
    row([(v.name === s.current ? '\u2605 ' : '') + v.name.slice(0, 8), v.date.slice(0, 16).replace('T', ' '), v.damage || v.author + (v.note ? ': ' + v.note : '')])));
  const found = [...s.wrong.map(text => ['bad', text]), ...s.odd.map(text => ['odd', text])];
  $('findings').replaceChildren(...found.map(([kind, text]) => element('li', text, kind)));
  $('findings-card').hidden = !found.length;
  $('drives').replaceChildren(...s.drives.map(drive => {
    const out = element('tr'), cell = element('td');
    cell.append(field(drive.name, '', input => { drive.is_shown = input.checked; }, {type: 'checkbox', checked: drive.is_shown !== false}));
    out.append(cell);
    return out;
  }));
  $('drives-card').hidden = !s.drives.length;
}
// The form of a tool whose points are there.
function ask_for(name) {
  const card = $('asked'), [a, b] = tool.points;
  card.hidden = !name;
  if (!name) return;
  const values = {}, take = key => input => { values[key] = Number(input.value.replace(',', '.')); };
  const done = edits => { say(edits.every(e => Object.values(e).every(v => v !== undefined && !Number.isNaN(v))) ? act(...edits) : 'A number is missing.'); choose('move'); show_tools(); };
  if (name === 'origin') {
    card.replaceChildren(element('h2', 'Where is ' + fixed(a[0], 2) + ', ' + fixed(a[1], 2) + ' m?'), field('latitude, \u00b0', '', take('latitude_deg')), field('longitude, \u00b0', '', take('longitude_deg')),
      field('altitude, m', '', take('altitude_m')), element('p', 'WGS84. The axes of the plan are then east and north.', 'note'),
      button('Set the origin', () => done([{do: 'origin', floor: model.floor, x_m: a[0], y_m: a[1], latitude_deg: values.latitude_deg, longitude_deg: values.longitude_deg, altitude_m: values.altitude_m}])));
    return;
  }
  const far = Math.hypot(a[0] - b[0], a[1] - b[1]);
  card.replaceChildren(element('h2', name === 'scale' ? 'How far is it really?' : 'Distance'), element('p', length(far) + ' on the plan; ' + fixed(b[0] - a[0], 3) + ' m in x, ' + fixed(b[1] - a[1], 3) + ' m in y'));
  if (name !== 'scale') return;
  const landmarks = field('landmarks, too', '', null, {type: 'checkbox'});
  card.append(field('true distance, m', '', take('true_m')), landmarks, element('p', 'The first point stays. Landmarks that were placed on this plan go with it; surveyed ones do not.', 'note'),
    button('Set the scale', () => {
      const factor = values.true_m / far, edits = [{do: 'scale', floor: model.floor, factor, x_m: a[0], y_m: a[1]}];
      if (landmarks.lastChild.checked)
        for (const l of floor_now().landmarks.values()) edits.push({do: 'set', floor: model.floor, id: l.id, x_m: a[0] + factor * (l.x_m - a[0]), y_m: a[1] + factor * (l.y_m - a[1])});
      done(edits);
    }));
}
const LAYERS = [['plan', 'plan', () => swatch('mark-edges', 'M0 0H24')], ['landmarks', 'landmarks and tags', () => swatch('mark-fill', 'M12-6l6 6l-6 6l-6-6Z')],
  ['drives', 'drives', () => swatch('mark-trail', 'M0 0H24')], ['ways', 'lifts, ramps, doors', () => swatch('mark-way', '6', 'circle')], ['areas', 'ignored areas', () => swatch('mark-area', 'M2-6H22V6H2Z')]];
function show_layers() {
  $('layers').replaceChildren(...LAYERS.map(([key, words, make]) => {
    const item = element('li'), press = button('', () => { shown[key] = !shown[key]; press.setAttribute('aria-pressed', String(shown[key])); });
    press.append(make(), words);
    press.setAttribute('aria-pressed', 'true');
    item.append(press);
    return item;
  }));
}
function changed() {
  show_state();
  show_tools();
  show_floors();
  show_selected();
  show_list();
  show_rest();
  show_plan();
}

calls.asked = name => { ask_for(name); show_tools(); show_state(); };
calls.selected = () => { show_selected(); show_list(); };
calls.say = say;
on_change(changed);
$('save-card').onsubmit = save;
$('selected').onsubmit = e => e.preventDefault();
addEventListener('beforeunload', e => { if (model.steps.length) e.preventDefault(); });
addEventListener('keydown', e => {
  if (!(e.ctrlKey || e.metaKey) || !['z', 'y'].includes(e.key.toLowerCase()) || (e.target instanceof HTMLInputElement && e.target.type !== 'checkbox')) return;
  e.preventDefault();
  (e.key.toLowerCase() === 'y' || e.shiftKey ? redo : undo)();
});
matchMedia('(prefers-color-scheme: dark)').addEventListener('change', repaint);
matchMedia('(max-width: 820px)').addEventListener('change', () => model.site && changed());
function paint() {
  requestAnimationFrame(paint);
  if (!document.hidden) draw(layers);
}
async function begin() {
  repaint();
  show_layers();
  $('author').value = localStorage.getItem('waymark-author') || '';
  try {
    const site = await read_site();
    model.floor = site.floors[0].name;
    take_site(site);
  } catch (problem) {
    $('state').className = 'state silent';
    $('state').lastElementChild.textContent = 'no building';
    $('why').textContent = problem.message;
    return;
  }
  set_mode('fit');
  paint();
  setTimeout(watch, ASK_MS);
}
begin();
window.waymark = {model, applied, drawn, tool, view, at: (x, y) => [right(x), down(y)]};
