// SPDX-License-Identifier: Apache-2.0
// The building as the server has it, and a person's edits on it in steps that can be undone.
export const model = {site: null, steps: [], undone: [], floor: ''};
const listeners = [];
export const on_change = call => listeners.push(call);
export const changed = () => listeners.forEach(call => call());

const PLACE = ['x_m', 'y_m', 'sigma_m'];
function without_covariance(edit, landmark) {
  return PLACE.some(key => key in edit) ? null : landmark && landmark.cov;
}
const scaled = (edit, [x, y]) => [edit.x_m + edit.factor * (x - edit.x_m), edit.y_m + edit.factor * (y - edit.y_m)];

// What an edit can't be done for; '' where it can.
function unfit(floors, edit) {
  const floor = floors.find(f => f.name === edit.floor);
  if (!floor) return 'there is no floor ' + edit.floor;
  if (['set', 'delete', 'rename'].includes(edit.do) && !floor.landmarks.has(edit.id)) return 'landmark ' + edit.id + ' is no longer there';
  const taken = edit.do === 'add' ? edit.id : edit.do === 'rename' && edit.to !== edit.id ? edit.to : -1;
  return floor.landmarks.has(taken) ? 'landmark ' + taken + ' is there already' : '';
}
function apply(floors, edit) {
  const floor = floors.find(f => f.name === edit.floor), all = floor.landmarks, old = all.get(edit.id);
  if (edit.do === 'set' || edit.do === 'add') {
    const {do: _, floor: __, ...fields} = edit;
    all.set(edit.id, {z_m: null, yaw_rad: null, ...old, ...fields, cov: without_covariance(edit, old), is_edited: true});
  } else if (edit.do === 'delete') all.delete(edit.id);
  else if (edit.do === 'rename') {
    all.delete(edit.id);
    all.set(edit.to, {...old, id: edit.to, is_edited: true});
  } else if (edit.do === 'scale') {
    const p = floor.plan, [x, y] = scaled(edit, p.origin);
    floor.plan = {...p, factor: p.factor * edit.factor, origin: [x, y, p.origin[2]]};
    floor.areas = floor.areas.map(area => area.map(corner => scaled(edit, corner)));
  } else if (edit.do === 'ignore') floor.areas = edit.areas;
}
// The floors of a site with edits on them.
export function applied(site = model.site, steps = model.steps) {
  const floors = site.floors.map(f => ({...f, landmarks: new Map(f.landmarks.map(l => [l.id, l])), plan: f.plan && {...f.plan, factor: 1}}));
  for (const edit of steps.flat()) apply(floors, edit);
  return floors;
}
export const floor_now = () => applied().find(f => f.name === model.floor);

// A step is a list of edits that are done and undone together.
export function act(...edits) {
  const problem = edits.map(edit => unfit(applied(), edit)).find(Boolean);
  if (problem) return problem;
  model.steps.push(edits);
  model.undone = [];
  changed();
  return '';
}
// Several presses of a key are one step.
export function act_on(edit, is_same) {
  const last = model.steps.at(-1);
  if (is_same && last && last.length === 1 && last[0].do === edit.do && last[0].id === edit.id && last[0].floor === edit.floor) model.steps.pop();
  return act(edit);
}
export function undo() {
  if (model.steps.length) model.undone.push(model.steps.pop());
  changed();
}
export function redo() {
  if (model.undone.length) model.steps.push(model.undone.pop());
  changed();
}
const same = (a, b) => JSON.stringify(a) === JSON.stringify(b);
// Another version came: the edits stay, on top of it. Returns lines of what does not fit any more, or was changed there, too.
export function take_site(site) {
  const notes = [], before = model.site, steps = model.steps;
  model.site = site;
  model.steps = [];
  if (!site.floors.some(f => f.name === model.floor)) model.floor = site.floors[0].name;
  for (const step of steps) {
    const fitting = step.filter(edit => {
      const problem = unfit(applied(), edit);
      if (problem) notes.push('Left out: ' + words(edit) + ': ' + problem + '.');
      return !problem;
    });
    if (fitting.length) model.steps.push(fitting);
  }
  if (before) {
    const of = (s, edit) => { const f = s.floors.find(g => g.name === edit.floor); return edit.do === 'scale' || edit.do === 'ignore' ? f && [f.plan, f.areas] : f && f.landmarks.find(l => l.id === edit.id); };
    for (const edit of model.steps.flat())
      if (!same(of(before, edit), of(site, edit))) notes.push('Changed there, too: ' + words(edit) + ' would replace it.');
  }
  model.undone = [];
  changed();
  return notes;
}
export function words(edit) {
  const names = {x_m: 'x', y_m: 'y', z_m: 'z', sigma_m: 'sigma', yaw_rad: 'heading'};
  const fields = Object.keys(edit).filter(key => names[key]).map(key => names[key]).join(', ');
  return {set: edit.floor + ': ' + edit.id + ': ' + fields, add: edit.floor + ': ' + edit.id + ' added', delete: edit.floor + ': ' + edit.id + ' deleted',
    rename: edit.floor + ': ' + edit.id + ' is now ' + edit.to, scale: edit.floor + ': plan ' + (edit.factor || 0).toPrecision(5) + ' times as large',
    origin: edit.floor + ': origin', ignore: edit.floor + ': areas to be ignored: ' + (edit.areas || []).length}[edit.do];
}
